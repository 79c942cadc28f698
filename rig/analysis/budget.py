"""The uncertainty budget: what each thing that may be wrong does to scale and bias, and all of it together.

Every contributor is one or several patterns of error in the mean readings; the solution's response turns a pattern into
changes of scale and bias (JCGM 100, 5.1). Half-widths stand for equally likely values (4.3.7), so their standard
uncertainty is the half-width over √3.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.analysis.explained import Explained, Seen
from rig.analysis.surroundings import Surroundings
from rig.config.models import EARTH_RATE_RAD_S
from rig.estimation.arrays import Array

COVERAGE_FACTOR = 2.0
GRAVITY_M_S2 = 9.80665  # of the unit g


@dataclass(frozen=True, slots=True)
class Contributor:
    """One line of the budget.

    `kind` is the type of evaluation (JCGM 100, 4.2 and 4.3), `half_width` in `unit` what it was assumed to be, None
    where it was found from the recording; `freedom` the degrees of freedom, infinite where it is known.
    `covariance` (6, 6): kx ky kz bx by bz.
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
    """All contributors; independent of each other."""

    contributors: tuple[Contributor, ...]

    @property
    def covariance(self) -> Array:
        """(6, 6) combined."""
        combined: Array = np.sum([each.covariance for each in self.contributors], axis=0)
        return combined

    @property
    def std(self) -> Array:
        """(6,) combined standard uncertainties."""
        std: Array = np.sqrt(np.diag(self.covariance))
        return std

    @property
    def expanded(self) -> Array:
        """(6,) expanded uncertainties U, k = 2."""
        expanded: Array = COVERAGE_FACTOR * self.std
        return expanded

    @property
    def freedom(self) -> Array:
        """(6,) effective degrees of freedom (Welch–Satterthwaite, JCGM 100, G.4); infinite where all is known."""
        parts = np.array([each.std**4 / each.freedom for each in self.contributors]).sum(axis=0)
        with np.errstate(divide="ignore"):
            freedom: Array = self.std**4 / parts
        return freedom

    @property
    def shares(self) -> Array:
        """(contributors, 6): of the variance."""
        shares: Array = np.array([each.std**2 for each in self.contributors]) / self.std**2
        return shares


def budget(explained: Explained, sensor: str, surroundings: Surroundings) -> Budget:
    """The budget of one sensor's vector solution."""
    return Budget(tuple(_contributors(explained, sensor, surroundings)))


def _contributors(explained: Explained, sensor: str, surroundings: Surroundings) -> Iterator[Contributor]:
    solution, seen = explained.solution, explained.seen
    known, clock = surroundings.uncertainty, surroundings.clock
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

    walk = _of_walk(explained)
    noise = solution.covariance - walk
    yield Contributor("noise", "A", "normal", None, "", "scatter of the readings", np.inf, noise)
    if not explained.bias.steady:
        found = "scatter of rests and sweeps about each other"
        yield Contributor("bias instability", "A", "normal", None, "", found, float(explained.bias.freedom), walk)
    turned = seen.turns_rad_s @ matrix.T
    clocks = " and ".join(each.by for each in clock.comparisons) or "no other clock"
    clock_spread = of(clock.std * turned[None])
    yield Contributor("controller clock", "A", "normal", None, "", f"held against {clocks}", np.inf, clock_spread)
    jitter = np.sqrt(2) * surroundings.state_jitter_s / np.diff(seen.windows_s).T[0]
    each_turn = np.eye(len(turned))[:, :, None] * (jitter[:, None] * turned)[None]
    yield Contributor(
        "times of the arm's states", "A", "normal", None, "", "scatter of the joint angles", np.inf, of(each_turn)
    )
    yield assumed(
        "arm's axes", known.axis_deg, "°", "uncertainty.axis_deg", _tilted(seen, np.radians(known.axis_deg)) @ matrix.T
    )
    if surroundings.site.earth_rate_rad_s is None:
        patterns = EARTH_RATE_RAD_S * np.swapaxes(seen.attitudes, 0, 2).swapaxes(1, 2)  # (base axis, N, flange axis)
        yield assumed("Earth's rate", EARTH_RATE_RAD_S, "rad/s", "site.latitude_deg is not given", patterns @ matrix.T)
    per_g = np.radians(known.g_sensitivity_deg_s_g[sensor]) / GRAVITY_M_S2
    unknown = [np.outer(row, column) for row in per_g * np.eye(3) for column in np.eye(3)]
    sensitivity = solution.g_sensitivity
    if sensitivity is None:
        yield assumed(
            "g-sensitivity",
            known.g_sensitivity_deg_s_g[sensor],
            "°/s/g",
            "what is known of the part; rests at more attitudes would tell it",
            np.array([seen.gravity_m_s2 @ each.T for each in unknown]),
        )
    offsets = known.sensor_offset_mm / 1000 * np.eye(3)
    outwards = np.array([seen.centripetal_m_s2(offset) for offset in offsets])
    felt = unknown if sensitivity is None else [sensitivity]
    yield assumed(
        "centripetal acceleration",
        known.sensor_offset_mm,
        "mm",
        "uncertainty.sensor_offset_mm",
        np.concatenate([outwards @ each.T for each in felt]),
    )


def _of_walk(explained: Explained) -> Array:
    """(6, 6) that the wandering bias adds to the solution's covariance."""
    if explained.bias.steady:
        return np.zeros((6, 6))
    response = explained.solution.response
    shared = explained.bias.covariance(explained.seen.windows_s)
    walk: Array = np.einsum("pni,nm,qmi->pq", response, shared, response)
    return walk


def _tilted(seen: Seen, angle_rad: float) -> Array:
    """(2 per axis, N, 3) errors of the turns' rates when one wrist's axis is tilted, for either way of tilting it."""
    patterns: list[Array] = []
    for joint in sorted(set(seen.joints) - {None}, key=str):
        swept = np.array([each == joint for each in seen.joints])
        axis = seen.turns_rad_s[swept][0] / np.linalg.norm(seen.turns_rad_s[swept][0])
        first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        first /= np.linalg.norm(first)
        tilts = angle_rad * np.array([np.cross(way, seen.turns_rad_s) for way in (first, np.cross(axis, first))])
        patterns.extend(np.where(swept[:, None], tilts, 0.0))
    return np.array(patterns)
