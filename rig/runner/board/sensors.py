"""The board as a source of samples: sets up its configured sensors and describes them for the recording."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from firmware_host.client import Board, Calibration, SampleBatch, StoredCalibration
from firmware_host.protocol import CALIBRATED_RAD_S, FULL_SCALE_COUNTS
from rig.board.identify import find_sensor, read_stored_calibration, refuse_other_firmware, require_board_section
from rig.config.models import SensorsConfig
from rig.config.sensors.sensor_sections import MagnetometerSection, SensorSection
from rig.data.quantity import ACCELERATION, FIELD, RATE, TEMPERATURE
from rig.data.recording.channel import thermometer_channel, triad_channel
from rig.data.recording.recorded_sensor import RecordedSensor, build_sensor
from rig.sensors.sample_source import OnSamples


@dataclass(frozen=True, slots=True)
class BoardSensor:
    """A sensor that is set up: its index on the board and its description.

    `stored` is the calibration that corrects its readings, None if they are raw.
    """

    index: int
    described: RecordedSensor
    stored: StoredCalibration | None = None


@dataclass(frozen=True, slots=True)
class BoardSource:
    """The board with its sensors set up, by name; it passes samples on by these names."""

    board: Board
    set_up: Mapping[str, BoardSensor]

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The board's sensors by name (see `SampleSource`)."""
        return {name: sensor.described for name, sensor in self.set_up.items()}

    @property
    def stored(self) -> Mapping[str, StoredCalibration]:
        """The stored calibrations that correct the readings, by sensor name."""
        return {name: sensor.stored for name, sensor in self.set_up.items() if sensor.stored is not None}

    def start(self) -> None:
        """Start the board's samples, which stored calibrations correct (see `SampleSource`)."""
        self.board.start([self.set_up[name].index for name in self.stored])

    def check(self, clock_s: float | None = None) -> None:
        """Check the board (see `SampleSource`). Raise BoardError."""
        self.board.check(clock_s)

    def catch_up(self) -> None:
        """Wait for the samples that precede the board's answer to a request (see `SampleSource`). Raise BoardError."""
        self.board.status()


@contextmanager
def open_board_source(config: SensorsConfig, on_samples: OnSamples, *, calibrated: bool) -> Iterator[BoardSource]:
    """Yield the connected board with its sensors set up, as a source of samples, for the block.

    Raise BoardError as `Board`, Refused as `require_board_section`, `refuse_other_firmware` and `set_up_sensors`.
    """
    section = require_board_section(config)
    names: dict[int, str] = {}

    def pass_on(batch: SampleBatch) -> None:
        on_samples(names[batch.sensor], batch.samples)

    with Board(section.port, section.baud, pass_on) as board:
        refuse_other_firmware(board.identity)
        set_up = set_up_sensors(board, config, calibrated=calibrated)
        names.update({sensor.index: name for name, sensor in set_up.items()})
        yield BoardSource(board, set_up)


def set_up_sensors(board: Board, config: SensorsConfig, *, calibrated: bool) -> Mapping[str, BoardSensor]:
    """Set up all configured sensors on the board; those to calibrate stream corrected readings if `calibrated`.

    Return the sensors by name. Raise Refused as `find_sensor` and `read_stored_calibration` do.
    """
    gyroscopes = {
        name: _set_up_corrected(board, name, section)
        if calibrated and name in config.to_calibrate
        else _set_up_raw(board, name, section)
        for name, section in config.on_board.items()
    }
    return gyroscopes | {
        name: _set_up_magnetometer(board, name, section) for name, section in config.magnetometers.items()
    }


def _set_up_magnetometer(board: Board, name: str, section: MagnetometerSection) -> BoardSensor:
    info = find_sensor(board.identity, name, section)
    setup = board.configure_magnetometer(info.index, section.rate_hz, section.range_gauss)
    field = triad_channel(FIELD, setup.sensitivity_t, FULL_SCALE_COUNTS, setup.range_t)
    return BoardSensor(info.index, build_sensor(section, field, rate_hz=setup.rate_hz))


def _set_up_raw(board: Board, name: str, section: SensorSection) -> BoardSensor:
    """Set up one sensor on the board for raw readings, and return its description."""
    info = find_sensor(board.identity, name, section)
    range_g = 0.0 if section.acceleration is None else section.acceleration.range_g
    setup = board.configure(info.index, section.rate_hz, section.range_deg_s, range_g)
    channels = [
        triad_channel(RATE, setup.sensitivity_rad_s, FULL_SCALE_COUNTS, radians(setup.range_deg_s)),
        thermometer_channel(setup.temperature_scale_c, setup.temperature_offset_c),
    ]
    if setup.sensitivity_m_s2:
        channels.append(triad_channel(ACCELERATION, setup.sensitivity_m_s2, FULL_SCALE_COUNTS, setup.range_m_s2))
    return BoardSensor(info.index, build_sensor(section, *channels, rate_hz=setup.rate_hz))


def _set_up_corrected(board: Board, name: str, section: SensorSection) -> BoardSensor:
    raw = _set_up_raw(board, name, section)
    stored = read_stored_calibration(board, name, section)
    return BoardSensor(raw.index, describe_corrected(raw.described, stored.calibration, CALIBRATED_RAD_S), stored)


def describe_corrected(sensor: RecordedSensor, calibration: Calibration, sensitivity_rad_s: float) -> RecordedSensor:
    """Return the description of a sensor whose rates the board corrects, in counts of `sensitivity_rad_s`."""
    raw = sensor.channel(RATE)
    assert raw.full_scale_counts is not None, "every driver states it"
    limit_rad_s = raw.full_scale_counts * raw.unit_per_count
    bias_rad_s, fraction = np.abs(calibration.bias_rad_s), np.ones(3)
    if calibration.polynomials is not None:  # the range is that of the whole temperature range
        changed, moved_rad_s = calibration.polynomials.most()
        fraction, bias_rad_s = 1 - changed, bias_rad_s + moved_rad_s
    # The least corrected rate of a saturated reading, for any readings of the other axes.
    on_axis, off_axis = np.diag(np.diag(calibration.matrix)), np.abs(calibration.matrix)
    np.fill_diagonal(off_axis, 0.0)
    lowest_rad_s = float(
        np.min(
            on_axis @ (fraction * (limit_rad_s - bias_rad_s)) - off_axis @ ((2 - fraction) * (limit_rad_s + bias_rad_s))
        )
    )
    full_scale = int(lowest_rad_s / sensitivity_rad_s)
    rate = replace(raw, unit_per_count=sensitivity_rad_s, full_scale_counts=full_scale)
    return replace(sensor, mode="calibrated", channels=(rate, sensor.channel(TEMPERATURE)))
