"""What the first screen after a run says: numbers as they are printed, what was before, what to do next."""

from dataclasses import replace

import pytest

from rig.analysis.check import Check, fitness
from rig.data.meaning import Meaning
from rig.page.outcome_screen import after_fault, after_verdict, outcome_rows, since_rows
from rig.station.events import LastCalibration
from support.page.scripted_runs import ABOUT
from support.page.scripted_six_sensors import PARTS, six_found

CONFORMING = Check("gyro.bias", 0.2, 0.1, "rad/s", Meaning("conformity", "gyro", "rate", "bias"))
UNFIT = fitness("gyro", "rate", "scale_std", 0.002, 0.001)
DISTURBED = Check("gyro.disturbed_sweep.3", 30.0, 20.0, "1", Meaning("fitness", "gyro", "rate", sweep=3))


def test_each_thing_found_has_a_row_with_its_serial_number_and_its_limits() -> None:
    rows = outcome_rows(six_found(), PARTS)
    assert [row["name"] for row in rows] == [*PARTS, *(f"{name}, accelerometer" for name in PARTS)]
    assert [row["part"] for row in rows] == [*PARTS.values()] * 2
    assert rows[0]["scale"]["limit"] == 0.3 and rows[0]["bias"]["limit"] is not None
    assert [*dict.fromkeys(row["model"] for row in rows)] == [
        "gyroscope: g = K (m + b)",
        "accelerometer: m = F (s + φ s²) + b",
    ]
    for row in rows:
        for found in (row["scale"], row["bias"]):
            decimals = [len(text.partition(".")[2]) for text in (*found["texts"], *found["u"])]
            assert decimals[:3] == decimals[3:]  # each value to the decimal of its own U


def test_what_was_before_stands_beside_the_row_of_its_sensor_in_that_rows_unit() -> None:
    before = {"kx": (1.01, 1e-4), "ky": (0.99, 1e-4), "kz": (1.0, 1e-4), "bx": (2e-5, 1e-7), "by": (0.0, 1e-7)}
    errors = dict.fromkeys(before, 0.5) | {"ky": 1.5}
    field = LastCalibration(
        "mag", "field", 7, "2026-11-20", before | {"bz": (1e-6, 1e-7)}, errors | {"bz": 0.1}, ("ky",)
    )
    rows = since_rows([field, replace(field, sensor="gyro", quantity="rate"), replace(field, quantity="a drift")])
    assert set(rows) == {"mag, magnetometer", "gyro"}
    assert rows["mag, magnetometer"]["bias"]["values"] == pytest.approx([20.0, 0.0, 1.0])  # µT
    found = rows["mag, magnetometer"]
    assert (found["changed"], found["worst"]) == (["ky"], ["ky", 1.5])
    assert found["scale"]["changed"] == [False, True, False]


@pytest.mark.parametrize(
    ("checks", "command"),
    [
        ([CONFORMING], "rig show 'a run' --all"),
        ([CONFORMING, UNFIT], "rig run 'a run/config.yaml'"),
        ([UNFIT, DISTURBED], "rig resume 'a run'"),
    ],
)
def test_what_to_do_after_a_failure_depends_on_what_failed(checks: list[Check], command: str) -> None:
    assert after_verdict(replace(ABOUT, folder="a run"), checks, passed=False, stored=False)["command"] == command


def test_a_calibration_is_to_be_stored_where_a_board_keeps_it_and_has_not_done_so() -> None:
    kept = replace(ABOUT, storing="rig board calibration write C R")
    assert after_verdict(kept, [], passed=True, stored=False)["command"] == kept.storing
    assert after_verdict(kept, [], passed=True, stored=True)["command"] == "rig history LSM9DS1-001"
    assert after_verdict(ABOUT, [], passed=True, stored=False)["command"] == "rig history LSM9DS1-001"


def test_after_a_fault_the_run_goes_on_in_its_folder() -> None:
    assert after_fault("rig resume 'a run'", repeats=False)["command"] == "rig resume 'a run'"
