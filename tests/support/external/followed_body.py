"""A body moved by hand, a gyroscope on it, and a reference for its attitude; no code is shared with the rig.

Yaw, pitch and roll are sums of sines, whose rates are known in closed form, without integration.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array
from rig.observation.external.reference_rows import Turning
from support.external.csv_tables import write_table

AT_REST = 0.02
EARTH_RAD_S = 7.292e-5 * np.array([0.6, 0.0, 0.8])  # in room coordinates


@dataclass(frozen=True)
class World:
    """A body that oscillates by `swing_rad` about all axes with periods of `fastest_s` and more, `duration_s` long.

    `random_walk_rad_sqrt_s` and `bias_walk_rad_s_sqrt_s` of the gyroscope; the reference errs by `attitude_rad` about
    each axis at `looks_hz`, with the correlation time `colour_s`; its look stamped t was at t + `late_s`. From each of
    `stops_s` on the body stands still for `stop_lasts_s`, and the reference errs by the fraction `AT_REST`.
    """

    duration_s: float = 40.0
    rate_hz: float = 100.0
    swing_rad: float = 2.0
    fastest_s: float = 2.0
    random_walk_rad_sqrt_s: float = 3e-4
    bias_walk_rad_s_sqrt_s: float = 0.0
    attitude_rad: float = 3e-3
    looks_hz: float = 40.0
    colour_s: float = 0.0
    late_s: float = 0.0
    stops_s: tuple[float, ...] = ()
    stop_lasts_s: float = 0.8


@dataclass(frozen=True)
class Followed:
    """Readings (n, 3) at `time_s` (n,), the reference's `attitudes` (k, 3, 3) at `looks_s` (k,), the truth.

    `rates_rad_s` (k, 3) are the true ones at the looks.
    """

    time_s: Array
    readings: Array
    looks_s: Array
    attitudes: Array
    rates_rad_s: Array
    matrix: Array
    bias: Array


def follow(world: World, seed: int) -> Followed:
    rng = np.random.default_rng(seed)
    swings = _Swings(world, rng)
    time_s = np.arange(round(world.duration_s * world.rate_hz) + 1) / world.rate_hz
    looks_s = np.arange(0.1, world.duration_s - 0.1, 1 / world.looks_hz)
    matrix = np.eye(3) + 0.02 * rng.normal(size=(3, 3))
    bias = 0.01 * rng.normal(size=3)
    attitudes, rates, _ = _stopping(swings, world, time_s)
    sensed = (rates + EARTH_RAD_S @ attitudes) @ matrix.T + bias
    walk = np.cumsum(rng.normal(size=sensed.shape), axis=0) * world.bias_walk_rad_s_sqrt_s / np.sqrt(world.rate_hz)
    noise = rng.normal(size=sensed.shape) * world.random_walk_rad_sqrt_s * np.sqrt(world.rate_hz)
    reported, told_rates, moving = _stopping(swings, world, looks_s + world.late_s)
    missed = _draw_coloured(world, len(looks_s), rng) * np.where(moving, 1.0, AT_REST)[:, None]
    errors = Rotation.from_rotvec(missed).as_matrix()
    return Followed(
        time_s, sensed + walk - walk.mean(axis=0) + noise, looks_s, errors @ reported, told_rates, matrix, bias
    )


class _Swings:
    """Yaw, pitch and roll, each a sum of three sines."""

    def __init__(self, world: World, rng: np.random.Generator) -> None:
        self._paces = 2 * np.pi / (world.fastest_s * rng.uniform(1, 4, size=(3, 3)))
        self._phases = rng.uniform(0, 2 * np.pi, size=(3, 3))
        self._sizes = world.swing_rad * rng.dirichlet([2, 2, 2], size=3)

    def evaluate(self, time_s: Array) -> tuple[Array, Array]:
        """Return attitudes (n, 3, 3), body to room, and rates (n, 3) in body coordinates."""
        phases = self._paces * time_s[:, None, None] + self._phases
        yaw, pitch, roll = np.sum(self._sizes * np.sin(phases), axis=2).T
        yaw_rate, pitch_rate, roll_rate = np.sum(self._sizes * self._paces * np.cos(phases), axis=2).T
        rates = [
            roll_rate - yaw_rate * np.sin(pitch),
            pitch_rate * np.cos(roll) + yaw_rate * np.cos(pitch) * np.sin(roll),
            -pitch_rate * np.sin(roll) + yaw_rate * np.cos(pitch) * np.cos(roll),
        ]
        angles = np.column_stack([yaw, pitch, roll])
        return np.asarray(Rotation.from_euler("ZYX", angles).as_matrix()), np.column_stack(rates)


def _stopping(swings: _Swings, world: World, time_s: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return attitudes (n, 3, 3) and rates (n, 3) of `swings` with the stops, and whether the body moves (n,)."""
    since_s = time_s[:, None] - np.array(world.stops_s)
    stood_s = np.clip(since_s, 0, world.stop_lasts_s)
    moving = np.all((since_s <= 0) | (since_s >= world.stop_lasts_s), axis=1)
    attitudes, rates = swings.evaluate(time_s - stood_s.sum(axis=1))
    return attitudes, rates * moving[:, None], moving


def _draw_coloured(world: World, count: int, rng: np.random.Generator) -> Array:
    """Return correlated errors (count, 3) in rad."""
    if world.colour_s == 0:
        return world.attitude_rad * rng.normal(size=(count, 3))
    kept = np.exp(-1 / (world.looks_hz * world.colour_s))
    fresh = rng.normal(size=(count + 1000, 3)) * world.attitude_rad * np.sqrt(1 - kept**2)
    return np.asarray(lfilter([1.0], [1.0, -kept], fresh, axis=0)[1000:])


def turning(followed: Followed) -> Turning:
    """Return the rig's solution, with rows as long as the interval of the looks."""
    half_s = np.median(np.diff(followed.looks_s)) / 2.1
    rows_s = np.column_stack([followed.looks_s - half_s, followed.looks_s + half_s])
    return Turning(followed.time_s, followed.readings, rows_s, followed.attitudes)


def write(folder: Path, followed: Followed, rates_rad_s: Array | None = None) -> list[Path]:
    """Write the files of `rig solve --attitudes`; with rates (k, 3) if given."""
    read = ["time_s", "x_rad_s", "y_rad_s", "z_rad_s"]
    samples = write_table(folder / "samples.csv", read, followed.time_s, followed.readings)
    half_s = np.median(np.diff(followed.looks_s)) / 2.1
    quaternions = Rotation.from_matrix(followed.attitudes).as_quat()[:, [3, 0, 1, 2]]
    columns = ["start_s", "end_s", "qw", "qx", "qy", "qz"]
    parts = [followed.looks_s - half_s, followed.looks_s + half_s, quaternions]
    if rates_rad_s is not None:
        columns += ["rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"]
        parts.append(rates_rad_s)
    return [samples, write_table(folder / "attitudes.csv", columns, *parts)]
