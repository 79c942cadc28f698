"""Where samples come from: whatever has a port of its own, be it a board with several sensors or one instrument."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from numpy.typing import NDArray

from rig.data.recording.recorded_sensor import RecordedSensor

# A sensor's name, and samples (n,) of the type its description says; called on the source's thread.
OnSamples = Callable[[str, NDArray[Any]], None]


class SampleSource(Protocol):
    """Connected and set up, and silent until `start`. Errors are ProblemErrors, by name."""

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """What it streams, by the sensors' names."""
        ...

    def start(self) -> None:
        """Start to hand every sample on, those of each sensor numbered from 0."""
        ...

    def check(self, clock_s: float | None = None) -> None:
        """Raises what went wrong meanwhile; a silence must be as long by the clock that shows `clock_s`, if any."""
        ...
