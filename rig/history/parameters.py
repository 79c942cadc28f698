"""What of a result is followed over the years: parameters with their uncertainties, by sensor. Pure.

Names: kx ky kz scale factors, k their mean, bx by bz biases; nonorth_yz nonorth_zx nonorth_xy the angles between axes
less 90°; gxx … gzz what an acceleration adds to a rate (first letter the gyroscope's axis). The mean is one of its own
because the only standard of size of a gyroscope, the clock, moves all three alike.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.quantity import QUANTITIES
from rig.data.result_file import ResultDocument, SensorEntry, VectorEntry
from rig.data.result_types import ErrorEntry, Freedom
from rig.estimation.arrays import Array
from rig.estimation.coverage import COVERAGE_FACTOR
from rig.report.expanded import expanded, flat

CHECKED_AS = {  # the checks whose limits hold for scale and bias
    "rate": ("scale_deviation", "bias"),
    "acceleration": ("acceleration_scale_deviation", "acceleration_bias"),
    "field": ("", ""),
}
ANGLES = ("nonorth_yz", "nonorth_zx", "nonorth_xy")
ORDER = ("k", "kx", "ky", "kz", "bx", "by", "bz", *ANGLES, *(f"g{row}{column}" for row in "xyz" for column in "xyz"))


@dataclass(frozen=True, slots=True)
class Parameter:
    """One number of a calibration. `std_combined` is None where no more than noise is known of its uncertainty.

    `max_deviation` from the nominal value is what the run's limits allowed, None without one. `coverage_factor` is that
    of U by its degrees of freedom, None where it is 2.
    """

    name: str
    value: float
    std_statistical: float
    std_combined: float | None
    unit: str
    max_deviation: float | None = None
    coverage_factor: float | None = None

    @property
    def std(self) -> float:
        """The larger account of it that there is."""
        return self.std_statistical if self.std_combined is None else self.std_combined

    @property
    def expanded(self) -> float:
        """U as the result states it."""
        return (self.coverage_factor or COVERAGE_FACTOR) * self.std

    @property
    def nominal(self) -> float:
        """What an ideal sensor has."""
        return nominal(self.name)


@dataclass(frozen=True, slots=True)
class Calibrated:
    """One sensor's calibration in a run; `full_scale` in the unit of its biases."""

    sensor: str
    quantity: str
    part: str
    serial_number: str
    full_scale: float
    estimator: str
    temperature_c: float | None
    parameters: tuple[Parameter, ...]


def nominal(name: str) -> float:
    """1 for scale factors, else 0."""
    return float(is_scale(name))


def is_scale(name: str) -> bool:
    """Whether a parameter of this name is a scale factor, whose changes are fractions."""
    return name in ("k", "kx", "ky", "kz")


def calibrated(document: ResultDocument) -> tuple[Calibrated, ...]:
    """All that a result says of sensors, references too."""
    found = [_gyroscope(name, entry, document) for name, entry in document.sensors.items()]
    found += [_accelerometer(name, entry, document) for name, entry in document.accelerometers.items()]
    for name, entry in document.magnetometers.items():
        if not isinstance(entry, ErrorEntry):
            found.append(_magnetometer(name, entry))
    return tuple(found)


def _gyroscope(name: str, entry: SensorEntry, document: ResultDocument) -> Calibrated:
    values = (*entry.scale, *entry.bias_rad_s)
    limits = _limits(name, "rate", document)
    parameters = list(_scale_and_bias(values, entry, "rate", limits))
    if isinstance(entry.vector_model, VectorEntry):
        vector = entry.vector_model
        stds = vector.non_orthogonality_std_rad
        parameters += _angles(vector.non_orthogonality_rad, stds, vector.non_orthogonality_freedom)
        if vector.g_sensitivity_rad_s_per_m_s2 is not None and vector.g_sensitivity_std_rad_s_per_m_s2 is not None:
            names = [f"g{row}{column}" for row in "xyz" for column in "xyz"]
            felt = np.ravel(vector.g_sensitivity_rad_s_per_m_s2)
            known = np.ravel(vector.g_sensitivity_std_rad_s_per_m_s2)
            factors = _factors(9, flat(vector.g_sensitivity_freedom))
            for name_of, value, std, factor in zip(names, felt.tolist(), known.tolist(), factors, strict=True):
                parameters.append(Parameter(name_of, value, std, None, "rad/s per m/s²", coverage_factor=factor))
    return Calibrated(
        name,
        "rate",
        entry.part,
        entry.serial_number,
        entry.range_rad_s,
        entry.estimator,
        entry.temperature_c,
        tuple(_known(parameters)),
    )


def _accelerometer(name: str, entry: AccelerometerEntry, document: ResultDocument) -> Calibrated:
    values = (*entry.scale, *entry.bias_m_s2)
    limits = _limits(name, "acceleration", document)
    parameters = [
        *_scale_and_bias(values, entry, "acceleration", limits),
        *_angles(entry.non_orthogonality_rad, entry.non_orthogonality_std_rad, entry.non_orthogonality_freedom),
    ]
    return Calibrated(
        name,
        "acceleration",
        entry.part,
        entry.serial_number,
        entry.range_m_s2,
        entry.estimator,
        entry.temperature_c,
        tuple(_known(parameters)),
    )


def _magnetometer(name: str, entry: MagnetometerEntry) -> Calibrated:
    values = (*entry.scale, *entry.bias_t)
    parameters = [
        *_scale_and_bias(values, entry, "field", (None, None)),
        *_angles(entry.non_orthogonality_rad, entry.non_orthogonality_std_rad, entry.non_orthogonality_freedom),
    ]
    return Calibrated(
        name,
        "field",
        entry.part,
        entry.serial_number,
        entry.range_t,
        entry.estimator,
        None,
        tuple(_known(parameters)),
    )


def _scale_and_bias(
    values: Sequence[float],
    entry: SensorEntry | AccelerometerEntry | MagnetometerEntry,
    quantity: str,
    limits: tuple[float | None, float | None],
) -> Iterator[Parameter]:
    """Of the six parameters, and the mean scale factor by their covariance, with the largest k of theirs."""
    mean = np.array([1 / 3, 1 / 3, 1 / 3, 0, 0, 0])
    combined = entry.covariance_combined
    factors = np.full(6, COVERAGE_FACTOR) if entry.budget is None else np.array(entry.budget.factors)
    rows: list[tuple[str, Array, str, float | None]] = [("k", mean, "1", None)]
    rows += [(f"k{axis}", np.eye(6)[i], "1", limits[0]) for i, axis in enumerate("xyz")]
    rows += [(f"b{axis}", np.eye(6)[3 + i], QUANTITIES[quantity].unit, limits[1]) for i, axis in enumerate("xyz")]
    for name, row, unit, limit in rows:
        yield Parameter(
            name,
            float(row @ np.array(values)),
            _std(row, entry.covariance),
            None if combined is None else _std(row, combined),
            unit,
            limit,
            None if (factor := float(factors[row > 0].max())) == COVERAGE_FACTOR else factor,
        )


def _std(row: Array, covariance: Sequence[Sequence[float]]) -> float:
    return float(np.sqrt(row @ np.array(covariance) @ row))


def _angles(angles: Sequence[float], stds: Sequence[float], freedom: Sequence[Freedom] | None) -> list[Parameter]:
    each = zip(ANGLES, angles, stds, _factors(3, freedom), strict=True)
    return [Parameter(name, value, std, None, "rad", coverage_factor=factor) for name, value, std, factor in each]


def _factors(count: int, freedom: Sequence[Freedom] | None) -> list[float | None]:
    """k of each; None where it is 2."""
    return [None if each == COVERAGE_FACTOR else each for each in expanded([1.0] * count, freedom).factors]


def _known(parameters: Sequence[Parameter]) -> Iterator[Parameter]:
    """Those with an uncertainty: of another, nothing can be said over time."""
    return (each for each in parameters if each.std_statistical > 0)


def _limits(sensor: str, quantity: str, document: ResultDocument) -> tuple[float | None, float | None]:
    limits = {check.name: check.limit for check in document.checks}
    scale, bias = CHECKED_AS[quantity]
    return limits.get(f"{sensor}.{scale}"), limits.get(f"{sensor}.{bias}")
