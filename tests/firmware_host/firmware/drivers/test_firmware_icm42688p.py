"""The driver of the ICM-42688-P against its registers, and what its register model alone does."""

import math
from functools import partial
from typing import Any

import numpy as np
import pytest

from firmware_host.emulator.chip.bus import Violation
from firmware_host.frames import encode
from support.board import emulated_session
from support.board.emulated_session import TRUTH, Session, samples
from support.board.host_board import HostBoard, configure, convert, first_samples
from support.board.spi_master import integers
from support.parts import NUMBER
from support.parts.icm42688p import Icm42688PDriver

SENSOR = NUMBER["icm42688p"]


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


def registers(board: HostBoard) -> Any:
    return board.parts["icm42688p"]


@pytest.mark.parametrize(
    ("wanted_hz", "hz", "code"),
    [(1, 25, 10), (50, 50, 9), (119, 100, 8), (200, 200, 7), (400, 500, 15), (1125, 1000, 6), (8000, 2000, 5)],
)
def test_both_sensors_run_at_the_nearest_rate_and_let_through_half_of_it(
    board: HostBoard, wanted_hz: float, hz: float, code: int
) -> None:
    assert configure(board, SENSOR, rate_hz=wanted_hz)["rate_hz"] == hz
    values = registers(board).values
    assert (values[0x4F] & 0x0F, values[0x50] & 0x0F, values[0x52], values[0x4E]) == (code, code, 0x00, 0x0F)


@pytest.mark.parametrize(
    ("wanted", "deg_s", "code", "counts_per_deg_s"),
    [
        (1, 15.625, 7, 2097.2),
        (16, 31.25, 6, 1048.6),
        (62.5, 62.5, 5, 524.3),
        (125, 125, 4, 262),
        (126, 250, 3, 131),
        (500, 500, 2, 65.5),
        (501, 1000, 1, 32.8),
        (2000, 2000, 0, 16.4),
    ],
)
def test_its_ranges_have_the_data_sheets_sensitivities(
    board: HostBoard, wanted: float, deg_s: float, code: int, counts_per_deg_s: float
) -> None:
    setup = configure(board, SENSOR, range_deg_s=wanted)
    assert setup["range_deg_s"] == deg_s
    assert setup["sensitivity_rad_s"] == pytest.approx(math.radians(1 / counts_per_deg_s), rel=1e-15)
    assert (setup["temperature_scale_c"], setup["temperature_offset_c"]) == (1 / 132.48, 25.0)
    assert registers(board).values[0x4F] >> 5 == code


@pytest.mark.parametrize(
    ("wanted_g", "g", "code", "counts_per_g"), [(1, 2, 3, 16384), (4, 4, 2, 8192), (5, 8, 1, 4096), (16, 16, 0, 2048)]
)
def test_its_accelerometer_has_the_data_sheets_sensitivities(
    board: HostBoard, wanted_g: float, g: float, code: int, counts_per_g: float
) -> None:
    setup = configure(board, SENSOR, range_g=wanted_g)
    assert setup["range_m_s2"] == pytest.approx(g * 9.80665, rel=1e-15)
    assert setup["sensitivity_m_s2"] == pytest.approx(9.80665 / counts_per_g, rel=1e-15)
    assert registers(board).values[0x50] >> 5 == code


def test_it_is_reset_first_and_started_last(board: HostBoard) -> None:
    part = registers(board)
    part.values[0x70], part.values[0x5F] = 0x07, 0x03  # a self-test and a FIFO that another image left on
    part.writes.clear()
    configure(board, SENSOR)
    assert (part.values[0x70], part.values[0x5F]) == (0, 0)
    assert part.writes[:2] == [(0x4C, 0xB3), (0x11, 0x01)], "I2C goes off as soon as it is known"
    assert part.writes[-1] == (0x4E, 0x0F)
    # INT1: pulses, push-pull, active high, data-ready alone; INT_ASYNC_RESET off; no I2C; the whole range of numbers
    expected = {0x14: 0x03, 0x64: 0x00, 0x65: 0x08, 0x4C: 0xB3, 0x4D: 0x91}
    assert {address: part.values[address] for address in expected} == expected


@pytest.mark.parametrize("register", [0x4C, 0x64, 0x4F, 0x50, 0x4E])
def test_a_setting_that_does_not_stick_is_refused(board: HostBoard, register: int) -> None:
    registers(board).stuck.add(register)
    (error,) = board.ask("configure", sensor=SENSOR, rate_hz=200, range_deg_s=100, range_g=0, range_gauss=0)
    assert error.name == "error"


@pytest.mark.parametrize("bank", [1, 4])
def test_it_is_found_in_whichever_bank_another_image_left_it(board: HostBoard, bank: int) -> None:
    registers(board).values[0x76] = bank
    (identity,) = board.ask("hello")
    assert identity.items["who_am_i"][SENSOR] == 0x47
    assert registers(board).values[0x76] == 0


def test_a_sample_is_the_status_and_one_burst_high_byte_first(board: HostBoard) -> None:
    configure(board, SENSOR, range_g=8)
    registers(board).transfers.clear()
    batch = first_samples(board, SENSOR, (-32768, 258, 32767), acceleration=(1, -2, 4096))
    assert registers(board).transfers == [2, 16] * 41  # once at the start, to begin with a line that is low
    assert batch.items["counts"][0].tolist() == [-32768, 258, 32767]
    assert batch.items["acceleration"][0].tolist() == [1, -2, 4096]
    assert batch.items["temperature_counts"][0] == -48


@pytest.mark.parametrize(("rate_hz", "settling"), [(1000, 101), (200, 21), (25, 3)])
def test_it_has_100_ms_to_start_up_and_settle(board: HostBoard, rate_hz: float, settling: int) -> None:
    configure(board, SENSOR, rate_hz=rate_hz)
    board.ask("start", 2, sensors=0)
    for k in range(110):
        convert(board, round(100_000 + 1e6 / rate_hz * k), (k, 0, 0), sensor=SENSOR)
    first = next(frame for frame in board.ask("stop", 3) if frame.name == "samples")
    assert (first.values["sequence"], int(first.items["counts"][0][0])) == (0, settling)


@pytest.mark.slow
def test_a_conversion_in_the_middle_of_a_reading_is_no_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    """The model tears what is being read, and another part delays the readings; what comes through is whole."""
    counting = iter(range(1, 10**6))

    def rate_at(_time_s: float) -> tuple[float, float, float]:
        step = next(counting) % 100
        return (step * 0.01, step * 0.01, step * 0.01)

    fast = partial(emulated_session.PARTS["icm42688p"], oscillator_ppm=7000.0)  # so that each delay comes
    monkeypatch.setitem(emulated_session.PARTS, "icm42688p", fast)
    session = Session(parts=("adis16465", "icm42688p"), rate_at=rate_at, noise_rad_s=0.0)
    session.run(0.2)
    session.configure("adis16465", 1000.0, range_g=8.0)  # 0.56 ms of the bus for each of its readings
    setup = session.configure("icm42688p", 2000.0, 500.0).values
    session.board.receive(encode("start", 7, {"sensors": 0}))
    found = samples(session.run(0.6), SENSOR)
    assert len(found) > 100
    rates = setup["sensitivity_rad_s"] * found["counts"]
    true = np.array(TRUTH.scale) * (rates + np.array(TRUTH.bias_rad_s))
    assert abs(true - true[:, :1]).max() < 2e-3, "all three are of one conversion"


# The register model


def test_the_model_knows_what_the_data_sheet_forbids() -> None:
    driver = Icm42688PDriver()
    driver.set(0x11, 0x01)
    with pytest.raises(Violation) as early:
        driver.get(0x75)
    assert "ms after its reset" in early.value.what
    driver = Icm42688PDriver()
    driver.start(200.0, 500.0)
    with pytest.raises(Violation) as at_once:
        driver.set(0x4F, 0x47)
    assert "switched on" in at_once.value.what
    driver.advance(driver.time_s + 1e-3)
    driver.set(0x4F, 0x46)  # a rate may change while it runs, but both sensors' alike
    with pytest.raises(Violation) as running:
        driver.set(0x52, 0x44)
    assert "12.9" in running.value.what


def test_without_the_whole_range_of_numbers_the_lowest_two_are_never_sent() -> None:
    driver = Icm42688PDriver(lambda _time_s: (-99.0, 0.0, 0.0))
    driver.set(0x4C, 0x33)
    for register, value in ((0x14, 0x03), (0x64, 0), (0x65, 0x08), (0x4F, 0x46), (0x50, 0x26), (0x4E, 0x0F)):
        driver.set(register, value)
    driver.advance(0.2)
    assert integers(driver.get(0x25, 6), ">")[0] == -32766


def test_its_line_is_a_pulse_of_100_us_and_reading_the_status_clears_it() -> None:
    driver = Icm42688PDriver()
    driver.start(1000.0, 500.0)
    driver.await_data()
    at_s = driver.time_s
    assert driver.get(0x2D)[0] & 0x08 and not driver.get(0x2D)[0] & 0x08
    driver.advance(at_s + 99e-6)
    assert driver.part.interrupt_level
    driver.advance(at_s + 101e-6)
    assert not driver.part.interrupt_level
