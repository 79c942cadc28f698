"""Tests of readings as the output of a converter with a noisy input: their bits, range and repetitions. Pure functions.

If the noise exceeds one step, a healthy converter sets every low bit in half of its readings, and there is no gap, no
pile-up at an end of the range, no run of equal readings and no repeated sequence. With less noise, a healthy converter
may show these too. A step is the resolution of the source: one count of a converter, one unit of an integer message,
the last digit of a printed number.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.arrays import MAD_TO_STD, Array, median
from rig.estimation.statistics.rounding import Steps
from rig.observation.consistency.raw_readings import PREDICTOR_ORDER, RawReadings, innovation_std
from rig.observation.sound_steps import SPIKE_STDS

Statistics = dict[str, tuple[float, float]]

# The checks of one sensor, at most.
CHECKS = ("clipping", "repeated_readings", "skewed_noise", "spikes", "stuck_axis", "stuck_bit")
SKEWNESS_LIMIT = 0.15  # a smaller skewness shifts a mean by hardly a fiftieth of the noise's standard deviation
MAX_EQUAL_READINGS = 25  # in a row on one axis: if the noise is one step, every fourth reading equals the one before
PATTERN_READINGS = 8  # readings on three axes: they have some 50 random bits if the noise is one step
MIN_DISTINCT_VALUES = 24  # of an axis: with as many, every bit should have changed
MIN_SAME_BIT_FRACTION = 0.8  # of the spikes with the same power of two: one bit causes them
MIN_SPIKES = 5
SINGLE_PRECISION_BITS = 21  # bits of a number in single precision that are random; the last three are rounded
MIN_NOISE_READINGS = 4 * PREDICTOR_ORDER  # of a window whose noise is estimated
# Fraction of the arm's vibration that may remain: the sensor's filter changes it, and the arm's states show it in part.
MAX_RESIDUAL_VIBRATION = 0.1
MIN_CLIPPED_READINGS = 10  # at one end of the range
BURST_READINGS = 4  # readings before and after one that show a burst of vibration
SETTLING_READINGS = 5  # first readings of a window, during which a low-pass filter may still follow the arm
MIN_NOISE_STEPS = 0.7  # smaller noise has so few values that a mean between two of them makes it skewed
MAX_STEP_COUNTS = 1.5  # readings in larger steps are not those of a converter


@dataclass(frozen=True, slots=True)
class Digits:
    """The resolution of recorded numbers: their `steps` in counts, and if their bits can be tested (`has_bits`)."""

    has_bits: bool
    steps: Steps

    @property
    def step_counts(self) -> Array:
        """The largest range (3,) of values that one recorded number may represent, in counts."""
        return self.steps.units * (2 if self.steps.cut else 1)


CONVERTER_DIGITS = Digits(True, Steps(1.0))


def find_digits(sensor: RecordedSensor, quantity: Quantity, samples: Sequence[NDArray[Any]]) -> Digits:
    """Return the resolution of a quantity's recorded numbers, from all `samples` (n,) of each recording.

    Steps are at least one count. A board sends the counts of the converter, so their bits can be tested. Other sources
    send computed or printed numbers, whose bits mean nothing if the numbers change in steps of several counts.
    """
    channel = sensor.channel(quantity)
    values = np.concatenate([channel.values(recorded) for recorded in samples])
    steps = channel.steps(values, trusts_counts=sensor.on_board)
    steps_counts = replace(steps, unit=np.maximum(steps.units / channel.unit_per_count, 1.0))
    are_counts = sensor.on_board or bool(steps_counts.units.max() <= MAX_STEP_COUNTS)
    return Digits(are_counts and not steps.cut, steps_counts)


def judge_readings(
    counts: Sequence[NDArray[np.int64]],
    windows: Sequence[RawReadings],
    false_alarm_probability: float,
    *,
    digits: Digits = CONVERTER_DIGITS,
    frozen: int = 0,
) -> Statistics:
    """Return a statistic and its limit for each check of a converter, by the check's name.

    `counts` are all readings (n, 3) of each recording, `windows` the readings in sweeps and rests. `frozen` is the
    number of readings in the longest run of equal readings of an axis during motion. A statistic of a healthy converter
    exceeds its limit with at most the given false-alarm probability.
    """
    from scipy.special import ndtri

    # For a normal variable, two-sided, over three axes and their bits.
    critical_value = -float(ndtri(false_alarm_probability / (2 * 3 * 16)))
    at_rest = [window for window in windows if window.sweep < 0] or windows
    noises = [innovation_std(window.counts) for window in at_rest]
    noise = median(np.array(noises), axis=0)  # not zero if an axis is stuck in a few windows only
    steps_of_noise = noise / digits.step_counts
    noisy = steps_of_noise >= 1
    spikes, spike_bits = _find_spikes(windows, digits.step_counts)
    statistics = {"spikes": (spikes, SPIKE_STDS)}
    if digits.has_bits:
        stuck = (
            _count_constant_bits(np.concatenate(counts))
            + _count_uneven_bits(windows, noise, critical_value)
            + spike_bits
        )
        statistics = {"stuck_bit": (float(stuck), 0.0), **statistics}
    informative = steps_of_noise >= MIN_NOISE_STEPS
    if any(window.sweep < 0 for window in windows) and informative.any():
        statistics["skewed_noise"] = _skewness(at_rest, informative, critical_value)
    runs = [_longest_run(recorded[:, noisy]) for recorded in counts]
    statistics["stuck_axis"] = float(max(frozen, *runs)), MAX_EQUAL_READINGS
    if noisy.all():
        statistics["repeated_readings"] = sum(map(_count_repeated, counts)), 0.0
        turning = [window for window in windows if window.sweep >= 0] or windows
        statistics["clipping"] = (
            _count_heaped(np.concatenate([window.counts for window in turning]), critical_value),
            0.0,
        )
    return statistics


def _count_constant_bits(counts: NDArray[np.int64]) -> int:
    """Count the bits of all axes that never change, although the range of the readings is wide enough for a change."""
    constant = 0
    for axis in counts.T:
        if len(np.unique(axis)) < MIN_DISTINCT_VALUES:
            continue
        bits = [bit for bit in range(16) if 2 ** (bit + 2) <= np.ptp(axis)]
        constant += sum(int(np.ptp((axis >> bit) & 1) == 0) for bit in bits)
    return constant


def _count_uneven_bits(windows: Sequence[RawReadings], noise: Array, critical_value: float) -> int:
    """Count the bits, over all axes, that are worth less than the noise but not set in about half of the readings."""
    uneven = 0
    counts = np.concatenate([window.counts for window in windows])
    for axis in range(3):
        first = int(np.abs(counts[:, axis]).max()).bit_length() - SINGLE_PRECISION_BITS
        for bit in range(max(first, 0), 16):
            if 1.5 * 2**bit > noise[axis]:
                break
            ones = float(np.mean((counts[:, axis] >> bit) & 1))
            uneven += abs(ones - 0.5) > critical_value * 0.5 / np.sqrt(len(counts))
    return uneven


def _find_spikes(windows: Sequence[RawReadings], step_counts: Array) -> tuple[float, int]:
    """Return the largest deviation relative to noise, and the number of axes with a bit that flips.

    If most spikes of an axis have the size of the same power of two, a bit flips. The noise includes vibration and is
    at least half a step. The first readings of a window are omitted, because the sensor's filter has not settled.
    """
    half = step_counts / 2
    farthest, sizes = 0.0, [list[Array]() for _ in range(3)]
    deviations_by_window = [
        (window.residual_counts - median(window.residual_counts, axis=0))[SETTLING_READINGS:] for window in windows
    ]
    noises = [np.maximum(MAD_TO_STD * median(np.abs(deviations), axis=0), half) for deviations in deviations_by_window]
    informative = [
        noise
        for deviations, noise in zip(deviations_by_window, noises, strict=True)
        if len(deviations) >= MIN_NOISE_READINGS
    ]
    least = np.min(informative or [half], axis=0)  # a short rest, such as that of an interrupted run, shows too little
    for window, deviations, noise_of_window in zip(windows, deviations_by_window, noises, strict=True):
        noise = np.maximum(noise_of_window, least)
        deviation = np.maximum(noise, MAX_RESIDUAL_VIBRATION * window.vibration_counts)
        scatter = np.maximum(deviation, _find_scatter_around(deviations) if window.sweep >= 0 else 0.0)
        farthest = max(farthest, float(np.max(np.abs(deviations) / scatter)))
        for axis in range(3):
            beyond = np.abs(deviations[:, axis]) > SPIKE_STDS * deviation[axis]
            power = np.round(np.log2(np.maximum(np.abs(deviations[beyond, axis]), 1)))
            near = np.abs(np.abs(deviations[beyond, axis]) - 2**power) < np.maximum(
                3 * deviation[axis], 0.05 * 2**power
            )
            sizes[axis].append(np.where(near, power, -1))  # -1: no power of two
    return farthest, sum(_is_one_bit(np.concatenate(powers)) for powers in sizes)


def _find_scatter_around(deviations: Array) -> Array:
    """Return for each reading the scatter (n, 3) of the readings around it, which is large in a burst of vibration."""
    sizes = np.pad(np.abs(deviations), ((BURST_READINGS, BURST_READINGS), (0, 0)), mode="reflect")
    around = np.lib.stride_tricks.sliding_window_view(sizes, 2 * BURST_READINGS + 1, axis=0)
    scatter: Array = MAD_TO_STD * median(around)
    return scatter


def _is_one_bit(powers: Array) -> bool:
    """Return whether most spikes have the same size 2ᵖ; `powers` (n,) are p, or −1 for spikes of other sizes."""
    if len(powers) < MIN_SPIKES:
        return False
    which, often = np.unique(powers, return_counts=True)
    most = int(np.argmax(often))
    return bool(which[most] >= 0 and often[most] >= MIN_SAME_BIT_FRACTION * len(powers))


def _skewness(windows: Sequence[RawReadings], axes: NDArray[np.bool_], critical_value: float) -> tuple[float, float]:
    """Return the largest skewness of the noise of any of the `axes`, and its limit; bit errors make noise skewed.

    The `windows` are at rest, because vibration of a moving arm may be skewed.
    """
    parts = [window.residual_counts / np.maximum(window.residual_counts.std(axis=0), 0.5) for window in windows]
    noise = np.concatenate(parts)
    noise -= noise.mean(axis=0)
    std = np.sqrt(np.maximum(np.mean(noise**2, axis=0), 1e-12))  # an axis may stand still
    skewness = np.mean((noise / std) ** 3, axis=0)  # computed here: scipy.stats takes half a second to import
    return float(np.max(np.abs(skewness[axes]))), max(SKEWNESS_LIMIT, critical_value * float(np.sqrt(6 / len(noise))))


def _longest_run(counts: NDArray[np.int64]) -> int:
    """Return the number of readings in the longest run of equal readings of any axis."""
    longest = 0
    for axis in counts.T:
        changes = np.flatnonzero(np.diff(axis))
        longest = max(longest, int(np.max(np.diff(changes, prepend=-1, append=len(axis) - 1))))
    return longest


def _count_repeated(counts: NDArray[np.int64]) -> int:
    """Count the sequences of `PATTERN_READINGS` consecutive readings that repeat an earlier sequence."""
    patterns = np.lib.stride_tricks.sliding_window_view(counts.astype(np.int16), PATTERN_READINGS, axis=0)
    rows = np.ascontiguousarray(patterns.reshape(len(patterns), -1))
    return len(rows) - len(np.unique(rows.view(f"V{rows.shape[1] * 2}")))


def _count_heaped(counts: NDArray[np.int64], critical_value: float) -> int:
    """Count the readings at an axis' extreme values, if they clearly outnumber those at the adjacent value."""
    heaped = 0
    for axis in counts.T:
        values, often = np.unique(axis, return_counts=True)
        for end, next_to_end in ((often[0], often[1]), (often[-1], often[-2])) if len(values) > 1 else ():
            if end >= MIN_CLIPPED_READINGS and end - next_to_end > critical_value * np.sqrt(end + next_to_end):
                heaped += int(end)
    return heaped
