"""The wait for the first sample of every sensor after the start of its stream."""

from collections.abc import Collection
from dataclasses import dataclass

from rig.data.processes import silence
from rig.errors import Fault

TIMEOUT_S = 2.0


@dataclass(slots=True)
class FirstSamples:
    """A wait that is counted in looks, `look_s` apart, and by the clock of what turns the sensors, if there is one.

    Elapsed time would not do: whoever looks may have been held up, and the thread that reads the samples with it. The
    limit is stretched by the crowding of this computer, because the far end may run on it. The other clock may be a
    simulated one, which stands still while its world is held up.
    """

    look_s: float
    _looks: int = 0
    _clock_began_s: float | None = None

    def wait_on(self, silent: Collection[str], clock_s: float | None = None) -> None:
        """Count one more look at which the sensors `silent` have sent nothing. Raises Fault `no_samples`.

        `clock_s` is what the other clock shows now.
        """
        if self._clock_began_s is None:
            self._clock_began_s = clock_s
        self._looks += 1
        waited_s = self._looks * self.look_s
        if clock_s is not None and self._clock_began_s is not None:
            waited_s = min(waited_s, clock_s - self._clock_began_s)
        if waited_s > TIMEOUT_S and waited_s > TIMEOUT_S * silence.crowding():
            raise Fault(
                "no_samples",
                f"no sample from {', '.join(silent)} within {waited_s:.1f} s of the start",
                "Check the sensor's wiring and its data-ready line, then run `rig check`",
            )
