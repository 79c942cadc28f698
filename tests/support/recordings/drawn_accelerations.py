"""Accelerometers drawn within their data sheets, on arms with errors: their sessions, and faults planted in them."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.consistency.reference_alternatives import ReferenceModel
from rig.analysis.consistency.reference_checks import check_reference
from rig.analysis.reference.arm_patterns import Posture, StatedArm, arm_patterns, list_arm_rotations
from rig.analysis.reference.datasheet_errors import (
    MICRO_G_PER_MILLI_G,
    RECTANGULAR_RATIO,
    Datasheet,
    ReferenceWindow,
    list_sensor_errors,
)
from rig.analysis.reference.reference_budgets import accelerometer_budget
from rig.config.procedures.attitude_sets import OPTIMAL_ATTITUDES
from rig.config.sensors.sensor_catalogue import PARTS
from rig.data.recording.settings import Site
from rig.estimation.arrays import Array
from rig.estimation.earth import MICRO_G_M_S2
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.reference.accelerometer_model import Movement, find_force
from rig.estimation.reference.imu import ImuSolution, solve_imu
from rig.estimation.reference.reading_errors import per_axis, project_errors, repeat_by_segment
from rig.estimation.statistics.bias_process import flicker_covariance
from rig.estimation.statistics.expected_variances import INDEPENDENT_FRACTIONS
from rig.motion.geometry import NOMINAL, WRIST_1
from support.motions.arm_attitudes import draw_true_arm, joints_rad
from support.motions.arm_sweeps import DWELL_S, Truth, joints_at, plan_sweeps, record_dwells, record_sweeps

GRAVITY = 9.80665
SITE = Site(up=(0.0, 0.0, 1.0), gravity_m_s2=GRAVITY, earth_rate_rad_s=None, gravity_expanded_m_s2=1e-5)
RANGES_G = {"lsm9ds1": 2.0, "mpu9250": 2.0, "adis16465": 8.0, "kvh1775": 10.0}
STEPS_K = {"lsm9ds1": 1 / 16, "mpu9250": 1 / 333.87, "adis16465": 0.1, "kvh1775": 1.0}
JOINTS, AXES = joints_rad(OPTIMAL_ATTITUDES), 6
SWEEP_S, BETWEEN_S = 6.0, 8.0
ASKEW = np.array([1.0, -0.7, 0.5])
SAMPLE_RATE_HZ = 200.0
WARMER_K = 0.3  # either way, in a run
AVERAGED = 500.0  # readings in a mean
NOISIER = {"kvh1775": 1.0}  # than the data sheet; other parts √2, as in the tables of docs/uncertainty.md


@dataclass(frozen=True, slots=True)
class Session:
    """The readings of one run, the true scale and bias (6,), and the prior knowledge of sensor and arm."""

    part: str
    truth: Truth
    movement: Movement
    parameters: Array
    arm_rad: float

    @property
    def times_s(self) -> Array:
        """Times (N + M,) of the middles, s."""
        assert self.movement.sensor_errors is not None
        return np.asarray(self.movement.sensor_errors.windows_s.mean(axis=1), dtype=np.float64)

    @property
    def late(self) -> Array:
        """Mask (N + M,): 1 in the second half of the run."""
        return np.asarray(self.times_s > (self.times_s.min() + self.times_s.max()) / 2, dtype=np.float64)

    def reading(self, more: Array, then: Array | float = 0.0) -> "Session":
        """Return the session with `more` (3 K,) added to its readings, and `then` (6,) as its true parameters."""
        added, count = more.reshape(-1, 3), len(self.movement.dwells.readings_m_s2)
        dwells, sweeps = self.movement.dwells, self.movement.sweeps
        movement = replace(
            self.movement,
            dwells=replace(dwells, readings_m_s2=dwells.readings_m_s2 + added[:count]),
            sweeps=replace(sweeps, harmonics_m_s2=sweeps.harmonics_m_s2 + added[count:].reshape(-1, 3, 3)),
        )
        return replace(self, movement=movement, parameters=self.parameters + then)


def sheet_of(part: str) -> Datasheet:
    """Return the data sheet of an accelerometer of this kind."""
    spec = PARTS[part]
    return Datasheet(
        spec.acceleration_nonlinearity_percent,
        spec.acceleration_nonlinear_over_g or RANGES_G[part],
        spec.acceleration_bias_mg_k,
        spec.acceleration_scale_ppm_k,
        spec.acceleration_bias_instability_ug,
    )


def drawn(
    part: str,
    seed: int,
    arm_rad: float = 1e-4,
    warmer_k: float = WARMER_K,
    *,
    evenly: bool = True,
    noisier: float | None = None,
) -> Session:
    """Draw eighteen dwells after sweeps about six axes, at temperatures that vary by `warmer_k`.

    Errors bounded by a data sheet are drawn `evenly` within the bounds, or from a normal distribution of that standard
    deviation. `noisier`: factor on the noise of the data sheet; None is `NOISIER`.
    """
    rng, sheet = np.random.default_rng([seed, 7]), sheet_of(part)
    noisier = NOISIER.get(part, 2**0.5) if noisier is None else noisier
    walk_ug = noisier * PARTS[part].velocity_random_walk_ug_sqrt_s
    truth = Truth(
        matrix=np.diag(1 + 0.02 * rng.normal(size=3)) @ (np.eye(3) + 0.005 * rng.normal(size=(3, 3))),
        bias_m_s2=0.1 * rng.normal(size=3),
        reference_m_s2=np.array([0.0, 0.0, GRAVITY]),
        lever_arm_m=np.array([0.02, 0.01, 0.03]),
        delay_s=0.004,
    )
    arm, turned = draw_true_arm(arm_rad, rng), plan_sweeps(AXES)
    straight = Movement(
        record_dwells(truth, arm, JOINTS, walk_ug, rng), record_sweeps(truth, arm, turned, walk_ug, rng)
    )
    even, odd, bias_k = sheet.even_s2_m, sheet.odd_s4_m2, MICRO_G_PER_MILLI_G * MICRO_G_M_S2 * sheet.bias_mg_k
    start_s = BETWEEN_S * np.concatenate([len(turned) + np.arange(len(JOINTS)), np.arange(len(turned))])
    length_s = np.repeat([DWELL_S, SWEEP_S], [len(JOINTS), len(turned)])
    warm_c = 22 + warmer_k * np.sin(start_s / 60 + rng.uniform(0, 2 * np.pi))
    stood = [
        *map(Posture, JOINTS),
        *(Posture(joints_at(sweep, np.zeros(1))[0], sweep.joint - WRIST_1) for sweep in turned),
    ]
    pieces = [
        ReferenceWindow(number, (start, start + length), round(SAMPLE_RATE_HZ * length), warm, pose)
        for number, (start, length, warm, pose) in enumerate(zip(start_s, length_s, warm_c, stood, strict=True))
    ]
    sensor_errors = list_sensor_errors(sheet, pieces, STEPS_K[part], second_order=False)
    movement = replace(straight, sensor_errors=sensor_errors, arm_turns=list_arm_rotations(stood, NOMINAL, np.eye(3)))
    session = Session(part, truth, movement, _parameters(truth, np.zeros(3)), arm_rad)

    def within(half_width: float) -> Array:
        return (
            rng.uniform(-half_width, half_width, 3) if evenly else half_width / RECTANGULAR_RATIO * rng.normal(size=3)
        )

    chi, theta = within(odd), truth.theta()
    warm = repeat_by_segment(sensor_errors.warmer_k + rng.uniform(-1, 1) * sensor_errors.unseen_k, movement)
    bent = project_errors(theta, movement, np.square) @ within(even)
    bent += project_errors(theta, movement, lambda force: force**3) @ chi
    bent += per_axis((warm * movement.constant())[:, None] * np.ones(3)) @ within(bias_k)
    bent += per_axis(_find_forces(session) * warm[:, None]) @ within(1e-6 * sheet.scale_ppm_k)
    flickered = rng.multivariate_normal(np.zeros(len(pieces)), flicker_covariance(sensor_errors.windows_s), 3)
    flickering = movement.constant() * [repeat_by_segment(sweep, movement) for sweep in flickered]
    bent += sensor_errors.instability_m_s2 * flickering.T.ravel()
    return session.reading(bent, _parameters(truth, chi) - session.parameters)


def solve_session(session: Session) -> tuple[ImuSolution, Budget, Array]:
    """Return the solution, its budget, and the errors of scale and bias (6,)."""
    movement = session.movement
    solution = solve_imu(
        movement.dwells,
        movement.sweeps,
        gravity_m_s2=GRAVITY,
        sensor_errors=movement.sensor_errors,
        arm_turns=movement.arm_turns,
        independent_fractions=INDEPENDENT_FRACTIONS,
    )
    dof = np.full(movement.readings().size, AVERAGED)
    budget = accelerometer_budget(solution, movement, SITE, 0.0, datasheet=sheet_of(session.part), noise_dof=dof)
    values = np.concatenate([1 / np.linalg.norm(solution.matrix, axis=1), solution.bias_m_s2])
    return solution, budget, values - session.parameters


def read_of(session: Session, solution: ImuSolution) -> ReferenceModel:
    """Return the inputs of the consistency checks."""
    turned = plan_sweeps(AXES)
    stood = [
        *map(Posture, JOINTS),
        *(Posture(joints_at(sweep, np.zeros(1))[0], sweep.joint - WRIST_1) for sweep in turned),
    ]
    stated = StatedArm(
        NOMINAL, float(np.degrees(RECTANGULAR_RATIO * session.arm_rad)), np.eye(3), solution.attitude_error.std_rad
    )
    patterns = arm_patterns(solution.theta, session.movement, stood, stated)
    return ReferenceModel(solution.theta, session.movement, patterns, session.times_s, second_order=False)


def find_detected(session: Session, solution: ImuSolution, rate: float) -> set[str]:
    """Return the names of the statistics beyond their limit."""
    statistics = check_reference(read_of(session, solution), rate)
    beyond = {name for name, (value, limit) in statistics.statistics.items() if value > limit}
    return beyond | ({"disturbed"} if statistics.disturbed else set())


Damage = Callable[[Session, float], Session]


def bent(change: Callable[[Array], Array], scale: float = 0.0) -> Damage:
    """Add `change` of the specific force to each axis; `scale`: the part that acts on the scale at ±1 g."""

    def damage(session: Session, size: float) -> Session:
        more = project_errors(
            session.truth.theta(), session.movement, lambda force: size * change(force / GRAVITY) * GRAVITY
        )
        then = np.zeros(6)
        then[:3] = 1 / (1 / session.parameters[:3] + size * scale) - session.parameters[:3]
        return session.reading(more @ np.ones(3), then)

    return damage


def step_bias(session: Session, size: float) -> Session:
    """Change the bias half-way; the true value is its mean."""
    more = per_axis((repeat_by_segment(session.late, session.movement) * session.movement.constant())[:, None] * ASKEW)
    return session.reading(size * more @ np.ones(3), np.concatenate([np.zeros(3), size * ASKEW / 2]))


def scale_half(axes: Array) -> Damage:
    """Change the scale factors half-way; the true value is their mean."""

    def damage(session: Session, size: float) -> Session:
        more = per_axis(_find_forces(session) * repeat_by_segment(session.late, session.movement)[:, None])
        return session.reading(size * more @ axes, np.concatenate([-size * axes / 2, np.zeros(3)]) * session.parameters)

    return damage


def swept(session: Session, size: float) -> Session:
    """Give sweeps alone another bias; the true bias is that at rest."""
    turning = session.movement.constant()
    turning[: len(JOINTS)] = 0.0
    return session.reading(size * per_axis(turning[:, None] * ASKEW) @ np.ones(3))


def disturb(session: Session, size: float) -> Session:
    """Change the readings of one dwell."""
    more = np.zeros((len(session.movement.readings()), 3))
    more[3] = size * ASKEW
    return session.reading(more.ravel())


def _find_forces(session: Session) -> Array:
    """Return the specific force (K, 3) of each axis."""
    return np.asarray(find_force(session.truth.theta(), session.movement) @ session.truth.matrix.T, dtype=np.float64)


def _parameters(truth: Truth, chi: Array) -> Array:
    """Return the parameters (6,) by the readings at 1 g up and down, and at 0 g."""
    return np.concatenate([1 / (np.linalg.norm(truth.matrix, axis=1) + chi * GRAVITY**2), truth.bias_m_s2])
