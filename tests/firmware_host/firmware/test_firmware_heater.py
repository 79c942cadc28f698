"""The heater as the firmware's core drives it: on by the host's word alone, off by itself."""

from typing import Any

import pytest

from firmware_host.protocol import HEATER_CAUSES, HEATER_LIMIT_C
from support.board.host_board import PERIOD_US, HostBoard, streaming_board

POWER = 200


class HeatedBoard:
    """A streaming board whose LSM9DS1 is at `temperature_c`; its time goes on from conversion to conversion."""

    def __init__(self, board: HostBoard) -> None:
        self.board = board
        self.temperature_c = 25.0
        self.time_us = 0
        self.thermometer_works = True

    def live(self, duration_s: float) -> None:
        """Convert for so long."""
        for _ in range(round(duration_s * 1e6 / PERIOD_US)):
            self.time_us += PERIOD_US
            self.board.wait_until(self.time_us)
            if self.thermometer_works:
                self.board.gyro.convert((1, 2, 3), round(16 * (self.temperature_c - 25)), (0, 0, 0))
                self.board.data_ready(self.time_us)
            self.board.run()

    def heat(self, power: int) -> tuple[int, str]:
        """What the board answers: its power, and why."""
        answers = [frame for frame in self.board.ask("heat", power=power) if frame.name == "heating"]
        values: dict[str, Any] = answers[0].values
        return values["power"], HEATER_CAUSES[values["cause"]]

    @property
    def power(self) -> int:
        """What the pin does."""
        return int(self.board.core.host_heating())


@pytest.fixture
def heated() -> HeatedBoard:
    board = HeatedBoard(streaming_board())
    board.live(0.1)
    return board


def test_the_hosts_word_switches_the_heater_on_and_off(heated: HeatedBoard) -> None:
    assert heated.power == 0
    assert heated.heat(POWER) == (POWER, "on")
    assert heated.power == POWER
    assert heated.heat(POWER // 2) == (POWER // 2, "on")
    assert heated.power == POWER // 2
    assert heated.heat(0) == (0, "not_wanted")
    assert heated.power == 0


def test_the_heater_goes_off_two_seconds_after_the_latest_word(heated: HeatedBoard) -> None:
    for _ in range(3):
        heated.heat(POWER)
        heated.live(1.9)
        assert heated.power == POWER
    heated.live(0.15)
    assert heated.power == 0
    assert heated.heat(POWER) == (POWER, "on"), "the next word switches it on again"


def test_what_is_too_hot_stays_off_until_the_host_says_so_itself(heated: HeatedBoard) -> None:
    heated.heat(POWER)
    heated.temperature_c = HEATER_LIMIT_C - 0.1
    heated.live(0.1)
    assert heated.power == POWER
    heated.temperature_c = HEATER_LIMIT_C
    heated.live(0.1)
    assert heated.power == 0
    assert heated.heat(POWER) == (0, "too_hot")
    heated.temperature_c = 25.0
    heated.live(0.1)
    assert heated.heat(POWER) == (0, "too_hot")
    assert heated.power == 0
    assert heated.heat(0) == (0, "not_wanted")
    assert heated.heat(POWER) == (POWER, "on")


def test_a_board_that_is_too_hot_already_does_not_even_begin(heated: HeatedBoard) -> None:
    heated.temperature_c = HEATER_LIMIT_C + 5
    heated.live(0.1)
    assert heated.heat(POWER) == (0, "too_hot")
    assert heated.power == 0


def test_without_a_thermometer_that_tells_nothing_is_heated(heated: HeatedBoard) -> None:
    assert HeatedBoard(HostBoard()).heat(POWER) == (0, "no_thermometer"), "nothing is configured"
    board = HeatedBoard(streaming_board())
    assert board.heat(POWER) == (0, "no_thermometer"), "nothing has been read yet"
    board.live(0.1)
    assert board.heat(POWER) == (POWER, "on")
    board.thermometer_works = False
    board.live(0.9)
    assert board.power == POWER
    board.live(0.2)
    assert board.power == 0
    assert board.heat(POWER) == (0, "no_thermometer")


def test_a_stream_that_stops_takes_the_heater_with_it(heated: HeatedBoard) -> None:
    heated.heat(POWER)
    heated.board.ask("stop")
    heated.board.run()
    assert heated.power == 0


def test_the_hottest_of_several_parts_counts_and_each_must_have_a_temperature() -> None:
    board = HostBoard()
    numbers = {name: number for number, name in enumerate(board.parts)}
    for name, rate_hz, range_deg_s in (("lsm9ds1", 238, 245), ("mpu9250", 200, 250)):
        sensor = numbers[name]
        board.ask("configure", sensor=sensor, rate_hz=rate_hz, range_deg_s=range_deg_s, range_g=0, range_gauss=0)
    board.ask("start", sensors=0)

    def convert(time_us: int, mpu9250_counts: int) -> None:
        board.wait_until(time_us)
        board.gyro.convert((1, 2, 3), 0, (0, 0, 0))
        board.data_ready(time_us, numbers["lsm9ds1"])
        board.mpu9250.convert((1, 2, 3), mpu9250_counts, (0, 0, 0))
        board.data_ready(time_us, numbers["mpu9250"])
        board.run()

    for k in range(40):
        convert(5000 * (k + 1), 0)
    (heating,) = [frame for frame in board.ask("heat", power=POWER) if frame.name == "heating"]
    assert heating.values["power"] == POWER
    assert heating.values["temperature_c"] == pytest.approx(25.0), "0 counts of the LSM9DS1; of the MPU-9250 21 °C"
    for k in range(40, 60):
        convert(5000 * (k + 1), 20_000)  # 81 °C
    assert board.core.host_heating() == 0


def test_a_reboot_leaves_the_heater_off(heated: HeatedBoard) -> None:
    heated.heat(POWER)
    heated.board.ask("reboot")
    heated.board.run()
    assert heated.board.restarts == 1
    assert heated.power == 0
