"""The sensors with a port of their own, by part."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from types import MappingProxyType
from typing import Protocol

from rig.config.sensors.sensor_sections import SensorSection
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.sensors.errors import SensorError
from rig.sensors.kvh1775 import kvh_source as kvh1775
from rig.sensors.lines import lines_source as lines
from rig.sensors.mavlink import autopilot_source as mavlink
from rig.sensors.sample_source import OnSamples, SampleSource

Sections = Mapping[str, SensorSection]


class SensorSource(SampleSource, Protocol):
    """The sample source of a sensor with a port of its own."""

    @property
    def corrected(self) -> Mapping[str, str]:
        """The settings in its memory that were corrected, with their former values."""
        ...


@dataclass(frozen=True, slots=True)
class PartKind:
    """The operations on sensors of one part at one port, which are given as sections by name. Errors are SensorErrors.

    - `connect`: returns a context manager of their source, set up, which passes their samples on.
    - `describe`: returns the description of a sensor's samples.
    - `look`: yields their state and their problems, and changes nothing.
    """

    connect: Callable[[Sections, OnSamples], AbstractContextManager[SensorSource]]
    describe: Callable[[str, SensorSection], RecordedSensor]
    look: Callable[[Sections], Iterator[str | SensorError]]


def _single_sensor_kind(
    connect: Callable[[str, SensorSection, OnSamples], AbstractContextManager[SensorSource]],
    describe: Callable[[str, SensorSection], RecordedSensor],
    look: Callable[[str, SensorSection], Iterator[str | SensorError]],
) -> PartKind:
    """Return the kind of a part with one sensor at its port."""

    def only(sections: Sections) -> tuple[str, SensorSection]:
        (item,) = sections.items()
        return item

    return PartKind(
        lambda sections, on_samples: connect(*only(sections), on_samples),
        describe,
        lambda sections: look(*only(sections)),
    )


PORT_KINDS: Mapping[str, PartKind] = MappingProxyType(
    {
        "kvh1775": _single_sensor_kind(kvh1775.kvh1775, kvh1775.describe, kvh1775.look),
        "lines": _single_sensor_kind(lines.lines, lines.describe, lines.look),
        "mavlink": PartKind(mavlink.mavlink, mavlink.describe, mavlink.look),
    }
)


def group_by_port(sensors: Sections) -> Iterator[tuple[str, PartKind, Sections]]:
    """Yield the sensors with a port of their own, grouped by port: the port, its kind of part, the sections."""
    sections_by_port: dict[str, dict[str, SensorSection]] = {}
    for name, section in sensors.items():
        if section.own_port is not None:
            sections_by_port.setdefault(section.own_port[1], {})[name] = section
    for port, sections in sections_by_port.items():
        (first, *_) = sections.values()
        yield port, PORT_KINDS[first.part], sections
