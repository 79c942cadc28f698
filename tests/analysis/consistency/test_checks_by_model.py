"""What arm and sensor may be off by is allowed, and no more: the least damage that is told."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.consistency.false_alarms import CHECKS
from rig.estimation.arrays import Array
from rig.motion.geometry import NOMINAL
from rig.observation.windows import swept
from support.recordings.checked_runs import check_run, kind_of, list_failed
from support.recordings.drawn_recording import KINDS, Drawn, add_readings, drawn
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow

DIRECTION = np.array([1.0, -0.7, 0.5])


def later(seen: Drawn) -> Array:
    """(n, 1) one in the second half, else zero."""
    second = seen.time_s > (seen.time_s[0] + seen.time_s[-1]) / 2
    return np.asarray(second[:, None], dtype=np.float64)


def sweep_2(seen: Drawn) -> Array:
    window = next(sweep.window for sweep in swept(seen.run) if sweep.sweep.index == 2)
    inside = (seen.time_s >= window.start_s) & (seen.time_s <= window.end_s)
    return np.asarray(inside[:, None], dtype=np.float64)


def turned(angle_deg: float) -> Array:
    from scipy.spatial.transform import Rotation

    turn = Rotation.from_rotvec(np.radians(angle_deg) * np.array([0.6, -0.48, 0.64])).as_matrix()
    return np.asarray(turn.T - np.eye(3), dtype=np.float64)


# Each with the size that is detected of an ADIS16465, and of a LSM9DS1 whose noise is 0.002 rad/s. The sweeps about y
# and z lie in one half of the recording: transfers alone show a gain that changes between the halves.
DAMAGES: dict[str, tuple[float, float, Callable[[Drawn, float], Array]]] = {
    "gain of all axes half-way": (6e-4, 9.5e-4, lambda seen, by: by * later(seen) * seen.sensed_rad_s),
    "gain of x half-way": (1e-3, 2.5e-3, lambda seen, by: by * later(seen) * seen.sensed_rad_s * [1, 0, 0]),
    "gain of y half-way": (8e-3, 6e-3, lambda seen, by: by * later(seen) * seen.sensed_rad_s * [0, 1, 0]),
    "gain of z half-way": (8e-3, 6e-3, lambda seen, by: by * later(seen) * seen.sensed_rad_s * [0, 0, 1]),
    "mounting half-way, °": (0.02, 0.075, lambda seen, by: later(seen) * (seen.sensed_rad_s @ turned(by))),
    "cw against ccw": (5e-4, 6.3e-4, lambda seen, by: by * np.maximum(seen.sensed_rad_s, 0.0)),
    "offset of one sweep, rad/s": (4e-4, 8e-4, lambda seen, by: by * sweep_2(seen) * DIRECTION),
    "gain of one sweep": (6e-4, 1e-3, lambda seen, by: by * sweep_2(seen) * seen.sensed_rad_s),
}
GOOD = {"ADIS16465": 0, "quiet LSM9DS1": 1}


@pytest.mark.thorough
@pytest.mark.one_in(4)
@pytest.mark.proof
@pytest.mark.parametrize("name", DAMAGES)
def test_the_smallest_relevant_fault_is_detected(name: str, thorough: bool) -> None:
    """In 95 of 100 recordings, as what is stated of a size is."""
    *sizes, damage = DAMAGES[name]
    seeds = range(20 if thorough else 1)
    for kind, place in GOOD.items():
        passed = []
        for seed in seeds:
            seen = drawn(500 + seed, KINDS[kind])
            run = add_readings(seen, KINDS[kind], damage(seen, float(sizes[place])))
            passed.extend([] if list_failed(check_run(run)) else [seed])
        print(f"{kind}: {len(passed)} of {len(seeds)} passed {passed}")
        assert len(passed) <= 0.05 * len(seeds), (kind, passed)


def test_every_check_that_is_made_has_its_share_of_the_false_alarms() -> None:
    made = sorted({kind_of(check) for check in check_run(drawn(3, KINDS["ADIS16465"]).run)})
    assert made == sorted(CHECKS)


def test_what_changes_on_one_axis_alone_is_told_by_the_ways_between_the_sweeps() -> None:
    """The axis is swept in one stretch of time, and its gain changes after it: no sweep shows that."""
    kind = KINDS["ADIS16465"]
    seen = drawn(3, kind)
    checks = check_run(add_readings(seen, kind, 1e-2 * later(seen) * seen.sensed_rad_s * [0, 0, 1]))
    assert max(checks, key=lambda check: (check.value or 0.0) / (check.limit or np.inf)).name == "gyro.axis_changed"
    assert list_failed(checks) <= {"axis_changed", "scale_changed", "loose_mounting"}


@pytest.mark.one_in(2)  # a frozen recording of several speeds has the same checks
@pytest.mark.parametrize("setup", [Setup(rest_s=0.0), Setup(procedure=(("speeds_deg_s", "[40, 90]"),))])
def test_a_recording_without_rests_or_with_several_speeds_is_held_to_the_model_too(setup: Setup) -> None:
    checks = check_run(drawn(11, KINDS["quiet LSM9DS1"], setup).run)
    assert {check.name.split(".")[1] for check in checks} >= {"axis_changed", "scale_changed", "residuals"}
    assert not list_failed(checks)


def test_a_wrist_whose_zero_is_off_makes_axes_lean_farther_than_the_sensors_do() -> None:
    """No sweep contradicts another, and the scale factors of a sensor that is mounted askew are off by it."""
    leaning = replace(NOMINAL, theta_rad=(0, 0, 0, 0, float(np.radians(5)), 0))
    off = synthetic_run(Setup(noise_rad_s=0.002, kinematics=leaning))
    checks = check_run(off)
    assert "non_orthogonality" in list_failed(checks) and "residuals" not in list_failed(checks)
    told = next(check for check in checks if check.name == "gyro.non_orthogonality")
    assert told.value == pytest.approx(5, abs=0.3) and told.unit == "°"
