"""How this program was installed, and so by which command an optional part of it comes there too."""

import json
import shlex
import sys
from pathlib import Path
from urllib.parse import urlsplit
from urllib.request import url2pathname

NAME = "calibration-rig"
SOURCE = Path(__file__).resolve().parents[1]


def install_command(extra: str) -> str:
    """The command that installs the optional part `extra` beside this very program, as one types it in a shell."""
    editable, source = _source()
    return shlex.join([sys.executable, "-m", "pip", "install", *(["-e"] if editable else []), f"{source}[{extra}]"])


def _source() -> tuple[bool, str]:
    """Whether it runs from the folder of its sources, and what pip has to be given."""
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        found = distribution(NAME)
        if Path(str(found.locate_file(""))).resolve() == SOURCE:  # what building leaves beside the sources
            return True, str(SOURCE)
        said = json.loads(found.read_text("direct_url.json") or "{}")
    except PackageNotFoundError:  # run from a folder of sources that is not installed
        return True, str(SOURCE)
    except ValueError:
        said = {}
    place = urlsplit(said.get("url", ""))
    path = Path(url2pathname(place.path))
    if place.scheme == "file" and path.exists():
        return bool(said.get("dir_info", {}).get("editable")), str(path)
    return False, NAME
