"""The Allan deviation of a sensor at rest, with its random walk and bias instability.

    σ²(τ) = ⟨(ȳ_{k+m} − ȳ_k)²⟩ / 2,   τ = m τ₀

over all overlapping pairs of adjacent means ȳ of m readings (NIST SP 1065, section 5.2.4, with readings instead of
frequencies). A pair lies within one interval of readings, because the sensor may have turned between two intervals.

The equivalent degrees of freedom of σ² (Howe, Allan and Barnes 1981; NIST SP 1065, table 5) are those of the noise that
dominates near τ, according to the slope of the curve. σ² times these degrees of freedom, divided by its true value, is
distributed as χ². White noise has the slope −1/2 and σ = N/√τ, N being the random walk; the least σ, at the flat part
of the curve, is 0.664 times the bias instability B (IEEE Std 952-1997, C.1.1 and C.1.3).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import check_finite

Noise = Literal["white", "flicker", "random_walk"]

COVERAGE = 0.95  # probability of the confidence intervals
RANDOM_WALK_TAU_S = 1.0  # beyond the sensor's filter, before its bias drifts
MAX_RANDOM_WALK_STD = 0.1  # relative, of a random walk that is stated
SLOPE_TOLERANCE = 0.05  # deviation from −1/2 in addition to the slope's uncertainty: an error of N by 5 %
MAX_INSTABILITY_STD = 0.2
FLICKER_RATIO = float(np.sqrt(2 * np.log(2) / np.pi))  # 0.664: ratio of the least σ to the bias instability
MIN_EXCESS_STDS = 3.0  # by which the least σ must exceed that of white noise alone
MIN_READINGS = 3  # of an interval
MIN_DURATION_S = 40.0  # shortest recording whose white noise determines a random walk to `MAX_RANDOM_WALK_STD`
MIN_FLOOR_DURATION_S = 600.0  # few gyroscopes reach their least deviation sooner


@dataclass(frozen=True, slots=True)
class AllanCurve:
    """The overlapping Allan deviation: `tau_s` (T,), and `deviation`, `low`, `high` (T, 3) in the readings' unit.

    `low` and `high` bound the true value with a probability of 95 %; `dof` (T, 3): equivalent degrees of freedom.
    `total_s` is the total duration.
    """

    tau_s: Array
    deviation: Array
    low: Array
    high: Array
    dof: Array
    total_s: float

    @property
    def relative_std(self) -> Array:
        """The relative standard deviation (T, 3) of each Allan deviation."""
        std: Array = 1 / np.sqrt(2 * self.dof)
        return std


@dataclass(frozen=True, slots=True)
class AllanReading:
    """A value that is read from the curve of one axis, its standard deviation, and the τ at which it was read."""

    value: float
    std: float
    tau_s: float


@dataclass(frozen=True, slots=True)
class AllanAxis:
    """The noise of one axis: random walk N in the readings' unit times √s, and bias instability B in their unit.

    A value that the curve does not determine is replaced by the Fault that says why.
    """

    random_walk: AllanReading | Fault
    bias_instability: AllanReading | Fault


def allan_curve(series: Sequence[Array], interval_s: float) -> AllanCurve:
    """Return the overlapping Allan deviation of series (nᵢ, 3) of readings that are `interval_s` apart.

    The times τ are `interval_s` times powers of two, and the multiple of `interval_s` nearest to 1 s. Raise Fault
    `not_finite`, and `recording_too_short` if no series has three readings.
    """
    used = [np.asarray(readings, dtype=np.float64) for readings in series if len(readings) >= MIN_READINGS]
    if not used:
        raise too_short(f"no interval at rest has {MIN_READINGS} readings without a gap")
    for readings in used:
        check_finite(readings=readings)
    phases = [np.vstack([np.zeros(3), np.cumsum(readings - readings.mean(axis=0), axis=0)]) for readings in used]
    longest = (max(map(len, phases)) - 1) // 2
    factors = {2**power for power in range(longest.bit_length())} | {round(RANDOM_WALK_TAU_S / interval_s)}
    chosen = np.array(sorted(factor for factor in factors if 1 <= factor <= longest))
    squares = np.array([_average_squares(phases, factor) for factor in chosen])
    points = [len(phase) for phase in phases]
    tau_s, deviation = chosen * interval_s, np.sqrt(squares)
    dof = np.array(
        [
            [_dof(points, int(factor), _classify_noise(slope)) for slope in slopes]
            for factor, slopes in zip(chosen, _slopes(tau_s, deviation), strict=True)
        ]
    )
    low, high = _bounds(deviation, dof)
    return AllanCurve(tau_s, deviation, low, high, dof, interval_s * sum(map(len, used)))


def read_axis(curve: AllanCurve, axis: int) -> AllanAxis:
    """Return random walk and bias instability from the curve of one axis."""
    walk = _random_walk(curve, axis)
    return AllanAxis(walk, _instability(curve, axis, walk))


def too_short(what: str, enough_s: float = MIN_DURATION_S) -> Fault:
    """Return the Fault for a recording that is too short for the value `what`; about `enough_s` would suffice."""
    return Fault("recording_too_short", what, f"Record at rest for {enough_s:.0f} s or more without interruption")


def equivalent_dof(points: int, factor: int, noise: Noise) -> float:
    """Return the equivalent dof (at least 1) of the Allan variance of means of `factor` readings.

    `points` is the number of phases (sums of readings), which is one more than the number of readings.
    """
    # Approximations for white, flicker and random-walk noise of frequency: NIST SP 1065, table 5.
    n, m = float(points), float(factor)
    if noise == "white":
        dof = (3 * (n - 1) / (2 * m) - 2 * (n - 2) / n) * 4 * m**2 / (4 * m**2 + 5)
    elif noise == "flicker":
        dof = 2 * (n - 2) ** 2 / (2.3 * n - 4.9) if factor == 1 else 5 * n**2 / (4 * m * (n + 3 * m))
    else:
        dof = (n - 2) / m * ((n - 1) ** 2 - 3 * m * (n - 1) + 4 * m**2) / (n - 3) ** 2 if points > 3 else 1.0
    return max(dof, 1.0)


def _average_squares(phases: Sequence[Array], factor: int) -> Array:
    """Return the Allan variance (3,) of means of `factor` readings.

    `phases` are for each series the running sums (nᵢ + 1, 3) of its readings; too short series are not used.
    """
    total, count = np.zeros(3), 0
    for phase in phases:
        if len(phase) > 2 * factor:
            second = phase[2 * factor :] - 2 * phase[factor:-factor] + phase[: -2 * factor]
            total += np.sum(second**2, axis=0)
            count += len(second)
    variance: Array = total / (2 * factor**2 * count)
    return variance


def _dof(points: Sequence[int], factor: int, noise: Noise) -> float:
    """Return the dof of the mean Allan variance of independent series, weighted by their numbers of pairs of means.

    `points` are the numbers of phases of the series; series without a pair of means are not used.
    """
    reach = [n for n in points if n > 2 * factor]
    pairs = np.array([n - 2 * factor for n in reach], dtype=np.float64)
    of_interval = np.array([equivalent_dof(n, factor, noise) for n in reach])
    return float(pairs.sum() ** 2 / np.sum(pairs**2 / of_interval))


def _slopes(tau_s: Array, deviation: Array) -> Array:
    """Return the slopes (T, 3) of the log–log curve between the neighbours of each point; −1/2 for a single point."""
    if len(tau_s) < 2:
        return np.full(deviation.shape, -0.5)
    logarithm = np.log(np.maximum(deviation, np.finfo(np.float64).tiny))
    slopes: Array = np.gradient(logarithm, np.log(tau_s), axis=0)
    return slopes


def _classify_noise(slope: float) -> Noise:
    """Return the type of noise whose slope, −1/2, 0 or 1/2, is nearest to a measured slope."""
    if slope < -0.25:
        return "white"
    return "flicker" if slope < 0.25 else "random_walk"


def _bounds(deviation: Array, dof: Array) -> tuple[Array, Array]:
    """Return the lower and upper confidence bounds (T, 3) of the deviation by χ²."""
    from scipy.special import chdtri

    tail = (1 - COVERAGE) / 2
    return deviation * np.sqrt(dof / chdtri(dof, tail)), deviation * np.sqrt(dof / chdtri(dof, 1 - tail))


def _random_walk(curve: AllanCurve, axis: int) -> AllanReading | Fault:
    """Return the random walk N = σ(τ) √τ at the τ nearest to 1 s, if the curve falls there like white noise (1/√τ)."""
    index = int(np.argmin(np.abs(curve.tau_s - RANDOM_WALK_TAU_S)))
    tau_s, relative_std = float(curve.tau_s[index]), float(curve.relative_std[index, axis])
    if abs(tau_s - RANDOM_WALK_TAU_S) > RANDOM_WALK_TAU_S / 2:
        what = f"no interval at rest reaches {RANDOM_WALK_TAU_S:g} s, the averaging time at which random walk is read"
        if curve.total_s >= MIN_DURATION_S:
            what = f"readings are missing so often that {what}"
            return Fault("lost_samples", what, "See that the sensor's link loses nothing, and record again")
        return too_short(what)
    if relative_std > MAX_RANDOM_WALK_STD:
        worst = float(curve.relative_std[index].max())  # one sentence for all axes
        return too_short(
            f"random walk would be known to {100 * worst:.0f} %; the limit is {100 * MAX_RANDOM_WALK_STD:.0f} %",
            max(MIN_DURATION_S, curve.total_s * (worst / MAX_RANDOM_WALK_STD) ** 2),
        )
    # A factor of about two to either side, so that the slope does not depend on one point.
    below, above = (int(np.argmin(np.abs(np.log(curve.tau_s / (tau_s * by))))) for by in (0.5, 2.0))
    if below == above:
        return too_short(f"the curve has no second point besides {RANDOM_WALK_TAU_S:g} s to show its slope")
    run = np.log(curve.tau_s[above] / curve.tau_s[below])
    slope = float(np.log(curve.deviation[above, axis] / curve.deviation[below, axis]) / run)
    slope_std = float(np.hypot(*curve.relative_std[[below, above], axis]) / run)
    if abs(slope + 0.5) > SLOPE_TOLERANCE + 3 * slope_std:
        return Fault(
            "not_white_noise",
            f"at {tau_s:.2g} s the deviation changes with the power {slope:+.2f} of τ, not −0.5",
            "Look at the curve: something vibrates, the readings are filtered over that time, or the bias "
            "moves that fast",
        )
    value = float(curve.deviation[index, axis] * np.sqrt(tau_s))
    return AllanReading(value, value * relative_std, tau_s)


def _instability(curve: AllanCurve, axis: int, walk: AllanReading | Fault) -> AllanReading | Fault:
    """Return the bias instability from the curve's minimum, if that lies in the well-determined part of the curve."""
    relative_std = curve.relative_std[:, axis]
    usable = np.flatnonzero(relative_std <= MAX_INSTABILITY_STD)
    if not len(usable):
        return too_short(f"no point of the curve is known to {100 * MAX_INSTABILITY_STD:.0f} %", MIN_FLOOR_DURATION_S)
    last = int(usable[-1])
    least = int(usable[np.argmin(curve.deviation[usable, axis])])
    tau_s, deviation = float(curve.tau_s[least]), float(curve.deviation[least, axis])
    if least == 0:
        return Fault(
            "not_white_noise",
            f"the deviation is smallest at {tau_s:.2g} s, the shortest averaging time, and only rises from there",
            "Look at the curve: something moves or vibrates, or the readings are filtered over that time",
        )
    by_noise = walk.value / np.sqrt(tau_s) if isinstance(walk, AllanReading) else 0.0
    if least == last or deviation < by_noise * (1 + MIN_EXCESS_STDS * relative_std[least]):
        return too_short(
            f"the deviation still falls at {curve.tau_s[last]:.3g} s, the longest known to "
            f"{100 * MAX_INSTABILITY_STD:.0f} %",
            max(MIN_FLOOR_DURATION_S, 2 * curve.total_s),
        )
    return AllanReading(deviation / FLICKER_RATIO, deviation / FLICKER_RATIO * float(relative_std[least]), tau_s)
