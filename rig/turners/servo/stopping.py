"""Stopping the shaft for good.

1. Goal Position becomes Present Position, with a short profile: the shaft brakes and is held. Torque stays on: without
   it an unbalanced board would fall, and no gear of these servos locks.
2. Where that is not acknowledged, a last word sets its watchdog to the shortest time there is, and nobody speaks to
   the servo any more: so it stops at once if it hears, and by the time it was given before if not.
3. A *state* newer than the stop tells whether the shaft stands.

None of this is a safety function. Only the switch of the servo's supply is sure.
"""

import threading
from collections.abc import Callable
from contextlib import suppress

from rig.turners.servo.bus import Bus, BusError, Denied
from rig.turners.servo.clock import Clock
from rig.turners.servo.instructions import brake
from rig.turners.servo.link import Link
from rig.turners.servo.registers import TRIPPED, WATCHDOG
from rig.turners.stop_once import StopOutcome

STOP_S = 0.95  # a stop is confirmed within this, or not at all
TOLD_S = 0.25  # the servo has so long to acknowledge
SURE = "only the switch of its supply is sure"


class Stop:
    """How the shaft is stopped.

    `seen_at_rest(since_s, timeout_s)` waits for states newer than `since_s` (reference time) that show the shaft at
    rest; `lets_go()` tells whether the servo has switched its motor off.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        watchdog_s: float,
        seen_at_rest: Callable[[float, float], bool],
        lets_go: Callable[[], bool],
    ) -> None:
        self._link, self._clock, self._watchdog_s = link, clock, watchdog_s
        self._seen_at_rest, self._lets_go = seen_at_rest, lets_go

    def carry_out(self) -> StopOutcome:
        """Stop the shaft, and say what is known of it; less than 1 s."""
        clock = self._clock
        since_s, ends_s = clock.reference_s(), clock.now_s() + STOP_S
        told = threading.Event()
        answer, refused = "the servo did not acknowledge the stop", False

        def tell(bus: Bus) -> None:
            nonlocal answer, refused
            try:
                if not _stopped_itself(bus):
                    brake(bus)
                answer = "the servo has taken the stop"
                told.set()
            except BusError as error:
                if isinstance(error, Denied):
                    answer, refused = f"the servo refused the stop ({error})", True
                with suppress(BusError):
                    bus.write_unheard(WATCHDOG, 1)
                self._link.keep_quiet(2 * self._watchdog_s)

        self._link.stop(tell)
        if not clock.wait(told, TOLD_S):
            self._link.keep_quiet(2 * self._watchdog_s)
        seen = self._seen_at_rest(since_s, ends_s - clock.now_s())
        refusal = f" ({answer})" if refused else ""
        if seen and self._lets_go():
            remedy = "Hold the board: nothing else may"
            return StopOutcome(True, f"the shaft stands, but its motor is off{refusal}", remedy)
        if seen:
            return StopOutcome(True, f"the shaft stands, and the servo holds it{refusal}")
        return StopOutcome(
            False,
            f"{answer}, and no state shows that the shaft stands",
            f"Look at the shaft: its watchdog stops it {self._watchdog_s:.1f} s after the last instruction, but {SURE}",
        )


def _stopped_itself(bus: Bus) -> bool:
    """Whether the watchdog has stopped the servo, which takes no goal then."""
    return bus.read(WATCHDOG) == (TRIPPED,)
