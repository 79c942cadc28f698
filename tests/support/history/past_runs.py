"""Finished runs for a history, with another sensor and other numbers than the verified run."""

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import numpy as np

from rig.data.result_file import ResultDocument, VectorEntry
from rig.errors import Refused
from rig.history.entered.finished_run import EnteredRecording, FinishedRun, compact
from rig.history.store import open_history
from support.documents.results import SENSOR, VERIFIED

FIRST = datetime(2025, 1, 6, 8, tzinfo=UTC)
SCALE, BIAS_RAD_S = (1.01, 0.99, 1.0), (0.01, -0.02, 0.005)
STD = np.array([4e-5, 4e-5, 4e-5, 2e-5, 2e-5, 2e-5])


def finish_run(
    day: float,
    scale: Sequence[float] = SCALE,
    bias_rad_s: Sequence[float] = BIAS_RAD_S,
    *,
    serial_number: str = "G-1",
    rig: str = "bench A",
    check_standard: bool = False,
    passed: bool = True,
    solved_after_s: float = 60.0,
) -> FinishedRun:
    """Return a run that began `day` days after the first."""
    text = document(day, scale, bias_rad_s, serial_number, rig, passed=passed, solved_after_s=solved_after_s)
    return FinishedRun(
        text=compact(json.loads(text.text())),
        document=text,
        rig=rig,
        check_standards=(serial_number,) if check_standard else (),
        simulated=False,
        computer="bench",
        path=f"/runs/{day}",
        recordings=(EnteredRecording("run.h5", 3, "ab" * 32),),
    )


def document(
    day: float,
    scale: Sequence[float],
    bias_rad_s: Sequence[float],
    serial_number: str,
    rig: str,
    *,
    passed: bool,
    solved_after_s: float,
) -> ResultDocument:
    """Return the result, with only the checks of scale and bias."""
    assert isinstance(SENSOR.vector_model, VectorEntry)
    without_gravity: dict[str, None] = {"g_sensitivity_rad_s_per_m_s2": None, "g_sensitivity_std_rad_s_per_m_s2": None}
    sensor = SENSOR.model_copy(
        update={
            "serial_number": serial_number,
            "scale": tuple(map(float, scale)),
            "bias_rad_s": tuple(map(float, bias_rad_s)),
            "covariance": tuple(map(tuple, np.diag(STD**2).tolist())),
            "covariance_combined": None,
            "budget": None,
            "vector_model": SENSOR.vector_model.model_copy(update=without_gravity),
            "observations": (),
            "rests": (),
        }
    )
    started = FIRST + timedelta(days=day)
    provenance = VERIFIED.provenance.model_copy(
        update={
            "started_utc": started.isoformat(),
            "solved_utc": (started + timedelta(seconds=solved_after_s)).isoformat(),
            "arm_serial_number": f"arm of {rig}",
        }
    )
    checks = tuple(check for check in VERIFIED.checks if check.name in ("gyro.scale_deviation", "gyro.condition"))
    checks = tuple(
        check.model_copy(update={"passed": passed or check.name != "gyro.condition", "limit": 0.02}) for check in checks
    )
    return VERIFIED.model_copy(
        update={"gyroscopes": {"gyro": sensor}, "verification": {}, "checks": checks, "provenance": provenance}
    )


def enter_many(url: str, worker: int, entries: int) -> int:
    """Enter runs that no other `worker` has, and return how many were new. Processes cannot import a test module.

    A server that is too busy to answer in time is asked again, as `rig history import` would.
    """
    first = finish_run(worker)
    began = first.document.provenance.started_utc
    new = entered = 0
    while entered < entries:
        with ask_again(), open_history(url) as history:
            for i in range(entered, entries):
                started = f"{began[:11]}{i // 60 + 8:02}:{i % 60:02}:00+00:00"
                provenance = first.document.provenance.model_copy(update={"started_utc": started})
                document = first.document.model_copy(update={"provenance": provenance})
                new += history.enter(replace(first, text=first.text.replace(began, started), document=document)).new
                entered += 1
    return new


@contextmanager
def ask_again() -> Iterator[None]:
    """Suppress the refusal of a history that has not answered in time, and no other: an entry that is lost is told."""
    try:
        yield
    except Refused as refused:
        if refused.name != "history_unreachable":
            raise
