"""The board's own calibration is held against the host's arithmetic, over resumed runs as well."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from firmware_host.answers import BoardObservation, BoardSolution
from rig.analysis.gyroscope.onboard_check import check_arithmetic, check_observed
from rig.data.recording.recorded_events import (
    BoardNotObserved,
    BoardObserved,
    BoardRecalled,
    BoardSolved,
    Event,
    TimedEvent,
)
from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.observation.onboard_window import find_averaged_sweeps
from rig.observation.windows import swept
from rig.report.entries.gyroscope import sensor_entry
from rig.report.terminal.result_table import print_result
from support.documents.results import result_document
from support.recordings.solving import solve_runs
from support.recordings.synthetic_run import SENSITIVITY, Setup, synthetic_run

START_MARGIN_US = 300_000  # past the ramps


@pytest.fixture(scope="module")
def run() -> RunData:
    return synthetic_run(Setup(noise_rad_s=0.002))


def observed(run: RunData, sweeps: Sequence[int]) -> list[Event]:
    """What a board would answer for these sweeps: averages over most of the turn at constant speed."""
    board_us = run.samples["gyro"]["board_time_us"]
    found: list[Event] = []
    for made in swept(run):
        if made.sweep.index in sweeps:
            # the synthetic board's clock began at controller time −4321 s
            start, end = (round((time_s + 4321.0) * 1e6) for time_s in (made.window.start_s, made.window.end_s))
            start, end = start + START_MARGIN_US, end - START_MARGIN_US
            used = (board_us >= start) & (board_us < end)
            mean = (run.samples["gyro"]["counts"][used].mean(axis=0) * SENSITIVITY).astype(np.float32)
            answer = BoardObservation(made.sweep.index, start, end, int(used.sum()), tuple(mean.tolist()))
            found.append(BoardObserved("gyro", made.sweep.index, float(np.radians(60)), answer))
    return found


def solved(
    scale: tuple[float, float, float], bias_rad_s: tuple[float, float, float], status: str = "solved", sweeps: int = 6
) -> BoardSolved:
    return BoardSolved("gyro", BoardSolution("closed_form", status, sweeps, 1, scale, bias_rad_s))


def triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def with_events(run: RunData, events: Sequence[Event]) -> RunData:
    return replace(run, events=(*run.events, *(TimedEvent(event, 0.0, 0.0) for event in events)))


def double_precision(run: RunData) -> tuple[np.ndarray, np.ndarray]:
    """What the host makes of the same observations."""
    found = check_arithmetic([with_events(run, observed(run, range(6)))], "gyro")
    assert found.host_scale is not None and found.host_bias_rad_s is not None
    return found.host_scale, found.host_bias_rad_s


def test_a_board_that_rounds_to_single_precision_agrees(run: RunData) -> None:
    scale, bias = double_precision(run)
    board = solved(triple(scale.astype(np.float32)), triple(bias.astype(np.float32)))
    found = check_arithmetic([with_events(run, [*observed(run, range(6)), board])], "gyro")
    assert all(check.passed for check in found.checks("gyro"))


@pytest.mark.parametrize(
    ("factor", "shift_rad_s", "failing", "unit"),
    [(1.0002, 0.0, "gyro.board_scale", "1"), (1.0, 2e-5, "gyro.board_bias", "rad/s")],
)
def test_a_board_that_computes_wrongly_fails_by_name(
    run: RunData, factor: float, shift_rad_s: float, failing: str, unit: str
) -> None:
    scale, bias = double_precision(run)
    board = solved(triple(scale * np.array([1, factor, 1])), triple(bias + np.array([0, 0, shift_rad_s])))
    found = check_arithmetic([with_events(run, [*observed(run, range(6)), board])], "gyro")
    assert [(check.name, check.unit) for check in found.checks("gyro") if not check.passed] == [(failing, unit)]


def test_a_board_without_a_solution_is_not_measured_and_fails(run: RunData) -> None:
    without: list[list[Event]] = [
        [],
        [*observed(run, range(6))],
        [*observed(run, range(6)), solved((0, 0, 0), (0, 0, 0), "not_converged")],
    ]
    for events in without:
        checks = check_arithmetic([with_events(run, events)], "gyro").checks("gyro")
        assert [(check.value, check.passed) for check in checks] == [(None, False)] * 2


def test_a_sweep_the_board_missed_is_a_fault_that_a_resumed_run_repeats(run: RunData) -> None:
    check_observed(with_events(run, observed(run, range(6))), ["gyro"])
    missed = with_events(run, [*observed(run, range(5)), BoardNotObserved("gyro", 5, "not_kept: late")])
    with pytest.raises(Fault, match=r"board_missed_sweep: .*gyro, sweep 5: not_kept: late"):
        check_observed(missed, ["gyro"])
    assert find_averaged_sweeps(missed, ["gyro"]) == {0, 1, 2, 3, 4}


def test_a_resumed_run_recalls_what_was_observed_before(run: RunData) -> None:
    scale, bias = double_precision(run)
    first = with_events(run, observed(run, [0, 1, 2]))
    recalled = [BoardRecalled("gyro", sweep) for sweep in (0, 1, 2)]
    second = with_events(run, [*recalled, *observed(run, [3, 4, 5]), solved(triple(scale), triple(bias))])
    found = check_arithmetic([first, second], "gyro")
    assert all(check.passed for check in found.checks("gyro"))
    assert found.scale_difference == pytest.approx(0, abs=1e-12)


def test_a_recall_of_what_no_recording_holds_is_not_checked_and_fails(run: RunData) -> None:
    scale, bias = double_precision(run)
    alone = with_events(
        run, [BoardRecalled("gyro", 0), *observed(run, range(1, 6)), solved(triple(scale), triple(bias))]
    )
    assert not any(check.passed for check in check_arithmetic([alone], "gyro").checks("gyro"))


def test_a_sample_lost_on_the_way_is_no_disagreement(run: RunData) -> None:
    """One of a thousand may be missing; the mean of the rest is off by more than the board's arithmetic is."""
    scale, bias = double_precision(run)
    seen = with_events(run, [*observed(run, range(6)), solved(triple(scale), triple(bias))])
    samples = seen.samples["gyro"]
    board_us = samples["board_time_us"]
    starts_us = [one.observation.start_us for one in observed(run, range(6)) if isinstance(one, BoardObserved)]
    inside = [int(np.searchsorted(board_us, start_us)) + 700 for start_us in starts_us]

    def without(some: Sequence[int]) -> RunData:
        return replace(seen, samples={"gyro": np.delete(samples, some)})

    found = check_arithmetic([without(inside[:1])], "gyro")
    assert found.scale_difference is not None and found.scale_difference < 1e-6
    assert all(check.passed for check in found.checks("gyro"))
    assert check_arithmetic([without(inside)], "gyro").scale_difference is None  # not one mean is left to check


def test_a_board_that_averages_other_samples_than_it_says_fails(run: RunData) -> None:
    scale, bias = double_precision(run)
    claimed = [
        replace(one, observation=replace(one.observation, samples=1000))
        for one in observed(run, range(6))
        if isinstance(one, BoardObserved)
    ]
    found = check_arithmetic([with_events(run, [*claimed, solved(triple(scale), triple(bias))])], "gyro")
    assert not any(check.passed for check in found.checks("gyro"))


@pytest.mark.slow
def test_a_sweep_that_the_board_missed_is_reported(run: RunData) -> None:
    missed = BoardNotObserved("gyro", 5, "not_kept: too late")
    unsolved = solved((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "too_few_observations", sweeps=5)
    events: list[Event] = [*observed(run, range(5)), missed, unsolved]
    result = solve_runs([run])["gyro"]
    entry = sensor_entry(result, "calibrate", check_arithmetic([with_events(run, events)], "gyro"))
    console = Console(width=120, record=True)
    print_result(result_document({"gyro": entry}, passed=False), console)
    shown = console.export_text()
    assert "on the board: too_few_observations, from 5 sweeps" in shown
    assert "not observed by the board: sweep 5: not_kept: too late" in shown
