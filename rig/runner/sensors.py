"""Sets the configured sensors up on the board, and describes them for the recording."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from firmware_host.client import Board, Calibration, StoredCalibration
from firmware_host.protocol import CALIBRATED_RAD_S, FULL_SCALE_COUNTS
from rig.board.identify import find_sensor, stored_calibration
from rig.config.models import MagnetometerSection, RigConfig, SensorSection, mounting_matrix
from rig.data.run_file import RecordedMagnetometer, RecordedSensor


@dataclass(frozen=True, slots=True)
class BoardSensor:
    """A sensor that is set up: its index on the board, and what a reader of its samples must know.

    `stored` is the calibration its readings are corrected by, None where they come raw.
    """

    index: int
    described: RecordedSensor
    stored: StoredCalibration | None = None


def set_up_sensors(board: Board, config: RigConfig, *, calibrated: bool) -> Mapping[str, BoardSensor]:
    """Every configured sensor by its name; those to calibrate stream corrected readings when `calibrated`.

    Raises Refused as `find_sensor` and `stored_calibration`.
    """
    return {
        name: _corrected(board, name, section)
        if calibrated and name in config.to_calibrate
        else _raw(board, name, section)
        for name, section in config.sensors.items()
    }


@dataclass(frozen=True, slots=True)
class BoardMagnetometer:
    """A magnetometer that is set up, as a `BoardSensor` is."""

    index: int
    described: RecordedMagnetometer


def set_up_magnetometers(board: Board, config: RigConfig) -> Mapping[str, BoardMagnetometer]:
    """Every configured magnetometer by its name. Raises Refused as `find_sensor`."""
    return {name: _magnetometer(board, name, section) for name, section in config.magnetometers.items()}


def _magnetometer(board: Board, name: str, section: MagnetometerSection) -> BoardMagnetometer:
    info = find_sensor(board.identity, name, section)
    setup = board.configure_magnetometer(info.index, section.rate_hz, section.range_gauss)
    described = RecordedMagnetometer(
        part=section.part,
        serial_number=section.serial_number,
        rate_hz=setup.rate_hz,
        range_t=setup.range_t,
        sensitivity_t_per_count=setup.sensitivity_t,
        full_scale_counts=FULL_SCALE_COUNTS,
        mounting=tuple(tuple(row) for row in mounting_matrix(section.mounting).tolist()),
    )
    return BoardMagnetometer(info.index, described)


def _raw(board: Board, name: str, section: SensorSection) -> BoardSensor:
    info = find_sensor(board.identity, name, section)
    range_g = 0.0 if section.acceleration is None else section.acceleration.range_g or 0.0
    setup = board.configure(info.index, section.rate_hz, section.range_deg_s, range_g)
    described = RecordedSensor(
        part=section.part,
        serial_number=section.serial_number,
        rate_hz=setup.rate_hz,
        range_rad_s=radians(setup.range_deg_s),
        sensitivity_rad_s_per_count=setup.sensitivity_rad_s,
        full_scale_counts=FULL_SCALE_COUNTS,
        temperature_c_per_count=setup.temperature_scale_c,
        temperature_offset_c=setup.temperature_offset_c,
        mounting=tuple(tuple(row) for row in mounting_matrix(section.mounting).tolist()),
        range_m_s2=setup.range_m_s2 or None,
        sensitivity_m_s2_per_count=setup.sensitivity_m_s2 or None,
    )
    return BoardSensor(info.index, described)


def _corrected(board: Board, name: str, section: SensorSection) -> BoardSensor:
    raw = _raw(board, name, section)
    stored = stored_calibration(board, name, section)
    return BoardSensor(raw.index, corrected(raw.described, stored.calibration), stored)


def corrected(sensor: RecordedSensor, calibration: Calibration) -> RecordedSensor:
    """The same sensor when the board corrects its rates, which it sends without accelerations: in microradians/s."""
    limit_rad_s = sensor.full_scale_counts * sensor.sensitivity_rad_s_per_count
    bias_rad_s = np.abs(calibration.bias_rad_s)
    # What a saturated reading becomes, at least: the other axes may read anything beside it.
    on_axis, beside = np.diag(np.diag(calibration.matrix)), np.abs(calibration.matrix)
    np.fill_diagonal(beside, 0.0)
    lowest_rad_s = float(np.min(on_axis @ (limit_rad_s - bias_rad_s) - beside @ (limit_rad_s + bias_rad_s)))
    return replace(
        sensor,
        sensitivity_rad_s_per_count=CALIBRATED_RAD_S,
        full_scale_counts=int(lowest_rad_s / CALIBRATED_RAD_S),
        mode="calibrated",
        range_m_s2=None,
        sensitivity_m_s2_per_count=None,
    )
