"""The board's clock relative to the controller's, estimated from the data alone.

The gyroscope and the arm (or another turner) measure the same rotation. A coarse search correlates turn rate with joint
rate over all data; a weighted least-squares fit to the data near motion then finds the offset to a fraction of a
millisecond. The delay of the sensor's own filter is part of the offset.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.clocks.clock_fit import MIN_SAMPLES, fit_clock
from rig.observation.clocks.coarse_search import COARSE_STEP_S, MAX_DRIFT, find_coarse_clock
from rig.observation.clocks.time_base import TimeBase, time_base_not_found
from rig.observation.motion.reference_motion import KnownMotion, check_span, not_finite

LONG_RUN_S = 1800.0  # the part of a recording that the coarse search uses first; it takes more only if that fails
MIN_TURN_RATE_RAD_S = 0.05  # RMS over a recording, of an axis that was turned
BLOCK_S, BLOCK_RATES = 0.1, 5  # whose mean speed is compared with the highest; number of rates in it
MOVING_SPEED_RATIO = 0.02  # least speed of a moving turner, as a fraction of its highest
NEAR_MOTION_S = 0.5  # rest around motion that is used: longer than a coarse clock's error


def estimate_time_base(board_time_s: Array, readings_rad_s: Array, motion: KnownMotion) -> TimeBase:
    """Return the board's clock relative to the turner's, estimated from readings (n, 3) taken at board times (n,).

    Raise Fault `not_finite`, `impossible_times`, `board_clock_restarted`, `duplicated_samples`, `stuck_sensor`,
    `stuck_axis`, `time_base_not_found`.
    """
    check_span(motion.time_s, "the states or attitudes")
    _check_samples(board_time_s, readings_rad_s, motion)
    moving = _MovingTimes.find(motion)
    clock, count = _find_first_clock(board_time_s, readings_rad_s, motion)
    while True:
        # The samples are chosen by the present clock: a choice that followed the fitted clock might never settle.
        time_s = clock.controller_time_s(board_time_s[:count])
        used = motion.covered(time_s) & moving.mask(time_s)
        if used.sum() < MIN_SAMPLES:
            raise time_base_not_found("board and arm were hardly recorded at the same time")
        used_time_s = board_time_s[:count][used]
        clock = clock.move_reference(float(used_time_s.mean()))
        clock = fit_clock(clock, used_time_s, readings_rad_s[:count][used], motion)
        if count == len(board_time_s):
            break
        count = _count_until(board_time_s, 2 * (board_time_s[count] - board_time_s[0]))
    if not abs(clock.drift) < MAX_DRIFT or not clock.offset_std_s < COARSE_STEP_S:
        raise time_base_not_found(
            f"the board's clock would run {100 * clock.drift:+.2f} % off, to {clock.offset_std_s * 1e3:.1f} ms"
        )
    return clock


def _check_samples(board_time_s: Array, readings: Array, motion: KnownMotion) -> None:
    """Raise a Fault for too few, impossible or constant samples, from which no clock can be found."""
    if len(board_time_s) < MIN_SAMPLES:
        raise time_base_not_found(
            f"the recording holds {len(board_time_s)} samples, but at least {MIN_SAMPLES} are needed",
            "Raise the rate of the samples, or sweep more slowly",
        )
    check_readings(board_time_s, readings)
    still = np.ptp(readings, axis=0) == 0
    if still.all():
        raise Fault(
            "stuck_sensor",
            f"the gyroscope reads {_triple(readings[0])} rad/s all the time, although the arm moves",
            "Check the sensor's supply and its bus wiring",
        )
    if still.any() and _turns_every_axis(motion):
        raise Fault(
            "stuck_axis",
            f"axis {'xyz'[int(np.argmax(still))]} of the gyroscope never changes, although the arm moves",
            "The sensor is broken or wrongly configured; replace it",
        )


def _turns_every_axis(motion: KnownMotion) -> bool:
    """Return whether the body turns about all directions, so that every sensor axis, however mounted, must respond."""
    rates = motion.rate(motion.time_s[motion.covered(motion.time_s)])
    return bool(np.linalg.eigvalsh(rates.T @ rates).min() > MIN_TURN_RATE_RAD_S**2 * len(rates))


def check_readings(board_time_s: Array, readings: Array) -> None:
    """Raise Fault if readings (n, 3) are not finite or their times (n,) do not rise.

    The faults are `not_finite`, `duplicated_samples`, `board_clock_restarted`, `impossible_times`.
    """
    if not np.isfinite(readings).all():
        raise not_finite("a reading")
    if np.any(np.diff(board_time_s) == 0):
        raise Fault(
            "duplicated_samples",
            "the recording holds two samples of the same moment",
            "Record again; the board's firmware or the link has delivered samples twice",
        )
    if np.any(np.diff(board_time_s) < 0):
        raise Fault(
            "board_clock_restarted",
            "the board's clock goes back within the recording: the board was reset",
            "Check the board's power and cable, then record again",
        )
    check_span(board_time_s, "the samples")


def _find_first_clock(board_time_s: Array, readings: Array, motion: KnownMotion) -> tuple[TimeBase, int]:
    """Return a coarse clock found from only the first samples of a long recording, and the number of these samples.

    All samples are used in a recording of ordinary length, or if fewer do not suffice. Otherwise the caller refines the
    clock with more and more samples, doubling their duration each time.
    """
    span_s = LONG_RUN_S
    while True:
        count = _count_until(board_time_s, span_s)
        try:
            return find_coarse_clock(board_time_s[:count], readings[:count], motion), count
        except Fault:
            if count == len(board_time_s):
                raise
        span_s *= 2


def _count_until(board_time_s: Array, span_s: float) -> int:
    """Return the number of samples in the first `span_s`."""
    return int(np.searchsorted(board_time_s, board_time_s[0] + span_s, side="right"))


@dataclass(frozen=True, slots=True)
class _MovingTimes:
    """The m blocks of `BLOCK_S` after `start_s`; `near` (m,) marks the blocks in or near which the body turns.

    Only samples in these blocks are used for a fit, because at rest there are only vibrations, which the turner's
    encoders and the sensor show differently.
    """

    start_s: float
    near: NDArray[np.bool_]

    @classmethod
    def find(cls, motion: KnownMotion) -> "_MovingTimes":
        """Return all blocks; `near` marks those near a speed of at least `MOVING_SPEED_RATIO` times the highest one."""
        start_s, end_s = motion.time_s[[0, -1]].tolist()
        count = int((end_s - start_s) / BLOCK_S) + 1
        middle_s = start_s + BLOCK_S * (np.arange(count)[:, None] + (np.arange(BLOCK_RATES) + 0.5) / BLOCK_RATES)
        rates = motion.rate(np.minimum(middle_s, end_s).ravel()).reshape(count, -1, 3)
        speed = np.linalg.norm(rates.mean(axis=1), axis=1)
        edge = round(NEAR_MOTION_S / BLOCK_S)
        around = np.lib.stride_tricks.sliding_window_view(np.pad(speed, edge), 2 * edge + 1).max(axis=1)
        return cls(start_s, around >= MOVING_SPEED_RATIO * speed.max())

    def mask(self, time_s: Array) -> NDArray[np.bool_]:
        """Return a mask of the times (n,) that lie in or near a block with motion."""
        index = np.clip((time_s - self.start_s) / BLOCK_S, 0, len(self.near) - 1).astype(np.intp)
        mask: NDArray[np.bool_] = self.near[index]
        return mask


def _triple(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
