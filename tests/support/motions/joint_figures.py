"""Figures of an arm's joints, read from the states that its controller sent: the same for real and simulated arms.

Times in s, angles in rad, rates in rad/s; one joint at a time, unless an array of all is stated.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
ORDERS = np.arange(20, 451)  # cycles a turn


@dataclass(frozen=True)
class RestNoise:
    """The noise of an angle at rest: standard deviation, correlation of neighbours, smallest step between values."""

    std_rad: float
    correlation: float
    step_rad: float


def rest_noise(q_rad: Array) -> RestNoise:
    """Return the noise of the angles (n,) of a joint at rest."""
    residuals = q_rad - q_rad.mean()
    power = float(residuals @ residuals)
    steps = np.diff(np.unique(q_rad))
    steps = steps[steps > 1e-8]  # less is the rounding of decimals
    return RestNoise(
        float(residuals.std(ddof=1)),
        float(residuals[1:] @ residuals[:-1]) / power if power else 0.0,
        float(steps.min()) if len(steps) else 0.0,
    )


@dataclass(frozen=True)
class SpeedRipple:
    """The ripple of a joint's rate: RMS, relative to the rate too, and amplitudes of `ORDERS` in rad/s."""

    rms_rad_s: float
    fraction: float
    amplitudes_rad_s: Array

    def strongest(self, low: int, high: int) -> int:
        """Return the strongest order in this range."""
        within = (low <= ORDERS) & (high >= ORDERS)
        return int(ORDERS[within][np.argmax(self.amplitudes_rad_s[within])])

    def peaks(self, count: int) -> list[int]:
        """Return the strongest orders, at least ten apart from each other."""
        orders: list[int] = []
        for order in ORDERS[np.argsort(self.amplitudes_rad_s)[::-1]]:
            if all(abs(order - other) > 10 for other in orders):
                orders.append(int(order))
        return orders[:count]


def speed_ripple(q_rad: Array, qd_rad_s: Array, smooth_rad_s: Array) -> SpeedRipple:
    """Return the ripple of the rates (n,) about the `smooth` ones, at the angles `q_rad`.

    Each order is fitted by itself: a cosine and a sine of that multiple of the angle, by least squares.
    """
    residuals = qd_rad_s - smooth_rad_s
    residuals = residuals - residuals.mean()
    amplitudes = []
    for order in ORDERS:
        waves = np.column_stack([np.cos(order * q_rad), np.sin(order * q_rad)])
        amplitudes.append(np.hypot(*np.linalg.lstsq(waves, residuals, rcond=None)[0]))
    rms = float(residuals.std())
    return SpeedRipple(rms, rms / float(np.abs(smooth_rad_s).mean()), np.array(amplitudes))


def band_rms(q_rad: Array, residuals_rad_s: Array, orders: Sequence[int]) -> float:
    """Return the RMS of the rates' residuals explained by all `orders` together, less that explained by noise."""
    waves = np.column_stack([wave(order * q_rad) for order in orders for wave in (np.cos, np.sin)])
    fitted = waves @ np.linalg.lstsq(waves, residuals_rad_s, rcond=None)[0]
    residuals = residuals_rad_s - fitted
    n, p = waves.shape
    noise = p * float(residuals @ residuals) / (n - p)
    return float(np.sqrt(max(0.0, float(fitted @ fitted) - noise) / n))


def smooth_sine(time_s: Array, qd_rad_s: Array, period_s: float, harmonics: int = 19) -> Array:
    """Return the smooth part of the rates (n,) of a joint that oscillates: a line and harmonics of the period."""
    waves = [wave(2 * np.pi * h * time_s / period_s) for h in range(1, harmonics + 1) for wave in (np.cos, np.sin)]
    design = np.column_stack([np.ones(len(time_s)), time_s, *waves])
    smooth: Array = design @ np.linalg.lstsq(design, qd_rad_s, rcond=None)[0]
    return smooth


def following_lag_s(q_rad: Array, target_q_rad: Array, target_qd_rad_s: Array, target_qdd_rad_s2: Array) -> float:
    """Return a joint's lag, s: the part of its following error (n,) that is proportional to rate.

    Parts proportional to acceleration and a constant are fitted too.
    """
    design = np.column_stack([target_qd_rad_s, target_qdd_rad_s2, np.ones(len(q_rad))])
    return float(np.linalg.lstsq(design, target_q_rad - q_rad, rcond=None)[0][0])


@dataclass(frozen=True)
class Settling:
    """The end of a move: the extreme rate against its direction, and the time until it stayed below a rate of rest."""

    back_rad_s: float
    duration_s: float


def settling(time_s: Array, target_qd_rad_s: Array, qd_rad_s: Array, rest_rad_s: float) -> Settling:
    """Return how a joint settles after the last moment in which its target moves."""
    last = int(np.flatnonzero(np.abs(target_qd_rad_s) > 1e-6)[-1])
    after = slice(last + 1, None)
    directed_rad_s = qd_rad_s[after] * np.sign(target_qd_rad_s[last])
    restless = np.flatnonzero(np.abs(directed_rad_s) > rest_rad_s)
    duration_s = float(time_s[after][restless[-1]] - time_s[last + 1]) if len(restless) else 0.0
    return Settling(float(directed_rad_s.min()), duration_s)


@dataclass(frozen=True)
class GentleStart:
    """How long the acceleration grows from zero, and its greatest value over the one that follows."""

    duration_s: float
    overshoot: float


def gentle_start(time_s: Array, target_qd_rad_s: Array) -> GentleStart | None:
    """Return the start of a move whose target speeds (n,) begin with it; None if it starts at its full acceleration."""
    acceleration = np.abs(np.diff(target_qd_rad_s) / np.diff(time_s))
    if len(acceleration) < 10:
        return None
    peak = int(np.argmax(acceleration[: len(acceleration) // 2]))
    following = float(np.median(acceleration[peak + 2 : peak + 12]))
    if acceleration[1] > 0.5 * following or not following:
        return None
    return GentleStart(float(time_s[peak + 1] - time_s[0]), float(acceleration[peak] / following))
