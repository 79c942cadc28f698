"""The motion of a chain of joints as a function of time, from all the states that were recorded."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array, median_step
from rig.estimation.cubic_spline import CubicSpline
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import (
    NOMINAL,
    axis_errors,
    flange_arm,
    flange_attitude,
    flange_axes,
    flange_rate,
    flange_rate_by_joint,
)
from rig.motion.steps import Sweep
from rig.motion.turner_state import JOINT_NAMES
from rig.observation.motion.even_turn import SMOOTHING_S, find_even_turn, fit_lines, well_timed
from rig.observation.motion.reference_motion import MIN_RATE_RAD_S, check_span, closely_followed, not_finite
from rig.observation.motion.revolution import MAX_STATE_STEP_S, Revolution, find_revolution
from rig.observation.oscillation import MAX_TRAVEL_AT_REST_RAD, MIN_OSCILLATION_ANGLES, remove_oscillation
from rig.observation.windows import Window

if TYPE_CHECKING:
    from rig.data.recording.recorded_turner import RecordedTurner

RATE_STEP_S = 0.008  # a shorter one shows the encoders' noise more than the rate
KNOT_S = 0.004  # interval between the knots of the rate: a ripple too fast for them would alias to a slower one
MAX_STEP_S = 0.025  # samples that are farther apart alias a ripple of the servo
REST_PARTS = 5  # if single readings scatter, the parts' means show whether a joint moved
MAX_RANGE_RATIO = 8.0  # to the difference of adjacent angles: noise of ten thousand readings has a smaller range
ATTITUDES = 72  # attitudes in a mean: over whole turns the part perpendicular to the axis averages out


class ArmMotion:
    """The `KnownMotion` of a chain of k joints: `angles(t)` (n, k) rad, and `rate(t)` (n, 3) rad/s of the flange.

    Rates come from the recorded joint angles, because the controller filters its velocity signal. `states` (m,) are
    rows of `state_dtype`; `kinematics` and `names` describe the joints. `mount` (3, 3) transforms all vectors in the
    flange's frame to the item's: the identity unless a stage mounts the item differently. `reading_std_rad` is the
    standard deviation of one reading of an angle. If it is not 0, angles and rates are fitted over a window, and a turn
    ends when its first reading recurs, because the encoder is accurate only over whole turns. Raise Fault `no_motion`,
    `not_finite`, `impossible_times`, `arm_clock_stepped`.
    """

    def __init__(
        self,
        states: NDArray[Any],
        kinematics: DenavitHartenberg = NOMINAL,
        names: Sequence[str] = JOINT_NAMES,
        mount: Array | None = None,
        reading_std_rad: float = 0.0,
    ) -> None:
        """Fit splines to the joint angles and the flange's rates; mark the times that the states cover."""
        self.kinematics, self.names, self._noisy_angles = kinematics, names, reading_std_rad > 0
        self.mount: Array = np.eye(3) if mount is None else mount
        states = well_timed(states) if self._noisy_angles else states
        _check_order(states["time_s"])
        self.time_s, first = np.unique(states["time_s"], return_index=True)
        self._states = states[first]
        if len(self.time_s) < 4 or not names:
            what = f"the recording holds {len(self.time_s)} arm states" if names else "the turner has no joints"
            raise Fault("no_motion", what, "Record a run with the arm on")
        if not (np.isfinite(self.time_s).all() and np.isfinite(self._states["q_rad"]).all()):
            raise not_finite("an arm state")
        check_span(self.time_s, "the arm's states")
        if self._noisy_angles:
            times_s, angles, joint_rates = fit_lines(self.time_s, self._states["q_rad"])
            self.angles = CubicSpline(times_s, angles)
            rates = flange_rate(angles, joint_rates, kinematics) @ self.mount.T
        else:
            self.angles = CubicSpline(self.time_s, self._states["q_rad"])
            step_s = median_step(self.time_s)
            times_s = self.time_s[:: max(min(round(KNOT_S / step_s), len(self.time_s) // 4), 1)]
            rates = self.mean_rates(times_s, max(RATE_STEP_S, step_s))
        if not np.linalg.norm(rates, axis=1).max() > MIN_RATE_RAD_S:
            raise Fault("no_motion", "the arm is at rest in the whole recording", "Record a run with sweeps")
        self.rate = CubicSpline(times_s, rates)
        close = np.diff(self.time_s) <= (SMOOTHING_S / 3 if self._noisy_angles else MAX_STATE_STEP_S)
        self._covered = close & np.append(close[1:], True) & np.append(True, close[:-1])

    @property
    def host_time_s(self) -> Array:
        """Times (m,) of this computer at which the states of `time_s` arrived."""
        times_s: Array = self._states["host_time_s"]
        return times_s

    def attitude(self, start_s: float, end_s: float) -> Array:
        """Return the mean rotation (3, 3) from the base frame into the flange's between two controller times."""
        mean: Array = self.mean_attitudes(np.array([start_s]), np.array([end_s]))[0]
        return mean

    def mean_attitudes(self, starts_s: Array, ends_s: Array) -> Array:
        """Return the mean rotations (n, 3, 3), as `attitude` does, in n intervals from `starts_s` to `ends_s` (n,)."""
        middles_s = (ends_s - starts_s) / (2 * ATTITUDES)
        times_s = np.linspace(starts_s, ends_s, ATTITUDES, endpoint=False) + middles_s
        mean: Array = self.attitudes(times_s).mean(axis=0)
        return mean

    def attitudes(self, time_s: Array) -> Array:
        """Return the rotations (n, 3, 3) from the base frame into the flange's at controller times (n,)."""
        rotations: Array = self.mount @ flange_attitude(self.angles(time_s), self.kinematics)
        return rotations

    def axes(self, q_rad: Array) -> Array:
        """Return the unit vectors (…, 3, 6) of the joints' axes for positive rotation, at joint angles (…, 6)."""
        axes: Array = self.mount @ flange_axes(q_rad, self.kinematics)
        return axes

    def axis_errors(self, q_rad: Array, joint: int) -> Array:
        """Return the change (…, 13, 3) of a joint's axis per radian of each error in `geometry.AXIS_ERRORS`."""
        errors: Array = axis_errors(q_rad, joint, self.kinematics) @ self.mount.T
        return errors

    def covered(self, time_s: Array) -> NDArray[np.bool_]:
        """Return a mask of the times (n,) between states that are close enough together for `rate` to be valid."""
        return closely_followed(self.time_s, self._covered, time_s)

    @property
    def has_accurate_angles(self) -> bool:
        """Whether single angles are accurate; if not, only whole turns are, from one reading to its recurrence."""
        return not self._noisy_angles

    def travel_rad(self, window: Window) -> float | None:
        """Return the travel, rad, of the joint that moved most in a window; None for fewer than two states.

        The oscillation of an arm at rest is excluded, because means are corrected for it.
        """
        q_rad = self._q_rad(window)
        if self._noisy_angles and len(q_rad) >= REST_PARTS:
            q_rad = np.array([part.mean(axis=0) for part in np.array_split(q_rad, REST_PARTS)])
        if len(q_rad) < 2:
            return None
        travel_rad = float(np.ptp(q_rad, axis=0).max())
        if travel_rad > MAX_TRAVEL_AT_REST_RAD and len(q_rad) >= MIN_OSCILLATION_ANGLES:
            travel_rad = float(np.ptp(remove_oscillation(q_rad), axis=0).max())
        return travel_rad

    def is_moving(self, start_s: float, end_s: float) -> NDArray[np.bool_]:
        """Return a mask (k,) of the joints whose angles change by more than encoder noise between two times."""
        return np.isnan(self._standing_rad(start_s, end_s))

    def max_distance_rad(self, window: Window, q_rad: Sequence[float]) -> float | None:
        """Return the largest distance of any joint from the pose `q_rad` (k,) in a window, or None without a state."""
        recorded_rad = self._q_rad(window)
        return float(np.abs(recorded_rad - np.array(q_rad)).max()) if len(recorded_rad) else None

    def angle(self, sweep: Sweep, time_s: Array | float, derivative: int = 0) -> Array:
        """Return the angle (n,) rad of the joint that a sweep turns, at times (n,); its rate if `derivative` is 1."""
        angle: Array = self.angles(time_s, derivative)[..., sweep.joint]
        return angle

    def mean_rates(self, time_s: Array, lasting_s: float) -> Array:
        """Return the flange's mean rate (n, 3), rad/s, over `lasting_s` around each of the times (n,).

        Rates are differences of joint angles, so an angle's error cancels between adjacent rates, and the mean over
        consecutive samples depends only on the first and the last angle.
        """
        return self._mean_rates(time_s, lasting_s, np.full(self.kinematics.joints, np.nan))

    def rates_at_samples(self, time_s: Array) -> Array:
        """Return the flange's rate (n, 3), rad/s, around consecutive evenly spaced samples at rising times (n,).

        A sample's rate is the mean over one interval between samples, or over `RATE_STEP_S` if samples are far apart,
        with the sample in the middle. Joints that stand still between the first and the last sample get the rate zero,
        so that their encoders' noise is not added to the motion.
        """
        standing_rad = self._standing_rad(float(time_s[0]), float(time_s[-1]))
        return self._mean_rates(time_s, _averaging_time(time_s), standing_rad)

    def state_gain(self, time_s: Array, weights: Array) -> float:
        """Return how many times more noise the states' angles cause in a weighted mean rate than in the plain mean.

        The weighted mean is that of `rates_at_samples` with `weights` (n,); the plain mean is the angle from first to
        last state divided by the time. For this ratio, angles between states are interpolated linearly.
        """
        lasting_s = _averaging_time(time_s)
        # A rate at a sample is the difference of two interpolated angles; `by_state` is the weight of each state.
        edges_s = np.concatenate([time_s + lasting_s / 2, time_s - lasting_s / 2])
        sizes = np.concatenate([weights, -weights]) / lasting_s
        later = np.clip(np.searchsorted(self.time_s, edges_s), 1, len(self.time_s) - 1)
        fraction = (edges_s - self.time_s[later - 1]) / (self.time_s[later] - self.time_s[later - 1])
        by_state = np.bincount(later - 1, sizes * (1 - fraction), len(self.time_s))
        by_state += np.bincount(later, sizes * fraction, len(self.time_s))
        return float(np.linalg.norm(by_state) * (time_s[-1] - time_s[0] + lasting_s) / np.sqrt(2))

    def mean_rate(self, start_s: float, end_s: float) -> Array:
        """Return the flange's mean rate (3,), rad/s, from one time to another."""
        count = max(round((end_s - start_s) / RATE_STEP_S), 1)
        lasting_s = (end_s - start_s) / count
        middles_s = np.linspace(start_s + lasting_s / 2, end_s - lasting_s / 2, count)
        rate: Array = self.mean_rates(middles_s, lasting_s).mean(axis=0)
        return rate

    def turn(self, sweep: Sweep, window: Window, thresholds: ObservationThresholds) -> Revolution:
        """Return the whole turn, or the arc, of a sweep in a window.

        Raise Fault `incomplete_revolution`, `arm_states_lost`, `speed_slider`, `speed_limited`, `speed_not_constant`,
        `other_joint_moved`.
        """
        begin, end = np.searchsorted(self.time_s, [window.start_s, window.end_s])
        find = find_even_turn if self._noisy_angles else find_revolution
        ends = find(self._states[max(begin - 1, 0) : end + 1], sweep, thresholds)
        start_q_rad = self.angles(ends.start_s)
        rate = self.rate(ends.time_s).mean(axis=0)
        return Revolution(
            ends.start_s,
            ends.end_s,
            ends.duration_std_s,
            axis_flange=rate / np.linalg.norm(rate),
            attitude=self.mount @ flange_attitude(start_q_rad, self.kinematics),
            axis_errors=sweep.growing * self.axis_errors(start_q_rad, sweep.joint),
            arm_m=self.mount @ flange_arm(start_q_rad, sweep.joint, self.kinematics),
            station=(sweep.joint, *np.round(np.delete(start_q_rad, sweep.joint), 2).tolist()),
            angle_rad=sweep.angle_rad,
            uneven=self._noisy_angles,
        )

    def table(self) -> dict[str, Array]:
        """Return the states as columns (m,) by name: times, and the controller's angles and rates of the joints."""
        angles = {f"{joint}_rad": self._states["q_rad"][:, i] for i, joint in enumerate(self.names)}
        rates = {f"{joint}_rad_s": self._states["qd_rad_s"][:, i] for i, joint in enumerate(self.names)}
        return {"time_s": self.time_s, **angles, **rates}

    def _mean_rates(self, time_s: Array, lasting_s: float, standing_rad: Array) -> Array:
        """Return the rates of `mean_rates`; `standing_rad` (k,) are the angles of joints at rest, NaN for others."""
        moving = np.flatnonzero(np.isnan(standing_rad))
        if not len(moving):
            return np.zeros((len(time_s), 3))
        columns = None if len(moving) == len(standing_rad) else moving
        before, middle, after = (
            self.angles(time_s + shift_s, columns=columns) for shift_s in (-lasting_s / 2, 0.0, lasting_s / 2)
        )
        angles: list[Array | float] = standing_rad.tolist()
        speeds: list[Array | float] = [0.0] * len(angles)
        for joint, angle, change in zip(moving.tolist(), middle.T, (after - before).T, strict=True):
            angles[joint], speeds[joint] = angle, change / lasting_s
        rates: Array = flange_rate_by_joint(angles, speeds, self.kinematics) @ self.mount.T
        return rates

    def _standing_rad(self, start_s: float, end_s: float) -> Array:
        """Return the mean angle (k,) of each joint that stands still between two times, NaN for others."""
        q_rad = self._q_rad(Window(start_s, end_s))
        if len(q_rad) < 2:
            return np.full(self.kinematics.joints, np.nan)
        noise_rad = np.sqrt(np.mean(np.diff(q_rad, axis=0) ** 2, axis=0))
        return np.where(np.ptp(q_rad, axis=0) > MAX_RANGE_RATIO * noise_rad, np.nan, q_rad.mean(axis=0))

    def _q_rad(self, window: Window) -> Array:
        start = np.searchsorted(self.time_s, window.start_s)
        end = np.searchsorted(self.time_s, window.end_s, side="right")
        q_rad: Array = self._states["q_rad"][start:end]
        return q_rad


def _averaging_time(time_s: Array) -> float:
    """Return the time, s, over which the arm's rate is averaged around samples at times (n,)."""
    step_s = median_step(time_s)
    return RATE_STEP_S if step_s > MAX_STEP_S else step_s


def is_sparse(time_s: Array) -> bool:
    """Return whether samples at times (n,) are too sparse for the arm's mean rates between them."""
    return median_step(time_s) > MAX_STEP_S


def motion_of(run: RunData, correction: Array | None = None) -> ArmMotion:
    """Return the turner's motion in a recording, in the item's frame.

    `correction` (3, 3) is the rotation of the item from its nominal to its actual mounting. Raise as `turner_of` does;
    Fault `no_motion`, `not_finite`, `impossible_times`, `arm_clock_stepped`.
    """
    turner = turner_of(run)
    mount = np.array(run.settings.mount)
    mount = mount if correction is None else correction @ mount
    return ArmMotion(run.states, turner.geometry, turner.joints, mount, turner.reading_std_rad)


def _check_order(time_s: Array) -> None:
    """Raise Fault `arm_clock_stepped` if a state has an earlier time than the one that arrived before it."""
    steps_back = np.flatnonzero(np.diff(time_s) < 0)
    if len(steps_back):
        before_s, after_s = time_s[steps_back[0] : steps_back[0] + 2]
        raise Fault(
            "arm_clock_stepped",
            f"the time of the arm's states goes back from {before_s:.3f} s to {after_s:.3f} s: the controller's clock "
            "was set",
            "Record again; nothing in this recording can be put on one clock",
        )


def turner_of(run: RunData) -> "RecordedTurner":
    """Return the machine that turned the sensor. Raise Refused `recorded_elsewhere` for a recording from files."""
    if run.turner is None:
        raise Refused(
            "recorded_elsewhere",
            "no arm turned the sensor: its readings come from a file, and its motion from another file",
            "Give the recording of an arm; for a command that uses readings alone, give the file",
        )
    return run.turner


def check_arms_times(states: NDArray[Any]) -> None:
    """Raise Fault `not_finite` or `impossible_times` if the states' times are not finite or too far apart."""
    time_s = np.unique(states["time_s"])
    if not np.isfinite(time_s).all():
        raise not_finite("an arm state")
    if len(time_s):
        check_span(time_s, "the arm's states")
