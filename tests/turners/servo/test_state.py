"""Rest and motion told from states."""

import math
from dataclasses import replace

from rig.turners.servo.servo_models import MODELS, PULSE_RAD
from rig.turners.servo.servo_registers import STATE
from rig.turners.servo.servo_state import ServoState, decode, stands

DATA = STATE.pack(100, 0, 1, 0, -5, -44, -1, 0, -1, 121, 33)


def states(*pulses: int, period_s: float = 0.008, moving: int = 0) -> list[ServoState]:
    one = decode(DATA, MODELS[1], (1.0, 1.002), 5.0, 0)
    return [
        replace(one, time_s=i * period_s, q_rad=(pulse * PULSE_RAD,), moving=moving) for i, pulse in enumerate(pulses)
    ]


def test_a_block_of_registers_is_read_with_its_signs_and_units() -> None:
    state = decode(DATA, MODELS[1], (1.0, 1.002), 5.0, 0x20)
    assert (state.time_s, state.took_s, state.host_time_s) == (1.001, 1.002 - 1.0, 5.0)
    assert state.q_rad == (-PULSE_RAD,)
    assert math.isclose(math.degrees(state.qd_rad_s[0]), -44 * 1.374)
    assert (state.voltage_v, state.temperature_c, state.hardware_error) == (12.1, 33.0, 0x20)
    assert math.isclose(state.load, -5 * 2.69e-3)


def test_a_shaft_that_dithers_stands_and_one_that_creeps_or_has_just_stopped_does_not() -> None:
    assert stands(states(*[0, 2, -3, 1] * 6))
    assert not stands(states(*range(24)))
    assert not stands(states(*[0] * 24, moving=1))
    assert not stands(states(*range(0, 200, 10), 200, 200, 200))


def test_rest_takes_some_time_and_some_states_to_see() -> None:
    assert not stands([])
    assert not stands(states(0, 0, 0, 0))
    assert not stands(states(*[0] * 10))
    assert stands(states(*[0] * 6, period_s=0.1))
