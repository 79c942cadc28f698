"""The driver of the LSM6DSV16X against its registers, and what its register model alone does."""

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
from support.parts import NUMBER
from support.parts.lsm6dsv16x import RATES, Lsm6dsv16xDriver

SENSOR = NUMBER["lsm6dsv16x"]


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


def registers(board: HostBoard) -> Any:
    return board.parts["lsm6dsv16x"]


@pytest.mark.parametrize("hz", RATES)
def test_every_rate_of_the_three_sets_is_reached_by_both_sensors(board: HostBoard, hz: float) -> None:
    selection, code = RATES[hz]
    assert configure(board, SENSOR, rate_hz=hz)["rate_hz"] == hz
    values = registers(board).values
    assert (values[0x62], values[0x10], values[0x11]) == (selection, 0x10 | code, 0x10 | code)


@pytest.mark.parametrize(("wanted_hz", "hz"), [(1, 12.5), (110, 100), (238, 240), (952, 960), (9000, 2000)])
def test_other_rates_become_the_nearest(board: HostBoard, wanted_hz: float, hz: float) -> None:
    assert configure(board, SENSOR, rate_hz=wanted_hz)["rate_hz"] == hz


@pytest.mark.parametrize(
    ("wanted", "deg_s", "code", "mdps"),
    [(1, 125, 0, 4.375), (126, 250, 1, 8.75), (500, 500, 2, 17.5), (501, 1000, 3, 35), (2000, 2000, 4, 70)],
)
def test_its_ranges_have_the_data_sheets_sensitivities(
    board: HostBoard, wanted: float, deg_s: float, code: int, mdps: float
) -> None:
    setup = configure(board, SENSOR, range_deg_s=wanted)
    assert setup["range_deg_s"] == deg_s
    assert setup["sensitivity_rad_s"] == pytest.approx(math.radians(1e-3 * mdps), rel=1e-15)
    assert (setup["temperature_scale_c"], setup["temperature_offset_c"]) == (1 / 256, 25.0)
    assert registers(board).values[0x15] == code


@pytest.mark.parametrize(
    ("wanted_g", "g", "code", "mg"), [(1, 2, 0, 0.061), (4, 4, 1, 0.122), (5, 8, 2, 0.244), (16, 16, 3, 0.488)]
)
def test_its_accelerometer_has_the_data_sheets_sensitivities(
    board: HostBoard, wanted_g: float, g: float, code: int, mg: float
) -> None:
    setup = configure(board, SENSOR, range_g=wanted_g)
    assert setup["range_m_s2"] == pytest.approx(g * 9.80665, rel=1e-15)
    assert setup["sensitivity_m_s2"] == pytest.approx(9.80665 * 1e-3 * mg, rel=1e-15)
    assert registers(board).values[0x17] == code


def test_it_is_reset_first_and_started_last(board: HostBoard) -> None:
    part = registers(board)
    part.values[0x19], part.values[0x0A] = 0x04, 0x06  # a self-test and a FIFO that another image left on
    part.writes.clear()
    configure(board, SENSOR)
    assert (part.values[0x19], part.values[0x0A]) == (0, 0)
    assert part.writes[:2] == [(0x03, 0x01), (0x12, 0x45)], "I2C goes off as soon as it is known"
    assert [address for address, _value in part.writes[-2:]] == [0x10, 0x11]
    # pulses, data-ready of the gyroscope alone, both bytes of one conversion, addresses that count up
    expected = {0x03: 0x01, 0x0D: 0x02, 0x12: 0x44, 0x13: 0x02}
    assert {address: part.values[address] for address in expected} == expected


def test_a_reset_that_does_not_end_is_refused(board: HostBoard) -> None:
    registers(board).resets_for = 1000
    (error,) = board.ask("configure", sensor=SENSOR, rate_hz=200, range_deg_s=100, range_g=0, range_gauss=0)
    assert error.name == "error"


@pytest.mark.parametrize("register", [0x03, 0x13, 0x62, 0x15, 0x17, 0x10, 0x11])
def test_a_setting_that_does_not_stick_is_refused(board: HostBoard, register: int) -> None:
    registers(board).stuck.add(register)
    (error,) = board.ask("configure", sensor=SENSOR, rate_hz=200, range_deg_s=250, range_g=4, range_gauss=0)
    assert error.name == "error"


@pytest.mark.parametrize("page", [0x80, 0x40])
def test_it_is_found_in_whichever_page_another_image_left_it(board: HostBoard, page: int) -> None:
    registers(board).values[0x01] = page
    (identity,) = board.ask("hello")
    assert identity.items["who_am_i"][SENSOR] == 0x70
    assert registers(board).values[0x01] == 0


def test_a_sample_is_one_burst_low_byte_first(board: HostBoard) -> None:
    configure(board, SENSOR, range_g=8)
    registers(board).transfers.clear()
    batch = first_samples(board, SENSOR, (-32768, 258, 32767), acceleration=(1, -2, 4096))
    assert registers(board).transfers == [18] * 41  # once at the start, to begin with a line that is low
    assert batch.items["counts"][0].tolist() == [-32768, 258, 32767]
    assert batch.items["acceleration"][0].tolist() == [1, -2, 4096]
    assert batch.items["temperature_counts"][0] == -48


@pytest.mark.parametrize(("rate_hz", "settling"), [(1000, 91), (240, 22), (15, 2)])
def test_it_has_90_ms_to_start_up_and_settle(board: HostBoard, rate_hz: float, settling: int) -> None:
    configure(board, SENSOR, rate_hz=rate_hz)
    board.ask("start", 2, sensors=0)
    for k in range(100):
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

    fast = partial(emulated_session.PARTS["lsm6dsv16x"], oscillator_ppm=7000.0)  # so that each delay comes
    monkeypatch.setitem(emulated_session.PARTS, "lsm6dsv16x", fast)
    session = Session(parts=("adis16465", "lsm6dsv16x"), rate_at=rate_at, noise_rad_s=0.0)
    session.run(0.2)
    session.configure("adis16465", 1000.0, range_g=8.0)  # 0.56 ms of the bus for each of its readings
    setup = session.configure("lsm6dsv16x", 2000.0, 500.0).values
    session.board.receive(encode("start", 7, {"sensors": 0}))
    found = samples(session.run(0.6), SENSOR)
    assert len(found) > 100
    rates = setup["sensitivity_rad_s"] * found["counts"]
    true = np.array(TRUTH.scale) * (rates + np.array(TRUTH.bias_rad_s))
    assert abs(true - true[:, :1]).max() < 2e-3, "all three are of one conversion"


# The register model


def test_the_model_knows_what_the_data_sheet_forbids() -> None:
    driver = Lsm6dsv16xDriver()
    driver.set(0x12, 0x45)
    with pytest.raises(Violation) as early:
        driver.set(0x13, 0x02)
    assert "reset is under way" in early.value.what
    driver = Lsm6dsv16xDriver()
    driver.set(0x10, 0x07)  # high-performance mode
    with pytest.raises(Violation) as entered:
        driver.set(0x10, 0x17)
    assert "section 6.5" in entered.value.remedy
    driver = Lsm6dsv16xDriver()
    driver.set(0x10, 0x17)
    with pytest.raises(Violation) as unlike:
        driver.set(0x11, 0x18)
    assert "one data rate" in unlike.value.remedy


def test_without_pulses_its_line_is_up_until_a_rate_is_read() -> None:
    driver = Lsm6dsv16xDriver()
    driver.start(240.0, 500.0)
    driver.set(0x13, 0x00)
    driver.await_data()
    driver.advance(driver.time_s + 1e-3)
    assert driver.part.interrupt_level
    driver.accelerations()
    assert driver.part.interrupt_level, "the accelerometer has a flag of its own"
    driver.read()
    assert not driver.part.interrupt_level


def test_its_pulse_is_65_us_long() -> None:
    driver = Lsm6dsv16xDriver()
    driver.start(240.0, 500.0)
    driver.await_data()
    at_s = driver.time_s
    driver.advance(at_s + 64e-6)
    assert driver.part.interrupt_level
    driver.advance(at_s + 66e-6)
    assert not driver.part.interrupt_level
