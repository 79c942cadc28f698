"""The drivers of the parts: what holds for all, and the LSM9DS1."""

import math

import pytest

from firmware_host.parts import BOARD_PARTS, GYROSCOPES, MAGNETOMETERS
from firmware_host.protocol import ERRORS
from support.board.host_board import PERIOD_US, HostBoard, configure, convert, error_of, streaming_board
from support.board.host_sensors import Nobody
from support.parts import NUMBER


@pytest.fixture
def board() -> HostBoard:
    return HostBoard()


# What holds for every part


@pytest.mark.parametrize("sensor", range(len(GYROSCOPES)))
@pytest.mark.parametrize("rate_hz", [0.0, -238.0, math.nan, math.inf])
def test_a_rate_that_is_no_rate_is_refused(board: HostBoard, sensor: int, rate_hz: float) -> None:
    assert (
        error_of(board.ask("configure", sensor=sensor, rate_hz=rate_hz, range_deg_s=100, range_g=0, range_gauss=0))
        == "bad_rate"
    )


@pytest.mark.parametrize("sensor", range(len(GYROSCOPES)))
@pytest.mark.parametrize("range_deg_s", [0.0, -245.0, 2001.0, math.nan, math.inf])
def test_a_range_the_part_does_not_have_is_refused(board: HostBoard, sensor: int, range_deg_s: float) -> None:
    assert (
        error_of(board.ask("configure", sensor=sensor, rate_hz=238, range_deg_s=range_deg_s, range_g=0, range_gauss=0))
        == "bad_range"
    )


@pytest.mark.parametrize("part", BOARD_PARTS)
@pytest.mark.parametrize("level", [0x00, 0xFF])
def test_a_missing_part_is_told_in_the_identity_and_refused(board: HostBoard, part: str, level: int) -> None:
    sensor, bytes_read = NUMBER[part], 2 if BOARD_PARTS[part].who_am_i > 0xFF else 1
    board.sensors[sensor] = Nobody(level)
    (identity,) = board.ask("hello")
    expected = int.from_bytes(bytes((level,)) * bytes_read, "big")
    assert identity.items["who_am_i"][sensor] == expected
    assert identity.items["present"].tolist() == [i != sensor for i in range(len(BOARD_PARTS))]
    ranges = (0, 0, 4) if part in MAGNETOMETERS else (100, 0, 0)
    wanted = dict(zip(("range_deg_s", "range_g", "range_gauss"), ranges, strict=True))
    (error,) = board.ask("configure", sensor=sensor, rate_hz=200, **wanted)
    assert (ERRORS[error.values["code"]].name, error.values["sensor"]) == ("sensor_absent", sensor)


@pytest.mark.parametrize(
    ("part", "identity"),
    [(name, other) for name, part in GYROSCOPES.items() for other in list(part.identities)[:8]],
)
def test_another_part_is_told_in_the_identity_and_refused(board: HostBoard, part: str, identity: int) -> None:
    sensor = NUMBER[part]
    board.parts[part].answer_as(identity)
    (answer,) = board.ask("hello")
    assert answer.items["who_am_i"][sensor] == identity and not answer.items["present"][sensor]
    (error,) = board.ask("configure", sensor=sensor, rate_hz=200, range_deg_s=100, range_g=0, range_gauss=0)
    assert (ERRORS[error.values["code"]].name, error.values["sensor"]) == ("sensor_mismatch", sensor)


@pytest.mark.parametrize("sensor", range(len(GYROSCOPES)))
def test_a_part_is_identified_before_its_range_is_judged(board: HostBoard, sensor: int) -> None:
    board.sensors[sensor] = Nobody()
    assert (
        error_of(board.ask("configure", sensor=sensor, rate_hz=238, range_deg_s=2001, range_g=0, range_gauss=0))
        == "sensor_absent"
    )


@pytest.mark.parametrize(("sensor", "register"), [(0, 0x10), (0, 0x22), (1, 0x19), (1, 0x13), (1, 0x6B), (2, 0x64)])
def test_a_setting_that_does_not_stick_is_refused_and_takes_the_sensor_out(
    board: HostBoard, sensor: int, register: int
) -> None:
    board.gyro.values[0x22], board.mpu9250.values[0x13], board.mpu9250.values[0x6B] = 0, 1, 0x41
    part = (board.gyro, board.mpu9250, board.adis16465)[sensor]
    part.stuck.add(register)
    assert (
        error_of(board.ask("configure", sensor=sensor, rate_hz=100, range_deg_s=100, range_g=0, range_gauss=0))
        == "setup_failed"
    )
    assert error_of(board.ask("start", sensors=0)) == "not_configured"
    part.stuck.clear()
    configure(board, sensor)
    assert board.ask("start", sensors=0)[0].name == "ack"


@pytest.mark.parametrize("sensor", range(len(GYROSCOPES)))
def test_asking_who_is_there_changes_nothing(board: HostBoard, sensor: int) -> None:
    configure(board, sensor)
    part = list(board.parts.values())[sensor]
    part.writes.clear()
    board.ask("start", 2, sensors=0)
    for k in range(40):
        part.convert((1, 2, 3), 0)
        board.data_ready(100_000 + 5000 * k, sensor)
        board.wait_until(100_000 + 5000 * k)
        board.ask("hello", 3)  # which the main loop answers before it reads the sensor
    assert set(part.writes) <= {(0x23, 0x04), (0x6A, 0x10)}, "but for what keeps the part off I2C"
    assert board.ask("status", 4)[-1].values["bus_errors"] == 0


def test_every_part_is_kept_off_i2c_from_the_start_and_also_one_that_is_never_configured() -> None:
    """On a shared bus what is said to another part may spell its I2C address."""
    board = HostBoard()
    board.ask("hello")
    assert board.gyro.values[0x23] == 0x04 and board.mpu9250.values[0x6A] == 0x10
    assert board.magnetometer.writes == [(0x22, 0x83)], "I2C off, and powered down"
    board.magnetometer.writes.clear()
    board.magnetometer.values[0x22] = 0x03
    board.gyro.values[0x0F], board.mpu9250.values[0x75] = 0x69, 0x70
    board.gyro.writes.clear()
    board.mpu9250.writes.clear()
    board.ask("hello", 2)
    assert not board.gyro.writes and not board.mpu9250.writes, "another part is left alone"
    assert board.magnetometer.writes == [(0x22, 0x83)], "the die is there by its own account"
    board.magnetometer.writes.clear()
    board.ask("hello", 3)
    assert not board.magnetometer.writes, "it has been told"


def test_a_magnetometer_whose_answers_are_not_wired_is_kept_off_i2c_blindly() -> None:
    board = HostBoard()
    board.magnetometer.is_heard = False
    (identity,) = board.ask("hello")
    assert identity.items[NUMBER["lsm9ds1_magnetometer"]].tolist() == (b"LSM9DS1-M", 0xFF, 0, 1)
    assert board.magnetometer.values[0x22] == 0x83


# LSM9DS1


@pytest.mark.parametrize(
    ("wanted_hz", "hz", "code"),
    [(1, 14.9, 1), (50, 59.5, 2), (100, 119.0, 3), (200, 238.0, 4), (238, 238.0, 4), (400, 476.0, 5), (1e4, 952.0, 6)],
)
def test_the_nearest_data_rate_is_set(board: HostBoard, wanted_hz: float, hz: float, code: int) -> None:
    (setup,) = board.ask("configure", sensor=0, rate_hz=wanted_hz, range_deg_s=245, range_g=0, range_gauss=0)
    assert setup.values["rate_hz"] == hz
    assert board.gyro.values[0x10] == code << 5


@pytest.mark.parametrize(
    ("wanted", "deg_s", "code", "mdps"),
    [(100, 245, 0, 8.75), (245, 245, 0, 8.75), (246, 500, 1, 17.5), (2000, 2000, 3, 70)],
)
def test_the_next_range_up_is_set_with_its_own_sensitivity(
    board: HostBoard, wanted: float, deg_s: float, code: int, mdps: float
) -> None:
    (setup,) = board.ask("configure", sensor=0, rate_hz=238, range_deg_s=wanted, range_g=0, range_gauss=0)
    assert setup.values["range_deg_s"] == deg_s
    assert setup.values["sensitivity_rad_s"] == pytest.approx(math.radians(mdps * 1e-3), rel=1e-15)
    assert (setup.values["temperature_scale_c"], setup.values["temperature_offset_c"]) == (1 / 16, 25.0)
    assert board.gyro.values[0x10] >> 3 & 3 == code


def test_settings_that_decide_what_a_reading_means_are_written_whatever_they_were(board: HostBoard) -> None:
    addresses = (0x0C, 0x11, 0x12, 0x13, 0x1E, 0x1F, 0x20, 0x21, 0x22, 0x23, 0x24)
    for address in addresses:
        board.gyro.values[address] = 0xFF & ~0x01
    board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245, range_g=0, range_gauss=0)
    # data-ready of the gyroscope alone; no filter, sign change, I2C or self-test; three axes; BDU, address increment
    expected = {0x0C: 0x02, 0x11: 0, 0x12: 0, 0x13: 0, 0x1E: 0x38, 0x22: 0x44, 0x23: 0x04, 0x24: 0}
    expected |= {0x1F: 0x38, 0x20: 0, 0x21: 0}  # the accelerometer off
    assert {address: board.gyro.values[address] for address in addresses} == expected
    assert board.gyro.writes[-1][0] == 0x10, "the part must start only when everything else is set"


def test_one_sample_is_one_transfer_of_temperature_status_and_rates() -> None:
    board = streaming_board()
    board.gyro.transfers.clear()
    for k in range(1, 20):
        convert(board, k * PERIOD_US, (-32768, 32767, k))
    assert board.gyro.transfers == [10] * 19
    first = next(frame for frame in board.frames() if frame.name == "samples")
    assert first.items["counts"][0].tolist() == [-32767, 32767, 1], "of the part's +32767 along its own x"
    assert first.items["temperature_counts"][0] == -48
