"""A fault of one of several sensors names the sensor, and says what to do about it on an arm."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.analysis.reference.magnetometer import calibrate_magnetometers
from rig.data.recording.run_file import read_run
from rig.errors import Fault, name_sensor
from rig.observation.observed_run import observe_runs
from rig.report.document import document_of
from support.paths import RECORDINGS


@pytest.mark.slow
def test_lost_samples_of_one_of_two_sensors_are_named_as_its_own() -> None:
    run = read_run(RECORDINGS / "verified" / "run.h5")
    samples = run.samples["reference"]
    begin = len(samples) // 4
    damaged = replace(run, samples={**run.samples, "reference": np.delete(samples, slice(begin, begin + 60))})
    with pytest.raises(Fault, match=r"^lost_samples: reference: in sweep 1 "):
        observe_runs([damaged])


def test_a_fault_of_the_only_sensor_is_raised_as_it_is() -> None:
    fault = Fault("stuck_axis", "it repeats", "Look")
    with pytest.raises(Fault) as raised, name_sensor("gyro", ["gyro"]):
        raise fault
    assert raised.value is fault


@pytest.mark.slow
def test_an_accelerometer_that_was_knocked_on_the_arm_costs_the_gyroscope_nothing() -> None:
    run = read_run(RECORDINGS / "imu" / "run.h5")
    samples = run.samples["gyro"].copy()
    samples["acceleration_counts"][3 * len(samples) // 4 :, 0] += 400
    outcome = calibrate([replace(run, samples={"gyro": samples})], "vector")
    np.testing.assert_array_equal(outcome.results["gyro"].scale, calibrate([run], "vector").results["gyro"].scale)
    assert not outcome.passed and not outcome.accelerometers
    assert "gyro.acceleration_unsolved" in {check.name for check in outcome.checks if not check.passed}
    why = document_of(outcome).unsolved["gyro"]["acceleration"].error
    assert why.startswith("attitude_untrustworthy: ") and "on the flange" in why and "body to table" not in why


@pytest.mark.slow
def test_a_magnetometer_without_a_solved_accelerometer_is_refused_by_name() -> None:
    run = read_run(RECORDINGS / "magnetometer" / "run.h5")
    (fault,) = calibrate_magnetometers(observe_runs([run]), run.settings, {}).faults.values()
    assert str(fault).startswith("attitude_untrustworthy: no accelerometer has a solution")
