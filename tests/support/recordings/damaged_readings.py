"""Readings of a recording, damaged on purpose as by a loose board, a broken wire or a worn sensor."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.observation.windows import iterate_rests, swept
from support.recordings.synthetic_run import SENSITIVITY, Setup, synthetic_run

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Readings:
    """The readings to damage: counts (n, 3), board times (n,) in µs, controller times (n,) in s, and a random
    generator.
    """

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
        window = next(sweep.window for sweep in swept(self.run) if sweep.sweep.index == index)
        return self.between(window.start_s, window.end_s)

    def half_of(self, index: int) -> Mask:
        """Return the mask of the second half of a sweep."""
        window = next(sweep.window for sweep in swept(self.run) if sweep.sweep.index == index)
        return self.between((window.start_s + window.end_s) / 2, window.end_s)

    def rest(self, index: int) -> Mask:
        window = list(iterate_rests(self.run))[index]
        return self.between(window.start_s, window.end_s)

    def between(self, start_s: float, end_s: float) -> Mask:
        inside: Mask = (self.time_s >= start_s) & (self.time_s < end_s)
        return inside

    def second(self, where: Mask) -> Mask:
        """Return the mask of one second from the middle of these samples."""
        middle = float(np.mean(self.time_s[where]))
        return self.between(middle - 0.5, middle + 0.5)

    def some(self, share: float) -> Mask:
        """Return the mask of this fraction of the samples, at random."""
        chosen: Mask = self.rng.random(len(self.counts)) < share
        return chosen

    def compute_rates(self) -> Array:
        """Return the sensed rates (n, 3) in rad/s, before the bias is added."""
        return np.asarray(self.counts * SENSITIVITY + np.array(self.setup.bias_rad_s), dtype=np.float64)

    def feeling(self, rates: Array) -> "Readings":
        counts = np.round((rates - np.array(self.setup.bias_rad_s)) / SENSITIVITY)
        return self.reading(np.clip(counts, -32768, 32767).astype(np.int64))

    def reading(self, counts: NDArray[np.int64]) -> "Readings":
        return replace(self, counts=counts)

    def recording(self) -> RunData:
        samples = self.run.samples["gyro"].copy()
        samples["counts"], samples["board_time_us"] = self.counts, self.board_us
        return replace(self.run, samples={"gyro": samples})


Damage = Callable[[Readings], Readings]


def readings_of(setup: Setup) -> Readings:
    """Return the readings of an undamaged recording."""
    run = synthetic_run(setup)
    samples = run.samples["gyro"]
    board_us = samples["board_time_us"].astype(np.int64)
    time_s = np.asarray(board_us * 1e-6 * (1 + setup.drift) + setup.boot_s, dtype=np.float64)
    return Readings(run, setup, samples["counts"].astype(np.int64), board_us, time_s, np.random.default_rng(setup.seed))


def scale(by: float, where: Callable[[Readings], Mask], axes: tuple[int, ...] = (0, 1, 2)) -> Damage:
    def damage(readings: Readings) -> Readings:
        rates = readings.compute_rates()
        rates[np.ix_(where(readings), np.array(axes))] *= by
        return readings.feeling(rates)

    return damage


def rotate(angle_deg: float, where: Callable[[Readings], Mask]) -> Damage:
    """Rotate the readings about a direction that is no sensor axis."""

    def damage(readings: Readings) -> Readings:
        from scipy.spatial.transform import Rotation

        direction = np.array([0.6, -0.48, 0.64])
        rates, chosen = readings.compute_rates(), where(readings)
        rates[chosen] = rates[chosen] @ Rotation.from_rotvec(np.radians(angle_deg) * direction).as_matrix().T
        return readings.feeling(rates)

    return damage


def offset(by_rad_s: float, where: Callable[[Readings], NDArray[Any]]) -> Damage:
    return lambda raw: raw.feeling(raw.compute_rates() + by_rad_s * np.array([1.0, -0.7, 0.5]) * where(raw)[:, None])


def bend(change: Callable[[Array], Array]) -> Damage:
    return lambda raw: raw.feeling(raw.compute_rates() + change(raw.compute_rates()))


def convert(change: Callable[[NDArray[np.int64]], NDArray[np.int64]], share: float = 1.0) -> Damage:
    """Change the bits of some readings, as a converter or a bus does."""
    return lambda raw: raw.reading(np.where(raw.some(share)[:, None], change(raw.counts), raw.counts))


def clip(low_rad_s: float, high_rad_s: float) -> Damage:
    limits = np.round(np.array([low_rad_s, high_rad_s]) / SENSITIVITY).astype(np.int64)
    return lambda readings: readings.reading(np.clip(readings.counts, *limits))


def wrap(at_rad_s: float) -> Damage:
    span = round(at_rad_s / SENSITIVITY)
    return lambda readings: readings.reading((readings.counts + span) % (2 * span) - span)


def drifting(by_rad_s: float) -> Damage:
    return lambda readings: readings.feeling(
        readings.compute_rates()
        + by_rad_s * np.linspace(-0.5, 0.5, len(readings.counts))[:, None] * np.array([1.0, -0.7, 0.5])
    )


def spiky(share: float, size_rad_s: float, *, one_sided: bool = False) -> Damage:
    def damage(readings: Readings) -> Readings:
        sizes = size_rad_s * readings.rng.uniform(0.3 if one_sided else -1, 1, readings.counts.shape)
        return readings.feeling(readings.compute_rates() + sizes * readings.some(share)[:, None])

    return damage


def frozen(where: Callable[[Readings], Mask], axes: tuple[int, ...]) -> Damage:
    def damage(readings: Readings) -> Readings:
        counts, chosen = readings.counts.copy(), readings.second(where(readings))
        counts[np.ix_(chosen, np.array(axes))] = counts[np.argmax(chosen)][list(axes)]
        return readings.reading(counts)

    return damage


def replace_readings(where: Callable[[Readings], Mask], by: int) -> Damage:
    def damage(readings: Readings) -> Readings:
        counts = readings.counts.copy()
        counts[where(readings)] = by
        return readings.reading(counts)

    return damage


def roll(where: Callable[[Readings], Mask], share: float) -> Damage:
    """Rotate the order of samples: the last fraction `share` comes first."""

    def damage(readings: Readings) -> Readings:
        counts, chosen = readings.counts.copy(), where(readings)
        counts[chosen] = np.roll(counts[chosen], round(share * chosen.sum()), axis=0)
        return readings.reading(counts)

    return damage


def repeat(where: Callable[[Readings], Mask], seconds: float) -> Damage:
    """Repeat samples in place of those that follow."""

    def damage(readings: Readings) -> Readings:
        counts, count = readings.counts.copy(), round(seconds * readings.setup.sample_rate_hz)
        first = int(np.flatnonzero(where(readings))[0]) + round(1.5 * readings.setup.sample_rate_hz)
        counts[first + count : first + 2 * count] = counts[first : first + count]
        return readings.reading(counts)

    return damage


def old(every: int) -> Damage:
    """Send the previous sample again at regular intervals."""

    def damage(readings: Readings) -> Readings:
        counts = readings.counts.copy()
        counts[every::every] = readings.counts[every - 1 : -1 : every]
        return readings.reading(counts)

    return damage


def late(by_s: float, where: Callable[[Readings], Mask]) -> Damage:
    """Delay the time stamps of an interval, compressed at its end so that their order remains."""

    def damage(readings: Readings) -> Readings:
        chosen = np.flatnonzero(where(readings))
        board_us, count = readings.board_us.copy(), round(2 * by_s * readings.setup.sample_rate_hz)
        board_us[chosen[:-count]] += round(by_s * 1e6)
        first, last = board_us[chosen[-count - 1]], board_us[chosen[-1] + 1]
        board_us[chosen[-count:]] = np.linspace(first, last, count + 2)[1:-1]
        return replace(readings, board_us=board_us)

    return damage


def noisier(by_rad_s: float, where: Callable[[Readings], Mask]) -> Damage:
    return lambda readings: readings.feeling(
        readings.compute_rates() + by_rad_s * readings.rng.normal(size=readings.counts.shape) * where(readings)[:, None]
    )


def swap(where: Callable[[Readings], Mask]) -> Damage:
    def damage(readings: Readings) -> Readings:
        counts, chosen = readings.counts.copy(), readings.second(where(readings))
        counts[chosen] = counts[chosen][:, [1, 0, 2]]
        return readings.reading(counts)

    return damage
