"""The sensors that have a port of their own: by part, what makes a configured one a source of samples."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

from rig.config.sensor_sections import SensorSection
from rig.data.recorded_sensor import RecordedSensor
from rig.sensors.errors import SensorError
from rig.sensors.kvh1775 import source as kvh1775
from rig.sensors.lines import source as lines
from rig.sensors.source import OnSamples, SampleSource


class Instrument(SampleSource, Protocol):
    """A sensor that is a source by itself."""

    @property
    def corrected(self) -> Mapping[str, str]:
        """Settings in its memory that were not as the run needs them: name → what was there."""
        ...


@dataclass(frozen=True, slots=True)
class Kind:
    """What can be done with a sensor of a part, by its name and its section; errors are SensorErrors.

    `connect` sets it up, for who takes its samples, which `describe` describes; `look` only looks: yields what is there
    and what is wrong.
    """

    connect: Callable[[str, SensorSection, OnSamples], AbstractContextManager[Instrument]]
    describe: Callable[[str, SensorSection], RecordedSensor]
    look: Callable[[str, SensorSection], Iterator[str | SensorError]]


OWN_PORT: Mapping[str, Kind] = MappingProxyType(
    {
        "kvh1775": Kind(kvh1775.kvh1775, kvh1775.describe, kvh1775.look),
        "lines": Kind(lines.lines, lines.describe, lines.look),
    }
)
