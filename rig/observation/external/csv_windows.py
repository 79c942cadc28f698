"""Windows of time in an external file: the samples in each, and the gaps between these."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps, bound_rounding_variance, find_steps
from rig.observation.average import Average
from rig.observation.statistics.coloured_noise import correlation_inflation, fit_autoregression
from rig.observation.time_stamps.gaps import hidden_angles_rad
from rig.observation.time_stamps.sampling import Sampling
from rig.observation.windows import Window, inside

MIN_SAMPLES = 20
MAX_LOST_FRACTION = 0.01
FEW_VALUES = 6  # different ones of an axis, whose least difference is a step
MIN_READ_FRACTION = 0.5  # of a row's readings: fewer do not determine its mean


def check_times(time_s: Array, where: str = "the samples") -> None:
    """Raise Refused `too_few_samples`, or `time_not_increasing` unless times (n,) rise; messages begin with `where`."""
    steps_back = np.flatnonzero(~(np.diff(time_s) > 0))
    if len(steps_back):
        first = int(steps_back[0])
        raise Refused(
            "time_not_increasing",
            f"{where} has time_s {time_s[first + 1]:.9g} after {time_s[first]:.9g}, in sample {first + 2}, and "
            f"{len(steps_back)} such steps in all: time_s must increase from row to row",
            "Give every sample once, in the order of time, on one clock, with all digits of its time",
        )
    if len(time_s) < MIN_SAMPLES:
        raise Refused(
            "too_few_samples",
            f"{where} has {len(time_s)} samples; at least {MIN_SAMPLES} are needed",
            "Give the whole recording, or record for longer",
        )


def find_overlap(windows: Sequence[Window]) -> tuple[int, int] | None:
    """Return the numbers, from 1, of two windows that overlap in time; None if no windows do."""
    order = np.argsort([window.start_s for window in windows]).tolist()
    for first, second in pairwise(order):
        if windows[second].start_s < windows[first].end_s:
            return first + 1, second + 1
    return None


def scatter_of(readings: Array) -> tuple[Array, Array, Array]:
    """Return three arrays (3,): variance of the mean of readings (n, 3), its degrees of freedom, one reading's std.

    A vibration counts as noise, because no arm's encoders show which part of the scatter it is. The variance includes
    the rounding to steps that are coarse for the noise.
    """
    variance = readings.var(axis=0, ddof=1)
    residuals = (readings - readings.mean(axis=0)).T
    inflation = np.array([correlation_inflation(axis) for axis in residuals])
    dof = np.array([fit_autoregression(axis).dof for axis in residuals])
    values = [np.unique(axis) for axis in readings.T]
    few = [np.diff(axis).min() if 1 < len(axis) <= FEW_VALUES else 0.0 for axis in values]
    steps = Steps(np.where(few, few, find_steps(readings)))
    rounding = bound_rounding_variance(readings, steps, np.zeros_like(readings), variance)
    return variance * inflation / len(readings) + rounding, dof, np.sqrt(variance)


def average_of(readings: Array, window: Window) -> Average:
    """Return the average of a window's readings (n, 3); their temperature is unknown."""
    variance, dof, noise = scatter_of(readings)
    return Average(
        mean_rad_s=readings.mean(axis=0),
        variance_rad2_s2=variance,
        noise_rad_s=noise,
        samples=len(readings),
        start_s=window.start_s,
        end_s=window.end_s,
        temperature_c=float("nan"),
        dof=dof,
    )


def average_bridged(readings: Array, numbers: NDArray[np.intp], window: Window, hidden_rad: float) -> Average:
    """Return the average of a window's readings (n, 3), with missing ones interpolated.

    Gaps in the readings' `numbers` (n,) show which are missing. The variance includes `hidden_rad`, the standard
    deviation of the rotation that the gaps may hide.
    """
    mean = average_of(readings, window)
    if not hidden_rad:
        return mean
    every = np.arange(numbers[0], numbers[-1] + 1)
    bridged = np.array([np.interp(every, numbers, axis).mean() for axis in readings.T])
    hidden = (hidden_rad / (window.end_s - window.start_s)) ** 2
    return replace(mean, mean_rad_s=bridged, variance_rad2_s2=mean.variance_rad2_s2 + hidden)


@dataclass(frozen=True, slots=True)
class RowGaps:
    """The gyroscope's readings in the window of one row of a file: their number `count`, and the gaps between them.

    - `expected`: the number of readings without losses; `missing`, `gaps`: the numbers of missing readings and of gaps.
    - `hidden_rad`: standard deviation of the rotation that the gaps hide; `first_s`: time of the reading before the
      first gap, None without a gap.
    - `is_inside`: whether the recording covers the row.
    """

    count: int
    expected: float
    missing: int
    gaps: int
    hidden_rad: float
    first_s: float | None
    is_inside: bool

    @property
    def is_usable(self) -> bool:
        """Whether enough readings of the whole row are present for its mean, and no gap hides too much rotation."""
        mostly = self.is_inside and self.count >= max(MIN_SAMPLES, MIN_READ_FRACTION * self.expected)
        return is_complete(self.count, self.expected) or (mostly and bool(np.isfinite(self.hidden_rad)))


def find_row_gaps(time_s: Array, readings: Array, sampling: Sampling, windows: Sequence[Window]) -> list[RowGaps]:
    """Return the gaps in each window, for a gyroscope's readings (n, 3), rad/s, at times (n,)."""
    expected = sampling.count_expected(time_s, np.array([(window.start_s, window.end_s) for window in windows]))
    rows = []
    for window, wanted in zip(windows, expected.tolist(), strict=True):
        cut = inside(time_s, window)
        gaps = cut.start + np.flatnonzero(sampling.missing[cut.start : max(cut.stop - 1, cut.start)])
        hidden_rad = float(np.linalg.norm(hidden_angles_rad(time_s, readings, gaps)))
        beyond_s = max(time_s[0] - window.start_s, 0.0) + max(window.end_s - time_s[-1], 0.0)
        covered = bool(beyond_s <= MAX_LOST_FRACTION * (window.end_s - window.start_s) + sampling.interval_s)
        first_s = float(time_s[gaps[0]]) if len(gaps) else None
        missing = int(sampling.missing[gaps].sum())
        rows.append(RowGaps(cut.stop - cut.start, wanted, missing, len(gaps), hidden_rad, first_s, covered))
    return rows


def is_losing(rows: Sequence[RowGaps]) -> bool:
    """Return whether single readings are missing throughout the rows, as they are if a link drops readings."""
    return sum(row.gaps for row in rows) > MAX_LOST_FRACTION * sum(row.count for row in rows)


CLOCK_REMEDY = "Check that both files use one clock in seconds, and that no samples are missing"


def check_complete(count: int, expected: float, window: Window, where: str, least: int = MIN_SAMPLES) -> None:
    """Raise Fault `lost_samples` if a window holds fewer than `least` samples, or many fewer than `expected`."""
    if is_complete(count, expected, least):
        return
    lasts_s = window.end_s - window.start_s
    wanted = f"{expected:.0f} are expected from {window.start_s:.10g} to {window.end_s:.10g} s"
    if expected < least:
        wanted = f"at least {least} are needed; it lasts {lasts_s:.3g} s at {expected / lasts_s:.3g} Hz"
    raise Fault("lost_samples", f"{where} has {count} samples, but {wanted}", CLOCK_REMEDY)


def is_complete(count: int, expected: float, least: int = MIN_SAMPLES) -> bool:
    """Return whether a window holds at least `least` samples, and nearly all of the `expected` ones."""
    return count >= max(least, (1 - MAX_LOST_FRACTION) * expected - 1)


def check_scattered(sampling: Sampling) -> None:
    """Raise Fault `lost_samples` if many readings are missing and the stamps are too poor to show where."""
    if sampling.scattered > MAX_LOST_FRACTION:
        raise Fault(
            "lost_samples",
            f"about {100 * sampling.scattered:.2g} % of the samples are missing all over the recording: their stamps "
            "advance in steps that no even clock explains and that do not show where",
            "See that the sensor's link loses nothing; stamp every reading when it is taken",
        )


def check_overlap(time_s: Array, windows: Sequence[Window]) -> None:
    """Raise Fault `clocks_apart` if no window holds any of the samples at times (n,)."""
    if all(window.end_s < time_s[0] or window.start_s > time_s[-1] for window in windows):
        raise clocks_apart(time_s, windows)


def clocks_apart(time_s: Array, windows: Sequence[Window]) -> Fault:
    """Return the error for windows that contain no sample at all."""
    start_s, end_s = min(window.start_s for window in windows), max(window.end_s for window in windows)
    return Fault(
        "clocks_apart",
        f"the rows reach from {start_s:.10g} to {end_s:.10g} s, the samples from {time_s[0]:.10g} to "
        f"{time_s[-1]:.10g} s: no row holds a sample",
        "Write both files by one clock, in seconds; with --attitudes, --estimate-clock-offset finds their offset",
    )
