"""What can be broken in the laboratory: sensors from inside, the safeguard, the pace."""

import pytest

from rig.config.load import load
from rig.world.board.sensing_element import ElementFault, SensingElement
from rig.world.clock import TICK_S, WorldClock
from rig.world.laboratory import Laboratory
from rig.world.ur10e.interfaces.primary_server import PrimarySession
from rig.world.ur10e.modes import RuntimeState, SafetyMode
from rig.world.world_section import read_world_section
from support.paths import DEMO

LOADED = load(DEMO)
TURN = b"def turn():\n movej([0, -1.57, 1.57, -1.57, -1.57, 3], a=4, v=0.5)\nend\n"


def test_a_stuck_element_feels_what_it_felt_and_a_saturated_one_far_too_much() -> None:
    element = SensingElement(lambda time_s: (time_s, 0.0, -time_s))
    assert element(1.0) == (1.0, 0.0, -1.0)
    element.set_fault(ElementFault.STUCK)
    assert element(2.0) == element(3.0) == (2.0, 0.0, -2.0)
    element.set_fault(ElementFault.SATURATED)
    assert element(4.0) == (1e3, 1e3, 1e3)
    element.set_fault(None)
    assert element(5.0) == (5.0, 0.0, -5.0)


def test_the_pace_can_change_while_the_world_runs() -> None:
    wall_s = 0.0
    clock = WorldClock(8.0, lambda: wall_s)
    assert clock.wait_s() == pytest.approx(TICK_S / 8)
    clock.pace(1.0)
    assert clock.wait_s() == pytest.approx(TICK_S)
    for wrong in (0.0, -1.0, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="not a time scale"):
            clock.pace(wrong)


@pytest.mark.slow
def test_a_safeguard_pauses_the_program_and_what_it_paused_goes_on_when_it_is_played() -> None:
    here = Laboratory(LOADED.config, read_world_section(LOADED))
    here.unplug()
    robot = here.robot

    def wait(duration_s: float) -> None:
        for _ in range(round(duration_s / TICK_S)):
            here.step()

    PrimarySession(robot).receive(TURN)
    wait(2.0)
    robot.safeguard_stop()
    assert robot.safety_mode == SafetyMode.SAFEGUARD_STOP and robot.safety_status_bits >> 4 & 1
    wait(1.0)
    assert robot.runtime_state == RuntimeState.PAUSED and not robot.motion.moving
    assert robot.time_s - robot.still_since_s > 0.5
    assert not robot.resume(), "it goes on behind an open safeguard"
    robot.release()
    wait(1.0)
    assert not robot.motion.moving, "it goes on by itself"
    assert robot.resume()
    wait(8.0)
    assert robot.motion.q_rad[5] == pytest.approx(3.0)
