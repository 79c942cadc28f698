"""What the operator is told of a stop whose end no state shows."""

import pytest

from rig.errors import Problem
from rig.turners.servo.packet_handler import Bus
from rig.turners.servo.servo_link import ServoLink
from rig.turners.servo.servo_models import MODELS
from rig.turners.servo.stopping import ShaftStop
from support.wires.servo_on_a_wire import BAUD, servo_on_a_wire

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_crowd")]  # their clock stands while the machine is busy


@pytest.mark.parametrize(
    ("denies", "answer"), [(False, "the servo has taken the stop"), (True, "the servo refused the stop")]
)
def test_a_shaft_that_never_comes_to_rest_is_told_with_the_servo_s_answer(denies: bool, answer: str) -> None:
    problems: list[Problem] = []
    with servo_on_a_wire() as wire:
        wire.do("fault", "denies", denies)
        bus = Bus(wire.port, BAUD, 1, wire.clock)
        link = ServoLink(bus, MODELS[0], 0.02, lambda _: None, problems.append)
        link.start()
        outcome = ShaftStop(link, wire.clock, 0.3, lambda *_: False, lambda: False).carry_out()
        link.close()
        bus.close()
    assert not outcome.at_rest and outcome.what.startswith(answer) and "Look at the shaft" in outcome.remedy
