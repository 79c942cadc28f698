"""Reads the `result.json` of a run for those who go on with it."""

import json
from pathlib import Path
from typing import Any

from rig.errors import Refused

SCHEMA = "rig.result/1"


def passed_result(path: Path) -> dict[str, Any]:
    """The `result.json` of a run folder or at `path` itself, if its verdict is a pass.

    Raises Refused: no_result, not_a_result, verdict_failed.
    """
    file = path / "result.json" if path.is_dir() else path
    try:
        document = json.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise Refused(
            "no_result", f"{file} cannot be read: {error.strerror}", "Give a run folder or its result.json"
        ) from error
    except ValueError as error:
        raise _not_a_result(file) from error
    if not isinstance(document, dict) or document.get("schema") != SCHEMA:
        raise _not_a_result(file)
    if document["verdict"] != "pass":
        failed = ", ".join(check["name"] for check in document["checks"] if not check["passed"])
        raise Refused(
            "verdict_failed", f"the run in {file} failed its verdict ({failed})", "Mend the cause and calibrate again"
        )
    return document


def _not_a_result(file: Path) -> Refused:
    return Refused("not_a_result", f"{file} is no result of a run ({SCHEMA})", "Give a run folder or its result.json")
