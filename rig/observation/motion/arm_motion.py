"""What turned, a chain of joints, as a function of time: all that is read of its states is read here."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.recorded_turner import RecordedTurner
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.cubic_spline import CubicSpline
from rig.motion.geometry import (
    NOMINAL,
    DenavitHartenberg,
    axis_errors,
    flange_arm,
    flange_attitude,
    flange_axes,
    flange_rate,
)
from rig.motion.state import JOINT_NAMES
from rig.motion.steps import Sweep
from rig.observation.motion.even_turn import SMOOTHED_S, find_even_turn, smoothed, well_timed
from rig.observation.motion.known_motion import MIN_RATE_RAD_S, check_span, closely_followed, not_finite
from rig.observation.motion.revolution import MAX_STATE_STEP_S, Revolution, find_revolution
from rig.observation.swing import FEWEST_OF_SWING, MAX_TRAVEL_AT_REST_RAD, remove_oscillation
from rig.observation.windows import Window

RATE_STEP_S = 0.008  # joint angles that are closer in time tell more of their encoders' noise than of a rate
KNOT_S = 0.004  # between the knots of the rate: a faster ripple than it can follow would look like a slower one
SPARSE_S = 0.025  # samples that are farther apart meet a ripple of the servo anywhere
PARTS = 5  # of a rest, whose means tell whether a joint moved where single readings scatter
SWINGS = 8.0  # times what neighbouring readings of an angle differ by: ten thousand that are noise range by less
ATTITUDES = 72  # of which a mean is made: over whole turns what is perpendicular to the axis averages out


class ArmMotion:
    """The `KnownMotion` of a chain of k joints: `angles(t)` (n, k) rad of them, `rate(t)` (n, 3) rad/s of the flange.

    Rates come from the recorded joint angles rather than from the controller's velocity signal, which is filtered: what
    counts is when the joint was where. `states` (m,) are rows as `state_dtype` has them, of joints of that `kinematics`
    and of those `names`. All that stands in the flange's frame is given in the item's, to which `mount` (3, 3) takes
    it: they are one where the item is not mounted anew. Where one reading of an angle scatters (`reading_std_rad`),
    angles and rates are those of a window, and a turn is known by the same reading one turn later.
    Raises Fault `no_motion`, `not_finite`, `impossible_times`, `arm_clock_stepped`.
    """

    def __init__(
        self,
        states: NDArray[Any],
        kinematics: DenavitHartenberg = NOMINAL,
        names: Sequence[str] = JOINT_NAMES,
        mount: Array | None = None,
        reading_std_rad: float = 0.0,
    ) -> None:
        self.kinematics, self._names, self._scatters = kinematics, names, reading_std_rad > 0
        self.mount: Array = np.eye(3) if mount is None else mount
        states = well_timed(states) if self._scatters else states
        _check_order(states["time_s"])
        self.time_s, first = np.unique(states["time_s"], return_index=True)
        self._states = states[first]
        if len(self.time_s) < 4 or not names:
            what = f"the recording holds {len(self.time_s)} arm states" if names else "what turned has no joints"
            raise Fault("no_motion", what, "Record a run with the arm on")
        if not (np.isfinite(self.time_s).all() and np.isfinite(self._states["q_rad"]).all()):
            raise not_finite("an arm state")
        check_span(self.time_s, "the arm's states")
        if self._scatters:
            times_s, angles, joint_rates = smoothed(self.time_s, self._states["q_rad"])
            self.angles = CubicSpline(times_s, angles)
            rates = flange_rate(angles, joint_rates, kinematics) @ self.mount.T
        else:
            self.angles = CubicSpline(self.time_s, self._states["q_rad"])
            step_s = float(np.median(np.diff(self.time_s)))
            times_s = self.time_s[:: max(min(round(KNOT_S / step_s), len(self.time_s) // 4), 1)]
            rates = self.mean_rates(times_s, max(RATE_STEP_S, step_s))
        if not np.linalg.norm(rates, axis=1).max() > MIN_RATE_RAD_S:
            raise Fault("no_motion", "the arm stands still in the whole recording", "Record a run with sweeps")
        self.rate = CubicSpline(times_s, rates)
        close = np.diff(self.time_s) <= (SMOOTHED_S / 3 if self._scatters else MAX_STATE_STEP_S)
        self._covered = close & np.append(close[1:], True) & np.append(True, close[:-1])

    @property
    def host_time_s(self) -> Array:
        """The times (m,) of this computer at which the states of `time_s` came."""
        times_s: Array = self._states["host_time_s"]
        return times_s

    def attitude(self, start_s: float, end_s: float) -> Array:
        """The mean rotation (3, 3) from the base frame into the flange's between two controller times."""
        times_s = np.linspace(start_s, end_s, ATTITUDES, endpoint=False) + (end_s - start_s) / (2 * ATTITUDES)
        mean: Array = self.attitudes(times_s).mean(axis=0)
        return mean

    def attitudes(self, time_s: Array) -> Array:
        """The rotations (n, 3, 3) from the base frame into the flange's at controller times (n,)."""
        found: Array = self.mount @ flange_attitude(self.angles(time_s), self.kinematics)
        return found

    def axes(self, q_rad: Array) -> Array:
        """(…, 3, 6) the joints' axes of growing angles at joint angles (…, 6)."""
        axes: Array = self.mount @ flange_axes(q_rad, self.kinematics)
        return axes

    def axis_errors(self, q_rad: Array, joint: int) -> Array:
        """(…, 13, 3) how the arm's own errors turn a joint's axis, per radian (`rig.motion.geometry.AXIS_ERRORS`)."""
        errors: Array = axis_errors(q_rad, joint, self.kinematics) @ self.mount.T
        return errors

    def covered(self, time_s: Array) -> NDArray[np.bool_]:
        """Which of these times (n,) lie where states follow each other closely enough for `rate` to be true."""
        return closely_followed(self.time_s, self._covered, time_s)

    @property
    def tells_parts_of_turns(self) -> bool:
        """Whether an angle is where its reading says, so that not only whole turns are known."""
        return not self._scatters

    def moved_rad(self, window: Window) -> float | None:
        """How far the joint that moved most was moved in a window; None where no two states tell.

        A standing arm that swings about where it stands is not moved: its angles tell the swing, and so do means.
        """
        q_rad = self._q_rad(window)
        if self._scatters and len(q_rad) >= PARTS:
            q_rad = np.array([part.mean(axis=0) for part in np.array_split(q_rad, PARTS)])
        if len(q_rad) < 2:
            return None
        moved_rad = float(np.ptp(q_rad, axis=0).max())
        if moved_rad > MAX_TRAVEL_AT_REST_RAD and len(q_rad) >= FEWEST_OF_SWING:
            moved_rad = float(np.ptp(remove_oscillation(q_rad), axis=0).max())
        return moved_rad

    def swing_rates(self, time_s: Array) -> Array:
        """(n, 3) rad/s as `sampled_rates`, at rising times (n,), of an arm that stands and swings; else zero.

        An arm that stands as still as its encoders tell has no rate, and their noise makes none.
        """
        still = np.zeros((len(time_s), 3))
        q_rad = self._q_rad(Window(float(time_s[0]), float(time_s[-1])))
        if len(q_rad) < 2 or not self.tells_parts_of_turns:
            return still
        noise_rad = np.sqrt(np.mean(np.diff(q_rad, axis=0) ** 2, axis=0))
        return self.sampled_rates(time_s) if (np.ptp(q_rad, axis=0) > SWINGS * noise_rad).any() else still

    def away_rad(self, window: Window, q_rad: Sequence[float]) -> float | None:
        """How far any joint ever was from the pose `q_rad` (k,) in a window; None where no state tells."""
        seen_rad = self._q_rad(window)
        return float(np.abs(seen_rad - np.array(q_rad)).max()) if len(seen_rad) else None

    def angle(self, sweep: Sweep, time_s: Array | float, derivative: int = 0) -> Array:
        """The angle (n,) rad of the joint that a sweep turns, at times (n,); with `derivative` 1 its rate in rad/s."""
        angle: Array = self.angles(time_s, derivative)[..., sweep.joint]
        return angle

    def mean_rates(self, time_s: Array, lasting_s: float) -> Array:
        """(n, 3) rad/s: the flange's mean rate over so long around each of the times (n,).

        By how far its joints came: what one angle errs, the rates before and after take back, and of samples that
        follow each other the mean is that between the ends.
        """
        came = self.angles(time_s + lasting_s / 2) - self.angles(time_s - lasting_s / 2)
        rates: Array = flange_rate(self.angles(time_s), came / lasting_s, self.kinematics) @ self.mount.T
        return rates

    def sampled_rates(self, time_s: Array) -> Array:
        """(n, 3) rad/s: the flange's rate as it is around samples at times (n,) that follow each other evenly.

        The mean from half-way to the sample before to half-way to the next; of samples far apart the rate there.
        """
        return self.rate(time_s) if is_sparse(time_s) else self.mean_rates(time_s, float(np.median(np.diff(time_s))))

    def mean_rate(self, start_s: float, end_s: float) -> Array:
        """(3,) rad/s: the flange's mean rate from one time to another."""
        count = max(round((end_s - start_s) / RATE_STEP_S), 1)
        lasting_s = (end_s - start_s) / count
        middles_s = np.linspace(start_s + lasting_s / 2, end_s - lasting_s / 2, count)
        rate: Array = self.mean_rates(middles_s, lasting_s).mean(axis=0)
        return rate

    def turn(self, sweep: Sweep, window: Window, thresholds: ObservationThresholds) -> Revolution:
        """The whole turn, or the arc, of a sweep that was made in a window.

        Raises Fault `incomplete_revolution`, `arm_states_lost`, `speed_slider`, `speed_limited`,
        `speed_not_constant`, `other_joint_moved`.
        """
        begin, end = np.searchsorted(self.time_s, [window.start_s, window.end_s])
        find = find_even_turn if self._scatters else find_revolution
        found = find(self._states[max(begin - 1, 0) : end + 1], sweep, thresholds)
        began = self.angles(found.start_s)
        rate = self.rate(found.time_s).mean(axis=0)
        return Revolution(
            found.start_s,
            found.end_s,
            found.duration_std_s,
            axis_flange=rate / np.linalg.norm(rate),
            attitude=self.mount @ flange_attitude(began, self.kinematics),
            axis_errors=sweep.growing * self.axis_errors(began, sweep.joint),
            arm_m=self.mount @ flange_arm(began, sweep.joint, self.kinematics),
            station=(sweep.joint, *np.round(np.delete(began, sweep.joint), 2).tolist()),
            angle_rad=sweep.angle_rad,
            uneven=self._scatters,
        )

    def table(self) -> dict[str, Array]:
        """The states as columns (m,) by name: times, and the joints' angles and rates as the controller tells them."""
        angles = {f"{joint}_rad": self._states["q_rad"][:, i] for i, joint in enumerate(self._names)}
        rates = {f"{joint}_rad_s": self._states["qd_rad_s"][:, i] for i, joint in enumerate(self._names)}
        return {"time_s": self.time_s, **angles, **rates}

    def _q_rad(self, window: Window) -> Array:
        q_rad: Array = self._states["q_rad"][(self.time_s >= window.start_s) & (self.time_s <= window.end_s)]
        return q_rad


def is_sparse(time_s: Array) -> bool:
    """Return whether samples at times (n,) are so far apart that the arm's mean rates between them are not theirs."""
    return float(np.median(np.diff(time_s))) > SPARSE_S


def motion_of(run: RunData, turned: Array | None = None) -> ArmMotion:
    """What turned in a recording, as it moves the item; `turned` (3, 3) is by how that sits off its nominal mount.

    Raises as `turner_of`; Fault `no_motion`, `not_finite`, `impossible_times`, `arm_clock_stepped`.
    """
    turner = turner_of(run)
    mount = np.array(run.settings.mount)
    mount = mount if turned is None else turned @ mount
    return ArmMotion(run.states, turner.geometry, turner.joints, mount, turner.reading_std_rad)


def _check_order(time_s: Array) -> None:
    """States stand in the order in which they came: one that is older than the one before it was stamped anew."""
    back = np.flatnonzero(np.diff(time_s) < 0)
    if len(back):
        before_s, after_s = time_s[back[0] : back[0] + 2]
        raise Fault(
            "arm_clock_stepped",
            f"the time of the arm's states goes back from {before_s:.3f} s to {after_s:.3f} s: the controller's clock "
            "was set",
            "Record again; of this recording nothing can be put on one clock",
        )


def turner_of(run: RunData) -> RecordedTurner:
    """What turned in a recording. Raises Refused `recorded_elsewhere`: nobody asks files what an arm did."""
    if run.turner is None:
        raise Refused(
            "recorded_elsewhere",
            "no arm turned the sensor: its readings come from a file, and its motion from another file",
            "Give the recording of an arm; for a command that uses readings alone, give the file",
        )
    return run.turner


def check_arms_times(states: NDArray[Any]) -> None:
    """A recording's times are looked at that nobody could follow. Raises Fault `not_finite`, `impossible_times`."""
    time_s = np.unique(states["time_s"])
    if not np.isfinite(time_s).all():
        raise not_finite("an arm state")
    if len(time_s):
        check_span(time_s, "the arm's states")
