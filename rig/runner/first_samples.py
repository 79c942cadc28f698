"""The wait for the first sample of every sensor after the start of its stream."""

from collections.abc import Collection
from dataclasses import dataclass

from firmware_host import computer_load
from rig.errors import Fault

TIMEOUT_S = 2.0


@dataclass(slots=True)
class FirstSamples:
    """The wait for first samples, measured as the number of polls times the interval `look_s`.

    Elapsed time would be too strict, because the threads that poll and read samples may be delayed. If the turner's
    clock shows a shorter wait, this shorter wait counts, because a simulated turner's clock stops if its world is late.
    The limit grows with the load of this computer, on which the simulated laboratory may run.
    """

    look_s: float
    _looks: int = 0
    _clock_began_s: float | None = None

    def wait_on(self, silent: Collection[str], clock_s: float | None = None) -> None:
        """Count one more poll without data of the sensors `silent`.

        `clock_s` is the reading of the turner's clock. Raise Fault `no_samples` after too long a wait.
        """
        if self._clock_began_s is None:
            self._clock_began_s = clock_s
        self._looks += 1
        waited_s = self._looks * self.look_s
        if clock_s is not None and self._clock_began_s is not None:
            waited_s = min(waited_s, clock_s - self._clock_began_s)
        if computer_load.exceeds(waited_s, TIMEOUT_S):
            raise Fault(
                "no_samples",
                f"no sample from {', '.join(silent)} within {waited_s:.1f} s of the start",
                "Check the sensor's wiring and its data-ready line, then run `rig check`",
            )
