"""Reads the `result.json` of a run for those who go on with it."""

from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rig.config.models import Positive, Vector3
from rig.errors import Refused

SCHEMA = "rig.result/1"


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class SensorResult(_Part):
    """What a sensor's entry says of its calibration, g = K (m + b)."""

    part: str
    serial_number: str
    role: Literal["calibrate", "reference"]
    range_rad_s: Positive
    temperature_c: float
    scale: tuple[Positive, Positive, Positive]
    bias_rad_s: Vector3


class CheckResult(_Part):
    """A check of the verdict."""

    name: str
    passed: bool


class Result(_Part):
    """The parts of a `result.json` that others go on with."""

    schema_name: Annotated[Literal["rig.result/1"], Field(alias="schema")]  # as SCHEMA
    verdict: Literal["pass", "fail"]
    checks: tuple[CheckResult, ...]
    sensors: dict[str, SensorResult]


def passed_result(path: Path) -> Result:
    """The `result.json` of a run folder or at `path` itself, if its verdict is a pass.

    Raises Refused: no_result, not_a_result, verdict_failed.
    """
    file = path / "result.json" if path.is_dir() else path
    try:
        result = Result.model_validate_json(file.read_bytes())
    except OSError as error:
        raise Refused(
            "no_result", f"{file} cannot be read: {error.strerror}", "Give a run folder or its result.json"
        ) from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))
        raise Refused(
            "not_a_result",
            f"{file} is no result of a run: {where}{': ' if where else ''}{first['msg']}",
            "Give a run folder or its result.json",
        ) from error
    if result.verdict != "pass":
        failed = ", ".join(check.name for check in result.checks if not check.passed)
        raise Refused(
            "verdict_failed", f"the run in {file} failed its verdict ({failed})", "Mend the cause and calibrate again"
        )
    return result
