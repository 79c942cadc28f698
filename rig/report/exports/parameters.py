"""A sensor's calibration as other programs want it: matrices for readings, offsets, noise densities. Pure.

In SI units and the right-angled frame nearest to the gyroscope's axes, whose rotation is the vector model's `mounting`:

    gyroscope      m = F ω + G a + c,    c = −b, a the specific force, which at rest points upwards
    accelerometer  m = F s + c

Without a solution of the vector model F = K⁻¹ and no g-sensitivity.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from rig.data.accelerometer_entries import AccelerometerEntry, DwellEntry
from rig.data.result_file import ObservationEntry, ResultDocument, SensorEntry, VectorEntry
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.estimation.arrays import Array


class Named(Protocol):
    """What is one of a maker's parts."""

    @property
    def part(self) -> str: ...
    @property
    def serial_number(self) -> str: ...


@dataclass(frozen=True, slots=True)
class Triad:
    """Reading (3,) = `matrix` (3, 3) · true + `offset` (3,); `density` of white noise, unit/√Hz.

    Rate and density are None where the result does not tell them.
    """

    matrix: Array
    offset: Array
    rate_hz: float | None
    density: float | None

    @property
    def scale(self) -> Array:
        """(3, 3) diagonal matrix of what one unit reads as."""
        return np.diag(np.linalg.norm(self.matrix, axis=1))

    @property
    def axes(self) -> Array:
        """(3, 3) unit vectors of the axes, in rows: matrix = scale · axes."""
        axes: Array = self.matrix / np.linalg.norm(self.matrix, axis=1)[:, None]
        return axes


@dataclass(frozen=True, slots=True)
class Exported:
    """What is exported of one sensor; `g_sensitivity` (3, 3) rad/s per m/s² is zero where it was not found."""

    name: str
    part: str
    serial_number: str
    temperature_c: float | None
    gyroscope: Triad
    g_sensitivity: Array
    found_g_sensitivity: bool
    accelerometer: Triad | None
    second_order: bool


def exported(result: ResultDocument) -> tuple[Exported, ...]:
    """Every calibrated gyroscope, with the accelerometer beside it. Raises Refused `nothing_to_export`."""
    found = tuple(
        _exported(name, sensor, result.accelerometers.get(name))
        for name, sensor in result.sensors.items()
        if sensor.role == "calibrate"
    )
    if not found:
        raise Refused("nothing_to_export", "the run calibrated no gyroscope", "Give a run that calibrates one")
    return found


def _exported(name: str, sensor: SensorEntry, beside: AccelerometerEntry | None) -> Exported:
    vector = sensor.vector_model if isinstance(sensor.vector_model, VectorEntry) else None
    matrix, sensitivity = np.diag(1 / np.array(sensor.scale)), None
    if vector is not None:
        to_sensor = np.array(vector.mounting)
        matrix = np.array(vector.matrix) @ to_sensor.T
        if vector.g_sensitivity_rad_s_per_m_s2 is not None:  # of gravity, which points down where force points up
            sensitivity = -np.array(vector.g_sensitivity_rad_s_per_m_s2) @ to_sensor.T
    rests = [(rest.noise_rad_s, rest.samples) for rest in sensor.rests]
    rate = _rate_hz(sensor.observations)
    return Exported(
        name=name,
        part=sensor.part,
        serial_number=sensor.serial_number,
        temperature_c=sensor.temperature_c,
        gyroscope=Triad(matrix, -np.array(sensor.bias_rad_s), rate, _density(rests, rate)),
        g_sensitivity=np.zeros((3, 3)) if sensitivity is None else sensitivity,
        found_g_sensitivity=sensitivity is not None,
        accelerometer=None if beside is None else _accelerometer(beside),
        second_order=beside is not None and beside.second_order_s2_m is not None,
    )


def _accelerometer(entry: AccelerometerEntry) -> Triad:
    rate = _rate_hz(entry.dwells)
    density = _density([(dwell.noise_m_s2, dwell.samples) for dwell in entry.dwells], rate)
    return Triad(np.linalg.inv(np.array(entry.correction_matrix)), np.array(entry.bias_m_s2), rate, density)


def _rate_hz(means: Sequence[ObservationEntry | DwellEntry]) -> float | None:
    """How often readings came, by what was averaged; None of attitudes that a file told."""
    lasted_s = sum(each.duration_s for each in means)
    return sum(each.samples for each in means) / lasted_s if lasted_s > 0 else None


def _density(noises: Sequence[tuple[Sequence[float], int]], rate_hz: float | None) -> float | None:
    """Noise density of the noisiest axis: σ of one sample over √rate, as if it were white up to half the rate."""
    if not noises or rate_hz is None:
        return None
    squares = np.average([np.square(noise) for noise, _ in noises], axis=0, weights=[count for _, count in noises])
    return float(np.sqrt(squares.max() / rate_hz))


def comments(result: ResultDocument, sensor: Exported) -> Iterator[str]:
    """Whose calibration it is and when it was found."""
    return origin(result, sensor.name, sensor, sensor.temperature_c)


def origin(result: ResultDocument, name: str, sensor: Named, temperature_c: float | None) -> Iterator[str]:
    """Whose calibration it is, when and how warm it was found, and by what."""
    made, warm = result.provenance, "" if temperature_c is None else f" at {temperature_c:.1f} degC,"
    yield printable(f"{name}: {sensor.part} {sensor.serial_number},{warm} {made.started_utc}")
    yield printable(f"by calibration-rig {made.rig_version}, configuration {made.configuration_sha256[:16]}")
