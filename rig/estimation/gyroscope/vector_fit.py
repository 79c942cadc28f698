"""The vector model with gravity, the Earth's rate, a drifting bias and errors of arm and sensor.

Gravity is fixed in the room and rotates in the flange's frame, so attitudes separate g-sensitivity from bias; at rest
the sensor reads only bias, Earth's rate and the effect of gravity. In a sweep the flange circles about the swept axis
with a centripetal acceleration that the arm's geometry determines. Sweeps about more than three axes separate the
angles between the sensor's axes from those between the arm's. Sweeps at several speeds determine the nonlinearity.
Effects that sweeps and rests do not separate are left out of the model and belong to the uncertainty.
"""

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.common_errors import CommonErrorModel
from rig.estimation.gyroscope.nonlinearity import Nonlinearity, curvature, distinct_speeds, nonlinearity
from rig.estimation.gyroscope.own_errors import OwnError, SensorProperties, list_own_errors, rounding_errors
from rig.estimation.gyroscope.vector_model import VectorSolution, check_identifiable, propagate_speed_std
from rig.estimation.statistics.bias_process import BiasProcess, bias_process

DESIGN_FAULTS = ("rank_deficient", "ill_conditioned", "too_few_observations")  # of too many columns
MIN_RATE_RATIO = 0.25  # to the largest rate: a smaller one has less than a sixteenth of its weight in the scale factor


@dataclass(frozen=True, slots=True)
class VectorInputs:
    """The inputs of the vector model: sweeps first, then rests, N in all.

    - means_rad_s, variances_rad2_s2 (N, 3): mean readings, and the variances of their noise.
    - turns_rad_s (N, 3): rates of the flange relative to the room.
    - earth_rate_rad_s (3,): rate of the room, in the base frame.
    - speed_std_rad_s (N,): standard deviations of the speeds.
    - attitudes (N, 3, 3): rotations from the base into the flange frame.
    - gravity_m_s2 (N, 3): downwards, in the flange frame.
    - windows_s (N, 2): start and end on the clock of the first recording.
    - joints (N): the joint that turned, None for a rest.
    - axis_errors_rad_s (P, N, 3): effect of one standard uncertainty of each of the arm's angles on the rates.
    - return_errors_rad_s (P, N, 3): effect of one standard uncertainty of each return of a joint to an angle.
    - mount_turns_rad (3 S, N, 3): rotation vectors of the item if its mounting in one of S stages is wrong by one std
      about x, y or z; the first stage comes last; None without remounting.
    - arms_m (N, 3): lever arms from the rotation axis to the sensor in the flange frame, None to neglect them.
    - noise_dof (N, 3): degrees of freedom of the variances.
    - sensor: the sensor's properties from the data sheet, None if unknown.
    - encoder_errors_rad_s (P, N, 3): effect of one standard uncertainty of each encoder error at the ends of arcs on
      the rates; None for whole revolutions.
    - ripples (N,): RMS ripple of each rotation as a fraction of its rate.
    - state_gains (N,): ratio of the noise that the arm's states cause in the mean rate to the noise that they cause in
      Δθ/T, a joint's travel over the duration.
    - roundings_rad_s (N, 3): standard uncertainty of each mean due to rounding.
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
    noise_dof: Array | float = np.inf
    sensor: SensorProperties | None = None
    encoder_errors_rad_s: Array | None = None
    ripples: Array | float = 0.0
    state_gains: Array | float = 1.0
    roundings_rad_s: Array | float = 0.0

    @property
    def speeds_rad_s(self) -> tuple[float, ...]:
        """The distinct speeds of the sweeps, slowest first; differences due to the arm's timing alone are ignored."""
        speeds = np.linalg.norm(self.turns_rad_s, axis=1)
        return distinct_speeds(speeds[speeds > 0])

    @property
    def rates_rad_s(self) -> Array:
        """The inertial rates (N, 3) of the flange."""
        rates: Array = self.turns_rad_s + self.attitudes @ self.earth_rate_rad_s
        return rates

    @property
    def acceleration_m_s2(self) -> Array:
        """The acceleration (N, 3) at the sensor's position, in the flange's frame."""
        return np.zeros(self.turns_rad_s.shape) if self.arms_m is None else self.centripetal_m_s2(self.arms_m)

    @property
    def apparent_gravity_m_s2(self) -> Array:
        """The apparent gravity (N, 3) in the flange's frame: gravity minus the acceleration."""
        apparent: Array = self.gravity_m_s2 - self.acceleration_m_s2
        return apparent

    @property
    def instability_rad_s(self) -> float:
        """The sensor's bias instability, zero if unknown."""
        return 0.0 if self.sensor is None else self.sensor.instability_rad_s

    @property
    def mount_errors_rad_s(self) -> Array | None:
        """The effects (3 S, N, 3) of one standard uncertainty of each mount on the rates.

        The first stage defines the item's frame, so an error of its mount (the last three) appears with the opposite
        sign in all other stages.
        """
        if self.mount_turns_rad is None:
            return None
        in_item_frame = self.mount_turns_rad.copy()
        in_item_frame[-3:] -= in_item_frame[-3:, :1]  # then zero in the first stage, to which the first reading belongs
        return np.cross(in_item_frame, self.turns_rad_s)

    @property
    def arm_errors_rad_s(self) -> Array:
        """The effects (P, N, 3) of P errors on the rates: first those of the arm's angles, then those of the mounts."""
        none = np.zeros((0, *self.means_rad_s.shape))
        kinds = (self.axis_errors_rad_s, self.return_errors_rad_s, self.encoder_errors_rad_s, self.mount_errors_rad_s)
        return np.concatenate([none, *(kind for kind in kinds if kind is not None)])

    def list_own_errors(self, matrix: Array) -> tuple[OwnError, ...]:
        """Return the sensor's errors that the model does not contain, for a sensor with this `matrix` (3, 3)."""
        if self.sensor is None:
            return ()
        rounded = rounding_errors(self.means_rad_s, self.roundings_rad_s, self.variances_rad2_s2)
        stated = list_own_errors(self.sensor, matrix, self.turns_rad_s, self.windows_s, self.speeds_rad_s)
        return (*stated, *rounded)

    def sensor_error_patterns(self, matrix: Array) -> Array:
        """Return the effects (P, N, 3) of one standard deviation of each of the sensor's own errors."""
        none = np.zeros((0, *self.means_rad_s.shape))
        return np.concatenate([none, *(own_error.patterns / np.sqrt(3) for own_error in self.list_own_errors(matrix))])

    def centripetal_m_s2(self, lever_arm_m: Array) -> Array:
        """Return the acceleration (N, 3) in the flange's frame, at a lever arm (3,) or (N, 3) from the axis."""
        return centripetal_m_s2(self.turns_rad_s, lever_arm_m)


@dataclass(frozen=True, slots=True)
class VectorFit:
    """The solution of the vector model, the bias drift, and the inputs of both.

    `nonlinearity` is None if all sweeps had one speed. `mounts` (3 S,) are the errors of the mounts as in
    `VectorInputs`, in prior standard deviations, with the posterior covariance `mounts_covariance` (3 S, 3 S); S is 0
    without remounting.
    """

    solution: VectorSolution
    bias: BiasProcess
    inputs: VectorInputs
    nonlinearity: Nonlinearity | None
    mounts: Array = field(default_factory=partial(np.zeros, 0))
    mounts_covariance: Array = field(default_factory=partial(np.zeros, (0, 0)))

    @property
    def axis_rate_ranges_rad_s(self) -> Array:
        """The smallest and largest rates (3, 2) along x, y, z, without sign, of the sweeps that determine the scale."""
        sensed = np.abs(self.inputs.turns_rad_s @ (self.solution.matrix * self.solution.scale[:, None]).T)
        largest = sensed.max(axis=0)
        smallest = np.where(sensed >= MIN_RATE_RATIO * largest, sensed, np.inf).min(axis=0)
        loads: Array = np.column_stack([smallest, largest])
        return loads


def centripetal_m_s2(turns_rad_s: Array, lever_arm_m: Array) -> Array:
    """Return ω × (ω × p) = ω (ω · p) − p ω² (…, 3) of lever arms p (…, 3) from the axis of the rates ω (…, 3)."""
    projections, squares = (np.sum(turns_rad_s * other, axis=-1, keepdims=True) for other in (lever_arm_m, turns_rad_s))
    inwards: Array = turns_rad_s * projections - lever_arm_m * squares
    return inwards


def explain(inputs: VectorInputs, nominal_mounting: Array, process: BiasProcess | None = None) -> VectorFit:
    """Return the fit of scale, bias and mounting, and of the g-sensitivity if the attitudes determine it.

    The bias drift is estimated from the means unless a `process` is given. Raise Fault as the vector model does.
    """
    try:
        fit = _explain(inputs, nominal_mounting, inputs.apparent_gravity_m_s2, process)
        # Only the attitudes determine it: centripetal accelerations, a fiftieth of gravity, are worse than the data
        # sheet.
        check_identifiable(inputs.rates_rad_s, inputs.gravity_m_s2)
        return fit
    except Fault as fault:
        if fault.name not in DESIGN_FAULTS:
            raise
    return _explain(inputs, nominal_mounting, None, process)


def _explain(
    inputs: VectorInputs, mounting: Array, gravity_m_s2: Array | None, process: BiasProcess | None
) -> VectorFit:
    """Return the fit with the bias drift `process`; if None, it is estimated from the residuals of a steady bias."""
    several = len(inputs.speeds_rad_s) > 1
    arm_errors = inputs.arm_errors_rad_s

    def arm_and_speed_patterns(matrix: Array) -> Array:
        """Return effects (P, N, 3) on readings: of one std of each arm error, and of the curvature if speeds differ."""
        curved = [curvature(matrix, inputs.rates_rad_s)] if several else []
        return np.concatenate([arm_errors @ matrix.T, *curved])

    def effects(matrix: Array) -> Array:
        return np.concatenate([arm_and_speed_patterns(matrix), inputs.sensor_error_patterns(matrix)])

    model = CommonErrorModel(
        inputs.means_rad_s,
        inputs.rates_rad_s,
        inputs.variances_rad2_s2,
        effects,
        inputs.speed_std_rad_s,
        gravity_m_s2,
        mounting,
    )
    # First a fit with a steady bias: the means less its errors of arm and nonlinearity show how the bias drifts.
    errors = model.predict().errors
    matrix = model.fit_matrix(errors.readings_rad_s)
    patterns, of_sensor = arm_and_speed_patterns(matrix), inputs.sensor_error_patterns(matrix)
    speed_squares = propagate_speed_std(inputs.rates_rad_s, inputs.speed_std_rad_s, matrix) ** 2
    bias = process or bias_process(
        model.design,
        inputs.means_rad_s - np.einsum("p,pni->ni", errors.sizes[: len(patterns)], patterns),
        inputs.variances_rad2_s2 + speed_squares,
        inputs.windows_s,
        # each error acts on one axis alone
        np.einsum("pni,pmi->inm", of_sensor, of_sensor) if len(of_sensor) else None,
        instability_rad_s=inputs.instability_rad_s,
    )
    solution, errors = model.solve(None if bias.steady else bias.covariance(inputs.windows_s))
    curved = slice(len(arm_errors), len(patterns))
    curve = nonlinearity(errors.sizes[curved], errors.covariance[curved, curved]) if several else None
    count = 0 if inputs.mount_turns_rad is None else len(inputs.mount_turns_rad)
    mounts = slice(len(arm_errors) - count, len(arm_errors))
    return VectorFit(solution, bias, inputs, curve, errors.sizes[mounts], errors.covariance[mounts, mounts])
