"""The board's time: one counter of 80 MHz ticks, and what is due when."""

from collections.abc import Callable

from firmware_host.emulator.hooks import Time

TICK_HZ = 80_000_000  # the core clock the firmware sets; while it runs slower, an instruction takes several ticks
NEVER = 1 << 62


class Timeline(Time):
    """Now, and one next due tick for each registered action.

    The machine's block hook reads `now` and `deadline` on every block, from machine code: `deadline` is the tick at
    which something is due, the limit is reached, or `interrupt` was called.
    """

    def __init__(self) -> None:
        super().__init__(now=0, deadline=0)
        self._limit = 0
        self._on: Callable[[], bool] | None = None
        self.next_due = NEVER
        self._actions: list[Callable[[], None]] = []
        self._due: list[int] = []

    def register(self, action: Callable[[], None]) -> int:
        """A slot for `action`; at equal ticks, slots registered first act first."""
        self._actions.append(action)
        self._due.append(NEVER)
        return len(self._due) - 1

    def schedule(self, slot: int, tick: int) -> None:
        before, self._due[slot] = self._due[slot], tick
        if tick <= self.next_due:
            self.next_due = tick
        elif before == self.next_due:
            self.next_due = min(self._due)
        self.deadline = min(self.deadline, tick)

    def cancel(self, slot: int) -> None:
        self._due[slot] = NEVER
        self.next_due = min(self._due)

    def run_due(self) -> None:
        """Do everything that is due by now, in the order of its ticks."""
        while self.next_due <= self.now:
            slot = self._due.index(self.next_due)
            self._due[slot] = NEVER
            self.next_due = min(self._due)
            self._actions[slot]()

    def run_until(self, limit: int, on: Callable[[], bool] | None = None) -> None:
        """The core runs from now on, and is to pause at `limit`, or when `on`, asked after every block, says no."""
        self._limit, self._on = limit, on
        self.deadline = min(self.next_due, limit if on is None else self.now + 1)

    def go_on(self) -> bool:
        """Do what is due while the core runs. Whether it may run on: nothing interrupted, the limit is still ahead."""
        if self.deadline:
            self.run_due()
        if not self.deadline or self.now >= self._limit:
            return False
        if self._on is None:
            self.deadline = min(self.next_due, self._limit)
            return True
        self.deadline = self.now + 1
        return self._on()

    def interrupt(self) -> None:
        """Have the core pause at the end of the current block: an exception may have become pending."""
        self.deadline = 0
