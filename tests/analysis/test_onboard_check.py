"""The board's own calibration is held against the host's arithmetic, over resumed runs as well."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from rig.analysis.calibration import solve_runs
from rig.analysis.onboard_check import agreement, check_observed
from rig.data.run_file import Event, RunData
from rig.errors import Fault
from rig.observation.observe import finished
from rig.report.sensor_entry import sensor_entry
from rig.report.table import print_result
from rig.runner.onboard import observed_sweeps
from support.results import result_document
from support.synthetic_run import SENSITIVITY, Setup, synthetic_run

START_MARGIN_US = 300_000  # past the ramps


@pytest.fixture(scope="module")
def run() -> RunData:
    return synthetic_run(Setup(noise_rad_s=0.002))


def event(name: str, **detail: Any) -> Event:
    return Event(name, 0.0, 0.0, {"sensor": "gyro", **detail})


def observed(run: RunData, sweeps: Sequence[int]) -> list[Event]:
    """What a board would answer for these sweeps: averages over most of the turn at constant speed."""
    board_us = run.samples["gyro"]["board_time_us"]
    found = []
    for sweep, (start_s, end_s) in finished(run, "sweep"):
        if sweep["index"] in sweeps:
            # the synthetic board's clock began at controller time −4321 s
            start, end = (round((time_s + 4321.0) * 1e6) for time_s in (start_s, end_s))
            start, end = start + START_MARGIN_US, end - START_MARGIN_US
            used = (board_us >= start) & (board_us < end)
            mean = (run.samples["gyro"]["counts"][used].mean(axis=0) * SENSITIVITY).astype(np.float32)
            found.append(
                event(
                    "board_observed",
                    sweep=sweep["index"],
                    start_us=start,
                    end_us=end,
                    samples=int(used.sum()),
                    mean_rad_s=mean.tolist(),
                    speed_rad_s=float(np.radians(60)),
                )
            )
    return found


def solved(scale: Sequence[float], bias_rad_s: Sequence[float], status: str = "solved") -> Event:
    return event("board_solved", method="closed_form", status=status, scale=list(scale), bias_rad_s=list(bias_rad_s))


def with_events(run: RunData, events: Sequence[Event]) -> RunData:
    return replace(run, events=(*run.events, *events))


def double_precision(run: RunData) -> tuple[np.ndarray, np.ndarray]:
    """What the host makes of the same observations."""
    found = agreement([with_events(run, observed(run, range(6)))], "gyro")
    assert found.host_scale is not None and found.host_bias_rad_s is not None
    return found.host_scale, found.host_bias_rad_s


def test_a_board_that_rounds_to_single_precision_agrees(run: RunData) -> None:
    scale, bias = double_precision(run)
    board = solved(scale.astype(np.float32).tolist(), bias.astype(np.float32).tolist())
    found = agreement([with_events(run, [*observed(run, range(6)), board])], "gyro")
    assert all(check.passed for check in found.checks("gyro"))


@pytest.mark.parametrize(
    ("factor", "shift_rad_s", "failing"), [(1.0002, 0.0, "gyro.board_scale"), (1.0, 2e-5, "gyro.board_bias")]
)
def test_a_board_that_computes_wrongly_fails_by_name(
    run: RunData, factor: float, shift_rad_s: float, failing: str
) -> None:
    scale, bias = double_precision(run)
    board = solved((scale * np.array([1, factor, 1])).tolist(), (bias + np.array([0, 0, shift_rad_s])).tolist())
    found = agreement([with_events(run, [*observed(run, range(6)), board])], "gyro")
    assert [check.name for check in found.checks("gyro") if not check.passed] == [failing]


def test_a_board_without_a_solution_is_not_measured_and_fails(run: RunData) -> None:
    for events in (
        [],
        observed(run, range(6)),
        [*observed(run, range(6)), solved((0, 0, 0), (0, 0, 0), "not_converged")],
    ):
        checks = agreement([with_events(run, events)], "gyro").checks("gyro")
        assert [(check.value, check.passed) for check in checks] == [(None, False)] * 2


def test_a_sweep_the_board_missed_is_a_fault_that_a_resumed_run_repeats(run: RunData) -> None:
    check_observed(with_events(run, observed(run, range(6))), ["gyro"])
    missed = with_events(run, [*observed(run, range(5)), event("board_not_observed", sweep=5, reason="not_kept: late")])
    with pytest.raises(Fault, match=r"board_missed_sweep: .*gyro, sweep 5: not_kept: late"):
        check_observed(missed, ["gyro"])
    assert observed_sweeps(missed, ["gyro"]) == {0, 1, 2, 3, 4}


def test_a_resumed_run_recalls_what_was_observed_before(run: RunData) -> None:
    scale, bias = double_precision(run)
    first = with_events(run, observed(run, [0, 1, 2]))
    recalled = [event("board_recalled", sweep=sweep) for sweep in (0, 1, 2)]
    second = with_events(run, [*recalled, *observed(run, [3, 4, 5]), solved(scale.tolist(), bias.tolist())])
    found = agreement([first, second], "gyro")
    assert all(check.passed for check in found.checks("gyro"))
    assert found.scale_difference == pytest.approx(0, abs=1e-12)


def test_a_sample_lost_on_the_way_is_no_disagreement(run: RunData) -> None:
    """One of a thousand may be missing; the mean of the rest is off by more than the board's arithmetic is."""
    scale, bias = double_precision(run)
    seen = with_events(run, [*observed(run, range(6)), solved(scale.tolist(), bias.tolist())])
    samples = seen.samples["gyro"]
    board_us = samples["board_time_us"]
    starts_us = [event.detail["start_us"] for event in seen.events if event.name == "board_observed"]
    inside = [int(np.searchsorted(board_us, start_us)) + 700 for start_us in starts_us]

    def without(some: Sequence[int]) -> RunData:
        return replace(seen, samples={"gyro": np.delete(samples, some)})

    found = agreement([without(inside[:1])], "gyro")
    assert found.scale_difference is not None and found.scale_difference < 1e-6
    assert all(check.passed for check in found.checks("gyro"))
    assert agreement([without(inside)], "gyro").scale_difference is None  # not one mean is left to check


def test_a_board_that_averages_other_samples_than_it_says_fails(run: RunData) -> None:
    scale, bias = double_precision(run)
    claimed = [replace(one, detail={**one.detail, "samples": 1000}) for one in observed(run, range(6))]
    found = agreement([with_events(run, [*claimed, solved(scale.tolist(), bias.tolist())])], "gyro")
    assert not any(check.passed for check in found.checks("gyro"))


def test_a_sweep_the_board_missed_is_told(run: RunData) -> None:
    missed = event("board_not_observed", sweep=5, reason="not_kept: too late")
    unsolved = event(
        "board_solved",
        method="closed_form",
        status="too_few_observations",
        observations=5,
        iterations=0,
        scale=[0.0] * 3,
        bias_rad_s=[0.0] * 3,
    )
    events = [*observed(run, range(5)), missed, unsolved]
    result = solve_runs([run])["gyro"]
    entry = sensor_entry(result, "calibrate", agreement([with_events(run, events)], "gyro"))
    console = Console(width=120, record=True)
    print_result(result_document({"gyro": entry}, passed=False), console)
    shown = console.export_text()
    assert "on the board: too_few_observations, from 5 sweeps" in shown
    assert "not observed by the board: sweep 5: not_kept: too late" in shown
