"""The Earth's rate, found from sweeps and rests of a gyroscope that is good enough: TRIAX, section III-A, on an arm.

    m = F (ω + R ω_E) + c (+ G a) + B e

R takes the arm's base frame into the flange's, ω_E (3,) is the Earth's rate in the base frame; F, c, G, e as in
`rig.estimation.gyroscope.vector_fit`. Rests in many attitudes tell the bias from what turns with the flange. So does a
sweep: of the Earth's rate only what lies along its axis is left in the mean of a turn. So 15 parameters are found: F, c
and ω_E.

What an arm does wrong is among the e: its angles, as in `explained`, and how differently it stands each time, by which
each sweep's axis leans for itself. A hundred microradians of that at 1 rad/s are 20 °/h across the axis, just where a
sweep reads its bias alone, so the Earth's rate rests on the attitudes. The end of a turn that is timed wrongly is a
wrong speed, along the axis.

Gravity and the Earth's axis both stand still in the room. A sensitivity G = λ F to gravity reads as an Earth's rate
along the vertical does, so one of both must be known: G, which is zero for light in a fibre, or the vertical part of
the Earth's rate, by the latitude.

Whether the Earth was seen is for the readings to say: what was found must be large against its uncertainty, in which is
what the bias did from one rest to the next, and it must be as large as the Earth's rate is.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.errors import Fault
from rig.estimation import refusals
from rig.estimation.arrays import Array, perpendicular_unit_vectors
from rig.estimation.earth import DEG_H, EARTH_RATE_RAD_S
from rig.estimation.gyroscope.common_errors import CommonErrors
from rig.estimation.gyroscope.nonlinearity import curvature
from rig.estimation.gyroscope.vector_fit import Seen, solver
from rig.estimation.gyroscope.vector_model import MAX_CONDITION, VectorSolution, design_matrix, of_the_speed
from rig.estimation.statistics.bias_process import bias_process

FREE_RAD_S = 100 * EARTH_RATE_RAD_S  # so large before that what the readings say is all that counts
SEEN = 10.0  # standard deviations, in the direction in which it is known least
AGREES = 4.0  # standard deviations from the Earth's rate
MIN_LEVEL = 0.1  # sine of the angle between the vertical and what a heading is given of
REMEDY = "Add rests in attitudes turned about two axes (procedure imu), or leave procedure.earth_rate at known"


@dataclass(frozen=True, slots=True)
class Known:
    """What is known before, of arm and sensor.

    `up` (3,): unit vector upwards in the base frame; `latitude_rad` where it is given; `g_sensitivity` whether the
    sensor may be sensitive to gravity, which is to be found along then, with the vertical part of the Earth's rate
    held to what it is at that latitude; `repeatability_rad` (one standard deviation, about each axis across the turn)
    how differently the arm stands each time; `state_jitter_s` how well the end of a turn is timed.
    """

    up: Array
    latitude_rad: float | None = None
    g_sensitivity: bool = False
    repeatability_rad: float = 0.0
    state_jitter_s: float = 0.0


@dataclass(frozen=True, slots=True)
class EarthRate:
    """The Earth's rate as found: `rate_rad_s` (3,) in the frame of the arm's base, `covariance_rad2_s2` (3, 3).

    `up` (3,) is upwards there; `vertical` says whether the vertical part was found or held to a known latitude.
    `scatter` is the ratio of residuals to what was expected of them, of so many degrees of `freedom`; above 1 it has
    widened the covariance.
    """

    rate_rad_s: Array
    covariance_rad2_s2: Array
    up: Array
    vertical_held: bool
    scatter: float
    freedom: float = np.inf

    @property
    def norm_rad_s(self) -> float:
        """Size of the Earth's rate that was found."""
        return float(np.linalg.norm(self.rate_rad_s))

    @property
    def norm_std_rad_s(self) -> float:
        """Standard deviation of the Earth rate's size."""
        return self._std(self.rate_rad_s / self.norm_rad_s)

    @property
    def latitude_rad(self) -> float:
        """Latitude by the rate's angle to the vertical; with the vertical part held, by the size of the level part."""
        return float(np.arcsin(self.up @ self.rate_rad_s / self.norm_rad_s))

    @property
    def latitude_std_rad(self) -> float:
        """Standard deviation of the latitude, without how well `up` is known: a base that leans counts as latitude."""
        latitude = self.latitude_rad
        slope = self.up - np.sin(latitude) * self.rate_rad_s / self.norm_rad_s
        return self._std(slope / (self.norm_rad_s * np.cos(latitude)))

    @property
    def heading_rad(self) -> float | None:
        """Where the base's x axis points, from north over east; None where it points up or down."""
        perpendicular_unit_vectors = self._level()
        if perpendicular_unit_vectors is None:
            return None
        ahead, left = perpendicular_unit_vectors
        return float(np.arctan2(self.rate_rad_s @ left, self.rate_rad_s @ ahead))

    @property
    def heading_std_rad(self) -> float | None:
        """Standard deviation of the heading; None where the base's x axis points up or down."""
        perpendicular_unit_vectors = self._level()
        if perpendicular_unit_vectors is None:
            return None
        ahead, left = perpendicular_unit_vectors
        along, aside = float(self.rate_rad_s @ ahead), float(self.rate_rad_s @ left)
        return self._std((along * left - aside * ahead) / (along**2 + aside**2))

    def _level(self) -> tuple[Array, Array] | None:
        """Unit vectors in the level plane: below the base's x axis, and to its left."""
        ahead = np.array([1.0, 0.0, 0.0]) - self.up[0] * self.up
        size = float(np.linalg.norm(ahead))
        return None if size < MIN_LEVEL else (ahead / size, np.cross(self.up, ahead / size))

    def _std(self, slope: Array) -> float:
        return float(np.sqrt(slope @ self.covariance_rad2_s2 @ slope))


def find_earth_rate(seen: Seen, nominal_mounting: Array, known: Known) -> EarthRate:
    """The Earth's rate in the base frame. What `seen` says is known of it is not made use of.

    Raises Fault `earth_rate_and_g_sensitivity`, `earth_rate_not_observable`, and as the vector model does.
    """
    held = np.zeros(3)
    directions = np.eye(3)
    if known.g_sensitivity and known.latitude_rad is not None:
        held = EARTH_RATE_RAD_S * np.sin(known.latitude_rad) * known.up
        directions = perpendicular_unit_vectors(known.up)
    gravity = seen.gravity_m_s2 if known.g_sensitivity else None
    _check_told(seen, directions, gravity)
    pull = None if gravity is None else seen.pull_m_s2
    fit = _fit(replace(seen, earth_rate_rad_s=held), nominal_mounting, directions, pull, known)
    free, covariance = _of_the_earth(fit, len(directions))
    freedom = 3 * (fit.solution.observations - (4 if gravity is None else 7)) - len(directions)
    scatter = _scatter(fit, freedom)
    found = EarthRate(
        rate_rad_s=held + free @ directions,
        covariance_rad2_s2=directions.T @ covariance @ directions * max(1.0, scatter) ** 2,
        up=known.up,
        vertical_held=len(directions) < 3,
        scatter=scatter,
        freedom=max(freedom, 1),
    )
    expected = float(np.sqrt(EARTH_RATE_RAD_S**2 - held @ held))
    what = "its level part" if found.vertical_held else "it"
    check_earth_seen(found.rate_rad_s - held, found.covariance_rad2_s2, expected, what)
    return found


@dataclass(frozen=True, slots=True)
class _Fit:
    """`expected_rad2_s2` (N, 3) is the variance each reading was expected to have."""

    solution: VectorSolution
    errors: CommonErrors
    expected_rad2_s2: Array


def _fit(seen: Seen, nominal_mounting: Array, directions: Array, gravity: Array | None, known: Known) -> _Fit:
    """F, c, G, the arm's errors and, last of these, the Earth's rate along `directions` (d, 3) of the base."""
    speeds = np.linalg.norm(seen.turns_rad_s, axis=1)
    durations = np.diff(seen.windows_s).T[0]
    timed = np.hypot(seen.speed_std_rad_s, np.sqrt(2) * known.state_jitter_s / durations * speeds)
    of_the_arm = [np.zeros((0, *seen.means_rad_s.shape)) if seen.axis_errors_rad_s is None else seen.axis_errors_rad_s]
    if known.repeatability_rad > 0:
        of_the_arm.append(known.repeatability_rad * _leaning(seen.turns_rad_s))
    turned = np.concatenate([*of_the_arm, FREE_RAD_S * np.moveaxis(seen.attitudes @ directions.T, -1, 0)])
    several = len(seen.speeds_rad_s) > 1

    def effects(matrix: Array) -> Array:
        bent = [curvature(matrix, seen.rates_rad_s)] if several else []
        return np.concatenate([*bent, seen.own_patterns(matrix), turned @ matrix.T])

    solve = solver(seen, nominal_mounting, gravity, timed, effects)
    solution, errors = solve(None)
    own = seen.variances_rad2_s2 + of_the_speed(seen.rates_rad_s, timed, solution.matrix) ** 2
    design = design_matrix(seen.rates_rad_s, gravity)
    means = seen.means_rad_s - errors.readings_rad_s
    bias = bias_process(design, means, own, seen.windows_s, instability_rad_s=seen.instability_rad_s)
    shared = bias.covariance(seen.windows_s)
    solution, errors = solve(shared)
    return _Fit(solution, errors, own + np.diag(shared)[:, None])


def _of_the_earth(fit: _Fit, directions: int) -> tuple[Array, Array]:
    """What was found of it along the directions (d,), and the covariance (d, d)."""
    sizes, covariance = fit.errors.sizes[-directions:], fit.errors.covariance[-directions:, -directions:]
    return FREE_RAD_S * sizes, FREE_RAD_S**2 * covariance


def _scatter(fit: _Fit, freedom: int) -> float:
    """Residuals over their expected standard deviations, as an RMS; what the arm's errors take up is not counted."""
    squares = float(np.sum(fit.solution.residuals_rad_s**2 / fit.expected_rad2_s2))
    return float(np.sqrt(squares / freedom)) if freedom > 0 else 1.0


def _leaning(turns_rad_s: Array) -> Array:
    """(2 M, N, 3) what each of M sweeps' axes, leaning by one radian either way, adds to the rates (N, 3) alone."""
    patterns: list[Array] = []
    for place in np.flatnonzero(turns_rad_s.any(axis=1)):
        turn = turns_rad_s[place]
        for way in perpendicular_unit_vectors(turn / np.linalg.norm(turn)):
            patterns.append(np.zeros_like(turns_rad_s))
            patterns[-1][place] = np.cross(way, turn)
    return np.array(patterns).reshape(-1, *turns_rad_s.shape)


def _check_told(seen: Seen, directions: Array, gravity: Array | None) -> None:
    """Whether sweeps and rests tell the Earth's rate beside all else, by a sensor as it should be."""
    told, needed = _told(seen, directions, gravity)
    if told.rank < needed and gravity is not None and len(directions) == 3:
        without, fewer = _told(seen, directions, None)
        if without.rank == fewer:
            raise Fault(
                "earth_rate_and_g_sensitivity",
                "the vertical part of the Earth's rate looks the same as a sensitivity to gravity, and "
                "neither is known",
                "Give site.latitude_deg, or uncertainty.g_sensitivity_deg_s_g: 0 for a gyroscope without "
                "such a sensitivity",
            )
    refusals.check_conditioning(told, needed, MAX_CONDITION, "the Earth's rate beside axes and bias", REMEDY)


def _told(seen: Seen, directions: Array, gravity: Array | None) -> tuple[refusals.Conditioning, int]:
    """Conditioning of the design (3 N, 3 p + d), all blocks of columns of one size, and how many it should tell."""
    sweeps = seen.turns_rad_s / (np.linalg.norm(seen.turns_rad_s) / len(seen.turns_rad_s) ** 0.5 or 1.0)
    pull = None if gravity is None else gravity / (np.linalg.norm(gravity) / len(gravity) ** 0.5)
    own = np.kron(design_matrix(sweeps, pull), np.eye(3))
    design = np.column_stack([own, (seen.attitudes @ directions.T).reshape(len(own), -1)])
    needed = design.shape[1]
    return refusals.condition_of(design, needed), needed


def check_earth_seen(
    free_rad_s: Array, covariance_rad2_s2: Array, expected_rad_s: float = EARTH_RATE_RAD_S, what: str = "it"
) -> None:
    """Whether what was found (3,) of the Earth's rate, or of a part of it, is as large as it is and known to a tenth.

    Raises Fault `earth_rate_not_observable`.
    """
    free = float(np.linalg.norm(free_rad_s))
    worst = float(np.sqrt(np.linalg.eigvalsh(covariance_rad2_s2)[-1]))
    if free < SEEN * worst:
        raise Fault(
            "earth_rate_not_observable",
            f"the gyroscope finds {what} to be {free / DEG_H:.3g} deg/h and knows it to {worst / DEG_H:.2g}, "
            f"not to a tenth",
            "Use a gyroscope with a steadier bias and less noise, or rest longer; give latitude and heading instead",
        )
    along = free_rad_s / free
    std = float(np.sqrt(along @ covariance_rad2_s2 @ along))
    if abs(free - expected_rad_s) > AGREES * std:
        raise Fault(
            "earth_rate_not_observable",
            f"the gyroscope finds {what} to be {free / DEG_H:.4g} ± {std / DEG_H:.2g} deg/h, where "
            f"{expected_rad_s / DEG_H:.4g} is right: something else turns with the attitude",
            "Look at the gyroscope's residuals, for warming and for a sensitivity to gravity; repeat the movement",
        )
