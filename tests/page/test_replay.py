"""A recording, replayed: the steps, the arm and the samples as they were, in the controller's time."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from rig.analysis.partial_results import so_far
from rig.data.recording.recorded_events import BoardNotObserved, BoardRecalled, TimedEvent
from rig.data.recording.run_data import RunData
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.page.about import About
from rig.page.page_state import PageState
from rig.page.replay import Moment, moments
from rig.page.rows import Look, look_of
from rig.station.events import ArmSeen, PhaseStarted, Progress, SamplesTaken, StepFinished, StepStarted
from support.recordings.synthetic_run import Setup, synthetic_run


@pytest.fixture(scope="module")
def run() -> RunData:
    """With samples that came while the arm moved."""
    made = synthetic_run(Setup(noise_rad_s=0.005, speed_deg_s=120))
    samples, arm = made.samples["gyro"].copy(), made.states
    samples["sequence"] = np.arange(len(samples))
    samples["host_time_s"] = np.linspace(arm["host_time_s"][0], arm["host_time_s"][-1], len(samples))
    return replace(made, samples={"gyro": samples})


@pytest.fixture(scope="module")
def replayed(run: RunData) -> list[Moment]:
    return list(moments(run))


@pytest.mark.slow
def test_steps_come_in_order_and_time_goes_on(replayed: list[Moment]) -> None:
    assert isinstance(replayed[0].event, PhaseStarted)
    assert all(one.at_s <= other.at_s for one, other in pairwise(replayed))
    started = [moment.event for moment in replayed if isinstance(moment.event, StepStarted)]
    finished = [moment.event for moment in replayed if isinstance(moment.event, StepFinished)]
    assert [event.number for event in started] == [event.number for event in finished]
    assert [event.number for event in started] == list(range(1, started[0].count + 1))
    progress = [moment.event for moment in replayed if isinstance(moment.event, Progress)]
    assert all(0 <= each.fraction <= 1 and each.remaining_s >= 0 for each in progress)
    assert progress[-1].remaining_s < 0.2


@pytest.mark.slow
def test_the_arm_and_the_samples_are_those_of_that_moment(run: RunData, replayed: list[Moment]) -> None:
    seen = [moment for moment in replayed if isinstance(moment.event, ArmSeen)]
    for moment in seen[:: len(seen) // 20]:
        assert isinstance(moment.event, ArmSeen)
        at_s = moment.event.state.time_s - run.states["time_s"][0]
        assert abs(at_s - moment.at_s) < 0.05
        place = np.searchsorted(run.states["time_s"], moment.event.state.time_s)
        assert moment.event.state.q_rad == tuple(run.states["q_rad"][place])
    last = [moment.event for moment in replayed if isinstance(moment.event, SamplesTaken)][-1]
    assert last.sensors[0].samples == len(run.samples["gyro"]) and last.sensors[0].lost == 0


@pytest.mark.slow
def test_what_is_shown_at_the_end_is_all_of_it(replayed: list[Moment]) -> None:
    shown = PageState(About("", "", replayed=True, arm={"model": "UR10e or UR12e", "serial_number": "2026"}))
    for moment in replayed:
        if isinstance(moment.event, Look):
            shown.look(moment.event)
        else:
            shown.take(moment.event)
    assert (shown.sections["arm"]["model"], shown.sections["arm"]["serial_number"]) == ("UR10e or UR12e", "2026")
    assert [(row["sweep"], row["by"]) for row in shown.sections["observations"]] == [(n, "host") for n in range(6)]
    assert shown.sections["parameters"][0]["scale"][0] == pytest.approx(1.1771, rel=1e-3)


@pytest.mark.slow
def test_a_value_is_rounded_on_the_screen_alone(run: RunData) -> None:
    """Rounded twice, its last digit there would be another than at the terminal."""
    found = so_far([run])
    solution = found.gyroscopes["gyro"].solution
    (parameters,) = look_of(found).parameters
    assert isinstance(solution, VectorSolution)
    assert parameters["scale"] == solution.scale.tolist() and parameters["bias"] == solution.bias_rad_s.tolist()


def test_what_the_board_says_is_replayed_at_its_time_by_the_controller_and_not_without_one() -> None:
    made = synthetic_run(Setup(speed_deg_s=120))
    said = TimedEvent(BoardNotObserved("gyro", 0, "readings were lost"), 0.0, float(made.states["time_s"][0]) + 0.05)
    cut = replace(made, states=made.states[:20], events=(said, TimedEvent(BoardRecalled("gyro", 1), 0.0, None)))
    (shown,) = (moment for moment in moments(cut) if isinstance(moment.event, BoardNotObserved | BoardRecalled))
    assert shown.event == said.event and shown.at_s == pytest.approx(0.1, abs=0.06)
