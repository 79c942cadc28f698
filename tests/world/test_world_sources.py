"""What the world lets a source do that devices do: each key of it, and what the rig's own readers make of the bytes."""

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from rig.analysis.consistency.converter_tests import judge_readings
from rig.config.load import load
from rig.config.models import RigConfig
from rig.observation.consistency.raw_readings import RawReadings
from rig.sensors.lines.decoding import LineReader
from rig.sensors.lines.stamping import Stamper
from rig.sensors.lines.time_steps import find_time_step_s
from rig.sensors.mavlink.dialect import dialect
from rig.sensors.mavlink.imu_readings import ImuReading, decode_reading
from rig.world.board.serial_line import SerialLine
from rig.world.laboratory import Laboratory
from rig.world.world_section import read_world_section
from support.paths import CONFIGS

pytestmark = pytest.mark.slow

LINES, AUTOPILOT = CONFIGS / "own_port" / "lines.yaml", CONFIGS / "own_port" / "autopilot.yaml"
WORLD, FAULTY = "world.sensors.imu.lines.", "faulty."
BLOCK_S, RATE_HZ = 0.05, 200.0
FIRST = 100  # lines that are looked at before a stream begins
SET_INTERVAL, SECONDS_TIME = 511, ("sensors.imu.lines.time={unit: s, wrap: 0}",)


def sent(path: Path, duration_s: float, overrides: Sequence[str], orders: bytes = b"") -> tuple[RigConfig, list[bytes]]:
    """Return the configuration, and the bytes of its one instrument at rest, in blocks as its line carries them."""
    loaded = load(path, list(overrides))
    ((_, mount),) = Laboratory(loaded.config, read_world_section(loaded)).instruments.items()
    instrument = mount.instrument
    assert instrument is not None
    line = SerialLine(lambda: instrument, seed=1)
    line.stolen = mount.stolen
    instrument.receive(orders)
    blocks = []
    for block in range(round(duration_s / BLOCK_S)):
        instrument.advance((block + 1) * BLOCK_S)
        line.tick()
        blocks.append(line.fresh)
    return loaded.config, blocks


class Heard:
    """What the rig's reader of lines makes of a stream: values (n, columns), numbers (n,), times (n,) s, and losses."""

    def __init__(self, overrides: Sequence[str], duration_s: float = 2.0) -> None:
        config, blocks = sent(LINES, duration_s, overrides)
        section = config.sensors["imu"].lines
        assert section is not None and section.time is not None
        reader = LineReader(section)
        batches = [reader.feed(block) for block in blocks]
        time_column = section.columns.index("time")
        first = np.concatenate([batch.values for batch in batches])[:FIRST, time_column]
        step_s = find_time_step_s(first, reader.time_decimals, section.time.unit)
        stamper = Stamper(section, RATE_HZ, "it", step_s)
        values = []
        numbers = []
        times_us = []
        for block, batch in enumerate(batches):
            taken, number, time_us = stamper.stamp(batch.values, len(batch.samples_before), block * BLOCK_S)
            values.append(batch.values[taken])
            numbers.append(number)
            times_us.append(time_us)
        self.values, self.numbers, self.times_s = (
            np.concatenate(values), np.concatenate(numbers), 1e-6 * np.concatenate(times_us)
        )  # fmt: skip
        self.rates = self.values[:, [section.columns.index(axis) for axis in ("gx", "gy", "gz")]]
        self.lost = stamper.lost

    @property
    def counts(self) -> np.ndarray:
        """The rates in steps of their last digit."""
        return np.asarray(np.rint(1e3 * self.rates), dtype=np.int64)


@cache
def plain() -> Heard:
    """The same device that prints as the configuration says."""
    return Heard(())


@pytest.mark.parametrize(
    "overrides",
    [
        (f"{WORLD}trailing_separator=true",),
        (f"{WORLD}colours=true", "sensors.imu.lines.prefix='I (*) imu: '"),
        (
            "sensors.imu.lines.columns=[-, -, time, gx, gy, gz, ax, ay, az, temperature]",
            f"{WORLD}texts=['2026-11-28', '12:04:05.123']",
        ),
        (*SECONDS_TIME, f"{WORLD}time_decimals=2"),
        (*SECONDS_TIME, f"{WORLD}time_in_single=true", f"{WORLD}uptime_s=20000"),
    ],
    ids=["trailing separator", "colours", "date and clock", "hundredths of a second", "float32 seconds"],
)
def test_lines_as_devices_print_them_are_read_whole_and_in_time(overrides: tuple[str, ...]) -> None:
    heard = Heard(overrides)
    assert np.array_equal(heard.rates, plain().rates) and heard.lost == 0
    assert np.array_equal(heard.numbers, np.arange(len(plain().numbers)))
    settled = heard.times_s[len(heard.times_s) // 2 :]
    assert np.abs(np.diff(settled) - 1 / RATE_HZ).max() < 0.2 / RATE_HZ


def test_what_another_reader_of_the_port_takes_is_lost_and_nothing_is_made_up() -> None:
    heard = Heard((f"{WORLD}stolen=0.2",))
    assert heard.lost > 0 and len(heard.rates) < len(plain().rates)
    assert {tuple(row) for row in heard.rates} <= {tuple(row) for row in plain().rates}
    assert (np.diff(heard.numbers) > 0).all() and (np.diff(heard.times_s) > 0).all()


def judged(counts: np.ndarray) -> dict[str, bool]:
    """Whether each check of readings at rest fails."""
    window = RawReadings(-1, counts, counts - counts.mean(axis=0), np.zeros(3))
    sound = RawReadings(-1, plain().counts, plain().counts - plain().counts.mean(axis=0), np.zeros(3))
    statistics = judge_readings([counts], [sound, sound, window], 1e-3)
    return {name: statistic > limit for name, (statistic, limit) in statistics.items()}


def test_a_frozen_axis_and_repeated_readings_are_detected_by_their_names() -> None:
    sensor = f"{WORLD.removesuffix('lines.')}{FAULTY}"
    sound = judged(plain().counts)
    assert not sound["stuck_axis"] and not sound["repeated_readings"]
    frozen = Heard((f"{sensor}frozen_axis=y", f"{sensor}frozen_from_s=1")).counts
    assert np.ptp(frozen[-150:, 1]) == 0 and np.ptp(frozen[-150:, 0]) > 0
    assert judged(frozen)["stuck_axis"]
    repeated = Heard((f"{sensor}repeated=0.1", f"{sensor}repeated_length=20"), duration_s=4.0).counts
    assert judged(repeated)["repeated_readings"] and not judged(repeated)["stuck_axis"]


def readings(message: int, *overrides: str) -> tuple[set[int], list[ImuReading]]:
    """Return the first bytes of an autopilot's messages, and the rig's readings of those that were asked for."""
    mavlink = dialect()
    asks = mavlink.MAVLink(None, srcSystem=255)
    order = mavlink.MAVLink_command_long_message(1, 1, SET_INTERVAL, 0, message, 1e4, 0, 0, 0, 0, 0).pack(asks)
    _, blocks = sent(AUTOPILOT, 0.5, [f"world.sensors.imu1.{override}" for override in overrides], order)
    messages = mavlink.MAVLink(None).parse_buffer(b"".join(blocks)) or []
    heard = [decode_reading(sample) for sample in messages if sample.get_msgId() == message]
    return {sample.get_msgbuf()[0] for sample in messages}, heard


SCALED_IMU, RAW_IMU, HIGHRES_IMU = 26, 27, 105


@pytest.mark.parametrize(
    ("message", "override", "begins_with"),
    [
        (SCALED_IMU, "autopilot.provides_temperature=false", 0xFD),
        (HIGHRES_IMU, "autopilot.provides_temperature=false", 0xFD),
        (SCALED_IMU, "autopilot.mavlink_version=1", 0xFE),
        (RAW_IMU, "autopilot.mavlink_version=1", 0xFE),
    ],
)
def test_an_autopilot_without_a_temperature_has_none_and_all_else(
    message: int, override: str, begins_with: int
) -> None:
    starts, heard = readings(message, override)
    starts_usually, usual = readings(message)
    assert (starts, starts_usually) == ({begins_with}, {0xFD})
    assert all(math.isnan(reading.temperature_c) and {"rate", "force"} <= reading.provided for reading in heard)
    assert all(reading.temperature_c > 20 for reading in usual) and len(heard) == len(usual) > 40
    assert all(np.array_equal(one.rate_rad_s, other.rate_rad_s) for one, other in zip(heard, usual, strict=True))


def rates_of(override: str) -> np.ndarray:
    """Return the rates (n, 3) of an autopilot's messages, once its filter has settled."""
    rates = np.array([reading.rate_rad_s for reading in readings(HIGHRES_IMU, f"{FAULTY}{override}")[1]])
    return rates[len(rates) // 2 :]


def test_an_autopilots_frozen_axis_and_repeated_readings_come_with_its_messages() -> None:
    frozen = rates_of("frozen_axis=x")
    assert np.ptp(frozen[:, 0]) == 0 and np.ptp(frozen[:, 1]) > 0
    repeated, usual = (rates_of(f"repeated={share}") for share in (0.5, 0.0))
    assert len(np.unique(usual, axis=0)) == len(usual)
    assert len(np.unique(repeated, axis=0)) < 0.9 * len(repeated)
