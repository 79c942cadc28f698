"""An invented run with the sensors of three boards: three gyroscopes, and an accelerometer with each."""

from collections.abc import Collection, Iterator
from dataclasses import replace
from pathlib import Path

from rig.analysis.check import Check
from rig.data.result_file import ResultDocument, read_result, write_result
from rig.data.run_folder import RESULT
from rig.page.replay import end_events
from rig.station.events import (
    Checked,
    DocumentWritten,
    LastCalibration,
    Remembered,
    RunEvent,
    SamplesTaken,
    VerdictReached,
)
from support.page.scripted_runs import ABOUT, moving, plan_demo
from support.paths import RECORDINGS

PARTS = {
    "lsm9ds1": "lsm9ds1 LSM9DS1-003",
    "mpu9250": "mpu9250 MPU9250-2031-17",
    "adis16465": "adis16465 ADIS16465-00042",
}
SIX = replace(ABOUT, folder="runs/2026-11-22T16-00-00Z-imu", procedure="imu", parts=PARTS)
IMU = RECORDINGS / "imu"


def six_moving(until_s: float) -> Iterator[RunEvent]:
    """Yield the arm's motion and the readings of all six sensors until `until_s`."""
    for event in moving(plan_demo(), until_s):
        if isinstance(event, SamplesTaken):
            yield SamplesTaken(tuple(replace(event.sensors[1], sensor=name, lost=0) for name in PARTS))
        else:
            yield event


def six_found() -> ResultDocument:
    """Return a result for all six, copied from the recording of one sensor."""
    one = read_result(IMU)
    checks = tuple(
        check.model_copy(update={"name": check.name.replace("gyro", name), "sensor": check.sensor and name})
        for name in PARTS
        for check in one.checks
    )
    return one.model_copy(
        update={
            "checks": checks,
            "gyroscopes": dict.fromkeys(PARTS, one.gyroscopes["gyro"]),
            "accelerometers": dict.fromkeys(PARTS, one.accelerometers["gyro"]),
        }
    )


def six_judged(folder: Path, *, passed: bool = True, broken: Collection[str] = ()) -> Iterator[RunEvent]:
    """Yield the events from the result to the comparison with the history: one sensor has changed, two are new.

    `broken`: names of checks that fail for each of the three boards.
    """
    document = six_found()
    write_result(document, folder)
    (folder / "certificate.html").write_text("<title>Certificate</title>", encoding="utf-8")
    yield DocumentWritten(folder / "certificate.html")
    yield DocumentWritten(folder / RESULT)
    *checks, _ = end_events(document)
    yield from checks
    if not passed:
        limit = document.checks[0]
        yield Checked(Check(limit.name, 0.177, 0.1, "1", limit.means, 0.0012))
    for check in document.checks:
        if check.name.partition(".")[2] in broken and check.limit is not None:
            yield Checked(Check(check.name, 3 * check.limit, check.limit, check.unit, check.means))
    yield VerdictReached(passed and not broken)
    yield Remembered("the history", (12, 13), tuple(_since(document)))


def _since(document: ResultDocument) -> Iterator[LastCalibration]:
    scale, bias = (
        document.gyroscopes["gyro" if "gyro" in document.gyroscopes else "lsm9ds1"].scale,
        (0.00766, -0.00977, -0.00452),
    )
    names = ("kx", "ky", "kz", "bx", "by", "bz")
    values = [*scale[:2], scale[2] - 0.004, *bias]
    before = {name: (value, 0.0012 if name[0] == "k" else 0.0005) for name, value in zip(names, values, strict=True)}
    errors = {name: 2.4 if name == "kz" else 0.3 for name in names}
    yield LastCalibration("lsm9ds1", "rate", 8, "2026-11-20", before, errors, ("kz",))
    yield LastCalibration("mpu9250", "rate", 9, "2026-11-20", before, {**errors, "kz": 0.4})
