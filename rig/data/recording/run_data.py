"""A recording in memory: the content of a run file."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

if TYPE_CHECKING:  # a plan needs only the type of a recording, not those of its contents
    from rig.data.quantity import Quantity, Scalar
    from rig.data.recording.motion_file import ExternalReadings
    from rig.data.recording.provenance import Provenance
    from rig.data.recording.recorded_events import TimedEvent
    from rig.data.recording.recorded_sensor import RecordedSensor
    from rig.data.recording.recorded_turner import RecordedTurner
    from rig.data.recording.settings import RunSettings


@dataclass(frozen=True, slots=True)
class RunData:
    """A run file in memory: `samples` (n,) by name of a sensor, `states` (n,) of its turner, events in order.

    `settings` are those for solving and judging; `config` is the configuration's text, for people. External readings
    have no turner (None); their samples are those of a sensor on a clock of its own.
    """

    config: str
    settings: "RunSettings"
    provenance: "Provenance"
    turner: "RecordedTurner | None"
    sensors: "dict[str, RecordedSensor]"
    samples: dict[str, NDArray[Any]]
    states: NDArray[Any]
    events: "tuple[TimedEvent, ...]"
    external: "ExternalReadings | None" = None

    def measuring(self, quantity: "Quantity | Scalar") -> "dict[str, RecordedSensor]":
        """Return the sensors whose samples hold the given quantity, by name."""
        return {name: sensor for name, sensor in self.sensors.items() if sensor.measures(quantity)}

    def override_settings(self, overrides: Sequence[str]) -> "RunData":
        """Return the recording with some of its settings replaced by `overrides`, such as `limits.scale_std=0.001`.

        Raise as `RunSettings.apply_overrides` does.
        """
        return replace(self, settings=self.settings.apply_overrides(overrides)) if overrides else self
