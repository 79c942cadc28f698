"""The simulated LSM9DS1 at its registers, against the datasheet: what is its own beside what every part does."""

import math
from collections.abc import Sequence

import numpy as np
import pytest

from firmware_host.emulator.chip.bus import Violation
from support.board.spi_master import Rate, integers, still
from support.parts.lsm9ds1 import RATES, Lsm9ds1Driver

INT1_CTRL, WHO_AM_I, CTRL_REG1_G, CTRL_REG8 = 0x0C, 0x0F, 0x10, 0x22
STATUS, OUT_G, CTRL_REG6_XL, STATUS_AGAIN, OUT_XL = 0x17, 0x18, 0x20, 0x27, 0x28
BDU, IF_ADD_INC, SW_RESET = 0x40, 0x04, 0x01
PERIOD_S = 1 / 238


def polled(rate_at: Rate = still, rate_hz: float = 238.0) -> Lsm9ds1Driver:
    """A part that converts, its interrupt pin not routed."""
    driver = Lsm9ds1Driver(rate_at)
    driver.set(CTRL_REG1_G, RATES[rate_hz] << 5)
    return driver


def next_counts(driver: Lsm9ds1Driver) -> list[int]:
    driver.advance(driver.part.next_event_s)
    return integers(driver.get(OUT_G, 6), "<")


def test_powered_down_it_does_nothing() -> None:
    driver = Lsm9ds1Driver()
    assert driver.part.next_event_s == math.inf
    driver.advance(10.0)
    assert driver.get(STATUS) == b"\0"
    assert not driver.part.interrupt_level


@pytest.mark.parametrize(("rate_hz", "discard"), [(14.9, 2), (59.5, 3), (119.0, 3), (238.0, 4), (476.0, 5), (952.0, 8)])
def test_the_first_conversions_after_a_start_are_wrong(rate_hz: float, discard: int) -> None:
    driver = polled(lambda _time_s: (1.0, 1.0, 1.0), rate_hz)
    right = [next_counts(driver)[1] == round(math.degrees(1.0) / 8.75e-3) for _ in range(20)]
    assert right == [False] * discard + [True] * (20 - discard)


def test_data_ready_lasts_until_the_last_byte_is_read() -> None:
    driver = polled()
    driver.set(INT1_CTRL, 0x02)
    ready_s = driver.part.next_event_s
    driver.advance(ready_s - 1e-4)
    assert not driver.part.interrupt_level
    driver.advance(ready_s)
    assert driver.part.interrupt_level
    assert driver.get(STATUS)[0] & 0x02
    driver.get(OUT_G, 5)
    assert driver.part.interrupt_level
    driver.get(OUT_G + 5)
    assert not driver.part.interrupt_level
    assert not driver.get(STATUS)[0] & 0x02
    driver.advance(ready_s + 1.1 * PERIOD_S)
    assert driver.part.interrupt_level


def test_the_pin_stays_low_unless_routed() -> None:
    driver = polled()
    driver.advance(0.1)
    assert driver.get(STATUS)[0] & 0x02
    assert not driver.part.interrupt_level


def ramp(time_s: float) -> Sequence[float]:
    """257 counts a conversion at 245 °/s and 238 Hz, from -1 count: every conversion changes both bytes."""
    rate = (round(time_s / PERIOD_S) * 0x101 - 1) * math.radians(8.75e-3)
    return -rate, rate, rate  # the part's x is the other way


def test_an_unread_conversion_is_replaced_by_the_next() -> None:
    driver = polled(ramp)
    driver.advance(5.5 * PERIOD_S)
    assert integers(driver.get(OUT_G, 6), "<") == [5 * 0x101 - 1] * 3


@pytest.mark.parametrize(("control", "torn"), [(IF_ADD_INC | BDU, False), (IF_ADD_INC, True)])
def test_block_data_update_keeps_both_bytes_of_one_conversion(control: int, torn: bool) -> None:
    driver = Lsm9ds1Driver(ramp)
    driver.set(CTRL_REG8, control)
    driver.set(CTRL_REG1_G, RATES[238.0] << 5)
    driver.advance(9.5 * PERIOD_S)
    low = driver.get(OUT_G)
    driver.advance(10.5 * PERIOD_S)
    high = driver.get(OUT_G + 1)
    first, second = 9 * 0x101 - 1, 10 * 0x101 - 1
    value = int.from_bytes(low + high, "little")
    assert value == ((second & 0xFF00 | first & 0xFF) if torn else first)
    assert np.frombuffer(driver.get(OUT_G, 6), "<i2").tolist() == [second] * 3


def test_without_address_increment_the_same_register_answers() -> None:
    driver = Lsm9ds1Driver()
    assert driver.get(WHO_AM_I, 2) == b"\x68\x00"
    driver.set(CTRL_REG8, 0)
    assert driver.get(WHO_AM_I, 3) == b"\x68\x68\x68"


def test_software_reset_restores_every_register() -> None:
    driver = polled()
    driver.set(INT1_CTRL, 0x02)
    driver.advance(0.1)
    driver.set(CTRL_REG8, SW_RESET)
    assert driver.get(CTRL_REG8) == bytes([IF_ADD_INC])
    assert driver.get(INT1_CTRL) + driver.get(CTRL_REG1_G) + driver.get(STATUS) == bytes(3)
    assert driver.part.next_event_s == math.inf


@pytest.mark.parametrize("control", [0x90, 0xE0])  # range code 2, rate code 7
def test_rates_and_ranges_it_does_not_have_are_refused(control: int) -> None:
    with pytest.raises(Violation, match="LSM9DS1") as caught:
        Lsm9ds1Driver().set(CTRL_REG1_G, control)
    assert caught.value.name == "sensor_setup"


def accelerating(force_at: Rate = lambda _time_s: (0.0, 0.0, 0.0, 0.25, 0.5, 1.0)) -> Lsm9ds1Driver:
    driver = Lsm9ds1Driver(force_at)
    driver.set(CTRL_REG8, IF_ADD_INC | BDU)
    driver.set(CTRL_REG6_XL, RATES[238.0] << 5)
    driver.set(CTRL_REG1_G, RATES[238.0] << 5)
    driver.advance(10.5 * PERIOD_S)
    return driver


def test_the_registers_of_both_triads_are_left_handed() -> None:
    """In the axes of the magnetometer, which are right-handed, their x points the other way (datasheet, figure 1)."""
    driver = accelerating(lambda _time_s: (1.0, 1.0, 1.0, 0.5, 0.5, 0.5))
    rate, force = round(math.degrees(1.0) / 8.75e-3), round(0.5 / 0.061e-3)
    assert integers(driver.get(OUT_G, 6), "<") == [-rate, rate, rate]
    assert integers(driver.get(OUT_XL, 6), "<") == [-force, force, force]


def test_the_accelerations_have_a_flag_of_their_own_that_reading_their_last_byte_lowers() -> None:
    driver = accelerating()
    assert driver.get(STATUS_AGAIN) == driver.get(STATUS) == b"\x07"
    driver.get(OUT_XL, 5)
    assert driver.get(STATUS_AGAIN) == b"\x07"
    driver.get(OUT_XL + 5)
    assert driver.get(STATUS_AGAIN) == b"\x06"
    driver.get(OUT_G, 6)
    assert driver.get(STATUS_AGAIN) == b"\x04"


def test_block_data_update_holds_for_accelerations_too() -> None:
    def force_at(time_s: float) -> Sequence[float]:
        counts = round(time_s / PERIOD_S) * 0x101 - 1
        return 0.0, 0.0, 0.0, 0.0, counts * 0.061e-3, 0.0

    driver = accelerating(force_at)
    low = driver.get(OUT_XL + 2)
    driver.advance(11.5 * PERIOD_S)
    assert int.from_bytes(low + driver.get(OUT_XL + 3), "little") == 10 * 0x101 - 1
    assert integers(driver.get(OUT_XL, 6), "<")[1] == 11 * 0x101 - 1


def test_writing_its_control_register_does_not_affect_the_accelerometer_until_the_gyroscope_is_set() -> None:
    driver = accelerating()
    driver.set(CTRL_REG6_XL, RATES[238.0] << 5)
    assert driver.part.next_event_s == math.inf
    driver.set(CTRL_REG1_G, RATES[238.0] << 5)
    assert driver.part.next_event_s - driver.time_s == pytest.approx(PERIOD_S)


def test_two_data_rates_at_once_are_refused() -> None:
    driver = Lsm9ds1Driver()
    driver.set(CTRL_REG6_XL, RATES[119.0] << 5)
    with pytest.raises(Violation, match="two data rates") as caught:
        driver.set(CTRL_REG1_G, RATES[238.0] << 5)
    assert caught.value.name == "sensor_setup"
