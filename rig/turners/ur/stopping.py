"""Stopping the arm for good: over the controller's ports and over the client at the same time, in its own threads."""

import threading
import time
from collections.abc import Callable
from contextlib import closing
from typing import Protocol

from rig.turners.stop_once import StopOutcome
from rig.turners.ur.dashboard import Dashboard
from rig.turners.ur.identity import is_polyscope_x
from rig.turners.ur.messages import Stop as Brake
from rig.turners.ur.primary_stop import PrimaryStop
from rig.turners.ur.spare_descriptors import SpareDescriptors

STOP_S = 0.9  # a stop is confirmed within this, or not at all
WAY_S = 0.8  # a port of the controller has so long to answer …
LATE_S = 0.1  # … and so long when no time is left
ASK_S = 0.05  # a port is asked so often whether the program has ended
BRAKE_RAD_S2 = 5.0


class Way(Protocol):
    """A connection to the controller by which its program is ended, over plain TCP and without `ur_rtde`.

    Its methods raise `OSError` when the controller does not answer in time.
    """

    @property
    def name(self) -> str: ...
    def stop_program(self) -> object: ...
    def program_running(self) -> bool: ...
    def close(self) -> None: ...


Port = type[Dashboard] | type[PrimaryStop]
Ways = tuple[Port, ...]


def independent_ways(version: tuple[int, ...]) -> Ways:
    """The ways to end a program on a controller with that software, the one no arm is moved without first."""
    return (PrimaryStop,) if is_polyscope_x(version) else (Dashboard, PrimaryStop)


class Order:
    """The order to end the program, given to the controller at `host` on all ways at once, each in its own thread.

    One that hangs holds up no other. Each goes on to ask for at most `timeout_s` whether the program has ended.
    """

    def __init__(self, host: str, ways: Ways, timeout_s: float) -> None:
        self._host = host
        self._deadline_s = time.monotonic() + timeout_s
        self._changed = threading.Condition()  # notified when anything below changes
        self._to_give, self._under_way = set[Port](ways), set[Port](ways)
        self._ended = False
        self._heard = False  # it was taken by the controller, or at least by its port
        self._failures: list[str] = []
        for way in ways:
            threading.Thread(target=self._give, args=(way,), name=f"arm stop by {way.name}", daemon=True).start()

    def given(self) -> bool:
        """Whether it is given on every way, or has failed there; waits for that as long as it may yet come.

        One that came later would end a program that somebody starts meanwhile.
        """
        with self._changed:
            return self._changed.wait_for(lambda: not self._to_give, max(0.0, self._left_s))

    def program_ended(self) -> bool:
        """Whether the controller says so on any way; waits for it as long as it may yet come, as `given` does."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended or not self._under_way, max(0.0, self._left_s))
        self.given()
        return self._ended

    @property
    def words(self) -> str:
        """What became of it."""
        if self._heard:
            return "the controller was told to stop"
        return f"the controller did not take the stop ({'; '.join(self._failures) or 'no answer'})"

    @property
    def _left_s(self) -> float:
        return self._deadline_s - time.monotonic()

    def _give(self, way: Port) -> None:
        try:
            # However late it is: a program that was ended in vain is better than an arm that goes on.
            with closing(way(self._host, max(LATE_S, min(WAY_S, self._left_s)))) as connection:
                connection.stop_program()
                self._heard = True
                self._no_longer(way, self._to_give)
                self._ask(connection)
        except OSError as error:
            self._failures.append(f"{way.name}: {error}")
        finally:
            self._no_longer(way, self._to_give, self._under_way)

    def _no_longer(self, way: Port, *among: set[Port]) -> None:
        with self._changed:
            for ways in among:
                ways.discard(way)
            self._changed.notify_all()

    def _ask(self, connection: Way) -> None:
        while not self._ended and self._left_s > 0.0:
            if not connection.program_running():
                self._ended = True
            else:
                time.sleep(ASK_S)


class Stop:
    """How the arm at `host` is stopped: by its controller's ports and by the client, at the same time.

    `ways` tells the controller's independent ways, `send` hands the child its request; `seen_at_rest(since_s,
    timeout_s)` waits for a state newer than `since_s` (monotonic time) that shows the arm at rest and its program
    ended.
    """

    def __init__(
        self,
        host: str,
        ways: Callable[[], Ways],
        send: Callable[[Brake], None],
        seen_at_rest: Callable[[float, float], bool],
    ) -> None:
        self._host = host
        self._ways = ways
        self._send = send
        self._seen_at_rest = seen_at_rest
        self.descriptors = SpareDescriptors()  # to be kept before the arm is under control

    def carry_out(self) -> StopOutcome:
        """Stop the arm, and say what is known of it; less than 1 s."""
        began_s = time.monotonic()
        # In a thread of its own: a child that does not listen must not keep the stop from the controller.
        threading.Thread(target=self._send, args=(Brake(BRAKE_RAD_S2),), name="arm brake", daemon=True).start()
        self.descriptors.release()
        order = Order(self._host, self._ways(), STOP_S)
        if self._seen_at_rest(began_s, began_s + STOP_S - time.monotonic()):
            order.given()
            return StopOutcome(True, "the arm is stopped and at rest")
        if order.program_ended():
            return StopOutcome(
                False,
                "the controller says that its program has ended, but no state shows that the arm is at rest",
                "Look at the arm: nothing drives it any more",
            )
        return StopOutcome(
            False,
            f"{order.words}, but no state confirms that the arm is at rest",
            "Look at the arm and press the emergency stop if it moves",
        )
