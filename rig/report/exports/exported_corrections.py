"""A run's calibrations for exports: corrections of all kinds, and gyroscopes paired with accelerometers as IMUs."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.quantity import ACCELERATION, RATE
from rig.data.result_file import ResultDocument
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.estimation.arrays import Array
from rig.report.findings.linear_corrections import SensorCorrection
from rig.report.kinds.kind_registry import outlets, terms_of

NOT_ALIGNED = "The rotation between gyroscope and accelerometer is not known: this file assumes parallel axes"


@dataclass(frozen=True, slots=True)
class Imu:
    """A gyroscope with the accelerometer of the same sensor, if one was calibrated.

    The true values of both are in the gyroscope's frame; otherwise `remarks` has the sentence NOT_ALIGNED.
    """

    gyroscope: SensorCorrection
    accelerometer: SensorCorrection | None
    remarks: tuple[str, ...] = ()

    @staticmethod
    def pair(gyroscope: SensorCorrection, accelerometer: SensorCorrection | None) -> "Imu":
        """Return the IMU, with the accelerometer's true values turned into the gyroscope's frame if possible."""
        if accelerometer is None or accelerometer.in_gyroscope_frame:
            return Imu(gyroscope, accelerometer)
        if accelerometer.mounting is None or gyroscope.mounting is None:
            return Imu(gyroscope, accelerometer, (NOT_ALIGNED,))
        matrix = accelerometer.matrix @ accelerometer.mounting @ gyroscope.mounting.T
        return Imu(gyroscope, replace(accelerometer, matrix=matrix, mounting=gyroscope.mounting))

    @property
    def name(self) -> str:
        """The name of the sensor that contains gyroscope and accelerometer."""
        return self.gyroscope.sensor

    @property
    def g_sensitivity(self) -> Array:
        """The gyroscope's g-sensitivity (3, 3), rad/s per m/s², zero if unknown."""
        matrix = self.gyroscope.g_sensitivity
        return np.zeros((3, 3)) if matrix is None else matrix


@dataclass(frozen=True)
class ExportedCalibrations:
    """The `sensors` that a run calibrated, kind by kind, and polynomials of temperature by sensor and quantity."""

    result: ResultDocument
    sensors: tuple[SensorCorrection, ...]
    over_temperature: Mapping[str, Mapping[str, OverTemperatureEntry]]

    @cached_property
    def imus(self) -> tuple[Imu, ...]:
        """All gyroscopes, with their accelerometers. Raise Refused `nothing_to_export` if there are none."""
        accelerometers = {triad.sensor: triad for triad in self.sensors if triad.quantity == ACCELERATION}
        gyroscopes = [triad for triad in self.sensors if triad.quantity == RATE]
        if not gyroscopes:
            raise Refused("nothing_to_export", "the run calibrated no gyroscope", "Give a run that calibrates one")
        return tuple(Imu.pair(gyroscope, accelerometers.get(gyroscope.sensor)) for gyroscope in gyroscopes)

    @property
    def not_in_imus(self) -> tuple[str, ...]:
        """The names of results that an IMU's file cannot hold: those of other sensors, and `further_terms`."""
        parts = {triad.name for imu in self.imus for triad in (imu.gyroscope, imu.accelerometer) if triad is not None}
        return (*(triad.name for triad in self.sensors if triad.name not in parts), *self.further_terms)

    @property
    def further_terms(self) -> tuple[str, ...]:
        """The names of results other than scale and bias, for which no format has a place."""
        terms = (term for term in terms_of(self.result, "exports") if not term.finding.is_reference)
        return tuple(printable(f"{term.whose}, {term.name}") for term in terms)

    def origin(self, sensor: SensorCorrection) -> Iterator[str]:
        """Yield lines that name the sensor, the time and temperature of its calibration, and the program."""
        provenance = self.result.provenance
        temperature = "" if sensor.temperature_c is None else f" at {sensor.temperature_c:.1f} degC,"
        yield printable(f"{sensor.sensor}: {sensor.part} {sensor.serial_number},{temperature} {provenance.started_utc}")
        yield printable(
            f"by calibration-rig {provenance.rig_version}, configuration {provenance.configuration_sha256[:16]}"
        )


def calibrations(result: ResultDocument) -> ExportedCalibrations:
    """Return the corrections that follow from a result, for all kinds of sensors except references."""
    corrections = (correct(finding) for _, correct, finding in outlets(result, lambda kind: kind.corrected))
    sensors = tuple(correction for correction in corrections if correction is not None)
    return ExportedCalibrations(result, sensors, result.over_temperature)
