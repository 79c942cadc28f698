"""The shipped image on the emulated chip: what it remembers over resets, power cuts and torn flash."""

import random
from typing import Any

import pytest

from firmware_host.emulator.chip.flash_memory import PAGE_BYTES, STORE_OFFSET, FlashMemory
from firmware_host.emulator.chip.nvic import NMI, Nvic
from firmware_host.frames import Frame, encode
from firmware_host.protocol import ERRORS
from support.board.emulated_session import FIRST_RECORD, Session, make_shipped_flash

pytestmark = pytest.mark.slow

IMAGE_BYTES = STORE_OFFSET
WRITE_OPERATIONS = 26  # one erase, twenty-five doublewords
ERASE_OPERATIONS = 2
KEPT = ("matrix", "bias_rad_s", "lowest_c", "highest_c", "scale_change", "bias_change_rad_s")


def calibration(number: int) -> dict[str, Any]:
    return {
        "model": 2,
        "serial_number": f"LSM-{number:04}",
        "written_unix_s": 1_790_000_000 + number,
        "temperature_c": 20.0 + number,
        "matrix": ((1.0 + 0.125 * number, 0.125, -0.0625), (0.25, 1.25, 0.0), (0.0, 0.5, 0.75)),
        "bias_rad_s": (0.5, -0.25, 0.0625 * number),
        "lowest_c": 10.0,
        "highest_c": 40.0,
        "scale_change": ((2.0**-10, 0.0, -(2.0**-12)), (2.0**-14, 0.0, 0.0), (0.0, 0.0, 0.0)),
        "bias_change_rad_s": ((0.0, 2.0**-11, 0.0), (0.0, 0.0, 2.0**-15), (2.0**-20, 0.0, 0.0)),
    }


def copy(flash: FlashMemory) -> FlashMemory:
    return FlashMemory(bytes(flash.data[:IMAGE_BYTES]), bytes(flash.data[STORE_OFFSET:]), frozenset(flash.torn))


def boot(flash: FlashMemory) -> Session:
    """A board that has just been powered up."""
    session = Session(flash=flash, boot_time_s=0.0, tick_s=0.001)
    session.run(0.01)
    return session


def stored(session: Session) -> int | None:
    """The number of the calibration the board has for its LSM9DS1."""
    answer = session.ask("read_calibration", sensor=0)
    if answer.name == "error":
        assert ERRORS[answer.values["code"]].name == "no_calibration"
        return None
    number: int = round(answer.values["temperature_c"] - 20)
    assert {key: answer.values[key] for key in KEPT} == {key: calibration(number)[key] for key in KEPT}
    return number


def write(session: Session, number: int) -> Frame:
    session.configure("lsm9ds1")
    return session.ask("write_calibration", sensor=0, **calibration(number))


@pytest.fixture(scope="module")
def written() -> FlashMemory:
    """Flash of a board that has been given calibrations 1 and 2."""
    session = boot(make_shipped_flash())
    assert stored(session) is None
    assert write(session, 1).name == "ack"
    assert write(session, 2).name == "ack"
    return session.flash


def test_a_calibration_survives_reset_and_power_loss(written: FlashMemory) -> None:
    session = boot(copy(written))
    assert stored(session) == 2
    session.board.reset()
    session.run(0.01)
    assert stored(session) == 2
    assert session.ask("reboot").name == "ack"
    assert stored(session) == 2
    assert stored(boot(session.flash)) == 2


def test_a_start_by_the_stored_calibration_streams_calibrated_rates(written: FlashMemory) -> None:
    session = boot(copy(written))
    session.configure("lsm9ds1")
    assert session.ask("start", sensors=1).name == "ack"
    batches = [frame for frame in session.run(0.5) if frame.name in ("samples", "rates")]
    assert {(frame.name, frame.values["mode"]) for frame in batches} == {("rates", 1)}


def test_what_is_said_while_the_flash_is_busy_is_lost_and_nothing_else(written: FlashMemory) -> None:
    session = boot(copy(written))
    session.configure("lsm9ds1")
    session.board.receive(encode("write_calibration", 5, {"sensor": 0, **calibration(3)}))
    session.run(0.005)  # of 27 ms
    session.board.receive(encode("reboot", 6) * 20)
    answers = [frame.values["reply_to"] for frame in session.run(0.06) if frame.name == "ack"]
    assert answers == [5]
    session.board.receive(b"\0")  # as the host begins each request
    assert stored(session) == 3


def test_an_erased_calibration_is_gone_for_good(written: FlashMemory) -> None:
    session = boot(copy(written))
    assert session.ask("erase_calibration", sensor=0).name == "ack"
    assert stored(session) is None
    assert stored(boot(session.flash)) is None


@pytest.mark.one_in(5)
@pytest.mark.parametrize("torn", [False, True])
@pytest.mark.parametrize("operation", range(1, WRITE_OPERATIONS + 1))
def test_power_that_fails_at_any_operation_of_a_write_leaves_the_old_calibration(
    written: FlashMemory, operation: int, torn: bool
) -> None:
    session = boot(copy(written))
    session.configure("lsm9ds1")
    session.flash.fail_power(session.flash.operations + operation, torn)
    session.board.receive(encode("write_calibration", 5, {"sensor": 0, **calibration(3)}))
    session.run(0.06)
    assert not session.board.powered
    after = boot(session.flash)
    assert stored(after) == 2
    assert write(after, 4).name == "ack"
    assert stored(after) == 4
    report = after.ask("status").values
    assert (report["fault_pc"], report["reset_cause"]) == (0, 1), "a torn doubleword is no fault"


@pytest.mark.parametrize("torn", [False, True])
@pytest.mark.parametrize("operation", range(1, ERASE_OPERATIONS + 1))
def test_power_that_fails_in_an_erase_leaves_the_newest_calibration_or_none(
    written: FlashMemory, operation: int, torn: bool
) -> None:
    session = boot(copy(written))
    session.flash.fail_power(session.flash.operations + operation, torn)
    session.board.receive(encode("erase_calibration", 5, {"sensor": 0}))
    session.run(0.06)
    assert not session.board.powered
    assert stored(boot(session.flash)) == (None if (operation, torn) == (2, True) else 2)


@pytest.mark.thorough
def test_power_that_fails_at_any_moment_of_a_write_leaves_the_old_calibration_or_the_new(
    written: FlashMemory,
) -> None:
    rng = random.Random(1)
    found = []
    for _ in range(25):
        session = boot(copy(written))
        session.configure("lsm9ds1")
        session.board.receive(encode("write_calibration", 5, {"sensor": 0, **calibration(3)}))
        session.board.advance(session.time_s + rng.uniform(0.0, 0.032))
        found.append(stored(boot(session.flash)))
    assert set(found) == {2, 3}


def test_a_page_that_is_torn_all_over_is_no_calibration_and_no_fault() -> None:
    flash = make_shipped_flash()
    flash.torn.update(range(FIRST_RECORD, FIRST_RECORD + 2 * PAGE_BYTES, 8))
    session = boot(flash)
    assert stored(session) is None
    assert write(session, 1).name == "ack"
    assert stored(session) == 1
    assert session.ask("status").values["fault_pc"] == 0


def test_any_other_non_maskable_interrupt_is_a_fault() -> None:
    session = boot(make_shipped_flash())
    (nvic,) = [block for block in session.board.peripherals if isinstance(block, Nvic)]
    nvic.pend(NMI)
    session.run(0.2)
    report = session.ask("status").values
    assert report["fault_pc"] != 0 and report["reset_cause"] == 5
