"""MAVLink's sequence numbers and an autopilot's time: lost, doubled, late, wrapped, restarted; four bytes' meaning."""

import struct

import numpy as np
import pytest

from rig.data.quantity import RATE
from rig.sensors.errors import SensorError
from rig.sensors.mavlink.autopilot_source import describe
from rig.sensors.mavlink.dialect import ARDUPILOT, PX4
from rig.sensors.mavlink.message_losses import ImuCounter, LinkCounter
from rig.sensors.mavlink.orientations import RIGHT_ANGLES, board_rotation
from rig.sensors.mavlink.parameter_encoding import AutopilotParameter, encode_value
from rig.world.autopilot.autopilot_imu import ORIENTATIONS, orientation_rotation
from support.wires.autopilot_on_a_wire import section


def taken(sequence: list[int], counter: LinkCounter) -> list[int]:
    return [number for number in sequence if counter.is_new(number, bytes([number]))]


def test_a_gap_is_so_many_lost_and_a_copy_is_one_doubled() -> None:
    counter = LinkCounter()
    assert taken([250, 251, 251, 254, 255, 255, 0, 3], counter) == [250, 251, 254, 255, 0, 3]
    assert (counter.lost, counter.doubled) == (4, 2)


def test_a_message_that_was_overtaken_stays_lost() -> None:
    counter = LinkCounter()
    assert taken([10, 12, 11, 13], counter) == [10, 12, 13]
    assert (counter.lost, counter.doubled) == (1, 0)


def test_samples_are_numbered_by_the_autopilots_time() -> None:
    counter = ImuCounter("imu", 10_000, 1000)
    numbers = [counter.number for time in (5, 15, 26, 26, 55, 64) if counter.count(time)]
    assert numbers == [0, 1, 2, 5, 6] and counter.repeated == 1
    assert counter.time_us == 64_000


def test_milliseconds_begin_anew_after_49_days() -> None:
    counter = ImuCounter("imu", 10_000, 1000)
    assert counter.count(2**32 - 4) and counter.count(6)
    assert counter.time_us == (2**32 + 6) * 1000 and counter.number == 1


@pytest.mark.parametrize("back", [3_000, 100_000_000])
def test_a_clock_that_jumps_is_a_restart(back: int) -> None:
    counter = ImuCounter("imu", 10_000, 1)
    assert counter.count(200_000_000)
    with pytest.raises(SensorError, match="restarted"):
        counter.count(back)


@pytest.mark.parametrize(
    ("firmware", "field", "value"),
    [
        (ARDUPILOT, struct.pack("<f", 2621698.0), 2621698.0),
        (PX4, struct.pack("<i", 2621698), 2621698.0),
        (PX4, struct.pack("<i", -1), -1.0),  # as a float it is no number
    ],
)
def test_whole_numbers_are_cast_by_one_and_copied_by_the_other(firmware: int, field: bytes, value: float) -> None:
    assert AutopilotParameter("CAL_GYRO0_ID", 6, field, firmware).value == value
    assert AutopilotParameter("X", 9, encode_value(0.1), firmware).value == np.float32(0.1)


def test_orientations_are_rotations_and_those_of_the_simulated_autopilot() -> None:
    for number in RIGHT_ANGLES:
        matrix = board_rotation(float(number))
        assert matrix is not None and matrix @ matrix.T == pytest.approx(np.eye(3))
        assert np.linalg.det(matrix) == pytest.approx(1.0)
    for number in ORIENTATIONS:
        assert board_rotation(float(number)) == pytest.approx(orientation_rotation(number))
    assert board_rotation(1.0) is None and board_rotation(100.0) is None and board_rotation(0.5) is None


@pytest.mark.parametrize(("imu", "end_rad_s"), [("SCALED_IMU", 32.767), ("HIGHRES_IMU", np.radians(2000))])
def test_a_rate_is_clipped_at_the_end_of_its_range_or_of_the_numbers_that_carry_it(imu: str, end_rad_s: float) -> None:
    """2000 °/s are 34.9 rad/s, and 16 bits of mrad/s end before."""
    channel = describe("imu", section("/dev/ttyACM0", imu, range_deg_s=2000)).channel(RATE)
    samples = np.zeros(2, np.dtype([(channel.column, channel.type, 3)]))
    channel.fill(samples, np.outer([0.97, 1.0], [end_rad_s, 0, 0]))
    assert channel.is_saturated(samples).tolist() == [False, True]
