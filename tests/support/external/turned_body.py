"""A gyroscope that a hand turns about the edges of a box and lays down in between; no code is shared with the rig.

Every turn consists of pushes of a raised cosine about an axis tilted a little in the body, and ends with an error.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.estimation.arrays import Array
from support.external.csv_tables import write_table

REST_S, PAUSE_S = 1.5, 0.15


@dataclass(frozen=True)
class Hand:
    """Turns by `angle_rad` about each of `axes` (w, 3), `fastest_rad_s` at most, read at `rate_hz`.

    A turn ends with an error of `ends_rad` about each axis; its axis is tilted by `leans_rad`.
    """

    axes: Array
    angle_rad: float = 2 * np.pi
    pushes: int = 4
    fastest_rad_s: float = 5.0
    rate_hz: float = 100.0
    noise_rad_s: float = 1e-3
    ends_rad: float = float(np.radians(0.3))
    leans_rad: float = 0.02


@dataclass(frozen=True)
class Session:
    """Readings (n, 3) at `time_s` (n,), rows [start_s, end_s, axis, angle_rad] as a person marks them, the truth."""

    time_s: Array
    readings: Array
    rows: Array
    matrix: Array
    bias: Array


def turn(hand: Hand, seed: int) -> Session:
    """Simulate a hand that turns a body about each axis in pushes; return the readings and the declared rows."""
    rng = np.random.default_rng(seed)
    pulses: list[tuple[float, float, Array]] = []  # beginning, length, angle about which axis
    now_s = REST_S
    rows = []
    rows.append([0.1, REST_S - 0.1, 0, 0, 0, 0.0])
    for axis in hand.axes:
        leant = axis + hand.leans_rad * across(axis, rng)
        start_s = now_s
        angle = hand.angle_rad + hand.ends_rad * rng.normal()
        for part in rng.dirichlet(np.full(hand.pushes, 20.0)):
            lasting_s = 2 * part * angle / (hand.fastest_rad_s * rng.uniform(0.7, 1.0))
            pulses.append((now_s, lasting_s, part * angle * leant / np.linalg.norm(leant)))
            now_s += lasting_s + PAUSE_S
        pulses.append((now_s - PAUSE_S, PAUSE_S, hand.ends_rad * across(axis, rng)))  # put down
        rows.append([start_s, now_s - PAUSE_S, *axis, hand.angle_rad])
        rows.append([now_s + 0.3, now_s + REST_S - 0.1, 0, 0, 0, 0.0])
        now_s += REST_S
    time_s = np.arange(0, now_s, 1 / hand.rate_hz)
    rates = np.zeros((len(time_s), 3))
    for start_s, lasting_s, about in pulses:
        part = np.clip((time_s - start_s) / lasting_s, 0, 1)
        rates += np.outer((1 - np.cos(2 * np.pi * part)) / lasting_s, about)
    matrix = np.eye(3) + 0.02 * rng.normal(size=(3, 3))
    bias = 0.01 * rng.normal(size=3)
    readings = rates @ matrix.T + bias + hand.noise_rad_s * rng.normal(size=rates.shape)
    return Session(time_s, readings, np.array(rows), matrix, bias)


def across(axis: Array, rng: np.random.Generator) -> Array:
    """Draw a vector (3,) at right angles to an axis, with normally distributed components."""
    drawn = rng.normal(size=3)
    return np.asarray(drawn - axis * (axis @ drawn), dtype=np.float64)


def write(folder: Path, session: Session) -> tuple[Path, Path]:
    """Write the two files of `rig solve --sweeps`."""
    columns = ("time_s", "x_rad_s", "y_rad_s", "z_rad_s")
    samples = write_table(folder / "samples.csv", columns, session.time_s, session.readings)
    turns = ("start_s", "end_s", "axis_x", "axis_y", "axis_z", "angle_rad")
    return samples, write_table(folder / "sweeps.csv", turns, session.rows)
