"""The board's even average of a sweep and the computer's mean of it contradict each other by name, or not at all."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from firmware_host.answers import BoardObservation
from rig.analysis.gyroscope.board_averages import LIMIT, board_averages
from rig.analysis.gyroscope.calibration import observe_recordings
from rig.data.recording.recorded_events import BoardObserved, TimedEvent
from rig.data.recording.run_data import RunData
from rig.observation.observed_run import ObservedRun
from support.recordings.synthetic_run import SENSITIVITY, Setup, synthetic_run

pytestmark = pytest.mark.slow

RIPPLED = Setup(noise_rad_s=4.5e-4, vibration=0.05, orders=(5, 9, 68), state_rate_hz=500.0, sample_rate_hz=200.0)
SHORTER_US = 15_000  # at either end: blocks of readings do not end where a turn does


@pytest.fixture(scope="module")
def recording() -> ObservedRun:
    return observe_recordings([synthetic_run(RIPPLED)])[0]


def with_averages(recording: ObservedRun, factors: Sequence[float]) -> ObservedRun:
    """The board's own average of each turn, times a factor."""
    run: RunData = recording.run
    board_us, counts = run.samples["gyro"]["board_time_us"], run.samples["gyro"]["counts"]
    stream, events = recording.stream("gyro"), list(run.events)
    for turn, factor in zip(recording.sensors["gyro"].revolutions, factors, strict=True):
        inside = np.searchsorted(stream.time_s, [turn.average.start_s, turn.average.end_s])
        start_us, end_us = int(board_us[inside[0]]) + SHORTER_US, int(board_us[inside[1]]) - SHORTER_US
        used = (board_us >= start_us) & (board_us < end_us)
        mean = (factor * counts[used].mean(axis=0) * SENSITIVITY).astype(np.float32)
        answer = BoardObservation(turn.sweep, start_us, end_us, int(used.sum()), tuple(mean.tolist()))
        events.append(TimedEvent(BoardObserved("gyro", turn.sweep, turn.speed_rad_s, answer), 0.0, 0.0))
    return replace(recording, run=replace(run, events=tuple(events)))


def test_of_an_arm_that_ripples_both_agree_although_their_windows_differ(recording: ObservedRun) -> None:
    """Over its window the board's average differs from 2π/T by the ripple: by twenty times what is allowed."""
    (check,) = board_averages("gyro", [with_averages(recording, [1.0] * 6)])
    assert check.name == "gyro.board_average" and check.passed
    assert check.value is not None and check.value < LIMIT / 3


def test_an_average_that_is_not_of_these_readings_fails_and_names_the_sweep(recording: ObservedRun) -> None:
    """By seven parts in ten thousand: so far was a mean rate that did not belong to its mean reading."""
    checks = board_averages("gyro", [with_averages(recording, [1.0, 1.0, 1.0007, 1.0, 1.0, 1.0])])
    assert [check.name for check in checks if not check.passed] == ["gyro.board_average.2"]


def test_without_the_board_s_averages_nothing_is_compared(recording: ObservedRun) -> None:
    assert board_averages("gyro", [recording]) == ()
