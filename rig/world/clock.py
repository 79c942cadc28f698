"""The world's clock: virtual time in ticks of 2 ms, which is paced against wall time and never jumps."""

from collections.abc import Callable

TICKS_PER_SECOND = 500
TICK_S = 1.0 / TICKS_PER_SECOND
PATIENCE_S = 0.02  # wall time by which the world may lag and still catch up
DIALOGUE_S = 0.1  # wall time after a client's question, in which the clock runs no faster than a real one


class WorldClock:
    """The clock that decides how many ticks are due. Virtual time runs at most `time_scale` times as fast as wall time.

    If the machine falls behind by more than `patience_s`, the lost wall time is dropped: virtual time slows down
    instead of jumping. While a client asks and waits for answers (`dialogue`), the clock runs no faster than wall time.
    `tick_s`: the real duration of one 2 ms tick of the controller's clock.
    """

    def __init__(
        self, time_scale: float, wall: Callable[[], float], tick_s: float = TICK_S, patience_s: float = PATIENCE_S
    ) -> None:
        self.time_scale = time_scale
        self._tick_s, self._patience_s = tick_s, patience_s
        self.tick = 0
        self._wall = wall
        self._stop_at: int | None = None
        self._dialogue_until_s = 0.0
        self._anchor()

    def _anchor(self) -> None:
        self._anchor_wall_s = self._counted_s = self._wall()
        self._anchor_tick = self.tick

    @property
    def time_s(self) -> float:
        """Virtual time since the world began, s."""
        return self.tick * TICK_S

    @property
    def is_held(self) -> bool:
        """Whether the clock is stopped."""
        return self._stop_at is not None and self.tick >= self._stop_at

    def hold(self) -> None:
        """Stop the clock."""
        self._stop_at = self.tick

    def run(self) -> None:
        """Let the clock run."""
        self._stop_at = None
        self._anchor()

    def advance(self, duration_s: float) -> int:
        """Let `duration_s` of virtual time pass, then hold the clock; return the tick at which it holds."""
        self._anchor()
        self._stop_at = self.tick + max(1, round(duration_s * TICKS_PER_SECOND))
        return self._stop_at

    def pace(self, time_scale: float) -> None:
        """Limit virtual time to `time_scale` times wall time. Raise ValueError if that is not positive and finite."""
        if not 0.0 < time_scale < float("inf"):
            raise ValueError(f"{time_scale} is not a time scale")
        self.time_scale = time_scale
        self._anchor()

    def dialogue(self) -> None:
        """Record that a client has asked something, and that its next question depends on the answer."""
        self._dialogue_until_s = self._wall() + DIALOGUE_S

    def wait_s(self) -> float:
        """Return the wall time until the next tick is due, s: 0 if it is due now, infinity while the clock is held."""
        if self.is_held:
            return float("inf")
        period_s = self._tick_s / self.time_scale
        due_s = self._anchor_wall_s + (self.tick + 1 - self._anchor_tick) * period_s
        now_s = self._wall()
        if now_s - due_s > self._patience_s:  # too late to catch up: from now on virtual time is later
            self._anchor()
            return 0.0
        if (
            now_s < self._dialogue_until_s
        ):  # a client waits for answers: no tick follows the last one faster than a real one
            due_s = max(due_s, self._counted_s + max(self._tick_s, period_s))
        return max(0.0, due_s - now_s)

    def count(self) -> None:
        """Count one tick, which begins now."""
        self.tick += 1
        self._counted_s = self._wall()
