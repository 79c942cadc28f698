"""What might be wrong with a gyroscope while it is recorded: as columns of a suspicion, and as damages of some size.

A check asks how much its columns explain of what the model leaves. A damage is what may really happen: the check that
is to tell it has columns that are like it, not the same.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.consistency.residual_tests import Damage, Suspicions
from rig.analysis.gyroscope.segments import Segments
from rig.estimation.arrays import Array
from rig.observation.consistency.raw_readings import REST


@dataclass(frozen=True, slots=True)
class Means:
    """N means of readings: `felt_rad_s` (N, 3) is what each axis of the sensor feels of the arm's turning, `times_s`
    (N, 2) from start to end, `sweep` (N,) the place of the sweep they belong to, negative where they belong to none."""

    felt_rad_s: Array
    times_s: Array
    sweep: NDArray[np.intp]

    @property
    def later(self) -> Array:
        """(N, 1) 1 in the second half of all the time."""
        later: Array = (self.times_s.mean(axis=1) > (self.times_s.min() + self.times_s.max()) / 2).astype(np.float64)
        return later[:, None]

    @property
    def sweeps(self) -> Array:
        """(N, M) 1 where a mean belongs to the sweep."""
        sweeps: Array = (self.sweep[:, None] == np.unique(self.sweep[self.sweep >= 0])).astype(np.float64)
        return sweeps


def _of_each_axis(columns: Array) -> Array:
    """(3, N, 3) columns made of (N, 3): what happens on one axis alone."""
    return np.moveaxis(per_axis(columns), -1, 0).swapaxes(1, 2)


def _in_each_sweep(means: Means) -> Array:
    alone = means.sweeps.T[:, None, :, None] * np.eye(3)[None, :, None, :]
    return np.asarray(alone.reshape(-1, len(means.sweep), 3), dtype=np.float64)


DAMAGES: tuple[Damage[Means], ...] = (  # (k, N, 3) each
    Damage(
        "all scale factors change half-way", "scale_changed", "1",
        lambda means: (means.felt_rad_s * (means.later - 0.5))[None],
    ),
    Damage(
        "one scale factor changes half-way", "axis_changed", "1",
        lambda means: _of_each_axis(means.felt_rad_s * (means.later - 0.5)),
    ),
    Damage(
        "the sensor turns on the flange half-way", "loose_mounting", "rad",
        lambda means: np.cross(np.eye(3)[:, None], means.felt_rad_s[None]) * (means.later - 0.5),
    ),
    Damage(
        "another scale one way than the other", "cw_against_ccw", "1",
        lambda means: np.abs(means.felt_rad_s)[None] / 2,
    ),
    Damage(
        "another bias in sweeps than in rests", "sweeps_against_rests", None,
        lambda means: _of_each_axis(means.sweeps.sum(axis=1, keepdims=True) * np.ones(3)),
    ),
    Damage(
        "the bias jumps half-way", "bias_jumped", None,
        lambda means: _of_each_axis((means.later - 0.5) * np.ones(3)),
    ),
    Damage("another reading in one sweep", "disturbed_sweep", None, _in_each_sweep),
)  # fmt: skip


def changes(segments: Segments, felt: Array) -> Suspicions:
    """What another scale factor of an axis, or another mounting, with time adds, by name of the check (3, N, k)."""
    time = in_time(segments)
    for sweep in np.unique(segments.sweep):  # what changes within a sweep is that sweep's own matter
        time[segments.sweep == sweep] = time[segments.sweep == sweep].mean()
    turned = np.cross(np.eye(3)[:, None], felt[None]) * time[None, :, None]  # (k, N, 3)
    return {"scale_changed": per_axis(felt * time[:, None]), "loose_mounting": np.transpose(turned, (2, 1, 0))}


def differences(segments: Segments, felt: Array, whole: Array | None) -> dict[str, Array | None]:
    """What a difference between directions, sweeps and rests adds, by name of the check (3, N, k).

    What else may differ is `whole` (3, N, k), each sweep from what the model says; None is anything at all, but of that
    the scatter within sweeps is made which the bias' wandering is found from.
    """
    found: dict[str, Array | None] = {"cw_against_ccw": per_axis(np.abs(felt)), "residuals": whole}
    moving = segments.sweep >= 0
    if not moving.all():
        found["sweeps_against_rests"] = per_axis(np.outer(moving, np.ones(3)))
    return found


def of_one_axis(ways: Segments, felt: Array) -> Array:
    """(3, N, k): another scale factor of one axis, from one sweep or way on."""
    starts = np.unique([ways.times_s[ways.sweep == sweep].min() for sweep in np.unique(ways.sweep[ways.sweep != REST])])
    later = ways.times_s.mean(axis=1)[:, None] > starts[1:]
    return np.concatenate([per_axis(felt * since[:, None]) for since in later.T], axis=2)


def in_quarters(means: Means) -> Array:
    """(3, N, 9): another scale factor of each axis from each quarter of all the time on."""
    middle, (begin, end) = means.times_s.mean(axis=1), (means.times_s.min(), means.times_s.max())
    edges = np.linspace(begin, end, 5)[1:-1]
    return np.concatenate([per_axis(means.felt_rad_s * (middle > edge)[:, None]) for edge in edges], axis=2)


def of_sweep(segments: Segments, sweep: int) -> Array:
    """(3, N, 6): another reading in this sweep, and another in its second half than in its first."""
    inside = (segments.sweep == sweep).astype(np.float64)
    return each_axis(np.column_stack([inside, inside * segments.position]))


def jumps(segments: Segments) -> list[Array]:
    """(N, 1) zero before a sweep ends and one after, for each end that rests stand on both sides of."""
    middle = segments.times_s.mean(axis=1)
    ends = [segments.times_s[segments.sweep == sweep].max() for sweep in np.unique(segments.sweep[segments.sweep >= 0])]
    steps = [np.where(middle < end, 0.0, 1.0)[:, None] for end in ends]
    return [step for step in steps if len(np.unique(step[segments.sweep < 0])) > 1]


def in_time(segments: Segments) -> Array:
    """(N,) times of the segments' middles, from −1 to 1."""
    middle = segments.times_s.mean(axis=1)
    time: Array = (2 * middle - middle.max() - middle.min()) / np.ptp(middle)
    return time


def each_axis(columns: Array) -> Array:
    """(3, N, 3 k): columns (N, k) for each axis with a coefficient of its own."""
    count, wide = columns.shape
    return np.asarray(np.einsum("ij,nk->injk", np.eye(3), columns).reshape(3, count, 3 * wide), dtype=np.float64)


def per_axis(columns: Array) -> Array:
    """(3, N, 3) columns made of (N, 3): each axis' own column, with a coefficient of its own."""
    stacked: Array = np.einsum("ij,ni->inj", np.eye(3), columns)
    return stacked
