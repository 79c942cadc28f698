"""The heater's pin on the emulated chip, with the shipped image: 20 times of 20 it is off when it must be."""

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from firmware_host.emulator.chip.flash_memory import STORE_OFFSET, FlashMemory
from firmware_host.frames import encode
from firmware_host.protocol import HEATER_CAUSES, HEATER_LIMIT_C, RESET_CAUSES
from support.board.emulated_session import Session, make_shipped_flash

POWER = 255
OFF_WITHIN_S = 2.5
TIMES = 20
WORD_EVERY_S = 0.5


class Oven:
    """Heats the part while the pin is up, and cools it otherwise."""

    def __init__(self) -> None:
        self.temperature_c = 25.0
        self.k_per_s = 0.0

    def __call__(self, time_s: float) -> float:
        return self.temperature_c


def streaming(oven: Oven, flash: FlashMemory | None = None) -> Session:
    session = Session(temperature_c=oven, flash=flash, tick_s=0.01)
    session.run(0.2)
    start(session)
    return session


def start(session: Session) -> None:
    session.configure("lsm9ds1")
    session.ask("start", sensors=0)
    session.run(0.1)


def heat(session: Session, power: int = POWER) -> str:
    answer = session.ask("heat", power=power)
    assert answer.name == "heating"
    cause: int = answer.values["cause"]
    return HEATER_CAUSES[cause]


def off_after_s(session: Session, at_most_s: float) -> float:
    began_s = session.time_s
    while session.board.heater_duty > 0:
        session.run(0.01)
        assert session.time_s - began_s < at_most_s, "the heater is still on"
    return session.time_s - began_s


def moments(times: int) -> Iterator[float]:
    """When something happens after the host's word, s: anywhere between two of them."""
    yield from np.random.default_rng(31).uniform(0.0, WORD_EVERY_S, times)


def killed(times: int) -> None:
    session = streaming(Oven())
    for after_s in moments(times):
        assert heat(session) == "on"
        assert session.board.heater_duty == 1.0
        session.run(after_s)  # the host is killed now
        took_s = off_after_s(session, OFF_WITHIN_S)
        assert took_s > 1.0, "one lost word does not switch it off"
        session.run(0.05)
        assert heat(session, 0) == "not_wanted"


def overheated(times: int) -> None:
    oven = Oven()
    session = streaming(oven)
    for k_per_s in np.random.default_rng(32).uniform(0.5, 20.0, times):
        oven.temperature_c = HEATER_LIMIT_C - 0.5
        session.run(0.05)
        assert heat(session) == "on"
        while session.board.heater_duty > 0:
            session.run(0.01)
            oven.temperature_c += k_per_s * 0.01
            assert oven.temperature_c < HEATER_LIMIT_C + 0.1 + 0.02 * k_per_s
        assert oven.temperature_c >= HEATER_LIMIT_C - 0.1
        assert heat(session) == "too_hot"
        assert session.board.heater_duty == 0.0
        heat(session, 0)


def reset(times: int) -> None:
    session = streaming(Oven())
    for number, after_s in enumerate(moments(times)):
        assert heat(session) == "on"
        session.run(after_s)
        if number % 2:
            session.board.reset()
            session.run(0.01)
        else:
            session.board.receive(encode("reboot", 9))
            session.run(0.02)
        assert session.board.heater_duty == 0.0
        session.run(0.2)
        assert session.board.heater_duty == 0.0
        assert RESET_CAUSES[session.ask("hello").values["reset_cause"]] == ("pin" if number % 2 else "software")
        start(session)


@pytest.mark.slow
@pytest.mark.parametrize("happens", [killed, overheated, reset], ids=lambda happens: str(happens.__name__))
def test_the_heater_goes_off_by_itself(happens: Callable[[int], None]) -> None:
    happens(2)


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.parametrize("happens", [killed, overheated, reset], ids=lambda happens: str(happens.__name__))
def test_the_heater_goes_off_by_itself_in_20_of_20(happens: Callable[[int], None]) -> None:
    happens(TIMES)


@pytest.mark.slow
def test_a_program_that_hangs_is_bitten_and_the_heater_goes_off() -> None:
    """The main loop kicks the watchdog by its tick: here the tick fails while the heater is on."""
    image = bytearray(make_shipped_flash().data[:STORE_OFFSET])
    systick, usart2 = 4 * 15, 4 * (16 + 38)
    image[systick : systick + 4] = image[usart2 : usart2 + 4]
    session = streaming(Oven(), FlashMemory(bytes(image)))
    assert heat(session) == "on"
    took_s = off_after_s(session, 1.2)
    session.run(0.2)
    assert took_s < 1.2
    assert RESET_CAUSES[session.ask("hello").values["reset_cause"]] == "watchdog"
    assert session.board.heater_duty == 0.0


def test_the_pin_is_up_for_the_part_of_the_time_that_is_asked_for() -> None:
    session = streaming(Oven())
    for power in (1, 64, 255):
        session.ask("heat", power=power)
        assert session.board.heater_duty == pytest.approx(power / 255)
