"""A run's calibrations as exports take them: the corrections of every kind, and IMUs of those that belong together."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.quantity import ACCELERATION, RATE
from rig.data.result_file import ResultDocument
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.estimation.arrays import Array
from rig.report.findings.corrected import Corrected
from rig.report.kinds.registry import outlets, terms_of


@dataclass(frozen=True, slots=True)
class Imu:
    """A gyroscope with the accelerometer beside it, if one was calibrated."""

    gyroscope: Corrected
    accelerometer: Corrected | None

    @property
    def name(self) -> str:
        """The sensor that both are part of."""
        return self.gyroscope.sensor

    @property
    def g_sensitivity(self) -> Array:
        """(3, 3) what the gyroscope reads of a specific force, rad/s per m/s²; zero where that was not found."""
        found = self.gyroscope.g_sensitivity
        return np.zeros((3, 3)) if found is None else found


@dataclass(frozen=True)
class Calibrations:
    """The `sensors` that a run calibrated, kind by kind, and the polynomials of those that have any, by sensor."""

    result: ResultDocument
    sensors: tuple[Corrected, ...]
    over_temperature: Mapping[str, Mapping[str, OverTemperatureEntry]]

    @cached_property
    def imus(self) -> tuple[Imu, ...]:
        """Every gyroscope, with the accelerometer beside it. Raises Refused `nothing_to_export`."""
        beside = {each.sensor: each for each in self.sensors if each.quantity == ACCELERATION}
        found = tuple(Imu(each, beside.get(each.sensor)) for each in self.sensors if each.quantity == RATE)
        if not found:
            raise Refused("nothing_to_export", "the run calibrated no gyroscope", "Give a run that calibrates one")
        return found

    @property
    def elsewhere(self) -> tuple[str, ...]:
        """What no file of an IMU has a place for: sensors that belong to none, and what is `beside`."""
        held = [each for imu in self.imus for each in (imu.gyroscope, imu.accelerometer)]
        return (*(each.name for each in self.sensors if each not in held), *self.beside)

    @property
    def beside(self) -> tuple[str, ...]:
        """What was found beside scale and bias, and no format knows."""
        found = (term for term in terms_of(self.result, "exports") if not term.finding.known)
        return tuple(printable(f"{term.whose}, {term.name}") for term in found)

    def origin(self, sensor: Corrected) -> Iterator[str]:
        """Whose calibration it is, when and how warm it was found, and by what."""
        made = self.result.provenance
        warm = "" if sensor.temperature_c is None else f" at {sensor.temperature_c:.1f} degC,"
        yield printable(f"{sensor.sensor}: {sensor.part} {sensor.serial_number},{warm} {made.started_utc}")
        yield printable(f"by calibration-rig {made.rig_version}, configuration {made.configuration_sha256[:16]}")


def calibrations(result: ResultDocument) -> Calibrations:
    """What every kind of result says to other programs; nothing of references, which are known already."""
    found = (correct(finding) for _, correct, finding in outlets(result, lambda kind: kind.corrected))
    return Calibrations(result, tuple(each for each in found if each is not None), result.over_temperature)
