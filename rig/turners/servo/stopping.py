"""The stop of the shaft.

1. Goal Position becomes Present Position, with a short profile: the shaft brakes and holds. Torque remains on: without
it an unbalanced board would fall, because these servos' gears do not lock. 2. If the servo does not acknowledge this, a
last write sets its watchdog to the shortest time, and nothing more is sent. The servo then stops at once if it receives
the write, otherwise after the watchdog time that was armed before. 3. A *state* newer than the stop confirms that the
shaft is at rest.

None of this is a safety function. Only the switch of the servo's supply is sure.
"""

import threading
from collections.abc import Callable
from contextlib import suppress

from rig.turners.servo.driver_clock import Clock
from rig.turners.servo.instructions import brake
from rig.turners.servo.packet_handler import Bus, BusError, InstructionDenied
from rig.turners.servo.servo_link import ServoLink
from rig.turners.servo.servo_registers import WATCHDOG, WATCHDOG_TRIPPED
from rig.turners.stop_once import StopOutcome

MAX_STOP_S = 0.95  # a stop is confirmed within this time, or not at all
MAX_ACKNOWLEDGE_S = 0.25
SURE = "only the switch of its supply is sure"


class ShaftStop:
    """The stop of a servo's shaft through its `ServoLink`.

    `await_rest(since_s, timeout_s)` waits for states newer than `since_s` (reference time) and returns whether they
    show rest; `lets_go()` returns whether the servo has switched its motor off.
    """

    def __init__(
        self,
        link: ServoLink,
        clock: Clock,
        watchdog_s: float,
        await_rest: Callable[[float, float], bool],
        lets_go: Callable[[], bool],
    ) -> None:
        self._link, self._clock, self._watchdog_s = link, clock, watchdog_s
        self._await_rest, self._lets_go = await_rest, lets_go

    def carry_out(self) -> StopOutcome:
        """Stop the shaft and return its state, within 1 s."""
        clock = self._clock
        since_s, ends_s = clock.reference_s(), clock.now_s() + MAX_STOP_S
        acknowledged = threading.Event()
        answer, refused = "the servo did not acknowledge the stop", False

        def send_stop(bus: Bus) -> None:
            nonlocal answer, refused
            try:
                if not _has_tripped(bus):
                    brake(bus)
                answer = "the servo has taken the stop"
                acknowledged.set()
            except BusError as error:
                if isinstance(error, InstructionDenied):
                    answer, refused = f"the servo refused the stop ({error})", True
                with suppress(BusError):
                    bus.write_unheard(WATCHDOG, 1)
                self._link.keep_quiet(2 * self._watchdog_s)

        self._link.stop(send_stop)
        if not clock.wait(acknowledged, MAX_ACKNOWLEDGE_S):
            self._link.keep_quiet(2 * self._watchdog_s)
        stands = self._await_rest(since_s, ends_s - clock.now_s())
        refusal = f" ({answer})" if refused else ""
        if stands and self._lets_go():
            remedy = "Hold the board: nothing else may"
            return StopOutcome(True, f"the shaft is at rest, but its motor is off{refusal}", remedy)
        if stands:
            return StopOutcome(True, f"the shaft is at rest, and the servo holds it{refusal}")
        return StopOutcome(
            False,
            f"{answer}, and no state shows that the shaft is at rest",
            f"Look at the shaft: its watchdog stops it {self._watchdog_s:.1f} s after the last instruction, but {SURE}",
        )


def _has_tripped(bus: Bus) -> bool:
    """Return whether the watchdog has stopped the servo, which then refuses goals."""
    return bus.read(WATCHDOG) == (WATCHDOG_TRIPPED,)
