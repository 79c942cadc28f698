"""The vector model with all that a recording tells beside the sweeps: gravity, the Earth's rate, a bias that wanders.

Gravity stands still in the room and turns in the flange's frame, so attitudes tell what of a reading is sensitivity
to it; at rest the sensor reads bias, Earth and gravity alone. In a sweep the flange circles about the swept axis, which
a sensor feels as it feels gravity, and the arm knows both. Sweeps about more than three axes tell the angles between
the sensor's axes from those between the arm's, sweeps at several speeds how nonlinear the sensor is. None of this is
assumed: what sweeps and rests do not tell apart stays out of the model and belongs into the uncertainty.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.common_errors import CommonErrors, solve_with_common_errors
from rig.estimation.gyroscope.nonlinearity import Nonlinearity, curvature, distinct_speeds, nonlinearity
from rig.estimation.gyroscope.own_errors import KnownSensor, OwnError, own_errors, rounding_errors
from rig.estimation.gyroscope.vector_model import VectorSolution, check_told, design_matrix, of_the_speed
from rig.estimation.statistics.bias_process import BiasProcess, bias_process

UNTOLD = ("rank_deficient", "ill_conditioned", "too_few_observations")  # what more columns than sweeps bear ends in
TELLS = 0.25  # of the largest load: what is smaller has less than a sixteenth of its weight in the scale factor


@dataclass(frozen=True, slots=True)
class Seen:
    """What the vector model is made of: sweeps first, then rests, N in all.

    `means_rad_s`, `variances_rad2_s2` (N, 3) of the noise alone; `turns_rad_s` (N, 3) rates of the flange in the room,
    `earth_rate_rad_s` (3,) that of the room, in the base's frame, as far as it is known; `speed_std_rad_s` (N,);
    `attitudes` (N, 3, 3) from the base into the flange; `gravity_m_s2` (N, 3) downwards, in the flange's frame;
    `windows_s` (N, 2) on the clock of the first recording; `joints` (N) which of the arm's joints turned, None for a
    rest; `axis_errors_rad_s` (P, N, 3) how far the turns would be off for one standard uncertainty of each of the arm's
    own angles, as far as it is known; `return_errors_rad_s` (P, N, 3) the same of joints that come back to an angle,
    for each time they do; `encoder_errors_rad_s` (P, N, 3) the same of what encoders err
    at the ends of arcs, None where all sweeps are whole turns; `mount_turns_rad` (3 S, N, 3) by which rotation vectors
    an item that was mounted anew for S stages would sit off for one standard uncertainty of each of their mounts, None
    where it stayed: of the stages but the first, which the first sweep is of, then of the first; `arms_m`
    (N, 3) a way from the axis that turns to where the sensor is taken to sit, in the flange's frame, None where its own
    motion is left out. `noise_freedom` (N, 3): with how many degrees of freedom the variances are known. `sensor` is
    what is known of the sensor beforehand, None where nothing is. `ripples` (N,) are how unevenly each turned,
    RMS as a share of its rate. `roundings_rad_s` (N, 3) is the standard uncertainty that rounding leaves in each mean.
    """

    means_rad_s: Array
    variances_rad2_s2: Array
    turns_rad_s: Array
    earth_rate_rad_s: Array
    speed_std_rad_s: Array
    attitudes: Array
    gravity_m_s2: Array
    windows_s: Array
    joints: tuple[str | None, ...]
    axis_errors_rad_s: Array | None = None
    return_errors_rad_s: Array | None = None
    mount_turns_rad: Array | None = None
    arms_m: Array | None = None
    noise_freedom: Array | float = np.inf
    sensor: KnownSensor | None = None
    encoder_errors_rad_s: Array | None = None
    ripples: Array | float = 0.0
    roundings_rad_s: Array | float = 0.0

    @property
    def speeds_rad_s(self) -> tuple[float, ...]:
        """The speeds of the sweeps, the slowest first; sweeps of one speed differ by the arm's timing only."""
        speeds = np.linalg.norm(self.turns_rad_s, axis=1)
        return distinct_speeds(speeds[speeds > 0])

    @property
    def rates_rad_s(self) -> Array:
        """(N, 3) rates of the flange against the stars."""
        rates: Array = self.turns_rad_s + self.attitudes @ self.earth_rate_rad_s
        return rates

    @property
    def acceleration_m_s2(self) -> Array:
        """(N, 3) acceleration of where the sensor is taken to sit, in the flange's frame."""
        return np.zeros(self.turns_rad_s.shape) if self.arms_m is None else self.centripetal_m_s2(self.arms_m)

    @property
    def pull_m_s2(self) -> Array:
        """(N, 3) what is felt as gravity, in the flange's frame: gravity less the acceleration."""
        pull: Array = self.gravity_m_s2 - self.acceleration_m_s2
        return pull

    @property
    def instability_rad_s(self) -> float:
        """The sensor's bias instability, zero where nothing is known of it."""
        return 0.0 if self.sensor is None else self.sensor.instability_rad_s

    @property
    def mount_errors_rad_s(self) -> Array | None:
        """(3 S, N, 3) how far the turns would be off for one standard uncertainty of each of the mounts.

        The frame of the item is that of the first stage: by what that is off all others differ from it.
        """
        if self.mount_turns_rad is None:
            return None
        against_first = self.mount_turns_rad.copy()
        against_first[-3:] -= against_first[-3:, :1]
        return np.cross(against_first, self.turns_rad_s)

    @property
    def arm_errors_rad_s(self) -> Array:
        """(P, N, 3) what all kinds of errors of the arm's angles add, and those of mounts last."""
        none = np.zeros((0, *self.means_rad_s.shape))
        kinds = (self.axis_errors_rad_s, self.return_errors_rad_s, self.encoder_errors_rad_s, self.mount_errors_rad_s)
        return np.concatenate([none, *(kind for kind in kinds if kind is not None)])

    def own_errors(self, matrix: Array) -> tuple[OwnError, ...]:
        """What a sensor of that F (3, 3) may do beside the model."""
        if self.sensor is None:
            return ()
        rounded = rounding_errors(self.means_rad_s, self.roundings_rad_s, self.variances_rad2_s2)
        own = own_errors(self.sensor, matrix, self.turns_rad_s, self.windows_s, self.speeds_rad_s)
        return (*own, *rounded)

    def own_patterns(self, matrix: Array) -> Array:
        """(P, N, 3) what one standard deviation of each of the sensor's own errors adds."""
        none = np.zeros((0, *self.means_rad_s.shape))
        return np.concatenate([none, *(own_error.patterns / np.sqrt(3) for own_error in self.own_errors(matrix))])

    def centripetal_m_s2(self, way_m: Array) -> Array:
        """(N, 3) acceleration at `way_m` (3,) or (N, 3) from the axis that turns, in the flange's frame."""
        return centripetal_m_s2(self.turns_rad_s, way_m)


@dataclass(frozen=True, slots=True)
class Explained:
    """The vector model's solution, how the bias wandered, and what both were found from.

    `nonlinearity` is None where all sweeps were made at one speed, for which the solution holds then. `mounts` (3 S,)
    are the errors of the mounts as in `Seen`, in standard deviations of what was known of them before, and
    `mounts_covariance` (3 S, 3 S) what is known of them now; S is 0 where the item stayed mounted as it was.
    """

    solution: VectorSolution
    bias: BiasProcess
    seen: Seen
    nonlinearity: Nonlinearity | None
    mounts: Array = field(default_factory=partial(np.zeros, 0))
    mounts_covariance: Array = field(default_factory=partial(np.zeros, (0, 0)))

    @property
    def loads_rad_s(self) -> Array:
        """(3, 2) smallest and largest rate along its x, y, z, either way, in the sweeps that tell its scale factors."""
        along = np.abs(self.seen.turns_rad_s @ (self.solution.matrix * self.solution.scale[:, None]).T)
        largest = along.max(axis=0)
        smallest = np.where(along >= TELLS * largest, along, np.inf).min(axis=0)
        loads: Array = np.column_stack([smallest, largest])
        return loads


def centripetal_m_s2(turns_rad_s: Array, way_m: Array) -> Array:
    """(…, 3) ω × (ω × p) of points that are `way_m` (…, 3) away from the axis of `turns_rad_s` (…, 3)."""
    inwards: Array = np.cross(turns_rad_s, np.cross(turns_rad_s, way_m))
    return inwards


def explain(seen: Seen, nominal_mounting: Array, process: BiasProcess | None = None) -> Explained:
    """Scale, bias and mounting, with gravity's share where the attitudes tell it.

    How the bias wanders is found from the means, but for a `process` that is known. Raises Fault as the vector model
    does.
    """
    try:
        found = _explain(seen, nominal_mounting, seen.pull_m_s2, process)
        # By the attitudes alone: circles that are a fiftieth of gravity would tell it, worse than it is known anyway.
        check_told(seen.rates_rad_s, seen.gravity_m_s2)
        return found
    except Fault as fault:
        if fault.name not in UNTOLD:
            raise
    return _explain(seen, nominal_mounting, None, process)


def solver(
    seen: Seen,
    nominal_mounting: Array,
    gravity_m_s2: Array | None,
    speed_std_rad_s: Array,
    effects: Callable[[Array], Array],
) -> Callable[[Array | None], tuple[VectorSolution, CommonErrors]]:
    """The vector model of what was seen, as a function of the covariance (N, N) its means share, if any.

    `effects` are those of `solve_with_common_errors`, `gravity_m_s2` is what is felt as gravity, None where no
    sensitivity to it is to be found.
    """

    def solve(shared: Array | None) -> tuple[VectorSolution, CommonErrors]:
        return solve_with_common_errors(
            seen.means_rad_s,
            seen.rates_rad_s,
            seen.variances_rad2_s2,
            effects,
            speed_std_rad_s=speed_std_rad_s,
            gravity_m_s2=gravity_m_s2,
            nominal_mounting=nominal_mounting,
            shared_covariance_rad2_s2=shared,
        )

    return solve


def _explain(seen: Seen, nominal_mounting: Array, gravity_m_s2: Array | None, process: BiasProcess | None) -> Explained:
    several = len(seen.speeds_rad_s) > 1
    arm_errors = seen.arm_errors_rad_s

    def of_arm_and_speeds(matrix: Array) -> Array:
        """(P, N, 3) effects on the readings, of one standard deviation each."""
        curved = [curvature(matrix, seen.rates_rad_s)] if several else []
        return np.concatenate([arm_errors @ matrix.T, *curved])

    def effects(matrix: Array) -> Array:
        return np.concatenate([of_arm_and_speeds(matrix), seen.own_patterns(matrix)])

    solve = solver(seen, nominal_mounting, gravity_m_s2, seen.speed_std_rad_s, effects)
    steady, errors = solve(None)
    known, own = of_arm_and_speeds(steady.matrix), seen.own_patterns(steady.matrix)
    of_the_speeds = of_the_speed(seen.rates_rad_s, seen.speed_std_rad_s, steady.matrix) ** 2
    bias = process or bias_process(
        design_matrix(seen.rates_rad_s, gravity_m_s2),
        seen.means_rad_s - np.einsum("p,pni->ni", errors.sizes[: len(known)], known),
        seen.variances_rad2_s2 + of_the_speeds,
        seen.windows_s,
        np.einsum("pni,pmi->inm", own, own) if len(own) else None,  # each is of one axis alone
        instability_rad_s=seen.instability_rad_s,
    )
    solution, errors = (steady, errors) if bias.steady else solve(bias.covariance(seen.windows_s))
    curved = slice(len(arm_errors), len(known))
    found = nonlinearity(errors.sizes[curved], errors.covariance[curved, curved]) if several else None
    count = 0 if seen.mount_turns_rad is None else len(seen.mount_turns_rad)
    mounts = slice(len(arm_errors) - count, len(arm_errors))
    return Explained(solution, bias, seen, found, errors.sizes[mounts], errors.covariance[mounts, mounts])
