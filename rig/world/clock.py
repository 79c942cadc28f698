"""The world's one clock: virtual time in ticks of 2 ms, paced against wall time but never made to jump."""

from collections.abc import Callable

TICKS_PER_SECOND = 500
TICK_S = 1.0 / TICKS_PER_SECOND
PATIENCE_S = 0.02  # wall time the world may be behind and still catch up
DIALOGUE_S = 0.1  # wall time after a client's question in which the clock goes no faster than a real one


class Clock:
    """Says how many ticks are due. Virtual time runs at most `time_scale` times as fast as wall time.

    When the machine cannot keep up by more than `patience_s`, the lost wall time is forgotten: virtual time slows down
    instead of jumping.
    While a client asks and is answered (`dialogue`) it goes no faster than wall time.
    `tick_s`: how long a tick of 2 ms of the controller's clock really lasts.
    `hold` stops it, `run` lets it go on, `advance` lets exactly so much pass and holds again.
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
        """Virtual time since the world began."""
        return self.tick * TICK_S

    @property
    def held(self) -> bool:
        return self._stop_at is not None and self.tick >= self._stop_at

    def hold(self) -> None:
        self._stop_at = self.tick

    def run(self) -> None:
        self._stop_at = None
        self._anchor()

    def advance(self, duration_s: float) -> int:
        """Let `duration_s` of virtual time pass, then hold; the tick at which it will hold."""
        self._anchor()
        self._stop_at = self.tick + max(1, round(duration_s * TICKS_PER_SECOND))
        return self._stop_at

    def pace(self, time_scale: float) -> None:
        """Go at most so many times as fast as wall time, from now on. Raises ValueError for what is no pace."""
        if not 0.0 < time_scale < float("inf"):
            raise ValueError(f"{time_scale} is no time scale")
        self.time_scale = time_scale
        self._anchor()

    def dialogue(self) -> None:
        """A client has asked something, and its next question depends on the answer."""
        self._dialogue_until_s = self._wall() + DIALOGUE_S

    def wait_s(self) -> float:
        """Wall time until the next tick is due: 0 when it is due now, infinity while held."""
        if self.held:
            return float("inf")
        period_s = self._tick_s / self.time_scale
        due_s = self._anchor_wall_s + (self.tick + 1 - self._anchor_tick) * period_s
        now_s = self._wall()
        if now_s - due_s > self._patience_s:
            self._anchor()
            return 0.0
        if now_s < self._dialogue_until_s:
            due_s = max(due_s, self._counted_s + max(self._tick_s, period_s))
        return max(0.0, due_s - now_s)

    def count(self) -> None:
        """A tick begins now."""
        self.tick += 1
        self._counted_s = self._wall()
