"""The hand's motion from one attitude to another: pushes, wobble, tremor, and rocking when the body is put down.

The rate is linear between the times of a fine grid, and the attitude is the exact integral of that rate.
"""

from dataclasses import dataclass

import numpy as np

from rig.world.hand.habits import Habits
from rig.world.hand.rotations import Array, exp_map, log_map, multiply_steps

STEP_S = 1e-3
CORRECTION_PASSES = 4  # after which the course ends at its target
GRASP_S = (0.1, 0.25)  # range of the time from the first touch to the first push
ROCK_S, ROCK_HZ = (0.1, 0.3), (3.0, 10.0)
WOBBLE_HZ, TREMOR_HZ = (0.3, 2.0), (6.0, 12.0)
KNOCK_S = 0.006


@dataclass(frozen=True, slots=True)
class HandCourse:
    """Times (n,), with rates and specific forces (n, 3) in body axes, and attitudes (n, 3, 3) from body to room."""

    time_s: Array
    rates: Array
    attitudes: Array
    forces: Array


def move(start: Array, end: Array, vector: Array, habits: Habits, rng: np.random.Generator) -> tuple[Array, Array]:
    """Simulate a hand that turns the body from attitude `start` to `end` (3, 3); return times and body rates.

    `vector` (3,) is the rotation vector between the two attitudes, in body axes.
    """
    angle = float(np.linalg.norm(vector))
    axis = vector / angle
    grasp_s, rock_s = rng.uniform(*GRASP_S), rng.uniform(*ROCK_S)
    pushes, end_s = _draw_pushes(angle, grasp_s, habits, rng)
    time_s = np.arange(0.0, end_s + rock_s + STEP_S, STEP_S)
    push_rate = np.zeros(len(time_s))
    for begins_s, lasting_s, part in pushes:
        push_rate += part * _pulse(time_s, begins_s, lasting_s)
    across = np.linalg.svd(axis[None])[2][1:]  # (2, 3), two unit vectors at right angles to the axis
    rates = np.outer(push_rate, axis)
    wobble = np.radians(habits.wobble_deg) * _oscillate(time_s, (0.0, end_s), WOBBLE_HZ, rng, 2)
    tremor = np.radians(habits.tremor_deg) * _oscillate(time_s, (0.0, end_s), TREMOR_HZ, rng, 3)
    rates += wobble @ across + tremor + 1e-3 * habits.rock_mrad * _rock(time_s, end_s, rock_s, rng) @ across
    rates[0] = rates[-1] = 0.0
    # The oscillations turn the body too, so a slow correction is added until the attitude at the end is the wanted one.
    last_s = grasp_s + 0.3 * (end_s - grasp_s)
    shape = _pulse(time_s, last_s, end_s - last_s)[:, None]
    for _ in range(CORRECTION_PASSES):
        rotations = integrate_rates(time_s, rates)
        residual = rotations[-1] @ log_map((start @ rotations[-1]).T @ end)  # in the axes of the body at the start
        rates = rates + shape * (np.swapaxes(rotations, -1, -2) @ residual)
    return time_s, rates


def nudge(vector: Array, lasting_s: float) -> tuple[Array, Array]:
    """Return times (n,) from 0, and rates (n, 3), rad/s, of one smooth rotation by `vector` (3,), rad."""
    time_s = np.arange(0.0, lasting_s + STEP_S, STEP_S)
    return time_s, np.outer(_pulse(time_s, 0.0, lasting_s), vector)


def hold(lasting_s: float, habits: Habits, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return times (n,) from 0, and rates (n, 3), rad/s, of a body that is held in the air."""
    time_s = np.arange(0.0, lasting_s + STEP_S, STEP_S)
    whole = (0.0, float(time_s[-1]))
    rates = np.radians(2 * habits.tremor_deg) * _oscillate(time_s, whole, TREMOR_HZ, rng, 3)
    return time_s, rates + np.radians(0.5) * _oscillate(time_s, whole, WOBBLE_HZ, rng, 3)


def build_course(start: Array, time_s: Array, rates: Array, habits: Habits, knock_m_s2: float = 0.0) -> HandCourse:
    """Return the course of body rates (n, 3) that begins at attitude `start` (3, 3), with a knock at its end."""
    attitudes = start @ integrate_rates(time_s, rates)
    lever_arm = np.asarray(habits.lever_arm_m)
    forces = np.swapaxes(attitudes, -1, -2) @ np.array([0.0, 0.0, habits.gravity_m_s2])
    forces += np.cross(np.gradient(rates, time_s, axis=0), lever_arm) + np.cross(rates, np.cross(rates, lever_arm))
    forces[[0, -1]] = attitudes[[0, -1], 2] * habits.gravity_m_s2
    during_knock = (time_s > time_s[-1] - 0.1) & (time_s < time_s[-1] - 0.1 + KNOCK_S)
    forces[during_knock] += knock_m_s2 * attitudes[during_knock, 2]
    return HandCourse(time_s, rates, attitudes, forces)


def integrate_rates(time_s: Array, rates: Array) -> Array:
    """Return attitudes (n, 3, 3) for rates (n, 3) that are linear between times (n,), to third order in the step."""
    step = np.diff(time_s)[:, None]
    vectors = 0.5 * step * (rates[1:] + rates[:-1]) + step**2 / 12 * np.cross(rates[:-1], rates[1:])
    return multiply_steps(vectors)


def _draw_pushes(
    angle: float, begins_s: float, habits: Habits, rng: np.random.Generator
) -> tuple[list[tuple[float, float, float]], float]:
    """Return start, duration and angle of every push, and the end of the last one."""
    count = max(1, round(rng.integers(habits.pushes_a_turn[0], habits.pushes_a_turn[1] + 1) * angle / (2 * np.pi)))
    pushes = []
    for part in rng.dirichlet(np.full(count, 20.0)):  # nearly equal parts
        peak = np.radians(habits.peak_deg_s) * rng.uniform(0.7, 1.0)
        lasting_s = float(np.clip(2 * part * angle / peak, 0.15, 20.0))  # a raised cosine's peak is twice its mean
        pushes.append((begins_s, lasting_s, part * angle))
        begins_s += lasting_s + rng.uniform(*habits.pause_s)
    return pushes, pushes[-1][0] + pushes[-1][1]


def _pulse(time_s: Array, begins_s: float, lasting_s: float) -> Array:
    """Return the values (n,) of a raised-cosine pulse whose integral over time is 1."""
    part = np.clip((time_s - begins_s) / lasting_s, 0, 1)
    return np.asarray((1 - np.cos(2 * np.pi * part)) / lasting_s, dtype=np.float64)


def _oscillate(
    time_s: Array, window_s: tuple[float, float], band_hz: tuple[float, float], rng: np.random.Generator, axes: int
) -> Array:
    """Return rates (n, axes) of a random oscillation that fades in and out within a window.

    The amplitude of the angle about each axis is drawn with standard deviation 1; the caller scales it.
    """
    part = np.clip((time_s - window_s[0]) / (window_s[1] - window_s[0]), 0, 1)
    envelope = 0.5 - 0.5 * np.cos(np.pi * np.clip(4 * np.minimum(part, 1 - part), 0, 1))  # smooth: rates do not jump
    turns = np.outer(time_s, rng.uniform(*band_hz, axes)) + rng.uniform(0, 1, axes)
    angle = envelope[:, None] * np.sin(2 * np.pi * turns) * rng.normal(0, 1, axes).clip(-2, 2)
    return np.asarray(np.gradient(angle, time_s, axis=0), dtype=np.float64)


def _rock(time_s: Array, begins_s: float, lasting_s: float, rng: np.random.Generator) -> Array:
    """Return rates (n, 2) of a body that rocks from edge to edge with decaying amplitude."""
    elapsed_s = time_s - begins_s
    is_rocking = (elapsed_s > 0) & (elapsed_s < lasting_s)
    part = np.where(is_rocking, elapsed_s / lasting_s, 0.0)
    phase = 2 * np.pi * rng.uniform(*ROCK_HZ) * elapsed_s.clip(0)
    angle = 20 * part**2 * np.exp(-4 * part) * (1 - part) ** 2 * np.sin(phase)
    return np.outer(np.asarray(np.gradient(angle, time_s)), rng.normal(0, 1, 2))


def tilt(vector: Array) -> Array:
    """Return the small rotation (3, 3) about the horizontal `vector` (2,), rad."""
    return exp_map(np.array([vector[0], vector[1], 0.0]))
