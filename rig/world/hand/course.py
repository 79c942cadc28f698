"""How the hand takes a body from one attitude to another: pushes, wobble, tremor, and the rocking when it is put down.

The rate is linear between the times of a fine grid, and the attitude is the integral of exactly that rate.
"""

from dataclasses import dataclass

import numpy as np

from rig.world.hand.habits import Habits
from rig.world.hand.rotations import Array, accumulate_rotations, rotation_from_rotvec, rotvec_from_rotation

STEP_S = 1e-3
PASSES = 4  # of the correction that ends the course where it should end
GRASP_S = (0.1, 0.25)  # from the first touch to the first push
ROCK_S, ROCK_HZ = (0.1, 0.3), (3.0, 10.0)
WOBBLE_HZ, TREMOR_HZ = (0.3, 2.0), (6.0, 12.0)
KNOCK_S = 0.006


@dataclass(frozen=True, slots=True)
class HandCourse:
    """Times (n,), rates (n, 3) in body axes, attitudes (n, 3, 3) body to room, specific forces (n, 3) in body axes."""

    time_s: Array
    rates: Array
    attitudes: Array
    forces: Array


def simulate_move(
    start: Array, end: Array, vector: Array, habits: Habits, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Times from 0 on and rates of a move from `start` to `end` (3, 3), about by `vector` (3,) in body axes."""
    angle = float(np.linalg.norm(vector))
    axis = vector / angle
    grasp_s, rock_s = rng.uniform(*GRASP_S), rng.uniform(*ROCK_S)
    pushes, until_s = _draw_pushes(angle, grasp_s, habits, rng)
    time_s = np.arange(0.0, until_s + rock_s + STEP_S, STEP_S)
    along = np.zeros(len(time_s))
    for begins_s, lasting_s, part in pushes:
        along += part * _pulse(time_s, begins_s, lasting_s)
    across = np.linalg.svd(axis[None])[2][1:]  # (2, 3)
    rates = np.outer(along, axis)
    wobble = np.radians(habits.wobble_deg) * _simulate_oscillation(time_s, (0.0, until_s), WOBBLE_HZ, rng, 2)
    tremor = np.radians(habits.tremor_deg) * _simulate_oscillation(time_s, (0.0, until_s), TREMOR_HZ, rng, 3)
    rates += (
        wobble @ across + tremor + 1e-3 * habits.rock_mrad * _simulate_rocking(time_s, until_s, rock_s, rng) @ across
    )
    rates[0] = rates[-1] = 0.0
    last_s = grasp_s + 0.3 * (until_s - grasp_s)
    shape = _pulse(time_s, last_s, until_s - last_s)[:, None]
    for _ in range(PASSES):
        turned_to = integrate_rates(time_s, rates)
        missed = turned_to[-1] @ rotvec_from_rotation((start @ turned_to[-1]).T @ end)  # in the axes that stand still
        rates = rates + shape * (np.swapaxes(turned_to, -1, -2) @ missed)
    return time_s, rates


def simulate_nudge(vector: Array, lasting_s: float) -> tuple[Array, Array]:
    """Times from 0 on and rates of one smooth turn by `vector` (3,)."""
    time_s = np.arange(0.0, lasting_s + STEP_S, STEP_S)
    return time_s, np.outer(_pulse(time_s, 0.0, lasting_s), vector)


def simulate_holding(lasting_s: float, habits: Habits, rng: np.random.Generator) -> tuple[Array, Array]:
    """Times from 0 on and rates of a body that is held and not laid down."""
    time_s = np.arange(0.0, lasting_s + STEP_S, STEP_S)
    whole = (0.0, float(time_s[-1]))
    rates = np.radians(2 * habits.tremor_deg) * _simulate_oscillation(time_s, whole, TREMOR_HZ, rng, 3)
    return time_s, rates + np.radians(0.5) * _simulate_oscillation(time_s, whole, WOBBLE_HZ, rng, 3)


def integrate_course(start: Array, time_s: Array, rates: Array, habits: Habits, knock_m_s2: float = 0.0) -> HandCourse:
    """The course from `start` (3, 3) on; a knock is felt at its end."""
    attitudes = start @ integrate_rates(time_s, rates)
    arm = np.asarray(habits.lever_arm_m)
    felt = np.swapaxes(attitudes, -1, -2) @ np.array([0.0, 0.0, habits.gravity_m_s2])
    felt += np.cross(np.gradient(rates, time_s, axis=0), arm) + np.cross(rates, np.cross(rates, arm))
    felt[[0, -1]] = attitudes[[0, -1], 2] * habits.gravity_m_s2
    knocked = (time_s > time_s[-1] - 0.1) & (time_s < time_s[-1] - 0.1 + KNOCK_S)
    felt[knocked] += knock_m_s2 * attitudes[knocked, 2]
    return HandCourse(time_s, rates, attitudes, felt)


def integrate_rates(time_s: Array, rates: Array) -> Array:
    """Attitudes (n, 3, 3) by rates (n, 3) that are linear between times (n,), to the third order of a step."""
    step = np.diff(time_s)[:, None]
    vectors = 0.5 * step * (rates[1:] + rates[:-1]) + step**2 / 12 * np.cross(rates[:-1], rates[1:])
    return accumulate_rotations(vectors)


def _draw_pushes(
    angle: float, begins_s: float, habits: Habits, rng: np.random.Generator
) -> tuple[list[tuple[float, float, float]], float]:
    """Beginning, length and angle of each push, and when the last one has ended."""
    count = max(1, round(rng.integers(habits.pushes_a_turn[0], habits.pushes_a_turn[1] + 1) * angle / (2 * np.pi)))
    pushes = []
    for part in rng.dirichlet(np.full(count, 20.0)):
        peak = np.radians(habits.peak_deg_s) * rng.uniform(0.7, 1.0)
        lasting_s = float(np.clip(2 * part * angle / peak, 0.15, 20.0))
        pushes.append((begins_s, lasting_s, part * angle))
        begins_s += lasting_s + rng.uniform(*habits.pause_s)
    return pushes, pushes[-1][0] + pushes[-1][1]


def _pulse(time_s: Array, begins_s: float, lasting_s: float) -> Array:
    """(n,) a raised cosine of area 1."""
    part = np.clip((time_s - begins_s) / lasting_s, 0, 1)
    return np.asarray((1 - np.cos(2 * np.pi * part)) / lasting_s, dtype=np.float64)


def _simulate_oscillation(
    time_s: Array, window_s: tuple[float, float], band_hz: tuple[float, float], rng: np.random.Generator, ways: int
) -> Array:
    """(n, ways) rates of an angle that swings by 1 within a window, and is zero at its ends."""
    part = np.clip((time_s - window_s[0]) / (window_s[1] - window_s[0]), 0, 1)
    envelope = 0.5 - 0.5 * np.cos(np.pi * np.clip(4 * np.minimum(part, 1 - part), 0, 1))  # no kink: rates do not leap
    turns = np.outer(time_s, rng.uniform(*band_hz, ways)) + rng.uniform(0, 1, ways)
    angle = envelope[:, None] * np.sin(2 * np.pi * turns) * rng.normal(0, 1, ways).clip(-2, 2)
    return np.asarray(np.gradient(angle, time_s, axis=0), dtype=np.float64)


def _simulate_rocking(time_s: Array, begins_s: float, lasting_s: float, rng: np.random.Generator) -> Array:
    """(n, 2) rates of a body that rocks from edge to edge, less and less."""
    since = time_s - begins_s
    on = (since > 0) & (since < lasting_s)
    part = np.where(on, since / lasting_s, 0.0)
    angle = (
        20 * part**2 * np.exp(-4 * part) * (1 - part) ** 2 * np.sin(2 * np.pi * rng.uniform(*ROCK_HZ) * since.clip(0))
    )
    return np.outer(np.gradient(angle, time_s), rng.normal(0, 1, 2))


def rotate_about_horizontal(vector: Array) -> Array:
    """(3, 3) a small rotation about the horizontal by `vector` (2,), rad."""
    return rotation_from_rotvec(np.array([vector[0], vector[1], 0.0]))
