"""Recordings of a sensor on a box that the simulated hand turns: readings as CSV, and the truth."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rig.estimation.arrays import Array
from rig.world.hand.habits import FLIPS, Action, FlipAction, Habits, TurnAction
from rig.world.hand.hand import SimulatedHand
from support.external.csv_tables import write_table

TWELVE: tuple[Action, ...] = tuple(FlipAction(face) for face in FLIPS)
SIX_TURNS: tuple[Action, ...] = (
    TurnAction(1),
    *(action for face in ("+x", "+y", "-z", "-x", "-y") for action in (FlipAction(face), TurnAction(1))),
)
# Three faces, a turn either way on each.
BOTH_WAYS: tuple[Action, ...] = (
    TurnAction(1),
    TurnAction(-1),
    FlipAction("+x"),
    TurnAction(1),
    TurnAction(-1),
    FlipAction("+y"),
    TurnAction(1),
    TurnAction(-1),
)
RATE, LEVEL = ("x_rad_s", "y_rad_s", "z_rad_s"), ("x_m_s2", "y_m_s2", "z_m_s2")


@dataclass(frozen=True)
class Part:
    """A sensor by its data sheet, read at `rate_hz`; its clock has an error of up to `clock_ppm`."""

    rate_hz: float = 119.0
    noise_rad_s: float = 1e-3
    noise_m_s2: float = 0.01
    walk_rad_s_sqrt_s: float = 5e-6
    g_sensitivity_deg_s: float = 0.03
    nonlinearity: float = 7e-5  # of the rate at `FAST_RAD_S`, even, and odd: of a move 1e-4
    clock_ppm: float = 20.0
    range_rad_s: float | None = None


LSM9DS1 = Part()
FAST_RAD_S = np.radians(150)  # as fast as a hand turns, half of the way


@dataclass(frozen=True)
class Recorded:
    """Readings (n, 3) at `time_s` (n,), the gyroscope's F (3, 3), and its bias (3,) at the end."""

    time_s: Array
    rates: Array
    acceleration: Array
    matrix: Array
    bias: Array

    @property
    def truth(self) -> Array:
        """Return k and b (6,) of g = K (m + b)."""
        return np.concatenate([1 / np.linalg.norm(self.matrix, axis=1), -self.bias])


def handle(
    actions: Sequence[Action], seed: int, part: Part = LSM9DS1, habits: Habits | None = None, rest_s: float = 1.2
) -> Recorded:
    rng = np.random.default_rng(seed + 1_000_000)
    hand, now_s = SimulatedHand(habits or Habits(), seed), 1.5
    for action in actions:
        now_s = hand.act(action, now_s) + rest_s
    time_s = np.arange(0, now_s, 1 / part.rate_hz)
    sensed = hand.motion_at(time_s)
    matrix, bias = np.eye(3) + 0.02 * rng.normal(size=(3, 3)), 0.01 * rng.normal(size=3)
    walk = part.walk_rad_s_sqrt_s / np.sqrt(part.rate_hz) * np.cumsum(rng.normal(size=(len(time_s), 3)), axis=0)
    sensitivity = np.radians(part.g_sensitivity_deg_s) / 9.81 * rng.normal(size=(3, 3))
    rates = (
        sensed.rate_rad_s @ matrix.T + sensed.specific_force_m_s2 @ sensitivity.T + bias + walk + sensed.gyro_bias_rad_s
    )
    rates += bent(sensed.rate_rad_s, part.nonlinearity, seed)
    rates += part.noise_rad_s * rng.normal(size=rates.shape)
    if part.range_rad_s is not None:
        rates = np.clip(rates, -part.range_rad_s, part.range_rad_s)
    level, offset = np.eye(3) + 0.01 * rng.normal(size=(3, 3)), 0.3 * rng.normal(size=3)
    force = sensed.specific_force_m_s2 @ level.T + offset + sensed.accelerometer_bias_m_s2
    force += part.noise_m_s2 * rng.normal(size=force.shape)
    stamped = time_s * (1 + 1e-6 * part.clock_ppm * rng.uniform(-1, 1))
    kept = ~sensed.lost
    return Recorded(stamped[kept], rates[kept], force[kept], matrix, bias + walk[-1] + sensed.gyro_bias_rad_s[-1])


def creeping(recorded: Recorded, start_s: float, end_s: float, turning_rad_s: Array) -> Recorded:
    """Return the recording of a body that turned slowly (3,) in a rest; the hand then turns it back."""
    rates = recorded.rates.copy()
    mask = (recorded.time_s >= start_s) & (recorded.time_s <= end_s)
    after = (recorded.time_s > end_s) & (recorded.time_s <= end_s + 0.15)
    rates[mask] += turning_rad_s
    rates[after] -= turning_rad_s * mask.sum() / after.sum()
    return replace(recorded, rates=rates)


def bent(rates: Array, nonlinearity: float, seed: int) -> Array:
    """Return deviations (n, 3) from a straight line: each axis has an even and an odd one, of different sizes."""
    even, odd = nonlinearity * np.random.default_rng(seed + 2_000_000).normal(size=(2, 3))
    deviations: Array = rates * (even * rates / FAST_RAD_S + odd * (rates / FAST_RAD_S) ** 2)
    return deviations


def write(path: Path, recorded: Recorded, *, level: bool = True) -> Path:
    """Write the file of `rig solve --turns`, with or without the accelerometer's columns."""
    columns = ("time_s", *RATE, *(LEVEL if level else ()))
    readings = np.hstack([recorded.rates, recorded.acceleration]) if level else recorded.rates
    return write_table(path, columns, recorded.time_s, readings)
