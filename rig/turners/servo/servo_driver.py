"""The driver of a servo: supervised moves and rests, a stream of states, and a stop at any time."""

import threading
from collections import deque
from collections.abc import Callable, Iterable
from contextlib import suppress
from types import TracebackType
from typing import Self

from firmware_host import computer_load
from rig.errors import Fault, Problem, Refused, RigError, refuse
from rig.motion.carried import FlangeLoad
from rig.motion.steps import Motion
from rig.turners.servo import problems
from rig.turners.servo.driver_clock import HOST, Clock
from rig.turners.servo.first_contact import look_at
from rig.turners.servo.goal_profiles import move_of, move_problems
from rig.turners.servo.instructions import disarm, go, make_ready
from rig.turners.servo.packet_handler import Bus, BusError, InstructionDenied
from rig.turners.servo.servo_link import Job, ServoLink
from rig.turners.servo.servo_models import PULSE_RAD
from rig.turners.servo.servo_preflight import servo_problems
from rig.turners.servo.servo_registers import WATCHDOG, WATCHDOG_MAX, WATCHDOG_S, WATCHDOG_TRIPPED
from rig.turners.servo.servo_state import ServoReport, ServoState, stands
from rig.turners.servo.stopping import SURE, ShaftStop
from rig.turners.stop_once import StopOnce, StopOutcome, stop_and_note, stopping_on_error
from rig.turners.turner import watch_nothing

WATCH_PERIOD_S = 0.02  # the caller's watch is called at least this often
ARRIVAL_TOLERANCE_RAD = 15 * PULSE_RAD  # 1.3°: the position error at rest of a servo without an integral gain
MAX_DURATION_RATIO, SETTLING_TIME_S = 1.1, 1.0  # to the planned duration, and in addition ("t4" of the manual)
MAX_FIRST_STATE_S = 5.0
MAX_REST_PROOF_S = 3.0  # time within which states must show rest before control is taken
MAX_UNWATCHED_S = 2.0  # without supervision, after which a move is stopped
MAX_LOOP_S = 1.0  # the link's thread repeats its loop at least this often
BUFFERED_S = 1.0  # of states that distinguish rest from motion
NOT_CONTROLLED = StopOutcome(True, "the rig has not moved the servo")
NOT_ENDED = StopOutcome(False, "the stop has not ended", f"Look at the shaft: {SURE}")


class Servo:
    """The servo `servo_id` at `port`, a context manager that receives states and leaves the shaft at rest.

    `model` is the configured one (`servo_models`). `on_state` gets every state in order, from a thread of this class,
    and must not wait, because a servo without traffic for `watchdog_s` stops. A failure of the servo or its line first
    stops the shaft; then every method raises a Fault that names the failure, or Refused if nothing has moved.
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
        """Prepare the driver; `start` opens the port.

        `baud`: the speed of the servo's line. `rate_hz`: the number of states a second. `watchdog_s`: the time without
        an instruction after which the servo stops by itself.
        """
        self._port, self._wanted_model, self._on_state, self._clock = port, model, on_state, clock
        self._id, self._baud, self._period_s = servo_id, baud, 1 / rate_hz
        self._watchdog = max(1, min(WATCHDOG_MAX, round(watchdog_s / WATCHDOG_S)))
        self._changed = threading.Condition()  # notified when anything below changes
        self._states: deque[ServoState] = deque(maxlen=round(BUFFERED_S * rate_hz))
        self._problem: Problem | None = None
        self._doing = "the preparation"
        self._holds = False  # this driver may have switched torque on, so it has to stop the shaft
        self._moving = False
        self._looked_s = 0.0  # time of the last supervision by `move`
        self.missed_states = 0  # polls without a state
        self._bus: Bus
        self._link: ServoLink | None = None
        self._stopper: StopOnce
        self._report: ServoReport

    # Looking ----------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Open the port, read the servo's report, and start to receive states; nothing moves.

        Raise Refused as `Bus` and `look_at` do, and `servo_silent` if no state comes.
        """
        self._bus = Bus(self._port, self._baud, self._id, self._clock)
        try:
            self._report = look_at(self._bus, self._port, self._id)
        except BaseException:
            self._bus.close()
            raise
        self._link = ServoLink(self._bus, self._report.servo, self._period_s, self._take_state, self._fail)
        stop = ShaftStop(self._link, self._clock, self._watchdog * WATCHDOG_S, self._await_rest, self._lets_go)
        self._stopper = StopOnce("servo stop", stop.carry_out, NOT_ENDED)
        self._link.start()
        ends_s = self._clock.now_s() + MAX_FIRST_STATE_S
        self._wait(lambda: bool(self._states) or self._clock.now_s() > ends_s)
        if not self._states:
            raise Refused(
                "servo_silent",
                f"no state arrives from the servo at {self._port}",
                "Look at its cable, then start again",
            )

    @property
    def latest(self) -> ServoState:
        """The newest state."""
        if not self._states:
            raise RuntimeError("start() comes first")
        return self._states[-1]

    def report(self) -> ServoReport:
        """Return the servo's report, read when the port was opened, for the pre-flight check."""
        self.check()
        return self._report

    def problems(self, carried: FlangeLoad, motions: Iterable[Motion] = ()) -> list[Problem]:
        """Return all problems of the servo, the payload and the motions."""
        return [
            *servo_problems(self._report, self._wanted_model, carried, self._period_s),
            *move_problems(motions, self._report.velocity_limit_rad_s),
        ]

    def check(self) -> None:
        """Raise the first problem or, after a requested stop, `servo_stopped`; return if there is neither.

        A shaft under control is stopped before the error is raised.
        """
        if self._link is not None and (problem := self._thread_problem(self._link)) is not None:
            self._fail(problem)
        if self._problem is None and not (self._link is not None and self._stopper.begun):
            return
        problem = self._problem or Problem(
            "servo_stopped", "the servo was stopped on request", "Start again when ready"
        )
        if not self._holds:
            raise Refused.from_problem(problem)
        outcome = self.stop()
        remedy = f"{outcome.remedy}. {problem.remedy}" if outcome.remedy else problem.remedy
        raise Fault.from_problem(problem._replace(what=f"{problem.what}; {outcome.what}", remedy=remedy))

    # Moving -----------------------------------------------------------------------------------------------------

    def take_control(self, carried: FlangeLoad) -> None:
        """Hold the shaft in place and arm the watchdog. Raise Refused for one of the `problems`, or `servo_moves`."""
        self.check()
        refuse(self.problems(carried))
        ends_s = self._clock.now_s() + MAX_REST_PROOF_S
        self._wait(lambda: stands(list(self._states)) or self._clock.now_s() > ends_s)
        if not stands(list(self._states)):
            raise Refused("servo_moves", "the servo's shaft is moving", "Hold the board still, then start again")
        with stopping_on_error(self.stop):
            self._holds = True
            self._call(lambda bus: make_ready(bus, self._watchdog))
            self._linked.supervising = True

    def move(self, motion: Motion, watch: Callable[[], None] = watch_nothing) -> None:
        """Make one movement and return when the shaft has arrived and is at rest.

        `watch` is called first and then at least every 20 ms; its exception stops the shaft and is passed to the
        caller. The servo executes `move_of(motion)`.
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
                takes_s = 1e-3 * move.total_ms * MAX_DURATION_RATIO + SETTLING_TIME_S
                began_s = self.latest.time_s
                goal_rad = move.goal * PULSE_RAD

                def is_at_goal() -> bool:
                    recent = [state for state in list(self._states) if state.time_s > began_s]
                    return stands(recent) and abs(recent[-1].q_rad[0] - goal_rad) < ARRIVAL_TOLERANCE_RAD

                self._wait(lambda: is_at_goal() or self.latest.time_s > began_s + takes_s, watch)
                if not is_at_goal():
                    self._fail(problems.slower_than_planned(motion, takes_s))
                self.check()
            finally:
                self._moving = False

    def rest(self, duration_s: float, watch: Callable[[], None] = watch_nothing) -> None:
        """Stand still for `duration_s` of the states' clock; `watch` is called as in `move`."""
        with stopping_on_error(self.stop):
            self._doing = "a rest"
            end_s = self.latest.time_s + duration_s
            self._wait(lambda: self.latest.time_s >= end_s, watch)

    def stop(self) -> StopOutcome:
        """Stop the shaft and return its state; takes less than 1 s.

        Callable at any time, repeatedly, from any thread. A Ctrl-C during the stop is raised after it. Afterwards this
        object no longer moves the shaft.
        """
        return self._stopper.outcome() if self._holds else NOT_CONTROLLED

    def close(self) -> None:
        """Stop the shaft if it is under control, and close the port; torque remains on."""
        if self._link is None:
            return
        try:
            outcome = self.stop()
            if self._holds and outcome.at_rest and self._link.alive:
                with suppress(BusError):  # otherwise the watchdog trips, which does no harm to a shaft at rest
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
        is_reported = self._problem is not None and isinstance(error, RigError)  # reported with the outcome of the stop
        if error is not None and not is_reported:
            stop_and_note(error, self.stop)
        self.close()

    # Inside -----------------------------------------------------------------------------------------------------

    @property
    def _linked(self) -> ServoLink:
        if self._link is None:
            raise RuntimeError("start() comes first")
        return self._link

    def _call(self, job: Job) -> None:
        """Send an instruction. Record an error as a problem of the servo, and raise as `check` does."""
        try:
            self._linked.call(job)
        except Refused as error:
            self._fail(error.problem)
        except InstructionDenied as error:
            self._fail(self._why_denied(error))
        except BusError as error:
            self._fail(problems.does_not_hear(error))
        self.check()

    def _why_denied(self, error: InstructionDenied) -> Problem:
        """Return why the servo refused an instruction: usually because the watchdog had stopped the shaft."""
        with suppress(BusError):
            if self._linked.call(lambda bus: bus.look_up(WATCHDOG), also_stopped=True) == (WATCHDOG_TRIPPED,):
                return problems.watchdog_tripped()
        return problems.refuses(error)

    def _wait(self, done: Callable[[], bool], watch: Callable[[], None] = watch_nothing) -> None:
        """Block until `done` is true; until then check the servo's faults and call the caller's `watch`."""
        finished = False
        while not finished:
            with self._changed:
                self._clock.wait_for(self._changed, lambda: self._problem is not None or done(), WATCH_PERIOD_S)
                finished = done()
            self._looked_s = self._clock.now_s()
            self.check()
            watch()

    def _thread_problem(self, link: ServoLink) -> Problem | None:
        """Return the problem `driver_hung` if the link's thread hangs, otherwise None."""
        silent_s = self._clock.now_s() - link.turned_s
        if not link.alive or not computer_load.exceeds(silent_s, MAX_LOOP_S):
            return None
        return problems.driver_hung(silent_s)

    def _take_state(self, state: ServoState) -> None:
        """Record a received state, on the link's thread."""
        if self._states:
            self.missed_states += max(0, round((state.time_s - self.latest.time_s) / self._period_s) - 1)
        self._states.append(state)
        try:
            self._on_state(state)
        except RigError as error:
            self._fail(error.problem)
        except Exception as error:
            self._fail(problems.state_not_taken(error))
        if self._moving and computer_load.exceeds(self._clock.now_s() - self._looked_s, MAX_UNWATCHED_S):
            self._fail(problems.move_unsupervised(MAX_UNWATCHED_S, self._doing))
        with self._changed:
            self._changed.notify_all()

    def _fail(self, problem: Problem) -> None:
        """Record the first problem and stop the shaft; ignore problems after a requested stop."""
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
        """Return whether the motor is off, because the servo shut down or another program switched off its torque."""
        return self._linked.torque_off or bool(self.latest.hardware_error & self._report.shutdown)

    def _await_rest(self, since_s: float, timeout_s: float) -> bool:
        def is_at_rest() -> bool:
            return stands([state for state in list(self._states) if state.time_s > since_s])

        with self._changed:
            self._clock.wait_for(self._changed, is_at_rest, timeout_s)
            return is_at_rest()
