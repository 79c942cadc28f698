"""A recording's readings, damaged on purpose: what a loose board, a broken wire or a tired sensor makes of them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.run_file import RunData
from rig.estimation.arrays import Array
from rig.observation.windows import rested, swept
from support.recordings.synthetic_run import SENSITIVITY, Setup, synthetic_run

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Readings:
    """What there is to damage: counts (n, 3), board times (n,) µs, controller times (n,) s and chance."""

    run: RunData
    setup: Setup
    counts: NDArray[np.int64]
    board_us: NDArray[np.int64]
    time_s: Array
    rng: np.random.Generator

    @property
    def late(self) -> Mask:
        """The second half of the run."""
        return self.between((self.time_s[0] + self.time_s[-1]) / 2, np.inf)

    @property
    def turning(self) -> Mask:
        """All sweeps."""
        return np.isin(np.arange(len(self.counts)), np.concatenate([np.flatnonzero(self.sweep(i)) for i in range(6)]))

    def sweep(self, index: int) -> Mask:
        window = next(each.window for each in swept(self.run) if each.sweep.index == index)
        return self.between(window.start_s, window.end_s)

    def half_of(self, index: int) -> Mask:
        """The second half of a sweep."""
        window = next(each.window for each in swept(self.run) if each.sweep.index == index)
        return self.between((window.start_s + window.end_s) / 2, window.end_s)

    def rest(self, place: int) -> Mask:
        window = list(rested(self.run))[place]
        return self.between(window.start_s, window.end_s)

    def between(self, start_s: float, end_s: float) -> Mask:
        inside: Mask = (self.time_s >= start_s) & (self.time_s < end_s)
        return inside

    def second(self, where: Mask) -> Mask:
        """A second from the middle of these samples."""
        middle = float(np.mean(self.time_s[where]))
        return self.between(middle - 0.5, middle + 0.5)

    def some(self, share: float) -> Mask:
        """So many of the samples, at random."""
        chosen: Mask = self.rng.random(len(self.counts)) < share
        return chosen

    def felt(self) -> Array:
        """(n, 3) rad/s before the bias is added."""
        return np.asarray(self.counts * SENSITIVITY + np.array(self.setup.bias_rad_s), dtype=np.float64)

    def feeling(self, felt: Array) -> "Readings":
        counts = np.round((felt - np.array(self.setup.bias_rad_s)) / SENSITIVITY)
        return self.reading(np.clip(counts, -32768, 32767).astype(np.int64))

    def reading(self, counts: NDArray[np.int64]) -> "Readings":
        return replace(self, counts=counts)

    def recording(self) -> RunData:
        samples = self.run.samples["gyro"].copy()
        samples["counts"], samples["board_time_us"] = self.counts, self.board_us
        return replace(self.run, samples={"gyro": samples})


Damage = Callable[[Readings], Readings]


def readings_of(setup: Setup) -> Readings:
    """An undamaged recording's."""
    run = synthetic_run(setup)
    samples = run.samples["gyro"]
    board_us = samples["board_time_us"].astype(np.int64)
    time_s = np.asarray(board_us * 1e-6 * (1 + setup.drift) + setup.boot_s, dtype=np.float64)
    return Readings(run, setup, samples["counts"].astype(np.int64), board_us, time_s, np.random.default_rng(setup.seed))


def scaled(by: float, where: Callable[[Readings], Mask], axes: tuple[int, ...] = (0, 1, 2)) -> Damage:
    def damage(seen: Readings) -> Readings:
        felt = seen.felt()
        felt[np.ix_(where(seen), np.array(axes))] *= by
        return seen.feeling(felt)

    return damage


def turned(angle_deg: float, where: Callable[[Readings], Mask]) -> Damage:
    """About a direction that no sensor axis has."""

    def damage(seen: Readings) -> Readings:
        from scipy.spatial.transform import Rotation

        direction = np.array([0.6, -0.48, 0.64])
        felt, there = seen.felt(), where(seen)
        felt[there] = felt[there] @ Rotation.from_rotvec(np.radians(angle_deg) * direction).as_matrix().T
        return seen.feeling(felt)

    return damage


def offset(by_rad_s: float, where: Callable[[Readings], NDArray[Any]]) -> Damage:
    return lambda seen: seen.feeling(seen.felt() + by_rad_s * np.array([1.0, -0.7, 0.5]) * where(seen)[:, None])


def curved(change: Callable[[Array], Array]) -> Damage:
    return lambda seen: seen.feeling(seen.felt() + change(seen.felt()))


def converted(change: Callable[[NDArray[np.int64]], NDArray[np.int64]], share: float = 1.0) -> Damage:
    """By what the converter or the bus does to the bits of some readings."""
    return lambda seen: seen.reading(np.where(seen.some(share)[:, None], change(seen.counts), seen.counts))


def clipped(low_rad_s: float, high_rad_s: float) -> Damage:
    limits = np.round(np.array([low_rad_s, high_rad_s]) / SENSITIVITY).astype(np.int64)
    return lambda seen: seen.reading(np.clip(seen.counts, *limits))


def wrapped(at_rad_s: float) -> Damage:
    span = round(at_rad_s / SENSITIVITY)
    return lambda seen: seen.reading((seen.counts + span) % (2 * span) - span)


def drifting(by_rad_s: float) -> Damage:
    return lambda seen: seen.feeling(
        seen.felt() + by_rad_s * np.linspace(-0.5, 0.5, len(seen.counts))[:, None] * np.array([1.0, -0.7, 0.5])
    )


def spiky(share: float, size_rad_s: float, *, one_sided: bool = False) -> Damage:
    def damage(seen: Readings) -> Readings:
        sizes = size_rad_s * seen.rng.uniform(0.3 if one_sided else -1, 1, seen.counts.shape)
        return seen.feeling(seen.felt() + sizes * seen.some(share)[:, None])

    return damage


def frozen(where: Callable[[Readings], Mask], axes: tuple[int, ...]) -> Damage:
    def damage(seen: Readings) -> Readings:
        counts, there = seen.counts.copy(), seen.second(where(seen))
        counts[np.ix_(there, np.array(axes))] = counts[np.argmax(there)][list(axes)]
        return seen.reading(counts)

    return damage


def replaced(where: Callable[[Readings], Mask], by: int) -> Damage:
    def damage(seen: Readings) -> Readings:
        counts = seen.counts.copy()
        counts[where(seen)] = by
        return seen.reading(counts)

    return damage


def rolled(where: Callable[[Readings], Mask], share: float) -> Damage:
    """The samples of a stretch in another order: what came first comes last."""

    def damage(seen: Readings) -> Readings:
        counts, there = seen.counts.copy(), where(seen)
        counts[there] = np.roll(counts[there], round(share * there.sum()), axis=0)
        return seen.reading(counts)

    return damage


def repeated(where: Callable[[Readings], Mask], seconds: float) -> Damage:
    """A stretch of samples stands in the place of the next one as well."""

    def damage(seen: Readings) -> Readings:
        counts, count = seen.counts.copy(), round(seconds * seen.setup.sample_rate_hz)
        first = int(np.flatnonzero(where(seen))[0]) + round(1.5 * seen.setup.sample_rate_hz)
        counts[first + count : first + 2 * count] = counts[first : first + count]
        return seen.reading(counts)

    return damage


def old(every: int) -> Damage:
    """Every so many samples the one before is sent again."""

    def damage(seen: Readings) -> Readings:
        counts = seen.counts.copy()
        counts[every::every] = seen.counts[every - 1 : -1 : every]
        return seen.reading(counts)

    return damage


def late(by_s: float, where: Callable[[Readings], Mask]) -> Damage:
    """Time stamps of a stretch shifted, squeezed at its end so that their order stays."""

    def damage(seen: Readings) -> Readings:
        there = np.flatnonzero(where(seen))
        board_us, count = seen.board_us.copy(), round(2 * by_s * seen.setup.sample_rate_hz)
        board_us[there[:-count]] += round(by_s * 1e6)
        first, last = board_us[there[-count - 1]], board_us[there[-1] + 1]
        board_us[there[-count:]] = np.linspace(first, last, count + 2)[1:-1]
        return replace(seen, board_us=board_us)

    return damage


def noisier(by_rad_s: float, where: Callable[[Readings], Mask]) -> Damage:
    return lambda seen: seen.feeling(
        seen.felt() + by_rad_s * seen.rng.normal(size=seen.counts.shape) * where(seen)[:, None]
    )


def swapped(where: Callable[[Readings], Mask]) -> Damage:
    def damage(seen: Readings) -> Readings:
        counts, there = seen.counts.copy(), seen.second(where(seen))
        counts[there] = counts[there][:, [1, 0, 2]]
        return seen.reading(counts)

    return damage
