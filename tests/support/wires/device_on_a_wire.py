"""A simulated device on a pseudo-terminal, without a laboratory around it: its thread."""

import fcntl
import os
import selectors
import struct
import termios
import threading
import time
from collections.abc import Callable

from rig.world.board.pty_port import PtyPort
from rig.world.board.serial_line import Device, SerialLine
from rig.world.clock import WorldClock
from support.processes.waiting import PATIENCE_S

IDLE_S = 0.001
UNREAD = 1024  # bytes that its reader may lag: a pseudo-terminal loses more than some thousand


class DeviceOnAWire:
    """A device simulated at most `pace` times as fast as real time, and no faster than it is read.

    However long this process or the reader of `port` is delayed, only a test's faults lose bytes: meanwhile the
    device's time stands still, and the delay is not made up for. The time also stands still at `limit_s`.
    """

    def __init__(self, device: Callable[[], Device | None], tick_s: float, pace: float, *, dead: bool = False) -> None:
        self._tick_s = tick_s
        self.time_s, self.limit_s = 0.0, float("inf")
        self.line = SerialLine(device, seed=5)
        self.line.silent = dead  # before a byte is under way
        self.clock = WorldClock(pace, time.monotonic, tick_s)
        self._selector = selectors.DefaultSelector()
        self._pty = PtyPort(self.line, self._selector)
        self.port = self._pty.path
        self._reader = os.open(self.port, os.O_RDWR | os.O_NOCTTY)  # to measure its reader's lag
        self._ending = threading.Event()
        self._orders: list[Callable[[], None]] = []
        self._thread: threading.Thread | None = None

    def live(self, advance: Callable[[float], None]) -> None:
        """Start the thread: `advance` simulates the device until a time."""
        self._thread = threading.Thread(target=self._run, args=(advance,), daemon=True)
        self._thread.start()

    def order(self, what: Callable[[], object]) -> None:
        """Let the device's own thread call `what` between two ticks, and wait until it is done."""
        done = threading.Event()

        def carry_out() -> None:
            what()
            done.set()

        self._orders.append(carry_out)
        assert done.wait(PATIENCE_S)

    def close(self) -> None:
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
        self._pty.close()
        self._selector.close()
        os.close(self._reader)

    def _unread(self) -> int:
        count: int = struct.unpack("i", fcntl.ioctl(self._reader, termios.FIONREAD, bytes(4)))[0]
        return count

    def _run(self, advance: Callable[[float], None]) -> None:
        while not self._ending.is_set():
            while self._orders:
                self._orders.pop(0)()
            stands = self.time_s >= self.limit_s or self._unread() > UNREAD
            wait_s = IDLE_S if stands else min(self.clock.wait_s(), IDLE_S)
            for key, events in self._selector.select(wait_s):
                key.data(events)
            if wait_s <= 0.0:
                self.clock.count()
                self.time_s += self._tick_s
                advance(self.time_s)
                self.line.tick()
                self._pty.tick()
