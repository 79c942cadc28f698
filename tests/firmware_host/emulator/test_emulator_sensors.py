"""The shipped image with several sensors on its bus: each at its own pace, and what is wrong with one is named."""

import hashlib
from pathlib import Path

import numpy as np
import pytest

from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.emulator.parts.gyroscope import GyroTruth
from firmware_host.emulator.parts.mpu9250 import Mpu9250
from firmware_host.errors import BoardError
from firmware_host.frames import Frame, encode
from firmware_host.protocol import ERRORS
from support.board import tiny_firmware
from support.board.emulated_session import (
    ACCELERATION,
    CRYSTAL_PPM,
    PARTS,
    RANGE_G,
    RATES_AND_RANGES,
    TRUTH,
    Session,
    samples,
)

ALL = tuple(PARTS)
RATE_RAD_S = (0.5, -0.3, 1.0)
BOARD_SECONDS = 122 * 32768 / 4e6 * (1 + CRYSTAL_PPM * 1e-6)  # the clock is locked to the 32768 Hz crystal


def streaming(noise_rad_s: float = 0.0, tick_s: float = 0.002) -> Session:
    session = Session(parts=ALL, rate_at=lambda _time_s: RATE_RAD_S, noise_rad_s=noise_rad_s, tick_s=tick_s)
    session.run(0.2)
    for part in ALL:
        session.configure(part)
    session.board.receive(encode("start", 78, {"sensors": 0}))
    return session


def error(frame: Frame) -> str:
    assert frame.name == "error", frame
    return ERRORS[frame.values["code"]].name


@pytest.mark.slow
def test_all_sensors_stream_each_at_its_own_pace_without_a_loss() -> None:
    session = streaming()
    setups = {part: session.sensors[part] for part in ALL}
    frames = session.run(2.0)
    for index, part in enumerate(setups):
        stream = samples(frames, index)
        rate_hz, _range = RATES_AND_RANGES[part]
        assert len(stream) > 1.8 * rate_hz
        assert np.all(np.diff(stream["sequence"]) == 1)
        expected_us = (stream["sequence"] - stream["sequence"][0]) * 1e6 / rate_hz * BOARD_SECONDS
        # An edge waits until the interrupt of another is done
        assert np.max(np.abs((stream["time_us"] - stream["time_us"][0]) - expected_us)) <= 6.0
    assert {frame.values["dropped"] for frame in frames if frame.name == "samples"} == {0}


@pytest.mark.slow
def test_each_tells_its_own_truth_in_its_own_counts() -> None:
    session = Session(parts=ALL, rate_at=lambda _time_s: RATE_RAD_S, noise_rad_s=0.0)
    session.run(0.2)
    per_count = {part: session.configure(part).values["sensitivity_rad_s"] for part in ALL}
    session.board.receive(encode("start", 78, {"sensors": 0}))
    frames = session.run(0.5)
    reading = np.array(RATE_RAD_S) / np.array(TRUTH.scale) - np.array(TRUTH.bias_rad_s)
    for index, part in enumerate(ALL):
        counts = samples(frames, index)["counts"]
        assert len(counts)
        assert np.all(np.abs(counts * per_count[part] - reading) <= 0.5 * per_count[part])


@pytest.mark.slow
def test_accelerations_of_all_come_along_in_the_same_axes_without_a_loss() -> None:
    """Motion and truth are in right-handed axes, and so is what arrives, of the LSM9DS1 too."""
    force_g = (0.5, -0.3, 0.8)
    session = Session(parts=ALL, rate_at=lambda _time_s: (*RATE_RAD_S, *force_g), noise_rad_s=0.0)
    session.run(0.2)
    setups = {part: session.configure(part, range_g=RANGE_G).values for part in ALL}
    session.board.receive(encode("start", 78, {"sensors": 0}))
    frames = session.run(1.0)
    rates = np.array(RATE_RAD_S) / np.array(TRUTH.scale) - np.array(TRUTH.bias_rad_s)
    forces = 9.80665 * np.array(force_g) / np.array(ACCELERATION.scale) - np.array(ACCELERATION.bias_m_s2)
    for index, part in enumerate(ALL):
        stream = samples(frames, index)
        assert len(stream) > 0.8 * setups[part]["rate_hz"]
        assert np.all(np.diff(stream["sequence"]) == 1)
        for name, sensitivity, expected in (
            ("counts", "sensitivity_rad_s", rates),
            ("acceleration", "sensitivity_m_s2", forces),
        ):
            assert np.all(
                np.abs(stream[name] * setups[part][sensitivity] - expected) <= 0.5 * setups[part][sensitivity]
            )
    assert {frame.values["dropped"] for frame in frames if frame.name == "imu_samples"} == {0}


@pytest.mark.slow
def test_equal_inputs_give_equal_bytes() -> None:
    def digest(tick_s: float) -> str:
        session = streaming(noise_rad_s=0.01, tick_s=tick_s)
        session.run(1.0)
        session.ask("status")
        return hashlib.sha256(session.sent).hexdigest()

    first = digest(0.002)
    assert digest(0.002) == first
    assert digest(0.01) == first, "the size of the world's tick must not matter"


@pytest.mark.parametrize("part", ALL)
@pytest.mark.parametrize(("fault", "name"), [(Fault.ABSENT, "sensor_absent"), (Fault.OTHER_PART, "sensor_mismatch")])
def test_a_part_that_is_not_there_is_told_from_another(part: str, fault: Fault, name: str) -> None:
    session = Session(parts=ALL)
    session.sensors[part].fault = fault
    session.run(0.2)
    present = session.ask("hello").items["present"].astype(bool)
    assert present[: len(ALL)].tolist() == [other != part for other in ALL]
    rate_hz, range_deg_s = RATES_AND_RANGES[part]
    answer = session.ask(
        "configure", sensor=ALL.index(part), rate_hz=rate_hz, range_deg_s=range_deg_s, range_g=0, range_gauss=0
    )
    assert error(answer) == name
    session.sensors[part].fault = None
    session.configure(part)


@pytest.mark.slow
def test_damaged_data_are_found_by_their_checksum() -> None:
    session = streaming()
    right = samples(session.run(0.3), 2)["counts"][-1]
    session.sensors["adis16465"].fault = Fault.DAMAGED
    frames = session.run(0.5)
    complaints = [frame for frame in frames if frame.name == "error"]
    assert [(error(frame), frame.values["sensor"]) for frame in complaints] == [("checksum_failed", 2)]
    undamaged = samples(session.run(0.5), 2)
    assert len(undamaged) < 10
    assert np.all(undamaged["counts"] == right)
    session.sensors["adis16465"].fault = None
    assert len(samples(session.run(0.3), 2)) > 40


SPI = """
#define CR1 REG(0x40013000)
static void spi(uint32_t divider_code)
{
    setup();
    REG(0x48000420) |= 5u << 12 | 5u << 16 | 5u << 20;
    REG(0x48000400) = (REG(0x48000400) & ~(0x3Fu << 6 | 3u)) | 0x2Au << 6 | 1u;
    REG(0x48000418) = 1u;
    CR1 = 0x347 | divider_code << 3;
    REG(0x48000418) = 1u << 16; /* PB0 low */
}
"""


@pytest.mark.parametrize(
    ("body", "what"),
    [
        ("spi(3); REG16(0x4001300C) = 0xF5;", "5 MHz to the MPU-9250"),  # WHO_AM_I
        ("spi(6); REG16(0x4001300C) = 0xF5; CR1 = 0x347 | 3 << 3;", "busy"),
        ("spi(6); CR1 = 0x347 | 3 << 3; REG16(0x4001300C) = 0xF5;", "5 MHz to the MPU-9250"),
        (
            "spi(6); REG(0x48000018) = 1u << 27; REG(0x48000000) = (REG(0x48000000) & ~(3u << 22)) | 1u << 22;"
            "REG16(0x4001300C) = 0xF5;",
            "two chip selects",
        ),
    ],
)
def test_the_bus_is_watched(body: str, what: str, tmp_path: Path) -> None:
    def still(_time_s: float) -> tuple[float, ...]:
        return (0.0, 0.0, 0.0)

    gyros = [part(still, GyroTruth(), temperature_c=25.0, seed=1) for part in (Mpu9250, PARTS["lsm9ds1"])]
    board = tiny_firmware.board(f"{SPI} int main(void) {{ {body} for (;;); }}", tmp_path, gyros)
    with pytest.raises(BoardError, match=what):
        board.advance(0.001)
