"""Recordings of every kind open, and solve to the numbers that were stored with them."""

from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from rig.config.sensors.sensor_catalogue import has_own_port
from rig.data.quantity import ACCELERATION, FIELD
from rig.data.result_file import ResultDocument, read_result
from rig.plans.procedure_registry import load_procedures
from rig.plans.recorded_run import RecordedRun, judge_phases, open_run
from rig.report.document import document_of
from support.paths import RECORDINGS
from support.recordings.frozen import frozen
from support.recordings.stated import SHARE, differences

FREEZE = "freeze one, as CONTRIBUTING.md says"


KINDS: dict[str, Callable[[RecordedRun], bool]] = {
    "sweeps alone": lambda run: bool(run.raw) and not run.raw[0].settings.planned_dwells,
    "dwells alone": lambda run: not run.movement[0].settings.planned_sweeps,
    "accelerometers beside sweeps": lambda run: bool(run.movement[0].settings.planned_sweeps) and _accelerates(run),
    "a magnetometer": lambda run: bool(run.movement[0].measuring(FIELD)),
    "a sensor with a port of its own": lambda run: any(has_own_port(s.part) for s in run.movement[0].sensors.values()),
    "a device that prints lines": lambda run: any(s.part == "lines" for s in run.movement[0].sensors.values()),
    "an autopilot's IMU": lambda run: any(s.part == "mavlink" for s in run.movement[0].sensors.values()),
    "several speeds": lambda run: len({sweep.speed_rad_s for sweep in run.movement[0].settings.planned_sweeps}) > 1,
    "resumed": lambda run: len(run.raw) > 1,
    "verified": lambda run: bool(run.raw and run.corrected),
    "a reference beside": lambda run: run.movement[0].settings.reference is not None,
    "the Earth's rate found": lambda run: run.movement[0].settings.finds_earth_rate,
}


def _accelerates(run: RecordedRun) -> bool:
    return bool(run.movement[0].measuring(ACCELERATION))


@cache
def opened(folder: Path) -> RecordedRun:
    return open_run(folder)


def named(folder: Path) -> str:
    return folder.name


@pytest.mark.slow
@pytest.mark.kernels
@pytest.mark.parametrize("folder", frozen(), ids=named)
def test_a_frozen_recording_solves_to_its_numbers(folder: Path) -> None:
    found = document_of(judge_phases(opened(folder)))
    assert differences(read_result(folder), found) == []


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_has_a_frozen_recording(kind: str) -> None:
    assert any(KINDS[kind](opened(folder)) for folder in frozen()), FREEZE


@pytest.mark.slow
def test_every_procedure_has_a_frozen_recording() -> None:
    kept = {run.settings.procedure for folder in frozen() for run in (*opened(folder).raw, *opened(folder).corrected)}
    assert load_procedures().keys() - kept == set(), FREEZE


def otherwise(result: ResultDocument) -> Iterator[ResultDocument]:
    """With a number moved by ten times what is allowed, a wider uncertainty, a check less, another verdict."""
    gyro = result.gyroscopes["gyro"]
    std = gyro.covariance[3][3] ** 0.5
    x, y, z = gyro.bias_rad_s
    first = gyro.covariance[0]
    wider = ((first[0] * (1 + 20 * SHARE), *first[1:]), *gyro.covariance[1:])
    for update in ({"bias_rad_s": (x + 10 * SHARE * std, y, z)}, {"covariance": wider}):
        yield result.model_copy(update={"gyroscopes": {"gyro": gyro.model_copy(update=update)}})
    yield result.model_copy(update={"checks": result.checks[1:]})
    yield result.model_copy(update={"verdict": "fail"})


def test_a_number_that_changed_by_a_hundred_thousandth_of_its_uncertainty_is_reported() -> None:
    result = read_result(RECORDINGS / "six_observation")
    assert differences(result, result) == []
    for other in otherwise(result):
        assert differences(result, other) != []
