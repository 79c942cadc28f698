"""The board's time: one counter of 80 MHz ticks, and the ticks of scheduled actions."""

from collections.abc import Callable

from firmware_host.emulator.hooks import Time

TICK_HZ = 80_000_000  # the core clock set by the firmware; at a slower clock an instruction takes several ticks
NEVER = 1 << 62


class Timeline(Time):
    """The present tick, and one next due tick for each registered action.

    The machine's block hook reads `now` and `deadline` on every block, in machine code: `deadline` is the earlier of
    the next action's tick and the limit, or 0 after `interrupt`.
    """

    def __init__(self) -> None:
        super().__init__(now=0, deadline=0)
        self._limit = 0
        self._may_continue: Callable[[], bool] | None = None
        self.next_due = NEVER
        self._actions: list[Callable[[], None]] = []
        self._due: list[int] = []

    def register(self, action: Callable[[], None]) -> int:
        """Return a slot for `action`; at equal ticks, slots registered first act first."""
        self._actions.append(action)
        self._due.append(NEVER)
        return len(self._due) - 1

    def schedule(self, slot: int, tick: int) -> None:
        old_tick, self._due[slot] = self._due[slot], tick
        if tick <= self.next_due:
            self.next_due = tick
        elif old_tick == self.next_due:
            self.next_due = min(self._due)
        self.deadline = min(self.deadline, tick)

    def cancel(self, slot: int) -> None:
        self._due[slot] = NEVER
        self.next_due = min(self._due)

    def run_due(self) -> None:
        """Run all actions that are due by now, in the order of their ticks."""
        while self.next_due <= self.now:
            slot = self._due.index(self.next_due)
            self._due[slot] = NEVER
            self.next_due = min(self._due)
            self._actions[slot]()

    def run_until(self, limit: int, may_continue: Callable[[], bool] | None = None) -> None:
        """Let the core run until `limit`, or until `may_continue`, called after every block, returns False."""
        self._limit, self._may_continue = limit, may_continue
        self.deadline = min(self.next_due, limit if may_continue is None else self.now + 1)

    def go_on(self) -> bool:
        """Run due actions while the core runs; return whether it may continue: no interrupt, limit not reached."""
        if self.deadline:
            self.run_due()
        if not self.deadline or self.now >= self._limit:
            return False
        if self._may_continue is None:
            self.deadline = min(self.next_due, self._limit)
            return True
        self.deadline = self.now + 1
        return self._may_continue()

    def interrupt(self) -> None:
        """Pause the core at the end of the current block, because an exception may have become pending."""
        self.deadline = 0
