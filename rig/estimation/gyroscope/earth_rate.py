"""The Earth's rate from sweeps and rests of a stable gyroscope on an arm, as in section III-A of the paper TRIAX.

    m = F (ω + R ω_E) + c (+ G a) + B e

R maps the arm's base frame to the flange's, ω_E (3,) is the Earth's rate in the base frame; the other symbols are those
of `rig.estimation.gyroscope.common_errors`. Rests in many attitudes separate the bias from rates fixed in the room. So
does a sweep: in the mean of a revolution only the Earth's rate along its axis remains. In all, 15 parameters are
estimated: F, c and ω_E.

e contains the errors of the arm's angles, as in `vector_fit.explain`, and of its repeatability, which tilts the axis of
each sweep independently. A tilt of a hundred microradians at 1 rad/s causes an error of 20 °/h across the axis, and an
error in a revolution's end time changes the speed along the axis. So sweeps help mainly by determining the bias; the
Earth's rate is determined by the rests in many attitudes.

Gravity and the Earth's axis are both fixed in the room. A g-sensitivity G = λ F has the same effect as an Earth's rate
along the vertical, so one of them must be given: G, which is zero for an optical gyroscope, or the vertical component
of the Earth's rate, which follows from the latitude.

The readings decide whether the Earth's rate was detected: the estimate must be large relative to its uncertainty, which
includes the drift of the bias between rests, and it must agree with the Earth's rate.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.errors import Fault
from rig.estimation import refusals
from rig.estimation.arrays import Array, perpendicular_unit_vectors
from rig.estimation.earth import DEG_H, EARTH_RATE_RAD_S
from rig.estimation.gyroscope.common_errors import CommonErrorModel, CommonErrors
from rig.estimation.gyroscope.nonlinearity import curvature
from rig.estimation.gyroscope.vector_fit import VectorInputs
from rig.estimation.gyroscope.vector_model import MAX_CONDITION, VectorSolution, design_matrix, propagate_speed_std
from rig.estimation.statistics.bias_process import bias_process

PRIOR_STD_RAD_S = 100 * EARTH_RATE_RAD_S  # so wide that only the readings determine the rate
MIN_SIGNAL_RATIO = 10.0  # of the estimate to its largest standard deviation
MAX_DEVIATION = 4.0  # largest deviation from the Earth's rate, in standard deviations
MIN_LEVEL_SINE = 0.1  # of the angle between the vertical and the base's x axis
REMEDY = "Add rests in attitudes turned about two axes (procedure imu), or leave procedure.earth_rate at known"


@dataclass(frozen=True, slots=True)
class EarthRatePrior:
    """The given properties of arm and sensor.

    - `up` (3,): unit vector upwards in the base frame.
    - `latitude_rad`: the stated latitude, None if not stated.
    - `g_sensitivity`: whether to estimate the sensor's sensitivity to gravity; the latitude then fixes the Earth's rate
      along the vertical.
    - `repeatability_rad`: standard deviation of the orientation to which the arm returns, about each axis perpendicular
      to the rotation.
    - `state_jitter_s`: standard deviation of the end time of a revolution.
    """

    up: Array
    latitude_rad: float | None = None
    g_sensitivity: bool = False
    repeatability_rad: float = 0.0
    state_jitter_s: float = 0.0


@dataclass(frozen=True, slots=True)
class EarthRate:
    """The estimated Earth's rate: `rate_rad_s` (3,) in the frame of the arm's base, `covariance_rad2_s2` (3, 3).

    `up` (3,) points upwards in that frame; `vertical_fixed` is True if the latitude fixed the vertical component.
    `birge_ratio` is the RMS ratio of residuals to their expected standard deviation, with `dof` degrees of freedom;
    above 1 it multiplies the standard deviations.
    """

    rate_rad_s: Array
    covariance_rad2_s2: Array
    up: Array
    vertical_fixed: bool
    birge_ratio: float
    dof: float = np.inf

    @property
    def norm_rad_s(self) -> float:
        """The norm of the estimated Earth's rate."""
        return float(np.linalg.norm(self.rate_rad_s))

    @property
    def norm_std_rad_s(self) -> float:
        """The standard deviation of the norm."""
        return self._std(self.rate_rad_s / self.norm_rad_s)

    @property
    def latitude_rad(self) -> float:
        """The latitude: from the rate's angle to the vertical; if `vertical_fixed`, from the rate's horizontal part."""
        return float(np.arcsin(self.up @ self.rate_rad_s / self.norm_rad_s))

    @property
    def latitude_std_rad(self) -> float:
        """The standard deviation of the latitude if `up` is exact; a tilted base would look like another latitude."""
        latitude = self.latitude_rad
        slope = self.up - np.sin(latitude) * self.rate_rad_s / self.norm_rad_s
        return self._std(slope / (self.norm_rad_s * np.cos(latitude)))

    @property
    def heading_rad(self) -> float | None:
        """The heading of the base's x axis, clockwise from north; None if the axis is vertical."""
        level = self._level()
        if level is None:
            return None
        ahead, to_left = level
        return float(np.arctan2(self.rate_rad_s @ to_left, self.rate_rad_s @ ahead))

    @property
    def heading_std_rad(self) -> float | None:
        """The standard deviation of the heading of the base's x axis; None if this axis is vertical."""
        level = self._level()
        if level is None:
            return None
        ahead, to_left = level
        forward, sideways = float(self.rate_rad_s @ ahead), float(self.rate_rad_s @ to_left)
        return self._std((forward * to_left - sideways * ahead) / (forward**2 + sideways**2))

    def _level(self) -> tuple[Array, Array] | None:
        """Return two horizontal unit vectors: the projection of the base's x axis, and the one 90° to its left.

        Return None if the x axis is vertical.
        """
        ahead = np.array([1.0, 0.0, 0.0]) - self.up[0] * self.up
        size = float(np.linalg.norm(ahead))
        return None if size < MIN_LEVEL_SINE else (ahead / size, np.cross(self.up, ahead / size))

    def _std(self, slope: Array) -> float:
        return float(np.sqrt(slope @ self.covariance_rad2_s2 @ slope))


def find_earth_rate(inputs: VectorInputs, nominal_mounting: Array, prior: EarthRatePrior) -> EarthRate:
    """Return the Earth's rate in the base frame; `inputs.earth_rate_rad_s` is not used.

    Raise Fault `earth_rate_and_g_sensitivity`, `earth_rate_not_observable`, and the Faults of the vector model.
    """
    fixed = np.zeros(3)
    directions = np.eye(3)
    if prior.g_sensitivity and prior.latitude_rad is not None:
        fixed = EARTH_RATE_RAD_S * np.sin(prior.latitude_rad) * prior.up
        directions = perpendicular_unit_vectors(prior.up)
    gravity = inputs.gravity_m_s2 if prior.g_sensitivity else None
    _check_identifiable(inputs, directions, gravity)
    sensed_gravity = None if gravity is None else inputs.apparent_gravity_m_s2
    fit = _fit(replace(inputs, earth_rate_rad_s=fixed), nominal_mounting, directions, sensed_gravity, prior)
    free, covariance = _extract_earth_rate(fit, len(directions))
    dof = 3 * (fit.solution.observations - (4 if gravity is None else 7)) - len(directions)
    birge_ratio = _find_birge_ratio(fit, dof)
    earth = EarthRate(
        rate_rad_s=fixed + free @ directions,
        covariance_rad2_s2=directions.T @ covariance @ directions * max(1.0, birge_ratio) ** 2,
        up=prior.up,
        vertical_fixed=len(directions) < 3,
        birge_ratio=birge_ratio,
        dof=max(dof, 1),
    )
    expected = float(np.sqrt(EARTH_RATE_RAD_S**2 - fixed @ fixed))
    component = "its level part" if earth.vertical_fixed else "it"
    check_earth_rate(earth.rate_rad_s - fixed, earth.covariance_rad2_s2, expected, component)
    return earth


@dataclass(frozen=True, slots=True)
class _EarthRateFit:
    """The vector model with the Earth's rate; `expected_rad2_s2` (N, 3) are the expected variances of the residuals."""

    solution: VectorSolution
    errors: CommonErrors
    expected_rad2_s2: Array


def _fit(
    inputs: VectorInputs, mounting: Array, directions: Array, gravity: Array | None, prior: EarthRatePrior
) -> _EarthRateFit:
    """Return the fit of the vector model with common errors.

    The last d of these errors are the components of the Earth's rate along `directions` (d, 3).
    """
    speeds = np.linalg.norm(inputs.turns_rad_s, axis=1)
    durations = np.diff(inputs.windows_s).T[0]
    by_states = np.sqrt(2) * prior.state_jitter_s * inputs.state_gains / durations * speeds  # at both ends
    speed_std = np.hypot(inputs.speed_std_rad_s, by_states)
    arm_errors = [
        np.zeros((0, *inputs.means_rad_s.shape)) if inputs.axis_errors_rad_s is None else inputs.axis_errors_rad_s
    ]
    if prior.repeatability_rad > 0:
        arm_errors.append(prior.repeatability_rad * _tilt_sweeps(inputs.turns_rad_s))
    rate_errors = np.concatenate([*arm_errors, PRIOR_STD_RAD_S * np.moveaxis(inputs.attitudes @ directions.T, -1, 0)])
    several = len(inputs.speeds_rad_s) > 1

    def effects(matrix: Array) -> Array:
        curved = [curvature(matrix, inputs.rates_rad_s)] if several else []
        return np.concatenate([*curved, inputs.sensor_error_patterns(matrix), rate_errors @ matrix.T])

    model = CommonErrorModel(
        inputs.means_rad_s, inputs.rates_rad_s, inputs.variances_rad2_s2, effects, speed_std, gravity, mounting
    )
    effect_rad_s = model.predict().errors.readings_rad_s
    matrix = model.fit_matrix(effect_rad_s)
    variances = inputs.variances_rad2_s2 + propagate_speed_std(inputs.rates_rad_s, speed_std, matrix) ** 2
    means = inputs.means_rad_s - effect_rad_s
    bias = bias_process(model.design, means, variances, inputs.windows_s, instability_rad_s=inputs.instability_rad_s)
    shared = bias.covariance(inputs.windows_s)
    solution, errors = model.solve(shared)
    return _EarthRateFit(solution, errors, variances + np.diag(shared)[:, None])


def _extract_earth_rate(fit: _EarthRateFit, directions: int) -> tuple[Array, Array]:
    """Return the components (d,) of the Earth's rate along d `directions`, and their covariance (d, d)."""
    sizes, covariance = fit.errors.sizes[-directions:], fit.errors.covariance[-directions:, -directions:]
    return PRIOR_STD_RAD_S * sizes, PRIOR_STD_RAD_S**2 * covariance


def _find_birge_ratio(fit: _EarthRateFit, dof: int) -> float:
    """Return the Birge ratio of residuals; the arm's estimated errors reduce the degrees of freedom."""
    squares = float(np.sum(fit.solution.residuals_rad_s**2 / fit.expected_rad2_s2))
    return float(np.sqrt(squares / dof)) if dof > 0 else 1.0


def _tilt_sweeps(turns_rad_s: Array) -> Array:
    """Return the changes (2 M, N, 3) of the rates if each of M sweeps is tilted by 1 rad about two directions."""
    patterns: list[Array] = []
    for index in np.flatnonzero(turns_rad_s.any(axis=1)):
        rate = turns_rad_s[index]
        for axis in perpendicular_unit_vectors(rate / np.linalg.norm(rate)):
            patterns.append(np.zeros_like(turns_rad_s))
            patterns[-1][index] = np.cross(axis, rate)
    return np.array(patterns).reshape(-1, *turns_rad_s.shape)


def _check_identifiable(inputs: VectorInputs, directions: Array, gravity: Array | None) -> None:
    """Raise Fault unless an ideal sensor could determine the Earth's rate from these sweeps and rests.

    The faults are `earth_rate_and_g_sensitivity`, `rank_deficient` and `ill_conditioned`.
    """
    conditioning, parameters = _condition(inputs, directions, gravity)
    if conditioning.rank < parameters and gravity is not None and len(directions) == 3:
        without, fewer_parameters = _condition(inputs, directions, None)
        if without.rank == fewer_parameters:
            raise Fault(
                "earth_rate_and_g_sensitivity",
                "the vertical part of the Earth's rate looks the same as a sensitivity to gravity, and "
                "neither is known",
                "Give site.latitude_deg, or uncertainty.g_sensitivity_deg_s_g: 0 for a gyroscope without "
                "such a sensitivity",
            )
    refusals.check_conditioning(
        conditioning, parameters, MAX_CONDITION, "the Earth's rate in addition to axes and bias", REMEDY
    )


def _condition(inputs: VectorInputs, directions: Array, gravity: Array | None) -> tuple[refusals.Conditioning, int]:
    """Return the conditioning of the design, whose blocks of columns are scaled to unit RMS, and the number of columns.

    The columns are those of the sensor's coefficients, for matrix, offset and, with `gravity`, g-sensitivity, and one
    for each of the `directions` (d, 3) of the Earth's rate.
    """
    sweeps = inputs.turns_rad_s / (np.linalg.norm(inputs.turns_rad_s) / len(inputs.turns_rad_s) ** 0.5 or 1.0)
    scaled_gravity = None if gravity is None else gravity / (np.linalg.norm(gravity) / len(gravity) ** 0.5)
    sensor_columns = np.kron(design_matrix(sweeps, scaled_gravity), np.eye(3))
    earth_columns = (inputs.attitudes @ directions.T).reshape(len(sensor_columns), -1)
    design = np.asarray(np.column_stack([sensor_columns, earth_columns]), dtype=np.float64)
    parameters = design.shape[1]
    return refusals.condition_of(design, parameters), parameters


def check_earth_rate(
    free_rad_s: Array, covariance_rad2_s2: Array, expected_rad_s: float = EARTH_RATE_RAD_S, component: str = "it"
) -> None:
    """Check that the estimate `free_rad_s` (d,) of the Earth's rate is significant and has the expected size.

    Raise Fault `earth_rate_not_observable`, whose message calls the estimated part of the Earth's rate `component`.
    """
    free = float(np.linalg.norm(free_rad_s))
    worst = float(np.sqrt(np.linalg.eigvalsh(covariance_rad2_s2)[-1]))
    if free < MIN_SIGNAL_RATIO * worst:
        raise Fault(
            "earth_rate_not_observable",
            f"the gyroscope finds {component} to be {free / DEG_H:.3g} deg/h, u {worst / DEG_H:.2g} deg/h, "
            "which is more than a tenth of it",
            "Use a gyroscope with a steadier bias and less noise, or rest longer; give latitude and heading instead",
        )
    direction = free_rad_s / free
    std = float(np.sqrt(direction @ covariance_rad2_s2 @ direction))
    if abs(free - expected_rad_s) > MAX_DEVIATION * std:
        raise Fault(
            "earth_rate_not_observable",
            f"the gyroscope finds {component} to be {free / DEG_H:.4g} ± {std / DEG_H:.2g} deg/h, but "
            f"{expected_rad_s / DEG_H:.4g} is expected: something else turns with the attitude",
            "Look at the gyroscope's residuals, for warming and for a sensitivity to gravity; repeat the movement",
        )
