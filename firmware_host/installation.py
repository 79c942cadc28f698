"""The installation of this program, and the command that installs an optional part of it."""

import json
import shlex
import sys
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import url2pathname

NAME = "calibration-rig"
SOURCE = Path(__file__).resolve().parents[1]


def install_command(extra: str) -> str:
    """Return the shell command that installs the optional part `extra` for this installation."""
    editable, source = _source()
    return shlex.join([sys.executable, "-m", "pip", "install", *(["-e"] if editable else []), f"{source}[{extra}]"])


def _source() -> tuple[bool, str]:
    """Return whether the program runs from the folder of its sources, and the requirement for pip."""
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        installed = distribution(NAME)
        is_in_sources = Path(str(installed.locate_file(""))).resolve() == SOURCE  # metadata left by a build
        if is_in_sources and (SOURCE / "pyproject.toml").exists():
            return True, str(SOURCE)
        origin: dict[str, Any] = json.loads(installed.read_text("direct_url.json") or "{}")
    except PackageNotFoundError:  # run from a folder of sources that is not installed
        return True, str(SOURCE)
    except ValueError:
        origin = {}
    url = urlsplit(origin.get("url", ""))
    path = Path(url2pathname(url.path))
    if url.scheme == "file" and path.exists():
        return bool(origin.get("dir_info", {}).get("editable")), str(path)
    return False, NAME
