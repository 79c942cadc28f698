"""What sound readings of an accelerometer contradict no more often than is meant, whatever arm they are from."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import ksone

from rig.analysis.consistency.reference_alternatives import ReferenceModel
from rig.analysis.consistency.reference_checks import check_reference
from rig.analysis.reference.arm_patterns import Posture, StatedArm, arm_patterns
from rig.config.procedures.attitude_sets import OPTIMAL_ATTITUDES
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import DELAY, LEVER, NO_SWEEPS, Movement
from rig.estimation.reference.imu import solve_imu
from rig.motion.geometry import NOMINAL, flange_pose
from support.motions.arm_attitudes import draw_true_arm, joints_rad
from support.motions.arm_sweeps import Truth, joints_at, plan_sweeps, record_dwells, record_sweeps
from support.recordings import drawn_accelerations
from support.recordings.reference_p_values import p_values

pytestmark = pytest.mark.slow

NORM = 9.80665
JOINTS = joints_rad(OPTIMAL_ATTITUDES)
WRIST_1 = 3
WAVE_FRACTION = 0.3
SMALL = 0.25  # p-values
EVERY = ("bias_changed", "scale_changed", "loose_mounting", "even_term", "odd_term", "asymmetry", "residuals")

Poses = Callable[[Array], Array]


def drawn(rng: np.random.Generator, delay_s: float = 0.004) -> Truth:
    return Truth(
        matrix=np.diag(1 + 0.02 * rng.normal(size=3)) @ (np.eye(3) + 0.005 * rng.normal(size=(3, 3))),
        bias_m_s2=0.3 * rng.normal(size=3),
        reference_m_s2=NORM * np.array([0.02, -0.01, 1.0]) / np.linalg.norm([0.02, -0.01, 1.0]),
        lever_arm_m=np.array([0.025, 0.01, 0.03]) + 0.01 * rng.normal(size=3),
        delay_s=delay_s,
    )


def moved(truth: Truth, arm: Poses, density_ug: float, rng: np.random.Generator, axes: int = 6) -> Movement:
    """Sweeps about so many axes, and eighteen dwells."""
    swept = record_sweeps(truth, arm, plan_sweeps(axes), density_ug, rng) if axes else NO_SWEEPS
    return Movement(record_dwells(truth, arm, JOINTS, density_ug, rng), swept)


def stood(axes: int) -> list[Posture]:
    turned = plan_sweeps(axes) if axes else ()
    return [
        *map(Posture, JOINTS),
        *(Posture(joints_at(each, np.zeros(1))[0], each.joint - WRIST_1) for each in turned),
    ]


def read_of(movement: Movement, axes: int, axis_rad: float) -> ReferenceModel:
    """With what is found of it, of an arm that is said to be good to so much."""
    found = solve_imu(movement.dwells, movement.sweeps, gravity_m_s2=NORM)
    theta = np.concatenate([found.matrix.ravel(), found.reference_m_s2, found.bias_m_s2, np.zeros(7)])
    if found.lever_arm_m is not None:
        theta[LEVER], theta[DELAY] = found.lever_arm_m, found.delay_s
    known = StatedArm(NOMINAL, float(np.degrees(np.sqrt(3) * axis_rad)), np.eye(3), found.attitude_error.std_rad)
    swept_s = 8.0 * np.arange(len(movement.sweeps.speeds_rad_s), dtype=np.float64)
    times_s = np.concatenate([100 + 5.0 * np.arange(len(JOINTS), dtype=np.float64), swept_s])
    return ReferenceModel(
        theta, movement, arm_patterns(theta, movement, stood(axes), known), times_s, second_order=False
    )


@pytest.mark.thorough
@pytest.mark.one_in(3)
@pytest.mark.proof
@pytest.mark.parametrize(("axes", "density_ug"), [(6, 150.0), (6, 23.0), (0, 150.0)])
@pytest.mark.parametrize("arm_rad", [0.0, 5e-4])
def test_sound_readings_exceed_a_limit_with_its_stated_probability(
    axes: int, density_ug: float, arm_rad: float, thorough: bool
) -> None:
    """Of a limit for one recording in twenty; a binomial count strays by three standard deviations once in 400."""
    runs, rate = 100 if thorough else 4, 0.05
    beyond, judged = 0, 0
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        movement = moved(drawn(rng), draw_true_arm(arm_rad, rng), density_ug, rng, axes)
        found = check_reference(read_of(movement, axes, arm_rad), rate)
        judged += len(found.statistics) + 1
        beyond += sum(value > limit for value, limit in found.statistics.values()) + bool(found.disturbed)
        assert set(found.statistics) == {*EVERY, *(("sweeps_against_dwells",) if axes else ())}
    expected = rate * judged
    print(f"{beyond} of {judged} beyond their limit, {expected:.1f} expected")
    assert beyond < expected + 3 * 1.5 * np.sqrt(expected)  # of one recording several may be beyond


def chance_of(values: list[float], below: float) -> float:
    """How likely p-values that are uniform below so much have as many small ones, by Kolmogorov and Smirnov."""
    ranked = np.sort(values)
    early = np.arange(1, len(ranked) + 1) / len(ranked) - ranked
    return float(ksone.sf(early[ranked < below].max(initial=0.0), len(ranked)))


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.parametrize(("evenly", "below"), [(False, 1.0), (True, SMALL)], ids=["normal", "even"])
@pytest.mark.parametrize("part", ["lsm9ds1", "mpu9250", "adis16465"])
def test_p_values_of_sensors_as_their_data_sheets_let_them_be_are_uniform(
    part: str, evenly: bool, below: float
) -> None:
    """Kolmogorov and Smirnov do not refuse at 1 % that they are no smaller than that.

    A check takes a curve to be normal. One that is drawn evenly within its bounds is more often of middling size (three
    of four have a p below a half), and never large: then small ones alone are held.
    """
    found: dict[str, list[float]] = {}
    for seed in range(50):
        session = drawn_accelerations.drawn(part, seed, evenly=evenly)
        solution, _, _ = drawn_accelerations.solve_session(session)
        held = drawn_accelerations.read_of(session, solution)
        for name, rate in p_values(held).items():
            found.setdefault(name, []).append(rate)
    for name, values in found.items():
        print(f"{part}, {name}: {chance_of(values, below):.3f}, least {min(values):.4f}")
    assert all(chance_of(values, below) > 0.01 for values in found.values())


def test_what_a_wrist_errs_by_is_told_as_such_an_arm_makes_it() -> None:
    """Twist, zero and the waves of the angle, of each wrist, made in where the flange goes."""
    size, axes = 1e-4, 6
    truth = drawn(np.random.default_rng(1), delay_s=0.0)

    def read(poses: Poses) -> Array:
        return moved(truth, poses, 1e-9, np.random.default_rng(1), axes).readings().ravel()

    movement = moved(truth, flange_pose, 1e-9, np.random.default_rng(1), axes)
    known = StatedArm(NOMINAL, float(np.degrees(np.sqrt(3))), np.eye(3), 0.0)
    patterns = arm_patterns(truth.theta(), movement, stood(axes), known)
    of_dwells = 3 * len(JOINTS)
    for error, pattern in enumerate(patterns):
        expected = pattern / (1.0 if error % 6 < 2 else WAVE_FRACTION)
        changed = (read(_off(error, size)) - movement.readings().ravel()) / size
        np.testing.assert_allclose(changed[:of_dwells], expected[:of_dwells], atol=1e-3)
        np.testing.assert_allclose(changed[of_dwells:], expected[of_dwells:], atol=0.2)  # r does not turn with a flange
        assert np.abs(expected).max() > 4


def _off(error: int, size_rad: float) -> Poses:
    """An arm of which that error of a wrist is so large."""
    wrist, kind = WRIST_1 + error // 6, error % 6

    def poses(joints: Array) -> Array:
        alpha, theta, q = list(NOMINAL.alpha_rad), list(NOMINAL.theta_rad), joints.copy()
        if kind == 0:
            alpha[wrist] += size_rad
        elif kind == 1:
            theta[wrist] += size_rad
        else:
            angle = joints[:, wrist]
            q[:, wrist] += size_rad * (np.cos(angle), np.sin(angle), np.cos(2 * angle), np.sin(2 * angle))[kind - 2]
        return flange_pose(q, replace(NOMINAL, alpha_rad=tuple(alpha), theta_rad=tuple(theta)))

    return poses


def test_a_turn_of_one_dwell_is_named_however_far_off_the_arm_is() -> None:
    rng = np.random.default_rng(3)
    movement = moved(drawn(rng), draw_true_arm(5e-4, rng), 150.0, rng)
    turned = movement.dwells.attitudes.copy()
    turned[7] = turned[7] @ Rotation.from_rotvec([2e-3, -3e-3, 1e-3]).as_matrix()
    damaged = replace(movement, dwells=replace(movement.dwells, attitudes=turned))
    assert check_reference(read_of(movement, 6, 5e-4), 1e-5).disturbed == {}
    assert set(check_reference(read_of(damaged, 6, 5e-4), 1e-5).disturbed) == {7}
