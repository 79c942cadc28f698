"""The sensors that have a port of their own: by part, what makes a configured one a source of samples."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

from rig.config.sensors.sensor_sections import SensorSection
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.sensors.errors import SensorError
from rig.sensors.kvh1775 import source as kvh1775
from rig.sensors.lines import source as lines
from rig.sensors.mavlink import source as mavlink
from rig.sensors.source import OnSamples, SampleSource

Sections = Mapping[str, SensorSection]


class Instrument(SampleSource, Protocol):
    """A sensor that is a source by itself."""

    @property
    def corrected(self) -> Mapping[str, str]:
        """Settings in its memory that were not as the run needs them: name → what was there."""
        ...


@dataclass(frozen=True, slots=True)
class Kind:
    """What can be done with the sensors of a part at one port, by their names and sections; errors are SensorErrors.

    `connect` sets them up, for who takes their samples, which `describe` describes of each; `look` only looks: yields
    what is there and what is wrong.
    """

    connect: Callable[[Sections, OnSamples], AbstractContextManager[Instrument]]
    describe: Callable[[str, SensorSection], RecordedSensor]
    look: Callable[[Sections], Iterator[str | SensorError]]


def _alone(
    connect: Callable[[str, SensorSection, OnSamples], AbstractContextManager[Instrument]],
    describe: Callable[[str, SensorSection], RecordedSensor],
    look: Callable[[str, SensorSection], Iterator[str | SensorError]],
) -> Kind:
    """The kind of a part that has its port for itself."""

    def only(sections: Sections) -> tuple[str, SensorSection]:
        (one,) = sections.items()
        return one

    return Kind(
        lambda sections, on_samples: connect(*only(sections), on_samples),
        describe,
        lambda sections: look(*only(sections)),
    )


OWN_PORT: Mapping[str, Kind] = MappingProxyType(
    {
        "kvh1775": _alone(kvh1775.kvh1775, kvh1775.describe, kvh1775.look),
        "lines": _alone(lines.lines, lines.describe, lines.look),
        "mavlink": Kind(mavlink.mavlink, mavlink.describe, mavlink.look),
    }
)


def by_port(sensors: Sections) -> Iterator[tuple[str, Kind, Sections]]:
    """Sensors with a port of their own, together by port: the port, what can be done with them, their sections."""
    at: dict[str, dict[str, SensorSection]] = {}
    for name, section in sensors.items():
        if section.own_port is not None:
            at.setdefault(section.own_port[1], {})[name] = section
    for port, sections in at.items():
        (first, *_) = sections.values()
        yield port, OWN_PORT[first.part], sections
