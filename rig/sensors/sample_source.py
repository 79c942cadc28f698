"""The protocol of a source of samples: a board with several sensors, or one instrument with a port of its own."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from numpy.typing import NDArray

from rig.data.recording.recorded_sensor import RecordedSensor

# A sensor's name, and samples (n,) of the type in its description; called on the source's thread.
OnSamples = Callable[[str, NDArray[Any]], None]


class SampleSource(Protocol):
    """A connected source, set up, and silent until `start`. Its errors are ProblemErrors, by name."""

    @property
    def sensors(self) -> Mapping[str, RecordedSensor]:
        """The sensors that it streams, by name."""
        ...

    def start(self) -> None:
        """Pass on every sample from now on, numbered from 0 for each sensor."""
        ...

    def check(self, clock_s: float | None = None) -> None:
        """Raise an error that has occurred since the last call.

        A silence counts only if the turner's clock, now at `clock_s`, confirms it.
        """
        ...

    def catch_up(self) -> None:
        """Wait until all samples that have arrived by now are passed on, because a busy computer reads them late."""
        ...
