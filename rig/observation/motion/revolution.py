"""A joint's exact revolution or arc: its ends in time, and checks of its motion."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.motion.steps import TURN_RAD, Sweep, closes, turn_words
from rig.observation.statistics.spectral_lines import SIDEBANDS

MAX_STATE_STEP_S = 0.02  # longest interval of arm states that show the servo's vibration
SMOOTHING_S = 0.05  # time over which the joint's rate is averaged before it is judged constant or not
MAX_STATE_GAP_S = 1.0  # longest gap after which a halt shows as a missing angle
MAX_OTHER_TRAVEL_RAD = 0.01
MIN_SPEED_FRACTION = 0.995


@dataclass(frozen=True, slots=True)
class Revolution:
    """A turn of `angle_rad` between two controller times: exactly 2π, or an arc as the encoders measure it.

    - `duration_std_s`: uncertainty due to interpolation between arm states.
    - `axis_flange` (3,): unit vector of the turn in the flange frame, from the measured joint angles.
    - `axis_errors` (13, 3): the axis' change per radian of each arm error (`rig.motion.geometry.AXIS_ERRORS`).
    - `attitude` (3, 3): transforms a vector from the arm's base frame to the flange's, at the start.
    - `arm_m` (3,): a vector from the joint's axis to the flange's origin, in the flange's frame.
    - `station`: the joint, from 0 at the base, then the angles, rad, of the other joints, rounded.
    - `uneven`: whether the encoder errs by a degree, so that the shaft's angle is known only over whole turns.
    """

    start_s: float
    end_s: float
    duration_std_s: float
    axis_flange: Array
    attitude: Array
    axis_errors: Array
    arm_m: Array
    station: tuple[float, ...]
    angle_rad: float = TURN_RAD
    uneven: bool = False

    @property
    def sidebands(self) -> int:
        """The number of sidebands on either side of a spectral line: as many as the speed has harmonics of a turn.

        A bad encoder errs, and so makes the shaft's speed vary, once and twice per turn. The readings also contain
        products of two such waves, so twice as many harmonics of a turn are fitted to them.
        """
        return 2 if self.uneven else SIDEBANDS

    @property
    def closed(self) -> bool:
        """Whether the sweep consists of whole turns, over which encoder errors cancel and gravity averages out."""
        return closes(self.angle_rad)

    @property
    def duration_s(self) -> float:
        """Duration T of the turn."""
        return self.end_s - self.start_s

    @property
    def speed_rad_s(self) -> float:
        """Mean speed Δθ/T, which vibration does not change; Δθ is 2π for a revolution."""
        return float(self.angle_rad / self.duration_s)

    @property
    def speed_std_rad_s(self) -> float:
        """The standard deviation of the mean speed, due to the error of the duration."""
        return self.speed_rad_s * self.duration_std_s / self.duration_s


@dataclass(frozen=True, slots=True)
class Ends:
    """Start and end of a revolution, the uncertainty of its duration, and the times (k,) of the states in it."""

    start_s: float
    end_s: float
    duration_std_s: float
    time_s: Array


def find_revolution(states: NDArray[Any], sweep: Sweep, settings: ObservationThresholds) -> Ends:
    """Return the revolution of one sweep from the turner's `states` (n,), in the order of their times.

    The revolution's ends are the times at which the joint angle crosses the ends of `revolution_rad`. Raise Fault
    `incomplete_revolution`, `arm_states_lost`, `speed_slider`, `speed_limited`, `speed_not_constant`,
    `other_joint_moved`.
    """
    where, (low, high) = describe(sweep), sweep.revolution_rad
    time_s, angle = states["time_s"], states["q_rad"][:, sweep.joint]
    travelled = angle - low if sweep.direction == "ccw" else high - angle
    first, last = _find_inner_states(travelled, high - low, sweep)
    turning = states[first : last + 1]
    gap = float(np.diff(time_s[first - 1 : last + 2]).max())
    if gap > MAX_STATE_GAP_S:
        raise arm_states_lost(where, f"for {gap:.2f} s")
    _check_slider(turning, where)
    _check_speed(time_s[first : last + 1], travelled[first : last + 1], where, settings)
    _check_other_joints(turning, sweep.joint, where)
    return Ends(*_find_ends(time_s, travelled, first, last, high - low), turning["time_s"])


def describe(sweep: Sweep) -> str:
    """Return a sweep's name in messages."""
    return f"sweep {sweep.index} ({sweep.joint_name} {sweep.direction})"


def arm_states_lost(where: str, extent: str) -> Fault:
    """Return the error for a sweep with too many states missing; `extent` says how many, or for how long."""
    return Fault(
        "arm_states_lost",
        f"in {where} the arm's states are missing {extent}",
        "Check the network to the robot and the load of this computer, then repeat the sweep",
    )


def _find_inner_states(travelled: Array, turn_rad: float, sweep: Sweep) -> tuple[int, int]:
    """Return the indices of a revolution's first and last state. Raise Fault `incomplete_revolution`."""
    entries = np.flatnonzero((travelled[:-1] < 0) & (travelled[1:] >= 0)) + 1
    exits = np.flatnonzero((travelled[:-1] < turn_rad) & (travelled[1:] >= turn_rad))
    if len(entries) and len(exits) and exits[0] > entries[0]:
        return int(entries[0]), int(exits[0])
    angle_rad = float(np.ptp(travelled)) if len(travelled) else 0.0
    raise Fault(
        "incomplete_revolution",
        f"in {describe(sweep)} the joint turned {np.degrees(angle_rad):.0f}° and not {_describe_extent(sweep)}",
        "Repeat the sweep; resume the run if it was interrupted",
    )


def _describe_extent(sweep: Sweep) -> str:
    return "the whole revolution" if sweep.angle_rad == TURN_RAD else turn_words(sweep.angle_rad)


def _find_ends(time_s: Array, travelled: Array, first: int, last: int, turn_rad: float) -> tuple[float, float, float]:
    """Return the start of the revolution, its end, and the standard deviation of the time between them, s.

    The angle is interpolated between two neighbouring states. If states are missing there, the joint may have been
    accelerating. Then the straight line through the whole revolution gives the time, with the ripple as its error.
    """
    t, angle = time_s[first : last + 1], travelled[first : last + 1]
    speed, offset = np.polyfit(t - t[0], angle, 1)
    ripple = float(np.std(angle - offset - speed * (t - t[0])))
    unsteady = float(np.sqrt(np.mean((np.diff(angle) / np.diff(t) - speed) ** 2)))
    ends = []
    missed = []
    for before, level in ((first - 1, 0.0), (last, turn_rad)):
        step_s = time_s[before + 1] - time_s[before]
        if step_s <= MAX_STATE_STEP_S:
            fraction = (level - travelled[before]) / (travelled[before + 1] - travelled[before])
            ends.append(time_s[before] + fraction * step_s)
            # A ripple of RMS r whose rate has RMS v accelerates by about v²/r; a chord misses h²/8 times that.
            missed.append(min(ripple, step_s**2 / 8 * unsteady**2 / ripple) if ripple > 0 else 0.0)
        else:
            ends.append(t[0] + (level - offset) / speed)
            missed.append(ripple)
    return float(ends[0]), float(ends[1]), float(np.linalg.norm(missed) / speed)


def _check_slider(turning: NDArray[Any], where: str) -> None:
    """Raise Fault `speed_slider` or `speed_limited` if an arm's states show that the speed was reduced."""
    if not {"target_speed_fraction", "speed_scaling"} <= {*(turning.dtype.names or ())}:
        return
    slider, scaling = (float(turning[name].min()) for name in ("target_speed_fraction", "speed_scaling"))
    if slider < MIN_SPEED_FRACTION:
        raise Fault(
            "speed_slider",
            f"in {where} the speed slider was at {100 * slider:.0f} %",
            "Set the speed slider on the pendant to 100 %, then repeat the sweep",
        )
    if scaling < MIN_SPEED_FRACTION:
        raise Fault(
            "speed_limited",
            f"in {where} the controller ran at {100 * scaling:.0f} % of the programmed speed with the slider at 100 "
            "%, as it does if a limit of the safety settings slows it down",
            "Widen that limit in the arm's safety settings, or lower procedure.speed_deg_s, then repeat the sweep",
        )


def _check_speed(time_s: Array, travelled: Array, where: str, settings: ObservationThresholds) -> None:
    """Raise Fault `speed_not_constant` if the rate, smoothed to hide vibration, strays from its mean, as at a halt."""
    middles = np.arange(time_s[0] + SMOOTHING_S / 2, time_s[-1] - SMOOTHING_S / 2, SMOOTHING_S / 5)
    ahead = np.interp(middles + SMOOTHING_S / 2, time_s, travelled)
    behind = np.interp(middles - SMOOTHING_S / 2, time_s, travelled)
    mean = (travelled[-1] - travelled[0]) / (time_s[-1] - time_s[0])
    check_constant((ahead - behind) / SMOOTHING_S / mean, where, settings)


def check_constant(relative_speeds: Array, where: str, settings: ObservationThresholds) -> None:
    """Raise Fault `speed_not_constant` if smoothed speeds (n,), relative to their mean, stray from 1, as at a halt."""
    deviation = float(np.max(np.abs(relative_speeds - 1), initial=0.0))
    if deviation > settings.max_speed_deviation:
        raise Fault(
            "speed_not_constant",
            f"in {where} the joint's speed differed by {100 * deviation:.0f} % from its mean; "
            f"{100 * settings.max_speed_deviation:.0f} % is allowed",
            "Repeat the sweep without pausing it; if it happens again check payload and acceleration",
        )


def _check_other_joints(turning: NDArray[Any], joint: int, where: str) -> None:
    others = np.delete(np.ptp(turning["q_rad"], axis=0), joint)
    if others.max(initial=0.0) > MAX_OTHER_TRAVEL_RAD:
        raise Fault(
            "other_joint_moved",
            f"in {where} another joint moved by {np.degrees(others.max()):.1f}°",
            "Make sure that nothing else moves the arm during a sweep, then repeat it",
        )
