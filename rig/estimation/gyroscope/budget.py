"""The uncertainty budget of scale and bias: its contributors and their combination.

A contributor is one or several patterns of error in the mean readings. The solution's response, its derivative with
respect to these readings, maps a pattern to changes of scale and bias (JCGM 100, 5.1). Half-widths are those of uniform
distributions (4.3.7): the standard uncertainty is the half-width over √3.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rig.estimation.arrays import Array, perpendicular_unit_vectors
from rig.estimation.earth import EARTH_RATE_RAD_S, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.mount_squares import propagate_mount_squares
from rig.estimation.gyroscope.vector_fit import VectorFit, VectorInputs
from rig.estimation.statistics.bias_process import BiasProcess
from rig.estimation.statistics.coverage import coverage_factors, effective_dof

NOISE = "noise"
BIAS_DRIFT, FLICKER = "bias instability", "flicker of the bias"
STATE_TIMES = "times of the arm's states"
CLOCK = "controller clock"
ENCODERS = "turner's encoders"
AXES, REPEATABILITY, REMOUNTING = "arm's axes", "arm's repeatability", "remounting"  # errors of directions
SAMPLE_TIMES = "times of the samples"
NOT_GIVEN_SUFFIX = "is not given"  # ends the source of a value that the configuration does not state


@dataclass(frozen=True, slots=True)
class Contributor:
    """One contributor of the budget.

    - `kind`: the type of evaluation (JCGM 100, 4.2 and 4.3).
    - `half_width`: the assumed half-width, or the U (k = 2) of a normal distribution, in `unit`; None if estimated.
    - `dof`: degrees of freedom, infinite for an exact uncertainty.
    - `covariance` (6, 6): of kx ky kz bx by bz.
    """

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    half_width: float | None
    unit: str
    source: str
    dof: float
    covariance: Array

    @property
    def std(self) -> Array:
        """The standard uncertainties (6,) of scale and bias."""
        std: Array = np.sqrt(np.diag(self.covariance).clip(min=0.0))
        return std


@dataclass(frozen=True, slots=True)
class Budget:
    """All contributors, independent of each other; U has the coverage factor of the effective degrees of freedom."""

    contributors: tuple[Contributor, ...]

    @property
    def covariance(self) -> Array:
        """The combined covariance (6, 6) of scale and bias."""
        combined: Array = np.sum([contributor.covariance for contributor in self.contributors], axis=0)
        return combined

    @property
    def std(self) -> Array:
        """The combined standard uncertainties (6,)."""
        std: Array = np.sqrt(np.diag(self.covariance))
        return std

    def line(self, name: str) -> Contributor:
        """Return the contributor called `name`. Raise KeyError if there is none."""
        return {contributor.name: contributor for contributor in self.contributors}[name]

    def std_of(self, name: str) -> Array:
        """Return the standard uncertainties (6,) due to the contributor `name`. Raise KeyError if there is none."""
        return self.line(name).std

    def omit(self, names: Collection[str]) -> "Budget":
        """Return the budget without the named contributors."""
        return replace(
            self, contributors=tuple(contributor for contributor in self.contributors if contributor.name not in names)
        )

    @property
    def coverage_factors(self) -> Array:
        """The coverage factors k (6,)."""
        return coverage_factors(self.dof)

    @property
    def expanded(self) -> Array:
        """The expanded uncertainties U = k u (6,)."""
        expanded: Array = self.coverage_factors * self.std
        return expanded

    @property
    def dof(self) -> Array:
        """The effective degrees of freedom (6,) by Welch–Satterthwaite (JCGM 100, G.4); infinite if all are exact."""
        variances = np.array([contributor.std**2 for contributor in self.contributors])
        return effective_dof(variances, np.array([[contributor.dof] for contributor in self.contributors]))

    @property
    def variance_fractions(self) -> Array:
        """Each contributor's fraction of the variance, (contributors, 6)."""
        variance_fractions: Array = np.array([contributor.std**2 for contributor in self.contributors]) / self.std**2
        return variance_fractions


@dataclass(frozen=True, slots=True)
class UnknownErrors:
    """The standard uncertainties, or half-widths, of error sources that no recording determines.

    - clock_std: relative uncertainty of the clock.
    - clock_source: explanation of clock_std.
    - state_jitter_s, stamp_std_s: errors of the times of the arm's states, and of the sensor's samples.
    - axis_rad: half-width of the direction of each swept axis.
    - sensor_offset_m: half-width of the sensor's position.
    - g_sensitivity_rad_s_per_g: half-width of the change of a reading by 1 g.
    - earth_rate: whether the Earth's rate is unknown.
    - earth_covariance_rad2_s2 (3, 3): covariance of the Earth's rate in the base frame, None if it was not estimated.
    - clock_dof, state_jitter_dof, earth_dof: degrees of freedom of these uncertainties, infinite if not estimated.
    - clock_half_width: half-width of the error of a clock with stated limits, else None.
    - repeatability_rad: half-width of the error of a joint that returns to an angle.
    - angle_std_rad: standard deviation of the error of a joint's encoder at the ends of arcs.
    - mount_rad: half-width of a mounted item's tilt about each axis.
    """

    clock_std: float
    clock_source: str
    state_jitter_s: float
    axis_rad: float
    sensor_offset_m: float
    g_sensitivity_rad_s_per_g: float
    earth_rate: bool
    earth_covariance_rad2_s2: Array | None = None
    clock_dof: float = np.inf
    clock_half_width: float | None = None
    state_jitter_dof: float = np.inf
    earth_dof: float = np.inf
    repeatability_rad: float = 0.0
    angle_std_rad: float = 0.0
    mount_rad: float = 0.0
    stamp_std_s: float = 0.0


Propagate = Callable[[Array], Array]  # patterns (k, N, 3) of readings to a covariance (6, 6)


def budget(explained: VectorFit, unknown: UnknownErrors) -> Budget:
    """Return the budget of one sensor's vector solution."""
    return Budget(tuple(_contributors(explained, unknown)))


def _contributors(explained: VectorFit, unknown: UnknownErrors) -> Iterator[Contributor]:
    """Yield the contributors; errors of the readings are propagated by the solution's derivatives (`response`)."""
    solution, inputs = explained.solution, explained.inputs
    matrix = solution.matrix

    def propagate(patterns: Array) -> Array:
        """Return the covariance (6, 6) of scale and bias due to independent errors `patterns` (k, N, 3) of readings."""
        effects = np.einsum("qni,kni->kq", solution.response, patterns)
        covariance: Array = effects.T @ effects
        return covariance

    def evaluate_b(name: str, half_width: float, unit: str, source: str, patterns: Array) -> Contributor:
        """Return a type B contributor, whose half-width changes the readings by `patterns` (k, N, 3), rad/s."""
        spread = propagate(patterns / np.sqrt(3))
        return Contributor(name, "B", "rectangular", half_width, unit, source, np.inf, spread)

    yield from _evaluate_readings(explained)
    turned = inputs.turns_rad_s @ matrix.T
    clock_half_width, clock_source = unknown.clock_half_width, unknown.clock_source
    if clock_half_width is None:
        timed = evaluate_a(CLOCK, clock_source, propagate(unknown.clock_std * turned[None]), unknown.clock_dof)
        # Type B if only the statement about clocks determines it.
        yield timed if np.isfinite(timed.dof) else replace(timed, kind="B")
    else:
        yield evaluate_b(CLOCK, 1e6 * clock_half_width, "ppm", clock_source, clock_half_width * turned[None])
    yield from _evaluate_times(inputs, unknown, turned, propagate)
    errors = inputs.axis_errors_rad_s
    tilted = _tilt_axes(inputs, unknown.axis_rad) if errors is None else np.sqrt(3) * errors
    yield evaluate_b(AXES, float(np.degrees(unknown.axis_rad)), "°", "uncertainty.axis_deg", tilted @ matrix.T)
    if inputs.return_errors_rad_s is not None:
        half_width = float(np.degrees(unknown.repeatability_rad))
        returned = np.sqrt(3) * inputs.return_errors_rad_s @ matrix.T
        yield evaluate_b(REPEATABILITY, half_width, "°", "uncertainty.repeatability_deg", returned)
    yield from _evaluate_mounts(explained, unknown, propagate)
    if unknown.earth_covariance_rad2_s2 is not None:
        variances, directions = np.linalg.eigh(unknown.earth_covariance_rad2_s2)
        error_axes = inputs.attitudes @ (directions * np.sqrt(variances.clip(min=0.0)))  # principal axes of the errors
        source, patterns = "found from sweeps and rests", np.moveaxis(error_axes, -1, 0) @ matrix.T
        yield evaluate_a("Earth's rate", source, propagate(patterns), unknown.earth_dof)
    elif unknown.earth_rate:
        # One pattern for each axis of the base.
        base_axes = EARTH_RATE_RAD_S * np.moveaxis(inputs.attitudes, -1, 0) @ matrix.T
        yield evaluate_b("Earth's rate", EARTH_RATE_RAD_S, "rad/s", f"site.latitude_deg {NOT_GIVEN_SUFFIX}", base_axes)
    for error in inputs.list_own_errors(matrix):
        yield evaluate_b(error.name, error.half_width, error.unit, error.source, error.patterns)
    per_m_s2 = unknown.g_sensitivity_rad_s_per_g / STANDARD_GRAVITY_M_S2
    unit_sensitivities = [per_m_s2 * np.outer(row, column) for row in np.eye(3) for column in np.eye(3)]
    sensitivity = solution.g_sensitivity
    if sensitivity is None:
        yield evaluate_b(
            "g-sensitivity",
            float(np.degrees(unknown.g_sensitivity_rad_s_per_g)),
            "°/s/g",
            "stated properties of the part; rests in more attitudes determine it",
            np.array([inputs.apparent_gravity_m_s2 @ unit.T for unit in unit_sensitivities]),
        )
    outwards = np.array([inputs.centripetal_m_s2(offset) for offset in unknown.sensor_offset_m * np.eye(3)])
    sensitivities = unit_sensitivities if sensitivity is None else [sensitivity]
    yield evaluate_b(
        "centripetal acceleration",
        1000 * unknown.sensor_offset_m,
        "mm",
        "uncertainty.sensor_offset_mm",
        np.concatenate([outwards @ one.T for one in sensitivities]),
    )


def _evaluate_mounts(explained: VectorFit, unknown: UnknownErrors, propagate: Propagate) -> Iterator[Contributor]:
    """Yield the contributors of encoders at the ends of arcs, and of remounting.

    `propagate` maps errors of the readings to the covariance of scale and bias.
    """
    inputs, matrix = explained.inputs, explained.solution.matrix
    if inputs.encoder_errors_rad_s is not None:
        spread = propagate(inputs.encoder_errors_rad_s @ matrix.T)
        stated = 2 * float(np.degrees(unknown.angle_std_rad))  # a normal distribution is listed with its U (k = 2)
        yield Contributor(ENCODERS, "B", "normal", stated, "°", "uncertainty.angle_std_deg", np.inf, spread)
    if inputs.mount_errors_rad_s is not None:
        spread = propagate(inputs.mount_errors_rad_s @ matrix.T) + propagate_mount_squares(explained)
        half_width = float(np.degrees(unknown.mount_rad))
        yield Contributor(REMOUNTING, "B", "rectangular", half_width, "°", "uncertainty.mount_deg", np.inf, spread)


def _evaluate_times(
    inputs: VectorInputs, unknown: UnknownErrors, turned: Array, propagate: Propagate
) -> Iterator[Contributor]:
    """Yield the contributors of the times of the arm's states and of the samples.

    `turned` (N, 3) are the flange's rates as the sensor reads them; `propagate` maps errors of the readings to the
    covariance of scale and bias.
    """
    per_s = np.sqrt(2) / np.diff(inputs.windows_s).T[0]
    per_sweep = np.eye(len(turned))[:, :, None]
    jitter = per_sweep * ((unknown.state_jitter_s * per_s * inputs.state_gains)[:, None] * turned)[None]
    source = "scatter of the joint angles"
    yield evaluate_a(STATE_TIMES, source, propagate(jitter), unknown.state_jitter_dof)
    if unknown.stamp_std_s:
        # A window that is shifted in time has other rates at its ends, because of the ripple.
        moved = per_sweep * ((unknown.stamp_std_s * per_s * inputs.ripples)[:, None] * turned)[None]
        source, half_width = "how the lines of the sensor are timed", 1e3 * np.sqrt(3) * unknown.stamp_std_s
        yield Contributor(SAMPLE_TIMES, "B", "rectangular", float(half_width), "ms", source, np.inf, propagate(moved))


def _find_noise_dof(explained: VectorFit) -> float:
    """Return the smallest of the six degrees of freedom of scale and bias for noise alone (JCGM 100, G.4.1)."""
    variances = explained.solution.response**2 * explained.inputs.variances_rad2_s2
    dof = np.broadcast_to(explained.inputs.noise_dof, variances.shape)
    parts, dofs = (array.reshape(len(variances), -1).T for array in (variances, dof))
    return float(effective_dof(parts, dofs).min())


def evaluate_a(name: str, source: str, covariance: Array, dof: float = np.inf) -> Contributor:
    """Return a contributor of type A, that is, estimated from the readings."""
    return Contributor(name, "A", "normal", None, "", source, dof, covariance)


def _evaluate_readings(explained: VectorFit) -> Iterator[Contributor]:
    """Yield the contributors of the readings: their noise, and the drift of the bias."""
    bias, response = explained.bias, explained.solution.response
    flicker, drift = split_bias_covariance(bias, response, explained.inputs.windows_s)
    noise = explained.solution.covariance - flicker - drift
    yield evaluate_a(NOISE, "scatter of the readings", noise, _find_noise_dof(explained))
    if bias.is_drifting:
        source = "scatter of rests and sweeps about each other"
        yield evaluate_a(BIAS_DRIFT, source, drift, float(bias.dof))
    if bias.instability_rad_s:
        source = f"least Allan deviation: {np.degrees(bias.instability_rad_s) * 3600:.3g} °/h"
        yield Contributor(FLICKER, "B", "normal", None, "", source, np.inf, flicker)


def split_bias_covariance(bias: BiasProcess, response: Array, windows_s: Array) -> tuple[Array, Array]:
    """Return the covariances (6, 6) of scale and bias due to the bias' flicker, and to the rest of its drift.

    `response` (6, N, 3) is the derivative of scale and bias with respect to the readings' means over windows (N, 2).
    """

    def propagate(part: BiasProcess) -> Array:
        covariance: Array = np.einsum("pni,nm,qmi->pq", response, part.covariance(windows_s), response)
        return covariance

    flicker = replace(bias, walk_rad_s_sqrt_s=0.0, scatter_rad_s=0.0)
    return propagate(flicker), propagate(replace(bias, instability_rad_s=0.0))


def _tilt_axes(inputs: VectorInputs, angle_rad: float) -> Array:
    """Return the errors (2 J, N, 3) of the rates if each of J joints' axes is tilted by `angle_rad`.

    Each axis has two errors: tilts about two directions perpendicular to the axis.
    """
    patterns: list[Array] = []
    for joint in sorted(set(inputs.joints) - {None}, key=str):
        swept = np.array([name == joint for name in inputs.joints])
        axis = inputs.turns_rad_s[swept][0] / np.linalg.norm(inputs.turns_rad_s[swept][0])
        across = perpendicular_unit_vectors(axis)
        tilts = angle_rad * np.array([np.cross(direction, inputs.turns_rad_s) for direction in across])
        patterns.extend(np.where(swept[:, None], tilts, 0.0))
    return np.array(patterns)
