"""The servo as the procedure sees it: supervised moves and rests, a stream of states, and a stop that always works."""

import threading
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from types import TracebackType
from typing import Self

from rig.data.processes import silence
from rig.errors import Fault, Problem, Refused, RigError, refuse
from rig.motion.carried import Carried
from rig.motion.steps import Motion
from rig.turners.servo import problems
from rig.turners.servo.bus import Bus, BusError, Denied
from rig.turners.servo.clock import HOST, Clock
from rig.turners.servo.instructions import disarm, go, make_ready
from rig.turners.servo.link import Job, Link
from rig.turners.servo.looking import look_at
from rig.turners.servo.models import PULSE_RAD
from rig.turners.servo.moves import move_of, move_problems
from rig.turners.servo.preflight import servo_problems
from rig.turners.servo.registers import TRIPPED, WATCHDOG, WATCHDOG_MOST, WATCHDOG_S
from rig.turners.servo.state import ServoReport, ServoState, stands
from rig.turners.servo.stopping import SURE, Stop
from rig.turners.stop_once import StopOnce, StopOutcome, stopping_on_error, tell_of_stop

WATCH_S = 0.02  # the caller's watch is called at least this often
ARRIVAL_RAD = 15 * PULSE_RAD  # 1.3°: where a servo without an integral gain comes to rest beside its goal
SLOWNESS, SLOWNESS_S = 1.1, 1.0  # a move may take so much longer than planned: "t4" of the manual, and standing still
FIRST_STATE_S = 5.0
STANDING_S = 3.0  # it must have been seen at rest within this, before it is taken under control
UNWATCHED_S = 2.0  # a move that nobody looks at for so long is stopped
HUNG_S = 1.0  # the thread that has the line comes round at least this often
KEPT_S = 1.0  # of states, to tell rest from motion
NOT_HELD = StopOutcome(True, "the servo was not under control")
NOT_ENDED = StopOutcome(False, "the stop has not ended", f"Look at the shaft: {SURE}")


def _nothing() -> None:
    """Watch nothing but the servo."""


class Servo:
    """The servo `servo_id` at `port`; a context manager that starts receiving on entry and leaves the shaft standing.

    `model` is the one that is meant (`rig.turners.servo.models`). `on_state` gets every state in order, from a thread
    of this class, and must not wait: a servo that nobody speaks to for `watchdog_s` stops. All methods raise `Fault` by
    name when the servo or its line fails: the shaft is then stopped already. `Refused` means that nothing has moved.
    """

    def __init__(
        self,
        port: str,
        model: str,
        on_state: Callable[[ServoState], None] = lambda state: None,
        *,
        servo_id: int = 1,
        baud: int = 1_000_000,
        rate_hz: float = 125.0,
        watchdog_s: float = 0.3,
        clock: Clock = HOST,
    ) -> None:
        self._port, self._wanted_model, self._on_state, self._clock = port, model, on_state, clock
        self._id, self._baud, self._period_s = servo_id, baud, 1 / rate_hz
        self._watchdog = max(1, min(WATCHDOG_MOST, round(watchdog_s / WATCHDOG_S)))
        self._changed = threading.Condition()  # notified when anything below changes
        self._states: deque[ServoState] = deque(maxlen=round(KEPT_S * rate_hz))
        self._problem: Problem | None = None
        self._doing = "the preparation"
        self._holds = False  # torque may be on by our doing, so a stop is ours to make
        self._moving = False
        self._looked_s = 0.0  # when `move` last looked at the states
        self.missed_states = 0  # polls without a state
        self._bus: Bus
        self._link: Link | None = None
        self._stopper: StopOnce
        self._report: ServoReport

    # Looking ----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Open the port, look, and receive; moves nothing. Raises `Refused` when no servo answers."""
        self._bus = Bus(self._port, self._baud, self._id, self._clock)
        try:
            self._report = look_at(self._bus, self._port, self._id)
        except BaseException:
            self._bus.close()
            raise
        self._link = Link(self._bus, self._report.servo, self._period_s, self._take_state, self._fail)
        stop = Stop(self._link, self._clock, self._watchdog * WATCHDOG_S, self._seen_at_rest, self._lets_go)
        self._stopper = StopOnce("servo stop", stop.carry_out, NOT_ENDED)
        self._link.start()
        ends_s = self._clock.now_s() + FIRST_STATE_S
        self._wait(lambda: bool(self._states) or self._clock.now_s() > ends_s)
        if not self._states:
            raise Refused(
                "servo_silent", f"no state comes from the servo at {self._port}", "Look at its cable, then start again"
            )

    @property
    def latest(self) -> ServoState:
        """The newest state."""
        if not self._states:
            raise RuntimeError("start() comes first")
        return self._states[-1]

    def report(self) -> ServoReport:
        """What the servo says about itself, for pre-flight, as it was when the port was opened."""
        self.check()
        return self._report

    def problems(self, carried: Carried, motions: Iterable[Motion] = ()) -> list[Problem]:
        """Everything that stands in the way of carrying this, and of moving so."""
        return [
            *servo_problems(self._report, self._wanted_model, carried, self._period_s),
            *move_problems(motions, self._report.velocity_limit_rad_s),
        ]

    def check(self) -> None:
        """Raise what a supervising thread has met. The shaft is stopped by then, if it was ours to stop."""
        if self._link is not None and (problem := self._thread_problem(self._link)) is not None:
            self._fail(problem)
        if self._problem is None and not (self._link is not None and self._stopper.begun):
            return
        problem = self._problem or Problem(
            "servo_stopped", "the servo was stopped on request", "Start again when ready"
        )
        if not self._holds:
            raise Refused.of(problem)
        outcome = self.stop()
        remedy = f"{outcome.remedy}. {problem.remedy}" if outcome.remedy else problem.remedy
        raise Fault.of(problem._replace(what=f"{problem.what}; {outcome.what}", remedy=remedy))

    # Moving -----------------------------------------------------------------------------------------------------

    def take_control(self, carried: Carried) -> None:
        """Have the shaft held where it is, with the watchdog armed. Raises `Refused` by name."""
        self.check()
        refuse(self.problems(carried))
        ends_s = self._clock.now_s() + STANDING_S
        self._wait(lambda: stands(list(self._states)) or self._clock.now_s() > ends_s)
        if not stands(list(self._states)):
            raise Refused("servo_moves", "the servo's shaft is moving", "Hold the board still, then start again")
        with stopping_on_error(self.stop):
            self._holds = True
            self._call(lambda bus: make_ready(bus, self._watchdog))
            self._linked.supervising = True

    def move(self, motion: Motion, watch: Callable[[], None] = _nothing) -> None:
        """Make one movement and return when the shaft has arrived and stands still.

        `watch` is called before and then at least every 20 ms; what it raises stops the shaft and goes on to the
        caller. What the servo is really asked for is `moves.move_of(motion)`.
        """
        with stopping_on_error(self.stop):
            watch()
            self.check()
            self._doing = motion.name
            if wrong := move_problems([motion], self._report.velocity_limit_rad_s):
                self._fail(wrong[0])
                self.check()
            move = move_of(motion)
            self._looked_s, self._moving = self._clock.now_s(), True
            try:
                self._call(lambda bus: go(bus, move))
                takes_s = 1e-3 * move.total_ms * SLOWNESS + SLOWNESS_S
                began_s = self.latest.time_s
                goal_rad = move.goal * PULSE_RAD

                def arrived() -> bool:
                    recent = [state for state in list(self._states) if state.time_s > began_s]
                    return stands(recent) and abs(recent[-1].q_rad[0] - goal_rad) < ARRIVAL_RAD

                self._wait(lambda: arrived() or self.latest.time_s > began_s + takes_s, watch)
                if not arrived():
                    self._fail(problems.slower_than_planned(motion, takes_s))
                self.check()
            finally:
                self._moving = False

    def rest(self, duration_s: float, watch: Callable[[], None] = _nothing) -> None:
        """Stand still for a time of the states' clock; `watch` as in `move`."""
        with stopping_on_error(self.stop):
            self._doing = "a rest"
            end_s = self.latest.time_s + duration_s
            self._wait(lambda: self.latest.time_s >= end_s, watch)

    def stop(self) -> StopOutcome:
        """Stop the shaft and tell what is known about it; takes less than 1 s.

        May be called at any time, again and again, from any thread; a second Ctrl-C does not undo it and is raised when
        it has ended. Afterwards this object moves the shaft no more.
        """
        return self._stopper.outcome() if self._holds else NOT_HELD

    def close(self) -> None:
        """Stop the shaft if it was under control, and give the port back; torque stays on."""
        if self._link is None:
            return
        try:
            outcome = self.stop()
            if self._holds and outcome.at_rest and self._link.alive:
                with suppress(BusError):  # else the watchdog trips, which does no harm to a shaft that stands
                    self._link.supervising = False
                    self._link.call(disarm, also_stopped=True)
        finally:
            self._link.close()
            self._bus.close()

    def __enter__(self) -> Self:
        try:
            self.start()
        except BaseException:
            self.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        told = self._problem is not None and isinstance(error, RigError)  # the servo's own problems tell of the stop
        if error is not None and not told:
            tell_of_stop(error, self.stop)
        self.close()

    # Inside -----------------------------------------------------------------------------------------------------

    @property
    def _linked(self) -> Link:
        if self._link is None:
            raise RuntimeError("start() comes first")
        return self._link

    def _call(self, job: Job) -> None:
        """Have the servo told something; what goes wrong with it is a problem of the servo's."""
        try:
            self._linked.call(job)
        except Refused as error:
            self._fail(error.problem)
        except Denied as error:
            self._fail(self._why_denied(error))
        except BusError as error:
            self._fail(problems.does_not_hear(error))
        self.check()

    def _why_denied(self, error: Denied) -> Problem:
        """The reason of a no: mostly that the watchdog has stopped the servo."""
        with suppress(BusError):
            if self._linked.call(lambda bus: bus.look_up(WATCHDOG), also_stopped=True) == (TRIPPED,):
                return problems.tripped()
        return problems.refuses(error)

    def _wait(self, done: Callable[[], bool], watch: Callable[[], None] = _nothing) -> None:
        """Block until `done`, looking at the servo's faults and the caller's watch all the time."""
        finished = False
        while not finished:
            with self._changed:
                self._clock.wait_for(self._changed, lambda: self._problem is not None or done(), WATCH_S)
                finished = done()
            self._looked_s = self._clock.now_s()
            self.check()
            watch()

    def _thread_problem(self, link: Link) -> Problem | None:
        """What keeps the thread that has the line from coming round."""
        silent_s = self._clock.now_s() - link.turned_s
        if not link.alive or silent_s < HUNG_S * silence.crowding():
            return None
        return problems.driver_hung(silent_s)

    def _take_state(self, state: ServoState) -> None:
        """Take a state as it comes, on the link's thread."""
        if self._states:
            self.missed_states += max(0, round((state.time_s - self.latest.time_s) / self._period_s) - 1)
        self._states.append(state)
        try:
            self._on_state(state)
        except RigError as error:
            self._fail(error.problem)
        except Exception as error:
            self._fail(problems.state_not_taken(error))
        if self._moving and self._clock.now_s() - self._looked_s > UNWATCHED_S * silence.crowding():
            self._fail(problems.unwatched(UNWATCHED_S, self._doing))
        with self._changed:
            self._changed.notify_all()

    def _fail(self, problem: Problem) -> None:
        """Keep the first problem and stop the shaft; nothing is a problem after a stop on request."""
        with self._changed:
            if self._problem is not None or (self._link is not None and self._stopper.begun):
                return
            if self._holds:
                problem = problem._replace(what=f"{problem.what} during {self._doing}")
            self._problem = problem
            self._changed.notify_all()
        if self._holds:
            self._stopper.begin()

    def _lets_go(self) -> bool:
        """Whether the servo's motor is off: by a shutdown, or because somebody has switched torque off."""
        return self._linked.torque_off or bool(self.latest.hardware_error & self._report.shutdown)

    def _seen_at_rest(self, since_s: float, timeout_s: float) -> bool:
        def at_rest() -> bool:
            return stands([state for state in list(self._states) if state.time_s > since_s])

        with self._changed:
            self._clock.wait_for(self._changed, at_rest, timeout_s)
            return at_rest()
