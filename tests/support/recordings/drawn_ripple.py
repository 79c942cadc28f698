"""The ripple and vibration of an arm's speed, drawn over all orders: 1 to 400 times a turn, 0 to 10 % of the rate.

Several lines are drawn: near each other, near a harmonic of the turn, or near an end of the searched band; from so
small that no check detects them to so large that every check does.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

MOST_ORDER = 400
MOST_FRACTION = 0.10
MOST_PEAK = 0.22  # of the rate: a sweep whose smoothed rate strays by 0.25 is refused
SLOWEST_LINE = 8  # times a turn; slower ones were never looked for
LEAST_HZ, MOST_HZ = 0.1, 200.0
UNSEEN_RAD_S, UNSEEN_ORDER = (2e-5, 4e-3), 4.0  # unseen slower vibrations are bias drift
SEEN_RAD_S, SEEN_ORDER = (2e-5, 3e-3), 1.3  # faster, and a standing arm is taken to move
FILTERED = 0.9  # of the data rate: a sensor's filter removes faster vibrations


@dataclass(frozen=True, slots=True)
class Ripple:
    """The ripple of an arm's speed, as a fraction of the rate, and its vibrations, RMS of each wrist, by frequency."""

    orders: Sequence[int]
    fraction: float
    unseen_rad_s: float
    unseen_hz: Sequence[float]
    seen_rad_s: float
    seen_hz: float


def make_keys(ripple: Ripple) -> dict[str, Any]:
    """Return the keys of `world.arm`."""
    return {
        "vibration_cycles_per_turn": list(ripple.orders),
        "vibration_fraction": ripple.fraction,
        "vibration_rms_rad_s": ripple.unseen_rad_s,
        "vibration_hz": ripple.unseen_hz[0],
        "vibration_further_hz": list(ripple.unseen_hz[1:]),
        "vibration_measured_rms_rad_s": ripple.seen_rad_s,
        "vibration_measured_hz": ripple.seen_hz,
    }


def drawn_ripple(rng: np.random.Generator, turn_hz: float, sample_rates_hz: Sequence[float]) -> Ripple:
    """Draw the ripple of an arm that makes `turn_hz` turns a second, for sensors read at `sample_rates_hz`."""
    orders = _orders(rng, [rate_hz / 2 / turn_hz for rate_hz in sample_rates_hz])
    most = min(MOST_FRACTION, MOST_PEAK / np.sqrt(2 * len(orders)))
    fastest_hz = min(MOST_HZ, FILTERED * min(sample_rates_hz))

    def hertz(slowest: float) -> float:
        return float(np.clip(_frequency(rng, orders, slowest) * turn_hz, LEAST_HZ, fastest_hz))

    unseen_hz = [hertz(UNSEEN_ORDER) for _ in range(int(rng.integers(1, 4)))]
    return Ripple(
        orders=orders,
        fraction=float(rng.uniform(0, most)),
        unseen_rad_s=_size(rng, UNSEEN_RAD_S),
        unseen_hz=unseen_hz,
        seen_rad_s=_size(rng, SEEN_RAD_S),
        seen_hz=hertz(SEEN_ORDER),
    )


def _orders(rng: np.random.Generator, nyquist: Sequence[float]) -> list[int]:
    match int(rng.integers(4)):
        case 0:
            orders = [_order(rng) for _ in range(int(rng.integers(1, 6)))]
        case 1:
            first = _order(rng)
            orders = [first, first + int(rng.integers(1, 4)), *(_order(rng) for _ in range(int(rng.integers(0, 3))))]
        case 2:
            slow = rng.integers(1, SLOWEST_LINE + 2, int(rng.integers(1, 4))).tolist()
            orders = [*slow, *(_order(rng) for _ in range(int(rng.integers(1, 3))))]
        case _:
            ends = [SLOWEST_LINE, *nyquist, *(2 * end for end in nyquist)]
            orders = [round(ends[int(rng.integers(len(ends)))]) + int(rng.integers(-2, 3)), _order(rng)]
    return sorted({min(max(order, 1), MOST_ORDER) for order in orders})


def _order(rng: np.random.Generator) -> int:
    return round(float(np.exp(rng.uniform(0, np.log(MOST_ORDER)))))


def _frequency(rng: np.random.Generator, orders: Sequence[int], slowest: float) -> float:
    """Draw an order (times a turn): any, or near one of the ripple's orders."""
    order = float(np.exp(rng.uniform(np.log(slowest), np.log(MOST_ORDER))))
    if rng.random() < 0.4:
        order = slowest + abs(orders[int(rng.integers(len(orders)))] + float(rng.uniform(-2, 2)) - slowest)
    return order


def _size(rng: np.random.Generator, bounds: tuple[float, float]) -> float:
    return float(np.exp(rng.uniform(*np.log(bounds))))
