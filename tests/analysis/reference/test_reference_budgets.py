"""The budgets of accelerometers and magnetometers: what each line does, and whether U covers the truth."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.analysis.reference.datasheet_errors import Datasheet, read_datasheet
from rig.analysis.reference.reference_budgets import accelerometer_budget, gravity_error_m_s2, magnetometer_budget
from rig.config.procedures.attitude_sets import OPTIMAL_ATTITUDES
from rig.data.quantity import ACCELERATION
from rig.data.recording.settings import Site
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.reference.accelerometer_model import OWN_ERRORS, Dwells, Movement, arm_effects
from rig.estimation.reference.imu import solve_imu
from rig.estimation.reference.magnetometer import field_drift, uniformity
from rig.estimation.reference.reference_budget import scale_and_bias_covariance
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import solve_triaxial
from rig.plans.recorded_run import open_run
from support.motions.arm_attitudes import attitudes_of, draw_true_arm, draw_true_attitudes, joints_rad
from support.motions.arm_sweeps import Truth, plan_sweeps, record_dwells, record_sweeps
from support.paths import RECORDINGS
from support.recordings import drawn_accelerations

GRAVITY, FIELD_T = 9.81, 48e-6
GRAVITY_U, FIELD_U = 3e-4, 2e-7  # expanded, k = 2
LAG_S, ARM_RAD, DENSITY_UG = 0.02, 1e-4, 150.0
SITE = Site(
    up=(0.0, 0.0, 1.0),
    gravity_m_s2=GRAVITY,
    earth_rate_rad_s=None,
    magnetic_field_t=FIELD_T,
    gravity_expanded_m_s2=GRAVITY_U,
    magnetic_field_expanded_t=FIELD_U,
)

pytestmark = pytest.mark.slow
JOINTS = joints_rad(OPTIMAL_ATTITUDES)
NOISE_T, TEST_NOISE_T = 3e-8, 2e-8  # of a mean
Session = tuple[Array, Budget, Array]  # error over u (6,), the budget, error over the solution's own spread (6,)


def accelerometer(seed: int, site: Site = SITE, lag_s: float = LAG_S) -> Session:
    """A session in which gravity, the arm and the sensor's filter are all off as the budget has it."""
    rng = np.random.default_rng([71, seed])
    gravity = GRAVITY + GRAVITY_U / 2 * rng.normal()
    truth = Truth(
        matrix=np.diag(1 + 0.02 * rng.normal(size=3)) @ Rotation.from_rotvec(0.01 * rng.normal(size=3)).as_matrix(),
        bias_m_s2=0.3 * rng.normal(size=3),
        reference_m_s2=np.array([0.0, 0.0, gravity]),
        lever_arm_m=np.array([0.02, 0.01, 0.03]),
        delay_s=0.0,
    )
    arm = draw_true_arm(ARM_RAD, rng)
    sweeps = record_sweeps(truth, arm, plan_sweeps(6), DENSITY_UG, rng)
    smaller = 1 - rng.uniform() * np.square(sweeps.speeds_rad_s * lag_s) / 2
    sweeps.harmonics_m_s2[:, 1:] *= smaller[:, None, None]
    dwells = record_dwells(truth, arm, JOINTS, DENSITY_UG, rng)
    solution = solve_imu(dwells, sweeps, gravity_m_s2=GRAVITY)
    readings = dwells.readings_m_s2.size + sweeps.harmonics_m_s2.size
    many = np.full(readings, np.inf)  # degrees of freedom
    budget = accelerometer_budget(solution, Movement(dwells, sweeps), site, lag_s, noise_dof=many)
    scale = 1 / np.linalg.norm(solution.matrix, axis=1)
    off = np.concatenate([scale - 1 / np.linalg.norm(truth.matrix, axis=1), solution.bias_m_s2 - truth.bias_m_s2])
    return off / budget.std, budget, off / own_spread(budget)


def magnetometer(seed: int, site: Site = SITE) -> Session:
    """A session in a field that is not quite of the stated size, and that drifts less than its tests at home show."""
    rng = np.random.default_rng([72, seed])
    told = attitudes_of(JOINTS)
    true = draw_true_attitudes(JOINTS, ARM_RAD, rng)
    direction = np.array([0.4, 0.1, -0.9])
    field = (FIELD_T + FIELD_U / 2 * rng.normal()) * direction / np.linalg.norm(direction)
    matrix = np.eye(3) + 0.03 * rng.normal(size=(3, 3))
    bias = 2e-5 * rng.normal(size=3)
    drift = TEST_NOISE_T * rng.normal(size=3)
    along = np.linspace(-0.5, 0.5, len(told))[:, None] * drift
    readings = np.einsum("nji,nj->ni", true, field + along) @ matrix.T + bias
    variances = np.full_like(readings, NOISE_T**2)
    readings += NOISE_T * rng.normal(size=readings.shape)
    solution = solve_triaxial(readings, told, variances, KnownNorm(FIELD_T, -np.eye(3)[2]), method="attitude_weighted")
    assert solution.attitude_error is not None
    tests = [bias, bias + drift] + TEST_NOISE_T / np.sqrt(2) * rng.normal(size=(2, 3))
    tested = (
        uniformity(solution, readings, told, variances, solution.attitude_error.std_rad),
        field_drift(tests, np.full((2, 3), TEST_NOISE_T**2 / 2), 0.0),
    )
    seen, many = Dwells(readings, variances, told), np.full(readings.size, np.inf)
    budget = magnetometer_budget(solution, seen, tested, site, field_t=FIELD_T, noise_dof=many)
    scale = 1 / np.linalg.norm(solution.matrix, axis=1)
    off = np.concatenate([scale - 1 / np.linalg.norm(matrix, axis=1), solution.bias - bias])
    return off / budget.std, budget, off / own_spread(budget)


def own_spread(budget: Budget) -> Array:
    """(6,) by noise and attitudes alone."""
    std: Array = np.hypot(budget.std_of("noise"), budget.std_of("arm's attitudes"))
    return std


def check(sessions: list[Session], within: tuple[float, float], without: float) -> None:
    """Errors over u are `within` these in the mean; `without`: how far the scale is beyond its own spread at least."""
    off = np.array([session[0] for session in sessions])
    alone = np.array([session[2] for session in sessions])
    rms = np.sqrt(np.mean(off**2, axis=0))
    for part in (rms[:3], rms[3:]):
        assert within[0] < np.sqrt(np.mean(part**2)) < within[1], rms
    assert np.mean(np.abs(off) < 2) > 0.92
    assert np.sqrt(np.mean(alone[:, :3] ** 2)) > without  # or the test would pass without a budget


BY_SHEET = {
    "nonlinearity": "0.25 % of 2 g",
    "bias over temperature": "0.05 mg/K",
    "scale over temperature": "20 ppm/K",
}


@pytest.mark.thorough
@pytest.mark.proof
@pytest.mark.parametrize(("session", "without"), [(accelerometer, 1.25), (magnetometer, 2.0)])
def test_the_stated_uncertainty_covers_the_truth(
    session: Callable[[int], Session], without: float, thorough: bool
) -> None:
    seeds, within = (200, (0.85, 1.1)) if thorough else (12, (0.6, 1.3))
    check([session(seed) for seed in range(seeds)], within, without)


@pytest.mark.thorough
@pytest.mark.one_in(3)
@pytest.mark.proof
@pytest.mark.parametrize("part", ["lsm9ds1", "mpu9250", "adis16465"])
def test_the_stated_uncertainty_covers_what_a_data_sheet_lets_a_sensor_do(part: str, thorough: bool) -> None:
    """It bends, and follows its temperature, as far as its data sheet says at most; its arm always errs alike."""
    seeds, within = (200, (0.85, 1.15)) if thorough else (10, (0.6, 1.4))
    off = []
    for seed in range(seeds):
        _, budget, error = drawn_accelerations.solve_session(drawn_accelerations.drawn(part, seed))
        off.append((error / budget.std, error / budget.expanded))
    over_u, over_expanded = np.swapaxes(off, 0, 1)
    rms = [float(np.sqrt(np.mean(each**2))) for each in (over_u[:, :3], over_u[:, 3:])]
    share = [float(np.mean(np.abs(each) < 1)) for each in (over_expanded[:, :3], over_expanded[:, 3:])]
    print(f"{part}: error / u {rms[0]:.2f} (scale), {rms[1]:.2f} (bias); within U {share[0]:.3f}, {share[1]:.3f}")
    assert all(within[0] < each < within[1] for each in rms)
    assert all(each > (0.92 if thorough else 0.8) for each in share)


@pytest.mark.thorough
@pytest.mark.parametrize(("new_rad", "least", "most"), [(0.0, 0.0, 0.01), (1e-4, 0.01, 0.2), (5e-4, 0.1, 0.5)])
def test_the_readings_tell_how_much_of_what_an_arm_is_off_by_is_new_in_each_dwell(
    new_rad: float, least: float, most: float
) -> None:
    """Of an arm that always errs by 0.3 mrad, and besides stands a little elsewhere whenever it comes back."""
    shares = []
    off = []
    for seed in range(6):
        session = drawn_accelerations.drawn("adis16465", seed, arm_rad=3e-4)
        turns = arm_effects(session.truth.theta(), session.movement)[:, : OWN_ERRORS * len(JOINTS)]
        elsewhere = new_rad * np.random.default_rng([9, seed]).standard_normal(turns.shape[1])
        solution, budget, error = drawn_accelerations.solve_session(session.reading(turns @ elsewhere))
        shares.append(solution.independent_fraction)
        off.append(error[3:] / budget.std[3:])
    assert least <= np.median(shares) <= most
    assert 0.5 < np.sqrt(np.mean(np.square(off))) < 1.5  # of 18 values, which scatter by 0.17


def test_nonlinearity_is_in_the_budget_if_attitudes_do_not_determine_it() -> None:
    """Named lines make up the whole; what a data sheet bounds is of type B, and known by more than its half-width."""
    session = drawn_accelerations.drawn("adis16465", 0)
    solution, budget, _ = drawn_accelerations.solve_session(session)
    stated = {line.name: f"{line.half_width:g} {line.unit}" for line in budget.contributors if line.name in BY_SHEET}
    assert stated == BY_SHEET
    for line in budget.contributors:
        if line.name in BY_SHEET:
            assert (line.kind, line.distribution, line.dof) == ("B", "rectangular", np.inf)
    whole = scale_and_bias_covariance(solution.matrix, 1 / np.linalg.norm(solution.matrix, axis=1), solution.covariance)
    readings = {"noise", "arm's attitudes", "bias instability", "flicker of the bias", *BY_SHEET}
    parts = sum(line.covariance for line in budget.contributors if line.name in readings)
    np.testing.assert_allclose(np.diag(parts), np.diag(whole), rtol=1e-6)
    own = session.movement.sensor_errors
    assert own is not None
    assert np.all(budget.std_of("nonlinearity")[3:] < 0.01 * own.even_s2_m * GRAVITY**2)  # the attitudes tell the rest


def test_a_quiet_sensor_s_flicker_and_what_its_thermometer_hides_are_in_its_budget() -> None:
    """By the least Allan deviation, and by half a step over the run: no more than that makes of a mean."""
    _, budget, _ = drawn_accelerations.solve_session(drawn_accelerations.drawn("adis16465", 0))
    (line,) = (line for line in budget.contributors if line.name == "flicker of the bias")
    assert (line.kind, line.distribution, line.source) == ("B", "normal", "least Allan deviation: 3.6 µg")
    assert np.all((line.std[3:] > 0.2 * 3.6e-6 * GRAVITY) & (line.std[3:] < 3.6e-6 * GRAVITY))
    assert np.all(budget.std_of("bias over temperature")[3:] > 0)


def test_a_data_sheet_is_that_of_the_recording() -> None:
    recording = open_run(RECORDINGS / "imu").movement[0]
    known, sensor = recording.settings.uncertainty, recording.sensors["gyro"]
    range_m_s2 = sensor.channel(ACCELERATION).range
    assert known is not None and range_m_s2 is not None
    assert read_datasheet(known, "gyro", range_m_s2) == Datasheet(0.5, 2.0, 1.5, 260, 30)
    said = known.model_copy(update={
        "acceleration_nonlinearity_percent": {"gyro": 0.1}, "acceleration_nonlinear_over_g": {"gyro": 1.0},
        "acceleration_bias_mg_k": {"gyro": 0.2}, "acceleration_scale_ppm_k": {"gyro": 30.0},
        "acceleration_bias_instability_ug": {"gyro": 4.0},
    })  # fmt: skip
    assert read_datasheet(said, "gyro", range_m_s2) == Datasheet(0.1, 1.0, 0.2, 30.0, 4.0)


@pytest.mark.parametrize(
    ("session", "size", "expanded"),
    [(accelerometer, "gravity", GRAVITY_U / GRAVITY), (magnetometer, "size of the field", FIELD_U / FIELD_T)],
)
def test_the_size_of_the_reference_is_the_scale_s_alone(
    session: Callable[[int], Session], size: str, expanded: float
) -> None:
    _, budget, _ = session(0)
    np.testing.assert_allclose(budget.std_of(size)[:3], expanded / 2, rtol=0.1)  # of scale factors near 1
    np.testing.assert_array_equal(budget.std_of(size)[3:], 0)


def test_an_unstated_value_is_assumed_and_reported() -> None:
    unstated = replace(SITE, gravity_expanded_m_s2=None, magnetic_field_expanded_t=None)
    known, standard = (accelerometer(0, replace(unstated, gravity_m_s2=stated))[1] for stated in (9.807, 9.80665))
    field = magnetometer(0, unstated)[1]
    lines = [
        next(contributor for contributor in found.contributors if contributor.kind == "B")
        for found in (known, standard, field)
    ]
    assert [line.half_width for line in lines] == [pytest.approx(each) for each in (0.0005, 0.03, 0.48)]
    assert all(line.distribution == "rectangular" and line.source.endswith("is not given") for line in lines)


def test_without_sweeps_no_filter_lags() -> None:
    assert "filter's lag" in {line.name for line in accelerometer(0)[1].contributors}
    quick = accelerometer(0, lag_s=0.0)[1]
    assert quick.std_of("filter's lag").max() == 0


@pytest.mark.parametrize(
    ("stated_m_s2", "half_width_m_s2"),
    [(9.80665, 0.03), (9.8, 0.03), (9.81, 0.03), (9.79, 0.005), (9.807, 0.0005), (9.80061, 0.0005)],
)
def test_a_gravity_without_uncertainty_is_believed_to_its_last_digit(
    stated_m_s2: float, half_width_m_s2: float
) -> None:
    """A place with 9.80 m/s² that states 9.81 would have scale factors off by 0.1 %, many U."""
    assert gravity_error_m_s2(stated_m_s2) == pytest.approx(half_width_m_s2)
