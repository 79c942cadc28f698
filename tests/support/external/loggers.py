"""Logs in the style of other loggers: rounded stamps or stamps of arrival, losses, knocks, a large bias.

No code is shared with the rig. The truth is m = F ω + b, and diag k of g = K (m + b) is one over the columns of F⁻¹.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from support.external.csv_tables import write_table

AXES = ("x", "y", "z")
SIX_WAYS = ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))
MATRIX = np.array([[1.02, 0.004, -0.006], [-0.003, 0.985, 0.005], [0.002, -0.004, 1.01]])
SCALE = 1 / np.linalg.norm(MATRIX, axis=1)  # of an axis: one over its response to a rate along itself
GRAVITY_M_S2 = 9.80665
RAMP_S, REST_S = 1.0, 2.0
FACES = np.array([[1, 0, -1, 0], [1, 0, 1, 0], [1, 1, 0, 0], [1, -1, 0, 0], [2**0.5, 0, 0, 0], [0, 2**0.5, 0, 0]]) / (
    2**0.5
)
FORCES = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]])


def polled(time_s: Array, every_s: float, late_s: float = 0.0, inner_s: float = 0.0, seed: int = 0) -> Array:
    """Return the stamps of readings that wait for the next poll, packet or radio event, at most `late_s` after it."""
    event = np.ceil(time_s / every_s - 1e-9).astype(int)
    late = late_s * np.random.default_rng(seed).random(event[-1] + 1)
    first = np.concatenate([[True], np.diff(event) > 0])
    index = np.arange(len(time_s))
    stamps: Array = every_s * event + late[event] + inner_s * (index - np.maximum.accumulate(np.where(first, index, 0)))
    return stamps


def stale_at_first(time_s: Array, count: int, every_s: float = 2.5e-3) -> Array:
    """Return the arrival times of a log whose first `count` readings waited in a buffer."""
    stamps = time_s.copy()
    stamps[:count] = time_s[count] - every_s * np.arange(count, 0, -1)
    return stamps


def stalled(time_s: Array, at_s: float, lasts_s: float, every_s: float = 5e-4) -> Array:
    """Return the arrival times over a link that stalls, and then sends at once everything that waited."""
    first = int(np.searchsorted(time_s, at_s))
    stamps = time_s.copy()
    stamps[first:] = np.maximum(stamps[first:], at_s + lasts_s + every_s * np.arange(len(stamps) - first))
    return stamps


@dataclass(frozen=True)
class Log:
    """Readings (n, 3) taken at `time_s` (n,), and the `rows` (k, …) that describe the motion."""

    time_s: Array
    readings: Array
    rows: Array


@dataclass(frozen=True)
class Stamps:
    """A logger's stamps: rounded to `rounded_s`, or packets of `burst` on arrival, `inner_s` apart, `late_s` at most.

    The fraction `lost` of the readings is missing at random, and all readings of the `gaps` (first, count).
    """

    rounded_s: float = 0.0
    burst: int = 1
    inner_s: float = 1e-3
    late_s: float = 0.0
    lost: float = 0.0
    gaps: tuple[tuple[int, int], ...] = ()

    def stamp(self, time_s: Array, seed: int = 0) -> tuple[Array, NDArray[np.bool_]]:
        """Return the stamps (k,) of the readings kept, and which of all were kept (n,)."""
        rng = np.random.default_rng(seed)
        kept = rng.random(len(time_s)) >= self.lost
        for first, count in self.gaps:
            kept[first : first + count] = False
        stamps = time_s.copy()
        if self.burst > 1:
            packet = np.arange(len(time_s)) // self.burst
            position = np.concatenate([np.arange(kept[packet == index].sum()) for index in range(packet[-1] + 1)])
            late_s = self.late_s * rng.random(packet[-1] + 1)[packet]
            stamps = time_s[0] + (packet + 1) * self.burst * (time_s[1] - time_s[0]) + late_s
            stamps[kept] += self.inner_s * position
        if self.rounded_s:
            stamps = np.rint(stamps / self.rounded_s) * self.rounded_s
        return stamps[kept], kept


def swept(rate_hz: float, seed: int = 1, noise_rad_s: float = 5e-4, bias_rad_s: Array | None = None) -> Log:
    """Draw a table's sweeps of one revolution in 4 s, in six directions, with ramps outside their rows, and rests."""
    rng = np.random.default_rng(seed)
    period_s = 2 * REST_S + 2 * RAMP_S + 4.6
    time_s = np.arange(round((6 * period_s) * rate_hz)) / rate_hz
    cycle, since_s = np.divmod(time_s, period_s)
    speed = np.interp(since_s, np.cumsum([0, REST_S, RAMP_S, 4.6, RAMP_S, REST_S]), [0, 0, 1, 1, 0, 0]) * np.pi / 2
    rates = np.array(SIX_WAYS, dtype=float)[cycle.astype(int)] * speed[:, None]
    begin_s = period_s * np.arange(6)
    turns = [[start_s + 3.3, start_s + 7.3, *axis, np.pi / 2] for start_s, axis in zip(begin_s, SIX_WAYS, strict=True)]
    rests = [[start_s + 0.2, start_s + 1.8, 0, 0, 1, 0] for start_s in begin_s]
    return Log(time_s, _read(rates, rng, noise_rad_s, bias_rad_s), np.array(sorted(turns + rests)))


def turn_slowly(
    mean_rad_s: float, bias_rad_s: Array, seed: int = 1, rate_hz: float = 100.0, rest_s: float = 5.0
) -> Log:
    """Draw a servo's turns from rest to rest with a raised-cosine profile, in six directions."""
    rng = np.random.default_rng(seed)
    lasts_s = 2 * np.pi / mean_rad_s
    period_s = lasts_s + rest_s
    time_s = np.arange(round((6 * period_s + rest_s) * rate_hz)) / rate_hz
    cycle, since_s = np.divmod(time_s - rest_s, period_s)
    part = np.clip(since_s / lasts_s, 0, 1)
    speed = np.where(cycle < 0, 0, mean_rad_s * (1 - np.cos(2 * np.pi * part)))
    rates = np.array(SIX_WAYS, dtype=float)[np.clip(cycle, 0, 5).astype(int)] * speed[:, None]
    starts_s = rest_s + period_s * np.arange(6)
    rows = [[start_s, start_s + lasts_s, *axis, 2 * np.pi] for start_s, axis in zip(starts_s, SIX_WAYS, strict=True)]
    rows.insert(0, [0.2, rest_s - 0.1, 0, 0, 1, 0])
    return Log(time_s, _read(rates, rng, 5e-4, bias_rad_s), np.array(rows))


def _read(rates: Array, rng: np.random.Generator, noise_rad_s: float, bias_rad_s: Array | None) -> Array:
    bias = np.array([0.01, -0.02, 0.005]) if bias_rad_s is None else bias_rad_s
    read: Array = rates @ MATRIX.T + bias + noise_rad_s * rng.normal(size=rates.shape)
    return read


@dataclass(frozen=True)
class Knock:
    """A knock that an accelerometer senses in `samples` readings from number `sample` on, m/s² along an axis."""

    sample: int
    size_m_s2: float
    axis: int = 0
    samples: int = 1


def laid_down(
    rate_hz: float = 63.0,
    dwell_s: float = 30.0,
    knocks: tuple[Knock, ...] = (),
    seed: int = 1,
    noise_m_s2: float = 5e-3,
) -> Log:
    """Draw an accelerometer on six faces in one log, and rows [start_s, end_s, qw, qx, qy, qz] of the faces."""
    rng = np.random.default_rng(seed)
    count, move_s = round(dwell_s * rate_hz), 4.0
    start_s = np.arange(6, dtype=np.float64) * (dwell_s + move_s)
    time_s = (start_s[:, None] + np.arange(count) / rate_hz).ravel()
    forces = GRAVITY_M_S2 * np.repeat(FORCES, count, axis=0).astype(float)
    for knock in knocks:
        forces[knock.sample : knock.sample + knock.samples, knock.axis] += knock.size_m_s2
    read = forces @ MATRIX.T + [0.3, -0.1, 0.2] + noise_m_s2 * rng.normal(size=forces.shape)
    return Log(time_s, read, np.column_stack([start_s + 0.5, start_s + dwell_s - 0.5, FACES]))


def write_rates(folder: Path, log: Log, stamps: Stamps | None = None, motion: str = "speed_rad_s") -> tuple[Path, Path]:
    """Write the two files of `rig solve --sweeps`."""
    stamped_s, kept = (stamps or Stamps()).stamp(log.time_s)
    samples = write_table(
        folder / "samples.csv", ["time_s", *(f"{a}_rad_s" for a in AXES)], stamped_s, log.readings[kept]
    )
    return samples, write_table(
        folder / "sweeps.csv", ["start_s", "end_s", *(f"axis_{a}" for a in AXES), motion], log.rows
    )


def write_forces(folder: Path, log: Log, stamps: Stamps | None = None, *beside: tuple[str, Array]) -> tuple[Path, Path]:
    """Write the two files of `rig solve --attitudes`, with further columns (n,)."""
    stamped_s, kept = (stamps or Stamps()).stamp(log.time_s)
    names = ["time_s", *(f"{a}_m_s2" for a in AXES), *(name for name, _ in beside)]
    samples = write_table(
        folder / "samples.csv", names, stamped_s, log.readings[kept], *(column[kept] for _, column in beside)
    )
    return samples, write_table(folder / "attitudes.csv", ["start_s", "end_s", "qw", "qx", "qy", "qz"], log.rows)
