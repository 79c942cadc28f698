"""Arrival times of the data that the page shows, from which it computes their age."""

from rig.station.events import ArmConnected, ArmSeen, PhaseStarted, RunEvent, SamplesTaken

ARM, READINGS = "arm", "readings"


class Arrivals:
    """The arrival times of the newest state and of the newest readings, of any turner and any sensor.

    An event that repeats a state, or a number of samples, is ignored.
    """

    def __init__(self) -> None:
        self._arrived_s: dict[str, float] = {}
        self._state_s: float | None = None  # time of the newest state, by the turner's clock
        self._samples: dict[str, int] = {}  # number of samples, by sensor

    def take(self, event: RunEvent, now_s: float) -> bool:
        """Handle an event at the time `now_s`, s; return whether it brought newer data."""
        match event:
            case ArmConnected(report):
                return self._take_state(report.state.q_rad, report.state.time_s, now_s)
            case ArmSeen(state):
                return self._take_state(state.q_rad, state.time_s, now_s)
            case SamplesTaken(sensors):
                before, self._samples = self._samples, {sensor.sensor: sensor.samples for sensor in sensors}
                newer = any(count and count != before.get(sensor) for sensor, count in self._samples.items())
                return newer and self._arrive(READINGS, now_s)
            case PhaseStarted():
                self._arrived_s.pop(READINGS, None)
                self._samples = {}
        return False

    def ages_s(self, now_s: float) -> dict[str, float]:
        """Return the ages, s, of the arm's state and of the readings, if they have arrived, at the time `now_s`."""
        return {name: round(now_s - arrived_s, 1) for name, arrived_s in self._arrived_s.items()}

    def _take_state(self, q_rad: tuple[float, ...], time_s: float, now_s: float) -> bool:
        """Return whether a state with joints is new, and note its arrival."""
        if not q_rad or time_s == self._state_s:
            return False
        self._state_s = time_s
        return self._arrive(ARM, now_s)

    def _arrive(self, name: str, now_s: float) -> bool:
        self._arrived_s[name] = now_s
        return True
