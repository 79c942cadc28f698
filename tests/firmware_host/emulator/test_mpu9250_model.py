"""The simulated MPU-9250 at its registers, against its register map: what is its own beside what every part does."""

import math

import numpy as np
import pytest

from firmware_host.emulator.chip.bus import Violation
from support.board.spi_master import integers
from support.parts.mpu9250 import Mpu9250Driver

SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG = 0x19, 0x1A, 0x1B, 0x1C
INT_PIN_CFG, INT_ENABLE, INT_STATUS, ACCEL_OUT, GYRO_OUT = 0x37, 0x38, 0x3A, 0x3B, 0x43
PWR_MGMT_1, WHO_AM_I = 0x6B, 0x75
LATCH, ANY_READ_CLEARS, SLEEP, RESET = 0x20, 0x10, 0x40, 0x80
ONE_RAD_S = round(math.degrees(1.0) * 131)


def turning() -> Mpu9250Driver:
    return Mpu9250Driver(lambda _time_s: (1.0, -1.0, 0.0))


def running(pin: int = 0) -> Mpu9250Driver:
    driver = turning()
    driver.set(CONFIG, 1)
    driver.set(SMPLRT_DIV, 4)
    driver.set(INT_PIN_CFG, pin)
    driver.set(INT_ENABLE, 1)
    return driver


def test_it_wakes_up_running_with_the_registers_of_the_map() -> None:
    driver = Mpu9250Driver()
    assert driver.get(PWR_MGMT_1) == b"\x01"
    assert driver.get(SMPLRT_DIV, 5) == bytes(5)


@pytest.mark.parametrize(
    ("bypass", "filter_code", "divider", "rate_hz"),
    [
        (0, 1, 0, 1000.0),
        (0, 1, 4, 200.0),
        (0, 6, 255, 1000 / 256),
        (0, 0, 4, 8000.0),  # the divider acts only behind the filters 1 to 6
        (0, 7, 4, 8000.0),
        (1, 1, 4, 32000.0),
        (2, 1, 4, 32000.0),
    ],
)
def test_the_divider_acts_only_with_the_filter_on(bypass: int, filter_code: int, divider: int, rate_hz: float) -> None:
    driver = Mpu9250Driver()
    for address, value in ((SMPLRT_DIV, divider), (CONFIG, filter_code), (GYRO_CONFIG, bypass), (INT_ENABLE, 1)):
        driver.set(address, value)
    assert driver.part.next_event_s - driver.time_s == pytest.approx(1 / rate_hz)


def test_outputs_are_big_endian_and_lie_side_by_side() -> None:
    driver = running(LATCH)
    driver.await_data()
    status, *data = driver.get(INT_STATUS, 15)
    assert status == 1
    x, y, z, temperature, *rates = integers(bytes(data), ">")
    assert (x, y, z) == (0, 0, 16384)  # at rest, z up
    assert temperature == round(333.87 * (25 - 21))
    assert rates == [ONE_RAD_S, -ONE_RAD_S, 0]


def test_gravity_goes_with_the_accelerometers_range() -> None:
    driver = running(LATCH)
    driver.set(ACCEL_CONFIG, 3 << 3)
    driver.await_data()
    assert integers(driver.get(ACCEL_OUT, 6), ">") == [0, 0, 2048]


def test_unlatched_the_interrupt_is_a_pulse_of_fifty_microseconds() -> None:
    driver = running()
    driver.await_data()
    risen_s = driver.time_s
    driver.advance(driver.part.next_event_s)
    assert not driver.part.interrupt_level
    assert driver.time_s - risen_s == pytest.approx(50e-6)
    driver.await_data()  # unread, and yet there is another
    assert driver.time_s - risen_s == pytest.approx(5e-3)


@pytest.mark.parametrize(
    ("pin", "address", "clears"),
    [
        (LATCH, INT_STATUS, True),
        (LATCH, GYRO_OUT, False),
        (LATCH | ANY_READ_CLEARS, GYRO_OUT, True),
        (LATCH | ANY_READ_CLEARS, WHO_AM_I, True),
    ],
)
def test_latched_the_interrupt_lasts_until_it_is_cleared(pin: int, address: int, clears: bool) -> None:
    driver = running(pin)
    driver.await_data()
    driver.advance(driver.time_s + 1e-3)
    assert driver.part.interrupt_level
    driver.get(address)
    assert driver.part.interrupt_level != clears
    assert driver.get(INT_STATUS) == bytes([not clears])


def test_a_burst_is_of_one_moment() -> None:
    driver = Mpu9250Driver(lambda time_s: (time_s, time_s, time_s))
    driver.set(INT_ENABLE, 1)  # 8 kHz
    driver.advance(0.5)
    part = driver.part
    part.select(0.5)
    part.transfer(0x80 | GYRO_OUT, 0.5)
    data = b""
    for byte in range(6):
        time_s = 0.5 + 2e-4 * byte
        part.advance(time_s)
        data += bytes([part.transfer(0, time_s)])
    part.deselect(0.51)
    assert len(set(integers(data, ">"))) == 1


@pytest.mark.parametrize(("pin", "told_pairs"), [(0, 3), (LATCH, 3), (ANY_READ_CLEARS, 0)])
def test_what_reading_does_not_change_can_be_told_beforehand(pin: int, told_pairs: int) -> None:
    driver = running(pin)
    driver.await_data()
    spoken = driver.get(GYRO_OUT, 6)
    part, time_s = driver.part, driver.time_s
    part.select(time_s)
    part.transfer(0x80 | GYRO_OUT, time_s)
    told = part.predict()
    assert told == spoken[: 2 * told_pairs]
    assert told + bytes([part.transfer(0, time_s) for _ in range(6 - len(told))]) == spoken


def test_asleep_it_does_not_convert_and_takes_35_ms_to_start() -> None:
    driver = running(LATCH)
    driver.set(PWR_MGMT_1, 0x01 | SLEEP)
    assert driver.part.next_event_s == math.inf
    driver.advance(1.0)
    driver.set(PWR_MGMT_1, 0x01)
    awake_s = driver.time_s
    first = []
    for _ in range(10):
        driver.await_data()
        first.append((driver.time_s - awake_s, driver.read()[0][0]))
    late = np.array([counts for since_s, counts in first if since_s < 0.0349])
    assert np.all(np.diff(late) > 0) and late[-1] < ONE_RAD_S
    assert {counts for since_s, counts in first if since_s > 0.0351} == {ONE_RAD_S}


def test_a_reset_restores_the_registers_and_takes_its_time() -> None:
    driver = running(LATCH)
    driver.set(PWR_MGMT_1, RESET)
    assert driver.part.next_event_s == math.inf
    with pytest.raises(Violation, match="after its reset"):
        driver.get(WHO_AM_I)
    driver.part.deselect(driver.time_s)
    driver.advance(driver.time_s + 0.1)
    assert driver.get(INT_PIN_CFG) + driver.get(CONFIG) + driver.get(PWR_MGMT_1) == b"\x00\x00\x01"


@pytest.mark.parametrize(
    ("first", "max_hz"),
    [
        (0x80 | WHO_AM_I, 1e6),
        (0x80 | INT_ENABLE, 1e6),
        (0x80 | INT_STATUS, 20e6),
        (0x80 | GYRO_OUT, 20e6),
        (GYRO_OUT, 1e6),  # a write
        (CONFIG, 1e6),
    ],
)
def test_only_data_may_be_read_fast(first: int, max_hz: float) -> None:
    part = running().part
    part.select(1.0)
    part.transfer(first, 1.0)
    assert part.spi_max_hz == max_hz


def test_data_without_their_interrupt_are_not_simulated() -> None:
    with pytest.raises(Violation, match="RAW_RDY_EN"):
        turning().get(GYRO_OUT, 6)
