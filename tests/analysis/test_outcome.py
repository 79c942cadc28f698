"""A verified run is observed and solved once, phase after phase as a run has them."""

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import FrameType
from typing import Any

import pytest

from rig.analysis.analyses import calibrate, verify_calibration, verify_stored_calibrations
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from rig.errors import Fault, Refused
from rig.observation.clocks.clock_estimate import estimate_time_base
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.observe import observe_sensor
from support.paths import RECORDINGS

pytestmark = pytest.mark.slow


def recorded(name: str) -> RunData:
    return read_run(RECORDINGS / "verified" / name)


@contextmanager
def calls(*functions: Callable[..., Any]) -> Iterator[Counter[str]]:
    """How often each of these functions is entered."""
    names = {function.__code__: function.__qualname__ for function in functions}
    counted: Counter[str] = Counter()

    def count(frame: FrameType, event: str, argument: object) -> None:
        if event == "call" and frame.f_code in names:
            counted[names[frame.f_code]] += 1

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        yield counted
    finally:
        sys.setprofile(before)


def test_two_recordings_of_two_sensors_are_four_observations() -> None:
    runs, repeated = [recorded("run.h5")], [recorded("verify.h5")]
    with calls(ArmMotion.__init__, estimate_time_base, observe_sensor) as counted:
        calibration = calibrate(runs)
        outcome = verify_calibration(calibration, repeated)
    assert calibration.passed and outcome.passed
    assert counted == {
        "ArmMotion.__init__": 2,  # one for each recording
        "estimate_time_base": 4,
        "observe_sensor": 4,
    }
    assert outcome.results is calibration.results


def test_the_delay_between_two_sensors_is_that_between_their_clock_fits() -> None:
    (recording,) = calibrate([recorded("run.h5")]).recordings
    late, none = recording.delay("gyro", behind="reference"), recording.delay("gyro", behind="gyro")
    assert late is not None and none is not None
    assert 5 * late.std_s < 1e-4 and 1e-3 < late.delay_s < 3e-3  # of the filters of the two parts
    assert none.delay_s == 0.0


def test_a_recording_without_sweeps_is_refused_by_name() -> None:
    with pytest.raises(Fault, match="too_few_observations: no finished sweep"):
        calibrate([replace(recorded("run.h5"), events=())])


def test_an_estimator_nobody_knows_is_refused_before_anything_is_observed() -> None:
    with calls(observe_sensor) as counted, pytest.raises(Refused, match="unknown_estimator"):
        calibrate([recorded("run.h5")], estimator="newtun")
    assert not counted


def test_stored_calibrations_are_verified_alone() -> None:
    repeated = [recorded("verify.h5")]
    outcome = verify_stored_calibrations(repeated)
    assert outcome.passed and list(outcome.verifications) == ["gyro"]
    assert not outcome.results and not outcome.recordings
    assert outcome.provenance.verified_utc == (repeated[0].provenance.started_utc,)


def test_a_verification_that_was_not_recorded_has_not_passed() -> None:
    outcome = verify_calibration(calibrate([recorded("run.h5")]), [])
    assert not outcome.passed and not outcome.verifications
