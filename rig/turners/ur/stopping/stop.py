"""Stopping the arm for good: over the controller's ports and over the client at the same time, in its own threads."""

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import closing

from rig.turners.stop_once import StopOutcome
from rig.turners.ur.messages import Braked
from rig.turners.ur.messages import Stop as Brake
from rig.turners.ur.stopping.spare_descriptors import SpareDescriptors
from rig.turners.ur.stopping.stop_paths import StopConnection, StopPath

STOP_S = 0.9  # a stop is confirmed within this, or not at all
PATH_S = 0.8  # a port of the controller has so long to answer …
LATE_S = 0.1  # … and so long when no time is left
LOOKS = 2  # at what a port tells of programs, after which a refusal would have come
ASK_S = 0.05  # a port is asked so often whether the program has ended
ANSWERS_S = 0.3  # an arm that stands waits so long for refusals that come later: of three states
BRAKE_RAD_S2 = 5.0


class Order:
    """The order to end the program, given to the controller on all `paths` at once, each in its own thread.

    One that hangs holds up no other. Each goes on to ask for at most `timeout_s` whether the program has ended.
    """

    def __init__(self, paths: Sequence[StopPath], timeout_s: float) -> None:
        self._deadline_s = time.monotonic() + timeout_s
        self._changed = threading.Condition()  # notified when anything below changes
        self._to_give, self._under_way, self._unheard = ({path.name for path in paths} for _ in range(3))
        self._ended = False
        self._answers = {path.name: f"the {path.name} has not answered the stop" for path in paths}
        self._refused: set[str] = set()
        for path in paths:
            threading.Thread(target=self._give, args=(path,), name=f"arm stop by {path.name}", daemon=True).start()

    def given(self) -> bool:
        """Whether it is given on every path, or has failed there; waits for that as long as it may yet come.

        One that came later would end a program that somebody starts meanwhile.
        """
        with self._changed:
            return self._changed.wait_for(lambda: not self._to_give, max(0.0, self._left_s))

    def answered(self, timeout_s: float) -> None:
        """Wait so long, at most, until every path has said what it thinks of the order, which may be later."""
        with self._changed:
            self._changed.wait_for(lambda: not self._unheard, timeout_s)

    def program_ended(self) -> bool:
        """Whether the controller says so on any path; waits for it as long as it may yet come, as `given` does."""
        with self._changed:
            self._changed.wait_for(lambda: self._ended or not self._under_way, max(0.0, self._left_s))
        self.given()
        return self._ended

    @property
    def words(self) -> str:
        """What became of it: for each path whether it was taken, refused with which words, or not heard."""
        with self._changed:
            return ", ".join(self._answers.values())

    @property
    def refusals(self) -> str:
        """Who refused it, and with which words; empty where nobody did."""
        with self._changed:
            return ", ".join(answer for name, answer in self._answers.items() if name in self._refused)

    @property
    def _left_s(self) -> float:
        return self._deadline_s - time.monotonic()

    def _give(self, path: StopPath) -> None:
        try:
            # However late it is: a program that was ended in vain is better than an arm that goes on.
            with closing(path.open(max(LATE_S, min(PATH_S, self._left_s)))) as connection:
                connection.stop_program()
                self._note(path, connection)
                self._no_longer(path, self._to_give)
                self._ask(path, connection)
        except OSError as error:
            self._note(path, error)
        finally:
            self._no_longer(path, self._to_give, self._under_way, self._unheard)

    def _note(self, path: StopPath, result: StopConnection | OSError) -> None:
        """Keep what a path has answered; what failed after an answer takes nothing from it."""
        with self._changed:
            if isinstance(result, OSError):
                if path.name in self._to_give:
                    self._answers[path.name] = f"the {path.name} did not take the stop ({result})"
            elif result.refusal is not None:
                self._answers[path.name] = f"the {path.name} refused the stop ({result.refusal})"
                self._refused.add(path.name)
            elif result.acknowledged:
                self._answers[path.name] = f"the {path.name} took the stop"
            else:
                self._answers[path.name] = f"the {path.name} was sent the stop and did not acknowledge it"

    def _no_longer(self, path: StopPath, *among: set[str]) -> None:
        with self._changed:
            for names in among:
                names.discard(path.name)
            self._changed.notify_all()

    def _ask(self, path: StopPath, connection: StopConnection) -> None:
        """Ask whether the program has ended, until it has; and once more where the path has not answered the order."""
        looks = 0
        while connection.tells_of_programs and self._left_s > 0.0:
            running = connection.program_running()
            looks += 1
            self._note(path, connection)
            self._ended = self._ended or not running
            # The first state that a port tells may have been made before the order came to it.
            if heard := looks >= LOOKS or connection.acknowledged or connection.refusal is not None:
                self._no_longer(path, self._unheard)
            if self._ended and heard:
                return
            with self._changed:
                self._changed.notify_all()
            time.sleep(ASK_S)


class Stop:
    """How the arm is stopped: by its controller's ports and by the client, at the same time.

    `paths` tells where the controller takes a stop, `send` hands the child its request, `braked` tells its answer, None
    before it comes; `seen_at_rest(since_s, timeout_s)` waits for a state newer than `since_s` (monotonic time) that
    shows the arm at rest and its program ended.
    """

    def __init__(
        self,
        paths: Callable[[], Sequence[StopPath]],
        send: Callable[[Brake], None],
        braked: Callable[[], Braked | None],
        seen_at_rest: Callable[[float, float], bool],
    ) -> None:
        self._paths = paths
        self._send = send
        self._braked = braked
        self._seen_at_rest = seen_at_rest
        self.descriptors = SpareDescriptors()  # to be kept before the arm is under control

    def carry_out(self) -> StopOutcome:
        """Stop the arm, and say what is known of it; less than 1 s."""
        began_s = time.monotonic()
        # In a thread of its own: a child that does not listen must not keep the stop from the controller.
        threading.Thread(target=self._send, args=(Brake(BRAKE_RAD_S2),), name="arm brake", daemon=True).start()
        self.descriptors.release()
        order = Order(self._paths(), STOP_S)
        if self._seen_at_rest(began_s, began_s + STOP_S - time.monotonic()):
            order.given()
            order.answered(ANSWERS_S)
            return StopOutcome(True, _with("the arm is stopped and at rest", order.refusals))
        if order.program_ended():
            return StopOutcome(
                False,
                _with(
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


def _with(what: str, refusals: str) -> str:
    """A sentence, and who refused the stop."""
    return f"{what} ({refusals})" if refusals else what


def _client_words(braked: Braked | None) -> str:
    if braked is None:
        return "the client has not answered it"
    return "the client braked the arm" if braked.taken else "the client could not brake the arm"
