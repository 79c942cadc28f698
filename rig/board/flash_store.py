"""Storing of calibrations in the board's flash, each confirmed by reading it back."""

from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import Literal, Protocol

import numpy as np

from firmware_host.client import Board, Calibration, StoredCalibration, StoredPolynomials
from firmware_host.errors import BoardError
from rig.board.identify import find_sensor, require_board_section
from rig.config.models import RigConfig
from rig.data.entries.temperature import OverTemperatureEntry
from rig.errors import Refused
from rig.estimation.arrays import Array


class SensorSolution(Protocol):
    """A sensor's solution, from the analysis or from `result.json`: the rate is g = M (m + b) for the reading m."""

    @property
    def serial_number(self) -> str: ...
    @property
    def temperature_c(self) -> float | None: ...
    @property
    def scale(self) -> Array | Sequence[float]: ...
    @property
    def correction(self) -> Literal["matrix", "diagonal"]: ...
    @property
    def correction_matrix(self) -> Array | Sequence[Sequence[float]]: ...
    @property
    def bias_rad_s(self) -> Array | Sequence[float]: ...


def store_calibrations(
    config: RigConfig, results: Mapping[str, SensorSolution]
) -> Iterator[tuple[str, StoredCalibration]]:
    """Store the solution of every sensor to calibrate on the board; yield each sensor's name and record.

    Raise BoardError if the board refuses, or `not_stored` if another record is read back; Refused as `find_sensor`.
    """
    if not config.on_board:
        return
    section = require_board_section(config)
    with Board(section.port, section.baud, lambda batch: None) as board:
        for name, sensor in config.on_board.items():
            if name not in config.to_calibrate:
                continue
            index = find_sensor(board.identity, name, sensor).index
            board.configure(index, sensor.rate_hz, sensor.range_deg_s)  # a record is valid for one range
            yield name, store(board, index, calibration_of(results[name]))


def calibration_of(solved: SensorSolution, entry: OverTemperatureEntry | None = None) -> Calibration:
    """Return a sensor's solution as a record for the board, with the present time.

    If `entry` is a calibration over temperature, the record has its polynomials. Raise Refused `not_in_result` if the
    temperature during the calibration is not known.
    """
    if solved.temperature_c is None:
        raise Refused(
            "not_in_result",
            f"the temperature of {solved.serial_number} during its calibration is not known",
            "Calibrate it again with its temperature recorded",
        )
    matrix = np.array(solved.correction_matrix)
    x, y, z = ((float(row[0]), float(row[1]), float(row[2])) for row in matrix)
    bx, by, bz = map(float, solved.bias_rad_s)
    return Calibration(
        model="matrix_times_m_plus_b" if solved.correction == "matrix" else "k_times_m_plus_b",
        serial_number=solved.serial_number,
        written_utc=datetime.now(UTC),
        temperature_c=solved.temperature_c if entry is None else entry.reference_c,
        matrix=(x, y, z),
        bias_rad_s=(bx, by, bz),
        polynomials=None if entry is None else _make_polynomials(entry),
    )


def _make_polynomials(entry: OverTemperatureEntry) -> StoredPolynomials:
    coefficients = np.array(entry.scale[1:]) / np.array(entry.scale[0])
    one, two, three = ((x, y, z) for x, y, z in coefficients.tolist())
    first, second, third = entry.bias[1:]
    return StoredPolynomials(entry.range_c, (one, two, three), (first, second, third))


def store(board: Board, index: int, calibration: Calibration) -> StoredCalibration:
    """Write a calibration of a configured sensor and read it back. Raise BoardError, for example `not_stored`."""
    board.write_calibration(index, calibration)
    stored = board.read_calibration(index)
    if stored is None or stored.calibration != calibration.quantize():
        raise BoardError(
            "not_stored",
            f"the board reads back another calibration for sensor {index} than the one that was written",
            "Write it again; if that does not help, replace the microcontroller board",
        )
    return stored
