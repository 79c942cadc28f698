"""The simulated magnetometer die at its registers, against the datasheet."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.emulator.parts.lsm9ds1_magnetometer import Lsm9ds1Magnetometer
from firmware_host.emulator.parts.magnetometer import MagnetometerTruth
from support.board.spi_master import Registers, integers

STATUS, OUT = 0x27, 0x28
COUNT_UP, BDU = 0x40, 0x40
PERIOD_S = 1 / 80
PER_COUNT_T = (0.14e-7, 0.29e-7, 0.43e-7, 0.58e-7)
NO_ERRORS = MagnetometerTruth()


def constant(_time_s: float) -> Sequence[float]:
    return (20e-6, -5e-6, 43e-6)


def die(
    field_at: Callable[[float], Sequence[float]] = constant,
    truth: MagnetometerTruth = NO_ERRORS,
    *,
    rate_code: int = 7,
    range_code: int = 0,
    ppm: float = 0.0,
    seed: int = 1,
) -> Registers:
    """A die that converts."""
    driver = Registers(Lsm9ds1Magnetometer(field_at, truth, seed=seed, oscillator_ppm=ppm))
    driver.set(0x20, rate_code << 2)
    driver.set(0x21, range_code << 5)
    driver.set(0x24, BDU)
    driver.set(0x22, 0x80)
    return driver


def field(driver: Registers) -> list[int]:
    driver.await_data()
    return integers(driver.get(OUT | COUNT_UP, 6), "<")


def test_its_identity_is_the_datasheets_unless_it_is_another_part() -> None:
    driver = Registers(Lsm9ds1Magnetometer(constant, NO_ERRORS, seed=1))
    assert driver.get(0x0F) == b"\x3d"
    driver.part.fault = Fault.OTHER_PART
    assert driver.get(0x0F) != b"\x3d"


def test_powered_down_as_after_a_start_it_does_nothing() -> None:
    driver = Registers(Lsm9ds1Magnetometer(constant, NO_ERRORS, seed=1))
    assert driver.get(0x20 | COUNT_UP, 5) == bytes((0x10, 0x00, 0x03, 0x00, 0x00))
    driver.set(0x20, 0xFC)
    assert driver.part.next_event_s == math.inf
    driver.advance(2.0)
    assert driver.get(STATUS) == b"\0" and not driver.part.interrupt_level


@pytest.mark.parametrize(("code", "hz"), list(enumerate((0.625, 1.25, 2.5, 5, 10, 20, 40, 80))))
def test_it_converts_at_its_data_rate_by_its_own_oscillator(code: int, hz: float) -> None:
    driver = die(rate_code=code, ppm=10_000.0)
    times_s = []
    for _ in range(4):
        field(driver)
        times_s.append(driver.time_s)
    assert np.diff(times_s) == pytest.approx(1 / hz / 1.01, rel=0.01 * hz)


@pytest.mark.parametrize("code", range(4))
def test_sensitivity_is_the_datasheets_and_no_axis_is_turned(code: int) -> None:
    true = np.array(constant(0.0))
    assert np.abs(field(die(range_code=code)) - true / PER_COUNT_T[code]).max() <= 0.5


def test_too_much_saturates() -> None:
    assert field(die(lambda _time_s: (1.0, -1.0, 0.0))) == [32767, -32768, 0]


def test_the_truth_is_m_equals_f_b_plus_b() -> None:
    xy, xz, yz = 0.02, -0.01, 0.03
    truth = MagnetometerTruth((1.1, 0.9, 1.2), (30e-6, -20e-6, 10e-6), non_orthogonality_rad=(xy, xz, yz))
    rows = np.array([[1, 0, 0], [math.sin(xy), math.cos(xy), 0], [math.sin(xz), math.sin(yz), math.cos(0.0316)]])
    expected = rows @ constant(0.0) / truth.scale + truth.bias_t
    assert np.array(field(die(truth=truth))) * PER_COUNT_T[0] == pytest.approx(expected, abs=PER_COUNT_T[0])


def test_noise_is_as_strong_as_told_and_follows_the_seed() -> None:
    truth = MagnetometerTruth(noise_t=0.3e-6)

    def readings(seed: int) -> np.ndarray:
        driver = die(truth=truth, seed=seed)
        return np.array([field(driver) for _ in range(400)])

    noise = readings(3)
    assert noise.std(axis=0) * PER_COUNT_T[0] == pytest.approx(0.3e-6, rel=4 / math.sqrt(800))
    assert np.array_equal(noise, readings(3)) and not np.array_equal(noise, readings(4))


def test_data_ready_lasts_until_the_high_bytes_of_all_axes_are_read() -> None:
    driver = die()
    driver.await_data()
    assert driver.get(STATUS) == b"\x0f"
    driver.get(OUT | COUNT_UP, 4)
    assert driver.part.interrupt_level and driver.get(STATUS) == b"\x0c"
    driver.get(OUT + 5)
    assert not driver.part.interrupt_level and driver.get(STATUS) == b"\0"


def test_a_conversion_that_nobody_read_is_overrun_without_a_new_edge() -> None:
    driver = die()
    driver.await_data()
    driver.advance(driver.time_s + 1.5 * PERIOD_S)
    assert driver.get(STATUS) == b"\xff" and driver.part.interrupt_level
    driver.get(OUT | COUNT_UP, 6)
    assert driver.get(STATUS) == b"\0"


@pytest.mark.parametrize(("control", "torn"), [(BDU, False), (0, True)])
def test_block_data_update_keeps_both_bytes_of_one_conversion(control: int, torn: bool) -> None:
    def ramp(time_s: float) -> Sequence[float]:
        return ((round(time_s / PERIOD_S) * 0x101 - 1) * PER_COUNT_T[0], 0.0, 0.0)

    driver = die(ramp)
    driver.set(0x24, control)
    driver.advance(9.5 * PERIOD_S)
    low = driver.get(OUT)
    driver.advance(10.5 * PERIOD_S)
    first, second = 9 * 0x101 - 1, 10 * 0x101 - 1
    expected = second & 0xFF00 | first & 0xFF if torn else first
    assert int.from_bytes(low + driver.get(OUT + 1), "little") == expected


def test_without_its_bit_an_address_does_not_count_up() -> None:
    assert die().get(0x0F, 3) == b"\x3d\x3d\x3d"


def test_a_new_rate_begins_anew_and_powering_down_ends() -> None:
    driver = die()
    driver.await_data()
    driver.set(0x20, 0x00)
    assert not driver.part.interrupt_level
    assert driver.part.next_event_s - driver.time_s == pytest.approx(1 / 0.625)
    driver.set(0x22, 0x83)
    assert driver.part.next_event_s == math.inf


def test_software_reset_restores_every_register() -> None:
    driver = die()
    driver.set(0x21, 0x04)
    assert driver.get(0x20 | COUNT_UP, 5) == bytes((0x10, 0x00, 0x03, 0x00, 0x00))
    assert driver.part.next_event_s == math.inf


@pytest.mark.parametrize(
    ("access", "name"),
    [
        (b"\x20\x02", "unmodelled_bits"),  # FAST_ODR
        (b"\x20\x01", "unmodelled_bits"),  # self-test
        (b"\x22\x20", "unmodelled_bits"),  # low power
        (b"\x22\x04", "unmodelled_bits"),  # SIM
        (b"\x22\x81", "sensor_setup"),  # single conversions
        (b"\x23\x02", "unmodelled_bits"),  # high byte first
        (b"\x24\x80", "unmodelled_bits"),  # FAST_READ
        (b"\x05\x01", "unmodelled_bits"),  # an offset
        (b"\x30\x01", "unmodelled_register"),
        (b"\xb0\x00", "unmodelled_register"),
        (b"\x28\x00", "unmodelled_register"),
    ],
)
def test_what_has_no_model_is_refused_by_name(access: bytes, name: str) -> None:
    with pytest.raises(Violation, match="LSM9DS1-M") as caught:
        die().exchange(access)
    assert caught.value.name == name
