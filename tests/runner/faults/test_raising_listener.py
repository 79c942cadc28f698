"""Who looks on cannot end a run, and a step of no time does not either."""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.commands.configured import load_configured
from rig.motion.steps import Rest
from rig.plans.verbs import Verbs
from rig.runner.phases import Run
from rig.station.events import ListenerDropped, Progress, RunEvent, VerdictReached
from rig.station.operator_station import Stations, always_yes
from support.laboratories.worlds import World

pytestmark = pytest.mark.slow


class Raising:
    """Fails in the middle of the first motion."""

    def __init__(self) -> None:
        self.after = 0

    def event(self, event: RunEvent) -> None:
        self.after += self.after > 0
        if isinstance(event, Progress):
            self.after += 1
            raise RuntimeError("no page to show it on")


class Everything:
    """Remembers all it is told."""

    def __init__(self) -> None:
        self.events: list[RunEvent] = []

    def event(self, event: RunEvent) -> None:
        self.events.append(event)


@pytest.mark.proof
@pytest.mark.thorough  # in `make test`, test_run_events.py has a listener that fails
def test_a_run_goes_on_when_a_listener_raises_while_the_arm_moves(world: World, tmp_path: Path) -> None:
    fast = {
        "arm": {"transfer_speed_deg_s": 170},
        "procedure": {"speed_deg_s": 170, "acceleration_deg_s2": 700, "rest_s": 0.5},
        "limits": {"scale_std": 1, "bias_std_rad_s": 1},
        "world": {"time_scale": 12},
    }
    found = load_configured(world(fast).config_path)
    stock = found.phase.procedure.script

    def script(rig: Verbs) -> None:
        stock(rig)
        rig.rest(Rest("a rest of no time", 0.0))

    procedure = replace(found.phase.procedure, script=script)
    raising, other = Raising(), Everything()
    run = Run(
        tmp_path, found.loaded, replace(found.script, procedure=procedure), Stations((raising, other), always_yes)
    )
    assert run.carry_out(replace(found.phase, procedure=procedure)).passed
    assert raising.after == 1
    assert [event for event in other.events if isinstance(event, ListenerDropped)] == [
        ListenerDropped("Raising", "RuntimeError: no page to show it on")
    ]
    assert other.events[-1] == VerdictReached(passed=True)
