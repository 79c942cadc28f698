"""The stop of an arm: over the controller's ports and over the client at the same time, in its own threads."""

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import closing

from rig.turners.stop_once import StopOutcome
from rig.turners.ur.child_messages import Braked, BrakeRequest
from rig.turners.ur.stopping.spare_descriptors import SpareDescriptors
from rig.turners.ur.stopping.stop_paths import StopConnection, StopPath

MAX_STOP_S = 0.9  # a stop is confirmed within this time, or not at all
PATH_TIMEOUT_S = 0.8  # time-out of a port of the controller
MIN_TIMEOUT_S = 0.1  # of a port, at the end of the stop's time
REFUSAL_REPORTS = 2  # reports about programs, within which a refusal would have come
POLL_S = 0.05  # of a port, whether the program has ended
REFUSAL_WAIT_S = 0.3  # at rest: the time of three states
BRAKE_RAD_S2 = 5.0


class StopOrder:
    """The order to end the program, given to the controller on all `paths` at once, each in its own thread.

    A path that hangs does not delay the others. Each path then polls at most `timeout_s` whether the program has ended.
    """

    def __init__(self, paths: Sequence[StopPath], timeout_s: float) -> None:
        self._deadline_s = time.monotonic() + timeout_s
        self._changed = threading.Condition()  # notified when anything below changes
        self._pending, self._active, self._unanswered = ({path.name for path in paths} for _ in range(3))
        self._ended = False
        self._answers = {path.name: f"the {path.name} has not answered the stop" for path in paths}
        self._refused: set[str] = set()
        for path in paths:
            threading.Thread(target=self._give, args=(path,), name=f"arm stop by {path.name}", daemon=True).start()

    def await_delivery(self) -> bool:
        """Wait until every path has delivered the order or failed; return whether all did so within `timeout_s`.

        A later delivery would end a program that is started after the stop.
        """
        with self._changed:
            return self._changed.wait_for(lambda: not self._pending, max(0.0, self._remaining_s))

    def await_answers(self, timeout_s: float) -> None:
        """Wait at most `timeout_s` until every stop path has answered, which may be after the order's delivery."""
        with self._changed:
            self._changed.wait_for(lambda: not self._unanswered, timeout_s)

    def await_program_end(self) -> bool:
        """Wait for a report that the program has ended; return whether this report came before the time limit."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended or not self._active, max(0.0, self._remaining_s))
        self.await_delivery()
        return self._ended

    @property
    def words(self) -> str:
        """The result on each path: accepted, refused with the controller's words, or unanswered."""
        with self._changed:
            return ", ".join(self._answers.values())

    @property
    def refusals(self) -> str:
        """The refusals of the stop, each with its path and the controller's words; empty if no path refused."""
        with self._changed:
            return ", ".join(answer for name, answer in self._answers.items() if name in self._refused)

    @property
    def _remaining_s(self) -> float:
        return self._deadline_s - time.monotonic()

    def _give(self, path: StopPath) -> None:
        """Stop the program by this path, record the answer, and poll whether the program has ended."""
        try:
            # At any time, however late: ending a program needlessly is better than an arm that goes on.
            with closing(path.open(max(MIN_TIMEOUT_S, min(PATH_TIMEOUT_S, self._remaining_s)))) as connection:
                connection.stop_program()
                self._note(path, connection)
                self._remove(path, self._pending)
                self._ask(path, connection)
        except OSError as error:
            self._note(path, error)
        finally:
            self._remove(path, self._pending, self._active, self._unanswered)

    def _note(self, path: StopPath, result: StopConnection | OSError) -> None:
        """Record a path's answer; a later error does not replace it."""
        with self._changed:
            if isinstance(result, OSError):
                if path.name in self._pending:
                    self._answers[path.name] = f"the {path.name} did not take the stop ({result})"
            elif result.refusal is not None:
                self._answers[path.name] = f"the {path.name} refused the stop ({result.refusal})"
                self._refused.add(path.name)
            elif result.acknowledged:
                self._answers[path.name] = f"the {path.name} took the stop"
            else:
                self._answers[path.name] = f"the {path.name} was sent the stop and did not acknowledge it"

    def _remove(self, path: StopPath, *sets: set[str]) -> None:
        with self._changed:
            for names in sets:
                names.discard(path.name)
            self._changed.notify_all()

    def _ask(self, path: StopPath, connection: StopConnection) -> None:
        """Poll until the program has ended and the path has answered the stop order."""
        looks = 0
        while connection.reports_programs and self._remaining_s > 0.0:
            running = connection.program_running()
            looks += 1
            self._note(path, connection)
            self._ended = self._ended or not running
            # The first state at a port may precede the stop order.
            if is_answered := looks >= REFUSAL_REPORTS or connection.acknowledged or connection.refusal is not None:
                self._remove(path, self._unanswered)
            if self._ended and is_answered:
                return
            with self._changed:
                self._changed.notify_all()
            time.sleep(POLL_S)


class ArmStop:
    """The stop of an arm through its controller's ports and through the client, at the same time.

    - `paths`: returns the paths of a stop.
    - `send`: passes a request to the child; `braked`: returns the child's answer, or None before it.
    - `await_rest(since_s, timeout_s)`: waits for a state newer than `since_s` (monotonic time) and returns whether it
      shows the arm at rest and the program ended.
    """

    def __init__(
        self,
        paths: Callable[[], Sequence[StopPath]],
        send: Callable[[BrakeRequest], None],
        braked: Callable[[], Braked | None],
        await_rest: Callable[[float, float], bool],
    ) -> None:
        self._paths = paths
        self._send = send
        self._braked = braked
        self._await_rest = await_rest
        self.descriptors = SpareDescriptors()  # reserve before the arm is under control

    def carry_out(self) -> StopOutcome:
        """Stop the arm and return the outcome, within 1 s."""
        began_s = time.monotonic()
        # In a thread of its own: a child that does not read must not delay the stop over the controller's ports.
        threading.Thread(target=self._send, args=(BrakeRequest(BRAKE_RAD_S2),), name="arm brake", daemon=True).start()
        self.descriptors.release()
        order = StopOrder(self._paths(), MAX_STOP_S)
        if self._await_rest(began_s, began_s + MAX_STOP_S - time.monotonic()):
            order.await_delivery()
            order.await_answers(REFUSAL_WAIT_S)
            return StopOutcome(True, _add_refusals("the arm is stopped and at rest", order.refusals))
        if order.await_program_end():
            return StopOutcome(
                False,
                _add_refusals(
                    "the controller says that its program has ended, but no state shows that the arm is at rest",
                    order.refusals,
                ),
                "Look at the arm: nothing drives it any more",
            )
        return StopOutcome(
            False,
            f"the stop is not confirmed: {order.words}, {_client_words(self._braked())}, and no state shows that the "
            "arm is at rest",
            "Look at the arm and press the emergency stop if it moves",
        )


def _add_refusals(what: str, refusals: str) -> str:
    """Return the sentence `what` with the refusals of the stop, if any, in brackets."""
    return f"{what} ({refusals})" if refusals else what


def _client_words(braked: Braked | None) -> str:
    if braked is None:
        return "the client has not answered it"
    return "the client braked the arm" if braked.confirmed else "the client could not brake the arm"
