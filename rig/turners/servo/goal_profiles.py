"""Movements in the servo's units: a goal in pulses, and a profile in milliseconds. Pure.

Only the time-based profile is used (firmware 42 and later): the duration of the whole move in milliseconds determines
its speed to 2e-4. The velocity-based profile has steps of 1.37 °/s and 21 °/s², too coarse for a sweep at 60 °/s.
"""

from collections.abc import Iterable
from typing import NamedTuple

from rig.errors import Problem
from rig.motion.steps import Motion
from rig.turners.servo.servo_models import MAX_PROFILE_MS, MAX_PULSES, PULSE_RAD

MIN_PROFILE_MS = 20  # a few of the servo's control steps; 0 would mean the fastest motion


class ProfileMove(NamedTuple):
    """A goal in pulses, and the durations of the whole move and of each ramp."""

    goal: int
    total_ms: int
    ramp_ms: int


def move_of(motion: Motion) -> ProfileMove:
    """Return the servo's profile nearest to a motion: goal and durations are rounded to the servo's units."""
    total_ms = max(MIN_PROFILE_MS, round(1000 * motion.duration_s))
    ramp_ms = min(round(1000 * motion.speed_rad_s / motion.acceleration_rad_s2), total_ms // 2)
    return ProfileMove(round(motion.target_q_rad[0] / PULSE_RAD), total_ms, ramp_ms)


def cruise_rad_s(from_rad: float, move: ProfileMove) -> float:
    """Return the speed between the ramps, rad/s, of the trapezoidal profile from `from_rad`."""
    distance_rad = abs(move.goal * PULSE_RAD - from_rad)
    return distance_rad / (1e-3 * (move.total_ms - move.ramp_ms))


def move_problems(motions: Iterable[Motion], velocity_limit_rad_s: float) -> list[Problem]:
    """Return the problems of motions that exceed the servo's limits, at most one of each kind."""
    problems: dict[str, Problem] = {}
    for motion in motions:
        move = move_of(motion)
        speed_rad_s = cruise_rad_s(motion.start_q_rad[0], move)
        if abs(move.goal) > MAX_PULSES:
            problem = Problem(
                "servo_out_of_range",
                f"{motion.name} ends {move.goal} pulses from zero, but the servo counts {MAX_PULSES} either way",
                "Switch the servo off and on, so that it forgets its turns, and plan fewer",
            )
        elif move.total_ms > MAX_PROFILE_MS:
            problem = Problem(
                "servo_move_too_long",
                f"{motion.name} takes {motion.duration_s:.1f} s, but the servo can take at most "
                f"{1e-3 * MAX_PROFILE_MS:.1f} s",
                "Turn faster, or fewer turns at a time",
            )
        elif speed_rad_s > velocity_limit_rad_s:
            problem = Problem(
                "servo_too_fast",
                f"{motion.name} needs {speed_rad_s:.2f} rad/s, but the servo's velocity limit is "
                f"{velocity_limit_rad_s:.2f} rad/s",
                "Turn slower; raise Velocity Limit (44) only as far as the servo's no-load speed",
            )
        else:
            continue
        problems.setdefault(problem.name, problem)
    return list(problems.values())
