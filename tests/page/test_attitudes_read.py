"""What was read in each attitude stands on the page while a run goes on, and is the same once its result is there."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.partial_results import so_far
from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.quantity import ACCELERATION
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from rig.data.result_file import ResultDocument, read_result
from rig.page.about import About
from rig.page.page_state import PageState
from rig.page.rows import look_of
from rig.runner.phases import list_observations
from support.paths import ROOT

RECORDED = ROOT / "tests" / "fixtures" / "recordings" / "magnetometer"

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def run() -> RunData:
    return read_run(RECORDED / "run.h5")


@pytest.fixture(scope="module")
def result() -> ResultDocument:
    return read_result(RECORDED)


def at_rest(run: RunData) -> list[dict[str, Any]]:
    return [row for row in look_of(so_far([run])).observations if "dwell" in row]


def test_accelerations_stand_beside_gravity_and_fields_beside_the_field(run: RunData, result: ResultDocument) -> None:
    rows = at_rest(run)
    ((felt, accelerometer),), ((seen, magnetometer),) = result.accelerometers.items(), result.magnetometers.items()
    assert isinstance(magnetometer, MagnetometerEntry)
    for sensor, dwells, expected, near, unit in (
        (f"{felt}, accelerometer", accelerometer.dwells, accelerometer.gravity_m_s2, 0.2, "m/s²"),
        (f"{seen}, magnetometer", magnetometer.dwells, magnetometer.field_t * 1e6, 1.0, "µT"),  # there is iron
    ):
        of = [row for row in rows if row["sensor"] == sensor]
        assert [row["sweep"] for row in of] == sorted(dwell.index for dwell in dwells)
        for row in of:
            assert row["refused"] is None and row["unit"] == unit and row["dwell"]
            assert row["expected"] == pytest.approx(expected)
            assert row["size"] == pytest.approx(row["expected"], rel=near) and 0 < row["std"] < 0.01 * row["size"]


def test_what_was_so_far_is_what_the_result_rests_on(run: RunData) -> None:
    shown = PageState(About("", ""))
    shown.look(look_of(so_far([run])))
    as_they_came = shown.sections["observations"]
    for event in list_observations(calibrate([run])):
        shown.take(event)
    assert shown.sections["observations"] == as_they_came and any(row["unit"] == "µT" for row in as_they_came)


def test_an_attitude_that_is_refused_says_why(run: RunData) -> None:
    (name,) = (name for name, sensor in run.sensors.items() if sensor.measures(ACCELERATION))
    samples = run.samples[name].copy()
    samples["acceleration_counts"][len(samples) // 2 :] = np.iinfo(np.int16).max
    rows = [
        row
        for row in at_rest(replace(run, samples={**run.samples, name: samples}))
        if row["sensor"] == f"{name}, accelerometer"
    ]
    refused = [row["sweep"] for row in rows if row["refused"]]
    assert 0 < len(refused) < len(rows) and refused == list(range(refused[0], len(rows)))
    assert rows[-1]["refused"].startswith("saturation: in dwell ")
