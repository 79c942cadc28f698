"""Stopping the arm for good: over the dashboard and over the client at the same time, in a thread of its own."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

from rig.turners.ur.dashboard import Dashboard
from rig.turners.ur.messages import Stop
from rig.turners.ur.spare import SpareDescriptors

STOP_S = 0.9  # a stop is confirmed within this, or not at all
DASHBOARD_S = 0.8  # the dashboard has so long to answer
ASK_S = 0.05  # … and is asked so often whether the program has ended
BRAKE_RAD_S2 = 5.0


@dataclass(frozen=True, slots=True)
class StopOutcome:
    """Whether the arm was seen at rest with its program ended, in words; `remedy` is empty when it was."""

    at_rest: bool
    what: str
    remedy: str = ""


class Stopper:
    """Stops the arm at `host` when `begin` is first called; later calls change nothing.

    `send` hands the child its request; `seen_at_rest(since_s, timeout_s)` waits for a state newer than `since_s`
    (monotonic time) that shows the arm at rest and its program ended. No interrupt of the caller breaks a stop off: it
    runs in its own thread.
    """

    def __init__(self, host: str, send: Callable[[Stop], None], seen_at_rest: Callable[[float, float], bool]) -> None:
        self._host = host
        self._send = send
        self._seen_at_rest = seen_at_rest
        self._starting = threading.Lock()
        self._thread = threading.Thread(target=self._stop, name="arm stop")
        self._ended = threading.Event()
        self._outcome = StopOutcome(False, "the stop has not ended", "Look at the arm")
        self.descriptors = SpareDescriptors()  # to be kept before the arm is under control

    @property
    def begun(self) -> bool:
        """Whether a stop has been asked for."""
        return self._thread.ident is not None

    def begin(self) -> None:
        """Stop the arm; returns at once."""
        with self._starting:
            if not self.begun:
                self._thread.start()

    def outcome(self) -> StopOutcome:
        """Stop the arm if that has not begun, and wait for the result; less than 1 s.

        An interrupt meanwhile is raised when the result is there. (An event, because `join`, once interrupted, takes
        the thread for ended in Python 3.11.)
        """
        self.begin()
        interrupt = None
        while not self._ended.is_set():
            try:
                self._ended.wait()
            except KeyboardInterrupt as impatient:
                interrupt = impatient
        if interrupt is not None:
            raise interrupt
        return self._outcome

    def _stop(self) -> None:
        try:
            self._outcome = self._stopped()
        finally:
            self._ended.set()

    def _stopped(self) -> StopOutcome:
        began_s = time.monotonic()
        # In a thread of its own: a child that does not listen must not keep the stop from the controller.
        threading.Thread(target=self._send, args=(Stop(BRAKE_RAD_S2),), name="arm brake", daemon=True).start()
        self.descriptors.release()
        try:
            with Dashboard(self._host, timeout_s=DASHBOARD_S) as dashboard:
                dashboard.stop_program()
            delivered = "the controller was told to stop"
        except OSError as error:
            delivered = f"the controller's dashboard did not take the stop ({error})"
        if self._seen_at_rest(began_s, began_s + STOP_S - time.monotonic()):
            return StopOutcome(True, "the arm is stopped and at rest")
        if self._program_ended(began_s + STOP_S):
            return StopOutcome(
                False,
                "the controller says that its program has ended, but no state shows that the arm is at rest",
                "Look at the arm: nothing drives it any more",
            )
        return StopOutcome(
            False,
            f"{delivered}, but no state confirms that the arm is at rest",
            "Look at the arm and press the emergency stop if it moves",
        )

    def _program_ended(self, deadline_s: float) -> bool:
        """Whether the controller says so itself by then: what is left to ask when no states come."""
        try:
            while (left_s := deadline_s - time.monotonic()) > 0.0:
                with Dashboard(self._host, timeout_s=left_s) as dashboard:
                    if not dashboard.program_running():
                        return True
                time.sleep(ASK_S)
        except OSError:
            return False
        return False
