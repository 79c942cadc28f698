"""The arm's side of an observation: when a joint turned through exactly one revolution, and whether properly."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.config.models import ObservationSection
from rig.errors import Fault
from rig.timebase import ArmMotion, Array

SMOOTHING_S = 0.05  # of the joint's rate before it is judged constant or not
MAX_STATE_GAP_S = 0.1
MAX_OTHER_TRAVEL_RAD = 0.01
MIN_SPEED_FRACTION = 0.995


@dataclass(frozen=True, slots=True)
class Revolution:
    """Exactly 2π of joint travel between two controller times; `axis_flange` (3,) is the unit vector of the turn."""

    start_s: float
    end_s: float
    axis_flange: Array

    @property
    def duration_s(self) -> float:
        """T."""
        return self.end_s - self.start_s

    @property
    def speed_rad_s(self) -> float:
        """2π/T: the mean speed, whatever the vibration."""
        return float(2 * np.pi / self.duration_s)


def find_revolution(
    motion: ArmMotion, sweep: Mapping[str, Any], window: tuple[float, float], settings: ObservationSection
) -> Revolution:
    """The revolution of one sweep (as its event describes it) between two controller times.

    Its ends are where the recorded joint angle crosses the ends of `revolution_rad`, interpolated between states.
    Raises Fault `incomplete_revolution`, `arm_states_lost`, `slider_below_100`, `speed_not_constant`,
    `other_joint_moved`.
    """
    joint, where = sweep["joint"], describe(sweep)
    inside = (motion.time_s >= window[0]) & (motion.time_s <= window[1])
    start_s, end_s = _crossings(motion.time_s[inside], motion.states["q_rad"][inside, joint], sweep)
    turning = (motion.time_s >= start_s) & (motion.time_s <= end_s)
    states = motion.states[turning]
    gap = float(np.max(np.diff(motion.time_s[turning]), initial=0.0))
    if gap > MAX_STATE_GAP_S:
        raise Fault(
            "arm_states_lost",
            f"in {where} the arm's states are missing for {gap:.2f} s",
            "Check the network to the robot and the load of this computer, then repeat the sweep",
        )
    slowest = float(min(states["target_speed_fraction"].min(), states["speed_scaling"].min()))
    if slowest < MIN_SPEED_FRACTION:
        raise Fault(
            "slider_below_100",
            f"in {where} the controller ran at {100 * slowest:.0f} % of the programmed speed",
            "Set the speed slider on the pendant to 100 %, then repeat the sweep",
        )
    _check_speed(motion, joint, (start_s, end_s), where, settings)
    others = np.delete(np.ptp(states["q_rad"], axis=0), joint)
    if others.max() > MAX_OTHER_TRAVEL_RAD:
        raise Fault(
            "other_joint_moved",
            f"in {where} another joint moved by {np.degrees(others.max()):.1f}°",
            "Let nothing else move the arm during a sweep, then repeat it",
        )
    rate = motion.rate(motion.time_s[turning]).mean(axis=0)
    return Revolution(start_s, end_s, rate / np.linalg.norm(rate))


def describe(sweep: Mapping[str, Any]) -> str:
    """How messages name a sweep."""
    return f"sweep {sweep['index']} ({sweep['joint_name']} {sweep['direction']})"


def _crossings(time_s: Array, angle: Array, sweep: Mapping[str, Any]) -> tuple[float, float]:
    low, high = sweep["revolution_rad"]
    travelled = angle - low if sweep["direction"] == "ccw" else high - angle
    entries = np.flatnonzero((travelled[:-1] < 0) & (travelled[1:] >= 0))
    if len(entries):
        rest = travelled[entries[0] :]
        exits = entries[0] + np.flatnonzero((rest[:-1] < high - low) & (rest[1:] >= high - low))
        if len(exits):
            return _crossing(time_s, travelled, entries[0], 0.0), _crossing(time_s, travelled, exits[0], high - low)
    turned = float(np.ptp(angle)) if len(angle) else 0.0
    raise Fault(
        "incomplete_revolution",
        f"in {describe(sweep)} the joint turned {np.degrees(turned):.0f}° and not through the whole revolution",
        "Repeat the sweep; resume the run if it was interrupted",
    )


def _crossing(time_s: Array, travelled: Array, before: int, level: float) -> float:
    """Time of a crossing between two states, linear: over 8 ms a servo's ripple bends it by 1e-5 rad at most."""
    share = (level - travelled[before]) / (travelled[before + 1] - travelled[before])
    return float(time_s[before] + share * (time_s[before + 1] - time_s[before]))


def _check_speed(
    motion: ArmMotion, joint: int, turn: tuple[float, float], where: str, settings: ObservationSection
) -> None:
    """The joint's rate, smoothed, must stay near its mean: vibration passes, a halt on the way does not."""
    times = np.arange(turn[0], turn[1], SMOOTHING_S / 5)
    angle = motion.states["q_rad"][:, joint]
    ahead = np.interp(times + SMOOTHING_S / 2, motion.time_s, angle)
    behind = np.interp(times - SMOOTHING_S / 2, motion.time_s, angle)
    mean = 2 * np.pi / (turn[1] - turn[0])
    deviation = float(np.max(np.abs(np.abs(ahead - behind) / SMOOTHING_S / mean - 1)))
    if deviation > settings.max_speed_deviation:
        raise Fault(
            "speed_not_constant",
            f"in {where} the joint's speed strayed {100 * deviation:.0f} % from its mean, "
            f"{100 * settings.max_speed_deviation:.0f} % is allowed",
            "Repeat the sweep without pausing it; if it happens again check payload and acceleration",
        )
