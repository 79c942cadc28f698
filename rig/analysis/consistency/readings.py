"""Whether readings are what a converter makes of a noisy quantity: their bits, their range, their repetitions. Pure.

Noise above one step sets every low bit as often as not, has no gap and no heap at an end of its range, no run of equal
readings and no two stretches alike. Where the noise is below a step none of this can be said, and nothing is. A step is
that of the source: a count of a converter, a unit of a message that holds whole numbers, the last digit of a line.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.consistency.raw_readings import MEMORY, RawReadings, innovation_std
from rig.observation.steps_that_count import SPIKE

Statistics = dict[str, tuple[float, float]]

CHECKS = ("clipping", "repeated_readings", "skewed_noise", "spikes", "stuck_axis", "stuck_bit")  # of a sensor, at most
SKEWNESS = 0.15  # below, hardly a fiftieth of the noise's deviation is left in a mean
LONGEST_RUN = 25  # equal readings of one axis: at one step of noise every fourth reading equals the one before
STRETCH = 8  # readings on three axes, some 50 bits at one step of noise
FEWEST_VALUES = 24  # of an axis, to say that a bit ought to have changed
ONE_BIT = 0.8  # of the spikes off by the same power of two: they are a bit's doing
FEWEST_SPIKES = 5
SINGLE = 21  # bits that a number in single precision sets as often as not; its last three it rounds
FEWEST_OF_NOISE = 4 * MEMORY  # readings of a window that tell their noise
VIBRATION_LEFT = 0.1  # of the arm's vibration, which the sensor's filter changes and the arm's states tell in part
HEAP = 10  # readings
SETTLING = 5  # readings at a window's beginning, in which a low-pass filter may still follow the arm
CHECKS = (
    "clipping",
    "repeated_readings",
    "skewed_noise",
    "spikes",
    "stuck_axis",
    "stuck_bit",
)  # of one sensor, at most
LEAST_TO_SKEW = 0.7  # steps of noise: less falls on so few numbers that a mean between two of them makes it skewed
BETWEEN_COUNTS = 1.5  # counts: readings that are farther apart are not a converter's


@dataclass(frozen=True, slots=True)
class Digits:
    """What recorded numbers of a source are: the `steps` of counts in which they come, and whether they have bits."""

    has_bits: bool
    steps: Steps

    @property
    def step_counts(self) -> Array:
        """(3,) how many counts neighbouring numbers are apart, at most."""
        return self.steps.units * (2 if self.steps.cut else 1)


COUNTS = Digits(True, Steps(1.0))


def digits_of(sensor: RecordedSensor, quantity: Quantity, samples: Sequence[NDArray[Any]]) -> Digits:
    """Return what the numbers of a sensor's quantity are, by all its samples (n,) of each recording.

    A board records the counts of the part's converter, whatever they are. What other sources send they have calculated
    or printed: where that comes in steps of several recorded counts, these have no bits to judge.
    """
    channel = sensor.channel(quantity)
    steps = channel.steps(np.concatenate([channel.values(each) for each in samples]), trusts_counts=sensor.on_board)
    counts = replace(steps, unit=np.maximum(steps.units / channel.unit_per_count, 1.0))
    has_bits = not steps.cut and (sensor.on_board or bool(counts.units.max() <= BETWEEN_COUNTS))
    return Digits(has_bits, counts)


def judge_readings(
    counts: Sequence[NDArray[np.int64]],
    windows: Sequence[RawReadings],
    rate: float,
    *,
    digits: Digits = COUNTS,
    frozen: int = 0,
) -> Statistics:
    """Every check's statistic and limit by its name, from all readings (n, 3) of each recording and from the windows.

    `rate` is that of false alarms for each, where it is not far smaller. The noise is the median of
    the windows': one in which an axis stands still does not make it a sensor without noise. `frozen` is the longest run
    of equal readings of an axis that moved meanwhile.
    """
    from scipy.special import ndtri

    sure = -float(ndtri(rate / (2 * 3 * 16)))  # of a normal variable, over three axes and their bits
    at_rest = [window for window in windows if window.sweep < 0] or windows
    noises = [innovation_std(window.counts) for window in at_rest]
    noise = np.asarray(np.median(noises, axis=0), dtype=np.float64)
    steps_of_noise = noise / digits.step_counts
    noisy = steps_of_noise >= 1
    spikes, of_a_bit = _spikes(windows, digits.step_counts)
    found = {"spikes": (spikes, SPIKE)}
    if digits.has_bits:
        stuck = _constant_bits(np.concatenate(counts)) + _uneven_bits(windows, noise, sure) + of_a_bit
        found = {"stuck_bit": (float(stuck), 0.0), **found}
    assess_identifiability = steps_of_noise >= LEAST_TO_SKEW
    if any(window.sweep < 0 for window in windows) and assess_identifiability.any():
        found["skewed_noise"] = _skewness(at_rest, assess_identifiability, sure)
    runs = [_longest_run(each[:, noisy]) for each in counts]
    found["stuck_axis"] = float(max(frozen, *runs)), LONGEST_RUN
    if noisy.all():
        found["repeated_readings"] = sum(map(_repeated, counts)), 0.0
        turning = [window for window in windows if window.sweep >= 0] or windows
        found["clipping"] = _heaped(np.concatenate([each.counts for each in turning]), sure), 0.0
    return found


def _constant_bits(counts: NDArray[np.int64]) -> int:
    """How many bits, over the axes, never change although the readings reach far enough to change them."""
    constant = 0
    for axis in counts.T:
        if len(np.unique(axis)) < FEWEST_VALUES:
            continue
        bits = [bit for bit in range(16) if 2 ** (bit + 2) <= np.ptp(axis)]
        constant += sum(int(np.ptp((axis >> bit) & 1) == 0) for bit in bits)
    return constant


def _uneven_bits(windows: Sequence[RawReadings], noise: Array, sure: float) -> int:
    """How many bits, far enough below the noise to be set in every other reading, are not."""
    uneven = 0
    counts = np.concatenate([window.counts for window in windows])
    for axis in range(3):
        first = int(np.abs(counts[:, axis]).max()).bit_length() - SINGLE
        for bit in range(max(first, 0), 16):
            if 1.5 * 2**bit > noise[axis]:
                break
            ones = float(np.mean((counts[:, axis] >> bit) & 1))
            uneven += abs(ones - 0.5) > sure * 0.5 / np.sqrt(len(counts))
    return uneven


def _spikes(windows: Sequence[RawReadings], step_counts: Array) -> tuple[float, int]:
    """The farthest reading in standard deviations of the noise, and how many bits, over the axes, make such.

    The noise is half a step at least. The first readings are left out: the filter of a quiet sensor has not settled.
    """
    half = step_counts / 2
    farthest, sizes = 0.0, [[], [], []]  # type: float, list[list[Array]]
    offs = [(window.residual_counts - np.median(window.residual_counts, axis=0))[SETTLING:] for window in windows]
    noises = [np.maximum(1.4826 * np.median(np.abs(off), axis=0), half) for off in offs]
    assess_identifiability = [noise for off, noise in zip(offs, noises, strict=True) if len(off) >= FEWEST_OF_NOISE]
    least = np.min(assess_identifiability or [half], axis=0)  # a short rest, as of an interrupted run, tells too little
    for window, off, own in zip(windows, offs, noises, strict=True):
        noise = np.maximum(own, least)
        deviation = np.maximum(noise, VIBRATION_LEFT * window.vibration_counts)
        farthest = max(farthest, float(np.max(np.abs(off) / deviation)))
        for axis in range(3):
            beyond = np.abs(off[:, axis]) > SPIKE * deviation[axis]
            power = np.round(np.log2(np.maximum(np.abs(off[beyond, axis]), 1)))
            near = np.abs(np.abs(off[beyond, axis]) - 2**power) < np.maximum(3 * deviation[axis], 0.05 * 2**power)
            sizes[axis].append(np.where(near, power, -1))
    return farthest, sum(_one_bit(np.concatenate(each)) for each in sizes)


def _one_bit(powers: Array) -> bool:
    """Whether most spikes, each off by a power of two or by none (−1), are off by the same."""
    if len(powers) < FEWEST_SPIKES:
        return False
    which, often = np.unique(powers, return_counts=True)
    most = int(np.argmax(often))
    return bool(which[most] >= 0 and often[most] >= ONE_BIT * len(powers))


def _skewness(windows: Sequence[RawReadings], axes: NDArray[np.bool_], sure: float) -> tuple[float, float]:
    """The largest skewness of the noise of such axes (3,), which a bit that is now and then wrong makes, and a limit.

    At rest: the arm's vibration need not be even.
    """
    parts = [window.residual_counts / np.maximum(window.residual_counts.std(axis=0), 0.5) for window in windows]
    noise = np.concatenate(parts)
    noise -= noise.mean(axis=0)
    spread = np.sqrt(np.maximum(np.mean(noise**2, axis=0), 1e-12))  # an axis may stand still
    skewness = np.mean((noise / spread) ** 3, axis=0)  # by hand: scipy.stats takes half a second to import
    return float(np.max(np.abs(skewness[axes]))), max(SKEWNESS, sure * float(np.sqrt(6 / len(noise))))


def _longest_run(counts: NDArray[np.int64]) -> int:
    """How many equal readings of one axis follow each other, at most."""
    longest = 0
    for axis in counts.T:
        changes = np.flatnonzero(np.diff(axis))
        longest = max(longest, int(np.max(np.diff(changes, prepend=-1, append=len(axis) - 1))))
    return longest


def _repeated(counts: NDArray[np.int64]) -> int:
    """How many stretches of readings have been there before."""
    stretches = np.lib.stride_tricks.sliding_window_view(counts.astype(np.int16), STRETCH, axis=0)
    rows = np.ascontiguousarray(stretches.reshape(len(stretches), -1))
    return len(rows) - len(np.unique(rows.view(f"V{rows.shape[1] * 2}")))


def _heaped(counts: NDArray[np.int64], sure: float) -> int:
    """How many readings stand at the very end of what an axis reads, where more do than next to it; else none."""
    heaped = 0
    for axis in counts.T:
        values, often = np.unique(axis, return_counts=True)
        for end, beside in ((often[0], often[1]), (often[-1], often[-2])) if len(values) > 1 else ():
            if end >= HEAP and end - beside > sure * np.sqrt(end + beside):
                heaped += int(end)
    return heaped
