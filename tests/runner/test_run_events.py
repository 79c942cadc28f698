"""Whoever listens to a run gets all of it as typed events, in order: enough for a page that shows nothing else."""

import subprocess
import sys
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import pytest

from rig.commands.configured import load_configured
from rig.data.recording.recorded_events import (
    BoardObserved,
    BoardSolved,
    RestFinished,
    RestStarted,
    SweepFinished,
    SweepStarted,
)
from rig.motion.steps import Sweep
from rig.motion.turner_state import ArmState, RuntimeState
from rig.runner.phases import Run
from rig.station.events import (
    Answered,
    ArmConnected,
    ArmSeen,
    BoardConnected,
    CalibrationStored,
    Checked,
    DocumentWritten,
    ListenerDropped,
    ObservationMade,
    PhaseRecorded,
    PhaseStarted,
    Plotted,
    PreflightPassed,
    Progress,
    Prompt,
    RunEvent,
    SamplesTaken,
    SamplingStarted,
    StepFinished,
    StepStarted,
    VerdictReached,
)
from rig.station.operator_station import Stations, always_yes
from support.laboratories.worlds import QUICK_EXPERIMENT, merge, worlds
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow  # a whole experiment

# Samples cost processor time, and this is about what happens between them.
SLOWLY_READ = {"sensors": {"gyro": {"rate_hz": 59.5}, "reference": {"rate_hz": 50}}}


class Failing:
    """Somebody else who looks on, and fails in the middle of the first motion."""

    def event(self, event: RunEvent) -> None:
        if isinstance(event, Progress):
            raise RuntimeError("no page to show it on")


class Everything:
    """Remembers all it is told."""

    def __init__(self) -> None:
        self.events: list[RunEvent] = []

    def event(self, event: RunEvent) -> None:
        self.events.append(event)


@pytest.fixture(scope="module")
def events(tmp_path_factory: pytest.TempPathFactory) -> Iterator[list[RunEvent]]:
    """All events of a calibration and its verification, but for the one that another listener has failed."""
    folder = tmp_path_factory.mktemp("events")
    listener = Everything()
    with worlds(folder) as start:
        found = load_configured(start(merge(QUICK_EXPERIMENT, SLOWLY_READ)).config_path)
        run = Run(folder, found.loaded, found.script, Stations((Failing(), listener), always_yes))
        assert run.carry_out(found.phase).passed
    dropped = ListenerDropped("Failing", "RuntimeError: no page to show it on")
    assert [event for event in listener.events if isinstance(event, ListenerDropped)] == [dropped]
    yield [event for event in listener.events if event != dropped]


def phases(events: list[RunEvent]) -> list[list[RunEvent]]:
    """The events of each phase from its start to what it recorded."""
    starts = [place for place, event in enumerate(events) if isinstance(event, PhaseStarted)]
    ends = [place for place, event in enumerate(events) if isinstance(event, PhaseRecorded)]
    return [events[start : end + 1] for start, end in zip(starts, ends, strict=True)]


def test_the_phases_come_one_after_the_other(events: list[RunEvent]) -> None:
    told = [type(event) for event in events]
    steps = (StepStarted, Progress, ArmSeen, SamplesTaken, StepFinished)
    recorded = (SweepStarted, SweepFinished, RestStarted, RestFinished, BoardObserved, BoardSolved)
    around = [kind for kind in told if kind not in (*steps, *recorded)]
    connected = [BoardConnected, ArmConnected, PhaseStarted, PreflightPassed]
    checks = around.count(Checked)
    assert around == [
        *connected, Prompt, Answered, SamplingStarted, PhaseRecorded,
        *[ObservationMade] * 12, CalibrationStored,
        *connected, SamplingStarted, PhaseRecorded,
        Plotted, *[DocumentWritten] * 3,
        *[Checked] * checks, VerdictReached,
    ]  # fmt: skip
    first, second = (event for event in events if isinstance(event, PhaseStarted))
    assert first.procedure == "six_observation" and first.sensors == {"gyro": "raw", "reference": "raw"}
    assert second.procedure == "verify" and second.sensors == {"gyro": "calibrated", "reference": "raw"}
    # Limits and verification; how many more hold the recording against itself, its rests decide.
    assert checks > 10 and events[-1] == VerdictReached(passed=True)


def test_every_step_of_the_plan_starts_goes_on_and_finishes(events: list[RunEvent]) -> None:
    for phase in phases(events):
        started = phase[0]
        assert isinstance(started, PhaseStarted)
        plan = started.plan
        steps = [event for event in phase if isinstance(event, StepStarted | Progress | StepFinished)]
        numbers = [event.number for event in steps]
        assert numbers == sorted(numbers) and set(numbers) == set(range(1, len(plan.steps) + 1))
        for number, step in enumerate(plan.steps, start=1):
            begun, *within, ended = (event for event in steps if event.number == number)
            assert begun == StepStarted(number, len(plan.steps), step)
            assert isinstance(ended, StepFinished) and ended.step == step
            # By the arm's clock, which goes on while a busy computer does not look.
            assert step.duration_s - 1.0 < ended.took_s < step.duration_s + 10.0
            assert within and all(isinstance(event, Progress) and event.step == step for event in within)
        progress = [event for event in steps if isinstance(event, Progress)]
        for one, other in pairwise(progress):
            assert other.elapsed_s >= one.elapsed_s - 1e-9 and other.remaining_s <= one.remaining_s + 1e-9
        for one in progress:
            assert 0 <= one.fraction <= 1
            assert one.elapsed_s + one.remaining_s == pytest.approx(plan.duration_s)


def test_every_sensors_samples_are_counted(events: list[RunEvent]) -> None:
    for phase in phases(events):
        taken = [event for event in phase if isinstance(event, SamplesTaken)]
        assert all([sensor.sensor for sensor in event.sensors] == ["gyro", "reference"] for event in taken)
        for name in range(2):
            counts = [event.sensors[name].samples for event in taken]
            assert counts == sorted(counts) and counts[-1] > 1000
            assert all(event.sensors[name].lost == 0 for event in taken)
        spinning = max(abs(rate) for event in taken for s in event.sensors for rate in s.latest.get("rate", ()))
        assert spinning > 2.0
        recorded = phase[-1]
        assert isinstance(recorded, PhaseRecorded) and recorded.sensors[0].samples >= taken[-1].sensors[0].samples


def test_the_arm_is_seen_once_more_when_it_was_let_go(events: list[RunEvent]) -> None:
    """After what was recorded, or whoever looks on is left with an arm whose program plays."""
    ends = [place for place, event in enumerate(events) if isinstance(event, PhaseRecorded)]
    for end in ends:
        seen = events[end + 1]
        assert isinstance(seen, ArmSeen) and isinstance(seen.state, ArmState)
        assert seen.state.at_rest and seen.state.runtime_state == RuntimeState.STOPPED


def test_the_observations_come_as_they_are_made(events: list[RunEvent]) -> None:
    calibration, verification = phases(events)
    place: StepStarted | None = None
    for event in calibration:
        if isinstance(event, StepStarted):
            place = event
        if isinstance(event, BoardObserved):
            assert place is not None and isinstance(place.step, Sweep) and place.step.index == event.sweep
            assert max(map(abs, event.observation.mean_rad_s)) == pytest.approx(event.speed_rad_s, rel=0.3)
    observed = [event for event in calibration if isinstance(event, BoardObserved)]
    assert [(event.sensor, event.sweep) for event in observed] == [("gyro", sweep) for sweep in range(6)]
    assert {event.solution.method for event in calibration if isinstance(event, BoardSolved)} >= {"closed_form"}
    assert not any(isinstance(event, BoardObserved) for event in verification)


def test_the_hosts_own_observations_come_when_the_calibration_is_judged(events: list[RunEvent]) -> None:
    made = [event for event in events if isinstance(event, ObservationMade)]
    assert [(e.sensor, e.observation.sweep) for e in made] == [(s, i) for s in ("gyro", "reference") for i in range(6)]
    for event in made:
        turned = event.observation.average.mean_rad_s["xyz".index(event.observation.axis)]
        assert abs(turned) == pytest.approx(event.observation.speed_rad_s, rel=0.3)


IMPORTS = """
import sys
from pathlib import Path
from rig.motion.turner_state import ArmState, RuntimeState
from rig.commands.configured import load_configured
from rig.runner.phases import Run
from rig.station.events import PhaseRecorded, PreflightPassed
from rig.station.operator_station import Stations, always_yes

class Imports:
    def event(self, event):
        if isinstance(event, PreflightPassed):
            self.before = set(sys.modules)
        if isinstance(event, PhaseRecorded):
            print(sorted(set(sys.modules) - self.before))

found = load_configured(Path(sys.argv[1]))
Run(Path(sys.argv[2]), found.loaded, found.script, Stations((Imports(),), always_yes)).carry_out(found.phase)
"""


@pytest.mark.proof
@pytest.mark.thorough
def test_nothing_is_imported_while_the_arm_is_under_way(tmp_path: Path) -> None:
    once = {**QUICK_EXPERIMENT, "procedure": {**QUICK_EXPERIMENT["procedure"], "verify": False}}
    with worlds(tmp_path) as start:
        command = [sys.executable, "-c", IMPORTS, str(start(once).config_path), str(tmp_path)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 0 and done.stdout == "[]\n", done.stdout + done.stderr
