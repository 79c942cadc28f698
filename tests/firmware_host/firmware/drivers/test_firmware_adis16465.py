"""The driver of the ADIS16465 against its registers."""

import ctypes
import math

import pytest

from firmware_host.protocol import ERRORS, MESSAGE_BY_NAME
from support.board.host_board import HostBoard, configure, convert, error_of, first_samples, sample_sequences
from support.board.host_sensors import Nobody
from support.parts.adis16465 import Adis16465Registers


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("model", "deg_s", "counts_per_deg_s"), [(0x0003, 125, 160), (0x0007, 500, 40), (0x000F, 2000, 10)]
)
def test_the_model_of_the_adis16465_has_its_range(
    board: HostBoard, model: int, deg_s: float, counts_per_deg_s: float
) -> None:
    board.adis16465.words[0x5E] = model
    setup = configure(board, 2, range_deg_s=100)
    assert setup["range_deg_s"] == deg_s
    assert setup["sensitivity_rad_s"] == pytest.approx(math.radians(1 / counts_per_deg_s), rel=1e-15)
    assert (setup["temperature_scale_c"], setup["temperature_offset_c"]) == (0.1, 0.0)
    assert (
        error_of(board.ask("configure", sensor=2, rate_hz=200, range_deg_s=deg_s + 1, range_g=0, range_gauss=0))
        == "bad_range"
    )


def test_a_model_of_the_adis16465_that_nobody_knows_is_another_part(board: HostBoard) -> None:
    board.adis16465.words[0x5E] = 0x000B
    assert (
        error_of(board.ask("configure", sensor=2, rate_hz=200, range_deg_s=125, range_g=0, range_gauss=0))
        == "sensor_mismatch"
    )


@pytest.mark.parametrize(
    ("wanted_hz", "hz", "decimation"),
    [(9000, 2000, 0), (1000, 1000, 1), (238, 250, 7), (400, 400, 4), (1.4, 2000 / 1429, 1428), (0.1, 1, 1999)],
)
def test_the_adis16465_decimates(board: HostBoard, wanted_hz: float, hz: float, decimation: int) -> None:
    assert configure(board, 2, rate_hz=wanted_hz)["rate_hz"] == hz
    assert board.adis16465.words[0x64] == decimation


def test_settings_of_the_adis16465_are_written_by_bytes_and_believed_when_they_read_back(board: HostBoard) -> None:
    board.adis16465.words |= {0x5C: 0x0004, 0x60: 0x0002}
    configure(board, 2, rate_hz=2)
    biases = [(address, 0x00) for address in range(0x40, 0x58)]  # of the rates, then of the accelerations
    filter_off = [(0x5C, 0x00), (0x5D, 0x00)]
    data_ready_rises = [(0x60, 0xC1), (0x61, 0x00)]
    decimation = [(0x64, 0xE7), (0x65, 0x03)]  # 999
    assert board.adis16465.writes == biases + filter_off + data_ready_rises + decimation
    board.adis16465.taking_us = 2000
    assert (
        error_of(board.ask("configure", sensor=2, rate_hz=200, range_deg_s=125, range_g=0, range_gauss=0))
        == "setup_failed"
    )


@pytest.mark.parametrize(
    ("rate_hz", "range_g", "frames"),
    [(200, 0, 5), (200, 8, 8), (2000, 8, 0)],  # three or six lower words and the counter; without averaging, none
)
def test_an_adis16465_sample_is_a_burst_with_a_checksum_and_the_lower_words_that_averaging_fills(
    board: HostBoard, rate_hz: float, range_g: float, frames: int
) -> None:
    configure(board, 2, rate_hz=rate_hz, range_g=range_g)
    board.adis16465.transfers.clear()
    batch = first_samples(board, 2, (-32768, 258, 32767))
    at_start = [22]  # what is read before the first conversion is nothing new
    assert board.adis16465.transfers == at_start + ([22] + [2] * frames) * 40
    assert batch.items["counts"][0].tolist() == [-32768, 258, 32767]
    assert batch.items["temperature_counts"][0] == -48


def streaming_adis16465() -> tuple[HostBoard, Adis16465Registers]:
    board = HostBoard()
    configure(board, 2)
    board.ask("start", 2, sensors=0)
    for k in range(3):
        convert(board, 50_000 + 5000 * k, sensor=2)
    return board, board.adis16465


@pytest.mark.parametrize("what", ["damaged", "supply too low", "repeated", "held low"])
def test_a_burst_that_cannot_be_trusted_is_a_bus_error_and_no_sample(what: str) -> None:
    board, part = streaming_adis16465()
    part.damage = what == "damaged"
    part.status = 0x10 if what == "supply too low" else 0
    if what == "held low":
        board.sensors[2] = Nobody(0x00)
    if what == "repeated":
        board.data_ready(100_000, 2)
        board.wait_until(100_000)
        board.run()
    else:
        convert(board, 100_000, sensor=2)
    board.sensors[2] = part
    part.damage = part.status = 0
    convert(board, 105_000, sensor=2)
    report = board.ask("status", 3)[-1]
    assert report.values["bus_errors"] == 1
    frames = board.ask("stop", 4)
    assert [f.values["dropped"] for f in frames if f.name == "samples"][-1] == report.items["dropped"][2] > 0


@pytest.mark.parametrize(("status", "name"), [(0x02, "sensor_fault"), (0x20, "sensor_fault"), (0x04, None)])
def test_a_fault_the_adis16465_reports_is_named(status: int, name: str | None) -> None:
    board, part = streaming_adis16465()
    part.status = status
    for k in range(30):
        convert(board, 100_000 + 5000 * k, sensor=2)
    errors = [(f.values["sensor"], ERRORS[f.values["code"]].name) for f in board.frames() if f.name == "error"]
    assert errors == ([(2, name)] if name else [])


@pytest.mark.parametrize(("every", "named"), [(3, True), (20, False)])
def test_damage_again_and_again_is_named_but_not_a_burst_now_and_then(every: int, named: bool) -> None:
    board, part = streaming_adis16465()
    for k in range(300):
        part.damage = k % every == 0
        convert(board, 100_000 + 5000 * k, sensor=2)
    errors = [ERRORS[f.values["code"]].name for f in board.frames() if f.name == "error"]
    assert errors == ["checksum_failed"] * named


def test_biases_somebody_stored_in_the_adis16465_are_cleared(board: HostBoard) -> None:
    biases = range(0x40, 0x58, 2)
    board.adis16465.words |= dict.fromkeys(biases, 0x1234)
    board.adis16465.stuck.add(0x56)
    assert (
        error_of(board.ask("configure", sensor=2, rate_hz=200, range_deg_s=125, range_g=0, range_gauss=0)[:1])
        == "setup_failed"
    )
    board.adis16465.stuck.clear()
    configure(board, 2)
    assert {board.adis16465.words[address] for address in biases} == {0}


def test_an_adis16465_that_reports_a_fault_is_reset_once_and_then_believed(board: HostBoard) -> None:
    board.adis16465.words[0x02] = 0x0002  # data path overrun
    board.adis16465.cured_by_reset = True
    configure(board, 2)
    assert board.adis16465.writes[:2] == [(0x68, 0x80), (0x69, 0x00)]
    assert board.core.port_time_us() >= 200_000
    board.adis16465.writes.clear()
    configure(board, 2)
    assert (0x68, 0x80) not in board.adis16465.writes
    board.adis16465.words[0x02] = 0x0020
    board.adis16465.cured_by_reset = False
    assert (
        error_of(board.ask("configure", sensor=2, rate_hz=200, range_deg_s=125, range_g=0, range_gauss=0)[:1])
        == "sensor_fault"
    )


def test_a_reading_that_the_next_conversion_overtakes_is_lost_and_the_part_not_blamed() -> None:
    """Whose reading it is cannot be told: it may be the next one's under the time of the one before."""
    board, part = streaming_adis16465()
    for k in range(20):
        next_us = 65_000 + 10_000 * k + 5000

        def overtake(next_us: int = next_us) -> None:
            part.convert((7, 7, 7), -48)
            board.data_ready(next_us, 2)

        part.before_burst = overtake
        convert(board, next_us - 5000, late_us=4990, sensor=2)
    frames = board.ask("stop", 4)
    assert [f for f in frames if f.name == "error"] == []
    assert sample_sequences(frames, 2) == [0]
    (report,) = [f for f in board.ask("status", 5) if f.name == "report"]
    assert (report.items["conversions"][2], report.items["dropped"][2], report.values["bus_errors"]) == (41, 40, 0)


def test_a_reading_during_which_the_next_conversion_comes_is_good_once_its_values_are_taken() -> None:
    board, part = streaming_adis16465()

    def overlap() -> None:
        board.data_ready(65_000 + 5000, 2)

    part.before_burst = overlap
    part.convert((7, 7, 7), -48)
    board.data_ready(65_000, 2)
    board.wait_until(69_900)
    board.run(1)
    part.convert((8, 8, 8), -48)
    board.run(1)
    frames = board.ask("stop", 4)
    assert sample_sequences(frames, 2) == [0, 1, 2]


FRESH, STALE = range(2)  # enum read_result of core/drivers/sensor.h


class Driver(ctypes.Structure):
    """`struct sensor_driver` of core/drivers/sensor.h."""

    _fields_ = (
        ("part", ctypes.c_char * 12),
        ("identity", ctypes.c_uint16),
        ("quantity", ctypes.c_uint8),
        ("settling_us", ctypes.c_uint32),
        ("settling", ctypes.c_uint8),
        ("holds_line", ctypes.c_bool),
        ("latched_within_us", ctypes.c_uint8),
        ("reset", ctypes.CFUNCTYPE(None, ctypes.c_uint)),
        ("keep_to_spi", ctypes.CFUNCTYPE(None, ctypes.c_uint)),
        ("identify", ctypes.CFUNCTYPE(ctypes.c_uint16, ctypes.c_uint)),
        ("configure", ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)),
        ("read", ctypes.CFUNCTYPE(ctypes.c_int, ctypes.c_uint, ctypes.c_void_p, ctypes.c_void_p)),
    )


def test_two_adis16465_on_one_bus_do_not_share_what_the_driver_remembers(board: HostBoard) -> None:
    driver = Driver.in_dll(board.core, "adis16465_gyro")
    setup, reading = ctypes.create_string_buffer(MESSAGE_BY_NAME["setup"].head.size), ctypes.create_string_buffer(14)
    first, second = board.adis16465, Adis16465Registers()
    board.sensors[1] = second
    for part in (first, second):
        part.convert((1, 2, 3), -48)
    assert first.counter == second.counter == 1
    assert [driver.read(device, setup, reading) for device in (2, 1, 2, 1)] == [FRESH, FRESH, STALE, STALE]
    board.core.board_reset()
    assert [driver.read(device, setup, reading) for device in (2, 1)] == [FRESH, STALE], (
        "device 2 alone is on this board"
    )
