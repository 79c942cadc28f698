"""The uncertainty budget: what each thing that may be wrong does to scale and bias, and all of it together.

Every contributor is one or several patterns of error in the mean readings; the solution's response turns a pattern into
changes of scale and bias (JCGM 100, 5.1). Half-widths stand for equally likely values (4.3.7), so their standard
uncertainty is the half-width over √3.
"""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rig.estimation.arrays import Array, perpendicular_unit_vectors
from rig.estimation.earth import EARTH_RATE_RAD_S, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.mount_squares import of_mount_squares
from rig.estimation.gyroscope.vector_fit import Explained, Seen
from rig.estimation.statistics.bias_process import BiasProcess
from rig.estimation.statistics.coverage import coverage_factors, effective_freedom

NOISE = "noise"
WANDERING, FLICKER = "bias instability", "flicker of the bias"
STATES = "times of the arm's states"
CLOCK = "controller clock"
ENCODERS = "turner's encoders"
AXES, REPEATABILITY, MOUNTS = "arm's axes", "arm's repeatability", "mounting anew"  # what directions may be off by
STAMPS = "times of the samples"
NOT_GIVEN = "is not given"  # ends the source of what is assumed because the configuration does not say it


@dataclass(frozen=True, slots=True)
class Contributor:
    """One line of the budget.

    `kind` is the type of evaluation (JCGM 100, 4.2 and 4.3), `half_width` in `unit` what it was assumed to be: of a
    normal distribution the expanded uncertainty (k = 2) that was stated; None where it was found from the recording.
    `freedom` are the degrees of freedom, infinite where it is known. `covariance` (6, 6): kx ky kz bx by bz.
    """

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    half_width: float | None
    unit: str
    source: str
    freedom: float
    covariance: Array

    @property
    def std(self) -> Array:
        """(6,) standard uncertainties of scale and bias."""
        std: Array = np.sqrt(np.diag(self.covariance).clip(min=0.0))
        return std


@dataclass(frozen=True, slots=True)
class Budget:
    """All contributors; independent of each other. U has the coverage factor of its degrees of freedom."""

    contributors: tuple[Contributor, ...]

    @property
    def covariance(self) -> Array:
        """(6, 6) covariance of scale and bias, all contributors together."""
        combined: Array = np.sum([contributor.covariance for contributor in self.contributors], axis=0)
        return combined

    @property
    def std(self) -> Array:
        """(6,) combined standard uncertainties."""
        std: Array = np.sqrt(np.diag(self.covariance))
        return std

    def line(self, name: str) -> Contributor:
        """One contributor. Raises KeyError where there is none of that name."""
        return {contributor.name: contributor for contributor in self.contributors}[name]

    def of(self, name: str) -> Array:
        """(6,) standard uncertainties by one contributor. Raises KeyError as `line` does."""
        return self.line(name).std

    def without(self, names: Collection[str]) -> "Budget":
        """The budget without contributors of these names."""
        return replace(
            self, contributors=tuple(contributor for contributor in self.contributors if contributor.name not in names)
        )

    @property
    def coverage_factors(self) -> Array:
        """(6,) coverage factors k."""
        return coverage_factors(self.freedom)

    @property
    def expanded(self) -> Array:
        """(6,) expanded uncertainties U = k u."""
        expanded: Array = self.coverage_factors * self.std
        return expanded

    @property
    def freedom(self) -> Array:
        """(6,) effective degrees of freedom (Welch–Satterthwaite, JCGM 100, G.4); infinite where all is known."""
        variances = np.array([contributor.std**2 for contributor in self.contributors])
        return effective_freedom(variances, np.array([[contributor.freedom] for contributor in self.contributors]))

    @property
    def shares(self) -> Array:
        """(contributors, 6) shares of the variance."""
        shares: Array = np.array([contributor.std**2 for contributor in self.contributors]) / self.std**2
        return shares


@dataclass(frozen=True, slots=True)
class Unknown:
    """What no recording shows: half-widths, but for what is named `std` and `state_jitter_s`.

    These are standard uncertainties. `clock_std` is a fraction, `clock_source` says how it is known, `clock_half_width`
    is there where it is that of any such clock; `axis_rad` is the direction of each swept axis, `repeatability_rad` an
    angle that is come back to, `angle_std_rad` that of a joint about what its encoder tells, at the ends of arcs,
    `mount_rad` (half of a width) how far an item sits off a stage's mount about each axis,
    `earth_rate` whether the Earth's rate is among the unknown, `earth_covariance_rad2_s2` (3, 3), in the base's frame,
    how well it was found where it was; `stamp_std_s` is that of the times of the sensor's samples. `…_freedom` are the
    degrees of freedom of what was found from readings.
    """

    clock_std: float
    clock_source: str
    state_jitter_s: float
    axis_rad: float
    sensor_offset_m: float
    g_sensitivity_rad_s_per_g: float
    earth_rate: bool
    earth_covariance_rad2_s2: Array | None = None
    clock_freedom: float = np.inf
    clock_half_width: float | None = None
    state_jitter_freedom: float = np.inf
    earth_freedom: float = np.inf
    repeatability_rad: float = 0.0
    angle_std_rad: float = 0.0
    mount_rad: float = 0.0
    stamp_std_s: float = 0.0


def budget(explained: Explained, unknown: Unknown) -> Budget:
    """The budget of one sensor's vector solution."""
    return Budget(tuple(_contributors(explained, unknown)))


def _contributors(explained: Explained, unknown: Unknown) -> Iterator[Contributor]:
    solution, seen = explained.solution, explained.seen
    matrix = solution.matrix

    def of(patterns: Array) -> Array:
        """Covariance of independent patterns (k, N, 3) of readings, rad/s, each of one standard uncertainty."""
        effects = np.einsum("qni,kni->kq", solution.response, patterns)
        covariance: Array = effects.T @ effects
        return covariance

    def assumed(name: str, half_width: float, unit: str, source: str, patterns: Array) -> Contributor:
        """Type B: `patterns` are for the half-width."""
        spread = of(patterns / np.sqrt(3))
        return Contributor(name, "B", "rectangular", half_width, unit, source, np.inf, spread)

    yield from _of_the_readings(explained)
    turned = seen.turns_rad_s @ matrix.T
    wide, said = unknown.clock_half_width, unknown.clock_source
    if wide is None:
        timed = found(CLOCK, said, of(unknown.clock_std * turned[None]), unknown.clock_freedom)
        yield timed if np.isfinite(timed.freedom) else replace(timed, kind="B")  # of what is stated of clocks alone
    else:
        yield assumed(CLOCK, 1e6 * wide, "ppm", said, wide * turned[None])
    yield from _of_times(seen, unknown, turned, of)
    tilted = _tilted(seen, unknown.axis_rad) if seen.axis_errors_rad_s is None else np.sqrt(3) * seen.axis_errors_rad_s
    yield assumed(AXES, float(np.degrees(unknown.axis_rad)), "°", "uncertainty.axis_deg", tilted @ matrix.T)
    if seen.return_errors_rad_s is not None:
        again, half_width = (
            np.sqrt(3) * seen.return_errors_rad_s @ matrix.T,
            float(np.degrees(unknown.repeatability_rad)),
        )
        yield assumed(REPEATABILITY, half_width, "°", "uncertainty.repeatability_deg", again)
    yield from _of_marks_and_mounts(explained, unknown, of)
    if unknown.earth_covariance_rad2_s2 is not None:
        size, way = np.linalg.eigh(unknown.earth_covariance_rad2_s2)
        spread = seen.attitudes @ (way * np.sqrt(size.clip(min=0.0)))  # of each way the rate found may be off
        source, patterns = "found from sweeps and rests", np.moveaxis(spread, -1, 0) @ matrix.T
        yield found("Earth's rate", source, of(patterns), unknown.earth_freedom)
    elif unknown.earth_rate:
        along = EARTH_RATE_RAD_S * np.moveaxis(seen.attitudes, -1, 0) @ matrix.T  # for each axis of the base
        yield assumed("Earth's rate", EARTH_RATE_RAD_S, "rad/s", f"site.latitude_deg {NOT_GIVEN}", along)
    for own_error in seen.own_errors(matrix):
        yield assumed(own_error.name, own_error.half_width, own_error.unit, own_error.source, own_error.patterns)
    per_m_s2 = unknown.g_sensitivity_rad_s_per_g / STANDARD_GRAVITY_M_S2
    any_sensitivity = [per_m_s2 * np.outer(row, column) for row in np.eye(3) for column in np.eye(3)]
    sensitivity = solution.g_sensitivity
    if sensitivity is None:
        yield assumed(
            "g-sensitivity",
            float(np.degrees(unknown.g_sensitivity_rad_s_per_g)),
            "°/s/g",
            "what is known of the part; rests at more attitudes would tell it",
            np.array([seen.pull_m_s2 @ each.T for each in any_sensitivity]),
        )
    outwards = np.array([seen.centripetal_m_s2(offset) for offset in unknown.sensor_offset_m * np.eye(3)])
    felt = any_sensitivity if sensitivity is None else [sensitivity]
    yield assumed(
        "centripetal acceleration",
        1000 * unknown.sensor_offset_m,
        "mm",
        "uncertainty.sensor_offset_mm",
        np.concatenate([outwards @ each.T for each in felt]),
    )


def _of_marks_and_mounts(explained: Explained, unknown: Unknown, of: Callable[[Array], Array]) -> Iterator[Contributor]:
    """Where arcs begin and end, and how an item sits that was mounted anew; `of` as in `_contributors`."""
    seen, matrix = explained.seen, explained.solution.matrix
    if seen.encoder_errors_rad_s is not None:
        spread = of(seen.encoder_errors_rad_s @ matrix.T)
        stated = 2 * float(np.degrees(unknown.angle_std_rad))
        yield Contributor(ENCODERS, "B", "normal", stated, "°", "uncertainty.angle_std_deg", np.inf, spread)
    if seen.mount_errors_rad_s is not None:
        spread = of(seen.mount_errors_rad_s @ matrix.T) + of_mount_squares(explained)
        half_width = float(np.degrees(unknown.mount_rad))
        yield Contributor(MOUNTS, "B", "rectangular", half_width, "°", "uncertainty.mount_deg", np.inf, spread)


def _of_times(seen: Seen, unknown: Unknown, turned: Array, of: Callable[[Array], Array]) -> Iterator[Contributor]:
    """What the times do at which the arm's states were, and the sensor's samples."""
    each_end = np.sqrt(2) / np.diff(seen.windows_s).T[0]
    each_turn = np.eye(len(turned))[:, :, None]
    jitter = each_turn * (unknown.state_jitter_s * each_end[:, None] * turned)[None]
    source = "scatter of the joint angles"
    yield found(STATES, source, of(jitter), unknown.state_jitter_freedom)
    if unknown.stamp_std_s:
        # A mean over a window that lies elsewhere holds other rates at its ends: those of the ripple.
        moved = each_turn * ((unknown.stamp_std_s * each_end * seen.ripples)[:, None] * turned)[None]
        source, half_width = "how the lines of the sensor are timed", 1e3 * np.sqrt(3) * unknown.stamp_std_s
        yield Contributor(STAMPS, "B", "rectangular", float(half_width), "ms", source, np.inf, of(moved))


def _noise_freedom(explained: Explained) -> float:
    """The noise's fewest degrees of freedom, of scale and bias, by the readings' variances (JCGM 100, G.4.1)."""
    variances = explained.solution.response**2 * explained.seen.variances_rad2_s2
    freedom = np.broadcast_to(explained.seen.noise_freedom, variances.shape)
    parts, counted = (each.reshape(len(variances), -1).T for each in (variances, freedom))
    return float(effective_freedom(parts, counted).min())


def found(name: str, source: str, covariance: Array, freedom: float = np.inf) -> Contributor:
    """A contributor that was found from the readings: type A."""
    return Contributor(name, "A", "normal", None, "", source, freedom, covariance)


def _of_the_readings(explained: Explained) -> Iterator[Contributor]:
    """What the readings contribute: their noise, and a bias that does not stand still."""
    bias, (flicker, wandering) = explained.bias, _of_bias(explained)
    noise = explained.solution.covariance - flicker - wandering
    yield found(NOISE, "scatter of the readings", noise, _noise_freedom(explained))
    if bias.found:
        source = "scatter of rests and sweeps about each other"
        yield found(WANDERING, source, wandering, float(bias.freedom))
    if bias.instability_rad_s:
        source = f"least Allan deviation: {np.degrees(bias.instability_rad_s) * 3600:.3g} °/h"
        yield Contributor(FLICKER, "B", "normal", None, "", source, np.inf, flicker)


def _of_bias(explained: Explained) -> tuple[Array, Array]:
    """(6, 6) what flicker of the bias adds to the solution's covariance, and what was found of its wandering beside."""
    bias, response, windows_s = explained.bias, explained.solution.response, explained.seen.windows_s

    def of(part: BiasProcess) -> Array:
        covariance: Array = np.einsum("pni,nm,qmi->pq", response, part.covariance(windows_s), response)
        return covariance

    return of(replace(bias, walk_rad_s_sqrt_s=0.0, scatter_rad_s=0.0)), of(replace(bias, instability_rad_s=0.0))


def _tilted(seen: Seen, angle_rad: float) -> Array:
    """(2 per axis, N, 3) errors of the turns' rates when one wrist's axis is tilted, for either way of tilting it."""
    patterns: list[Array] = []
    for joint in sorted(set(seen.joints) - {None}, key=str):
        swept = np.array([each == joint for each in seen.joints])
        axis = seen.turns_rad_s[swept][0] / np.linalg.norm(seen.turns_rad_s[swept][0])
        tilts = angle_rad * np.array([np.cross(way, seen.turns_rad_s) for way in perpendicular_unit_vectors(axis)])
        patterns.extend(np.where(swept[:, None], tilts, 0.0))
    return np.array(patterns)
