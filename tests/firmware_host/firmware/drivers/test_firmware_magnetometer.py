"""The LSM9DS1's magnetometer: a sensor of its own with its own select and line, whose samples are a field."""

import math
from typing import Any

import pytest

from firmware_host.answers import NO_CHANGE
from firmware_host.frames import Frame
from support.board.emulated_session import FIELD_T, MAGNETIC, Session
from support.board.host_board import PERIOD_US, HostBoard, configure, convert, error_of, sample_sequences, settle
from support.parts import NUMBER

SENSOR = NUMBER["lsm9ds1_magnetometer"]
PERIOD_80_HZ_US = 12_500
SETTLING = 2
CALIBRATION = {
    "model": 1,
    "serial_number": "M1",
    "written_unix_s": 0,
    "temperature_c": 25.0,
    "matrix": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "bias_rad_s": [0, 0, 0],
    "lowest_c": 25.0,
    "highest_c": 25.0,
    "scale_change": NO_CHANGE,
    "bias_change_rad_s": NO_CHANGE,
}


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


def ask_for(board: HostBoard, rate_hz: float = 80.0, **ranges: float) -> list[Frame]:
    wanted: dict[str, Any] = {"range_deg_s": 0.0, "range_g": 0.0, "range_gauss": 4.0} | ranges
    return board.ask("configure", sensor=SENSOR, rate_hz=rate_hz, **wanted)


@pytest.mark.parametrize(
    ("wanted", "gauss", "code", "mgauss"),
    [(1, 4, 0, 0.14), (4, 4, 0, 0.14), (4.1, 8, 1, 0.29), (12, 12, 2, 0.43), (16, 16, 3, 0.58)],
)
def test_its_ranges_have_the_data_sheets_sensitivities(
    board: HostBoard, wanted: float, gauss: float, code: int, mgauss: float
) -> None:
    (setup,) = ask_for(board, range_gauss=wanted)
    assert setup.values["range_t"] == pytest.approx(gauss * 1e-4)
    assert setup.values["sensitivity_t"] == pytest.approx(mgauss * 1e-7)
    assert all(setup.values[name] == 0 for name in ("range_deg_s", "sensitivity_rad_s", "sensitivity_m_s2"))
    assert board.magnetometer.values[0x21] == code << 5


@pytest.mark.parametrize(("wanted_hz", "hz", "code"), [(0.1, 0.625, 0), (9, 10, 4), (80, 80, 7), (952, 80, 7)])
def test_it_is_set_up_to_convert_at_the_nearest_rate_as_well_as_it_can(
    board: HostBoard, wanted_hz: float, hz: float, code: int
) -> None:
    board.magnetometer.values[0x05:0x0B] = bytes(range(1, 7))  # offsets that somebody left
    (setup,) = ask_for(board, wanted_hz)
    assert setup.values["rate_hz"] == hz
    values = board.magnetometer.values
    assert values[0x20] == 0xE0 | code << 2 and values[0x23] == 0x0C, "compensated, ultra-high performance"
    assert values[0x24] == 0x40, "both bytes of one conversion"
    assert values[0x05:0x0B] == bytes(6)
    assert board.magnetometer.writes[-1] == (0x22, 0x80), "on when all is set"


@pytest.mark.parametrize(
    "ranges",
    [
        {"range_gauss": 16.5},
        {"range_gauss": 0.0},
        {"range_gauss": math.nan},
        {"range_deg_s": 245.0},
        {"range_g": 2.0},
    ],
)
def test_a_range_it_does_not_have_and_one_of_another_quantity_are_refused(
    board: HostBoard, ranges: dict[str, float]
) -> None:
    assert error_of(ask_for(board, **ranges)) == "bad_range"


@pytest.mark.parametrize("sensor", range(3))
def test_a_gyroscope_has_no_range_of_a_field(board: HostBoard, sensor: int) -> None:
    wanted = {"rate_hz": 200, "range_deg_s": 125, "range_g": 0, "range_gauss": 4}
    assert error_of(board.ask("configure", sensor=sensor, **wanted)) == "bad_range"


@pytest.mark.parametrize(
    ("request_name", "values"),
    [
        ("start", {"sensors": 1 << SENSOR}),
        ("keep", {"sensors": 1 << SENSOR, "duration_s": 1.0}),
        ("observe", {"sensor": SENSOR, "index": 0, "start_us": 0, "end_us": 1, "speed_rad_s": 1.0}),
        ("recall", {"sensor": SENSOR, "index": 0, "mean_rad_s": (1, 0, 0), "speed_rad_s": 1.0}),
        ("solve", {"sensor": SENSOR, "method": 0}),
        ("read_calibration", {"sensor": SENSOR}),
        ("write_calibration", {"sensor": SENSOR, **CALIBRATION}),
        ("erase_calibration", {"sensor": SENSOR}),
    ],
)
def test_what_is_for_gyroscopes_only_is_refused_by_name(
    board: HostBoard, request_name: str, values: dict[str, object]
) -> None:
    ask_for(board)
    assert error_of(board.ask(request_name, 2, **values)) == "not_a_gyroscope"


def test_its_samples_are_a_field_numbered_and_stamped_as_any_other(board: HostBoard) -> None:
    ask_for(board)
    board.ask("start", 2, sensors=0)
    for k in range(62):
        convert(board, PERIOD_80_HZ_US * k, (k, -32768, 32767), sensor=SENSOR)
    frames = [f for f in board.ask("stop", 3) if f.name == "field_samples"]
    items = [item for f in frames for item in f.items]
    assert [int(item["field"][0]) for item in items] == list(range(SETTLING, 62))
    assert {tuple(item["field"].tolist()[1:]) for item in items} == {(-32768, 32767)}, "no axis is turned"
    assert sample_sequences(frames, SENSOR) == list(range(60))
    times_us = [f.values["base_time_us"] + d for f in frames for d in f.items["delta_us"].tolist()]
    assert times_us == [PERIOD_80_HZ_US * k for k in range(SETTLING, 62)]
    assert max(f.values["count"] for f in frames) <= 8, "none is older than 80 ms"


def test_what_a_line_that_stays_busy_keeps_waiting_is_counted_and_the_rest_is_whole(board: HostBoard) -> None:
    """Its ring is shorter than a gyroscope's: at 80 Hz a fifth of a second."""
    ask_for(board)
    board.ask("start", 2, sensors=0)
    board.line_is_free = False
    board.ask("status", 3)
    for k in range(SETTLING + 60):
        convert(board, PERIOD_80_HZ_US * k, (k, 0, 0), sensor=SENSOR)
    board.line_is_free = True
    board.sent()
    frames = board.ask("stop", 4) + board.ask("status", 5)
    counts = [f for f in frames if f.name == "report"][-1].items[SENSOR]
    numbers = sample_sequences(frames, SENSOR)
    assert len(numbers) == len(set(numbers)) == counts["samples"]
    assert counts["samples"] + counts["dropped"] == counts["conversions"] == 60
    assert counts["dropped"] > 10


def test_it_streams_beside_a_gyroscope_and_is_not_kept(board: HostBoard) -> None:
    configure(board, 0, rate_hz=238, range_deg_s=245)
    ask_for(board)
    assert [f.name for f in board.ask("keep", 2, sensors=1, duration_s=1.0)] == ["ack"]
    board.ask("start", 3, sensors=0)
    settle(board)
    for k in range(1, 30):
        convert(board, PERIOD_US * k, (k, 0, 0))
        convert(board, PERIOD_US * k + 1000, (-k, 0, 0), sensor=SENSOR)
    frames = board.ask("stop", 4)
    assert sample_sequences(frames, 0) == list(range(29))
    assert {f.name for f in frames if f.values.get("sensor") == SENSOR} == {"field_samples"}


def test_asking_who_is_there_and_setting_the_gyroscope_up_leave_it_converting(board: HostBoard) -> None:
    """Both dies are told to keep off I2C again and again, which must not power the configured one down."""
    ask_for(board)
    board.ask("hello", 2)
    configure(board, 0, rate_hz=238, range_deg_s=245)
    assert board.magnetometer.values[0x22] == 0x80


def test_another_part_in_its_place_is_not_written_to(board: HostBoard) -> None:
    board.magnetometer.values[0x0F] = 0x40
    assert error_of(ask_for(board)) == "sensor_mismatch"
    assert board.magnetometer.writes == []


def test_a_register_that_does_not_take_its_setting_is_found(board: HostBoard) -> None:
    board.magnetometer.stuck = {0x24}
    assert error_of(ask_for(board)) == "setup_failed"


def test_a_part_that_signals_but_no_longer_answers_is_named(board: HostBoard) -> None:
    ask_for(board)
    board.ask("start", 2, sensors=0)
    board.magnetometer.is_heard = False
    errors: list[Frame] = []
    for k in range(40):
        convert(board, PERIOD_80_HZ_US * k, (1, 2, 3), sensor=SENSOR)
        errors += [f for f in board.frames() if f.name == "error"]
    assert [error_of([f]) for f in errors] == ["sensor_absent"]


@pytest.mark.slow
def test_the_image_reads_the_emulated_die_on_its_own_select_and_line() -> None:
    """80 Hz beside the gyroscope's 238, exactly counted, in the field that is there."""
    session = Session(parts=("lsm9ds1", "lsm9ds1_magnetometer"), boot_time_s=0.0)
    session.run(0.1)
    identity = session.ask("hello")
    assert identity.items[[0, SENSOR]].tolist() == [(b"LSM9DS1", 0x68, 1, 0), (b"LSM9DS1-M", 0x3D, 1, 1)]
    session.configure("lsm9ds1")
    setup = session.configure_magnetometer()
    assert session.ask("start", sensors=0).name == "ack"
    frames = session.run(1.5)
    field = [f for f in frames if f.name == "field_samples"]
    counts = [item["field"].tolist() for f in field for item in f.items]
    assert len(counts) == pytest.approx(1.5 * 80, abs=10)
    expected = [
        (b / k + bias) / setup.values["sensitivity_t"]
        for b, k, bias in zip(FIELD_T, MAGNETIC.scale, MAGNETIC.bias_t, strict=True)
    ]
    assert counts[0] == pytest.approx(expected, abs=0.51)
    report = session.ask("status")
    assert report.items[SENSOR]["dropped"] == 0 and report.items[0]["dropped"] == 0
    assert report.values["bus_errors"] == 0
