"""Possible faults of a gyroscope during a recording: the columns that the checks test, and realistic fault modes.

A column is the effect of a possible fault on all readings. A check tests how much of the residuals its columns explain.
A fault mode resembles the columns of its check; the smallest detectable size of each fault mode is reported.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.consistency.residual_tests import FaultMode
from rig.analysis.gyroscope.segment_table import Segments
from rig.estimation.arrays import Array, distinct
from rig.observation.consistency.raw_readings import REST


@dataclass(frozen=True, slots=True)
class Means:
    """The means that a perfect sensor would read in N sweeps and rests.

    - sensed_rad_s (N, 3): the arm's rates along the sensor's axes.
    - times_s (N, 2): start and end.
    - sweep (N,): index of the sweep, −1 for a rest, a smaller number for a transfer.
    """

    sensed_rad_s: Array
    times_s: Array
    sweep: NDArray[np.intp]

    @property
    def later(self) -> Array:
        """A column (N, 1): 1 in the second half of the recording, else 0."""
        later: Array = (self.times_s.mean(axis=1) > (self.times_s.min() + self.times_s.max()) / 2).astype(np.float64)
        return later[:, None]

    @property
    def sweeps(self) -> Array:
        """A column (N,) for each of M sweeps, as (N, M): 1 if a mean belongs to the sweep, else 0."""
        sweeps: Array = (self.sweep[:, None] == distinct(self.sweep[self.sweep >= 0])).astype(np.float64)
        return sweeps


def _axis_patterns(columns: Array) -> Array:
    """Return three patterns (3, N, 3): pattern i has column i of `columns` (N, 3) on axis i, and zeros elsewhere."""
    return np.moveaxis(split_per_axis(columns), -1, 0).swapaxes(1, 2)


def _sweep_patterns(means: Means) -> Array:
    """Return the patterns (3 M, N, 3) in the N means: each is an offset of one axis during one of M sweeps."""
    alone = means.sweeps.T[:, None, :, None] * np.eye(3)[None, :, None, :]
    return np.asarray(alone.reshape(-1, len(means.sweep), 3), dtype=np.float64)


FAULT_MODES: tuple[FaultMode[Means], ...] = (  # (k, N, 3) each
    FaultMode(
        "all scale factors change half-way", "scale_changed", "1",
        lambda means: (means.sensed_rad_s * (means.later - 0.5))[None],
    ),
    FaultMode(
        "one scale factor changes half-way", "axis_changed", "1",
        lambda means: _axis_patterns(means.sensed_rad_s * (means.later - 0.5)),
    ),
    FaultMode(
        "the sensor turns on the flange half-way", "loose_mounting", "rad",
        lambda means: np.cross(np.eye(3)[:, None], means.sensed_rad_s[None]) * (means.later - 0.5),
    ),
    FaultMode(
        "another scale one way than the other", "cw_against_ccw", "1",
        lambda means: np.abs(means.sensed_rad_s)[None] / 2,
    ),
    FaultMode(
        "another bias in sweeps than in rests", "sweeps_against_rests", None,
        lambda means: _axis_patterns(means.sweeps.sum(axis=1, keepdims=True) * np.ones(3)),
    ),
    FaultMode(
        "the bias jumps half-way", "bias_jumped", None,
        lambda means: _axis_patterns((means.later - 0.5) * np.ones(3)),
    ),
    FaultMode("another reading in one sweep", "disturbed_sweep", None, _sweep_patterns),
)  # fmt: skip


def changes(segments: Segments, axis_rates: Array) -> dict[str, Array]:
    """Return the effects (3, N, 3) of scale factors or a mounting that change steadily, by the name of the check."""
    time = normalise_time(segments)
    for sweep in distinct(segments.sweep):  # a change within a sweep is tested for that sweep
        time[segments.sweep == sweep] = time[segments.sweep == sweep].mean()
    turned = np.cross(np.eye(3)[:, None], axis_rates[None]) * time[None, :, None]  # (k, N, 3)
    return {
        "scale_changed": split_per_axis(axis_rates * time[:, None]),
        "loose_mounting": np.transpose(turned, (2, 1, 0)),
    }


def differences(segments: Segments, axis_rates: Array, whole: Array | None) -> dict[str, Array | None]:
    """Return the effects (3, N, k) of a difference between directions, sweeps or rests, by the name of the check.

    The check `residuals` has the columns `whole` (3, N, k). If `whole` is None, it uses all residuals, including the
    scatter within sweeps.
    """
    columns_by_name: dict[str, Array | None] = {
        "cw_against_ccw": split_per_axis(np.abs(axis_rates)),
        "residuals": whole,
    }
    moving = segments.sweep >= 0
    if not moving.all():
        columns_by_name["sweeps_against_rests"] = split_per_axis(np.outer(moving, np.ones(3)))
    return columns_by_name


def single_axis_columns(segments: Segments, axis_rates: Array) -> Array:
    """Return the effects (3, N, k) of a scale factor of one axis that changes where a sweep or transfer starts."""
    moving = distinct(segments.sweep[segments.sweep != REST])
    starts = distinct(np.array([segments.times_s[segments.sweep == sweep].min() for sweep in moving]))
    later = segments.times_s.mean(axis=1)[:, None] > starts[1:]
    return np.concatenate([split_per_axis(axis_rates * since[:, None]) for since in later.T], axis=2)


def quarter_columns(means: Means) -> Array:
    """Return the effects (3, N, 9) of a change of each scale factor after one, two and three quarters of the time."""
    middle, (begin, end) = means.times_s.mean(axis=1), (means.times_s.min(), means.times_s.max())
    edges = np.linspace(begin, end, 5)[1:-1]
    return np.concatenate([split_per_axis(means.sensed_rad_s * (middle > edge)[:, None]) for edge in edges], axis=2)


def sweep_columns(segments: Segments, sweep: int) -> Array:
    """Return the effects (3, N, 6) of an offset of one sweep, and of a difference between its halves."""
    inside = (segments.sweep == sweep).astype(np.float64)
    return repeat_per_axis(np.column_stack([inside, inside * segments.position]))


def step_columns(segments: Segments) -> list[Array]:
    """Return for each sweep between two rests a step (N, 1) at the sweep's end: 0 before it, 1 after it."""
    middle = segments.times_s.mean(axis=1)
    ends = [segments.times_s[segments.sweep == sweep].max() for sweep in distinct(segments.sweep[segments.sweep >= 0])]
    steps = [np.where(middle < end, 0.0, 1.0)[:, None] for end in ends]
    return [step for step in steps if len(distinct(step[segments.sweep < 0])) > 1]


def normalise_time(segments: Segments) -> Array:
    """Return the middle times (N,) of the segments, scaled linearly so that they range from −1 to 1."""
    middle = segments.times_s.mean(axis=1)
    time: Array = (2 * middle - middle.max() - middle.min()) / np.ptp(middle)
    return time


def repeat_per_axis(columns: Array) -> Array:
    """Return `columns` (N, k) repeated for each axis, as (3, N, 3 k); a copy acts on one axis and is zero elsewhere."""
    count, wide = columns.shape
    return np.asarray(np.einsum("ij,nk->injk", np.eye(3), columns).reshape(3, count, 3 * wide), dtype=np.float64)


def split_per_axis(columns: Array) -> Array:
    """Return three columns (3, N, 3) of readings by axis; the last index i selects `columns[:, i]`, on axis i alone."""
    stacked: Array = np.einsum("ij,ni->inj", np.eye(3), columns)
    return stacked
