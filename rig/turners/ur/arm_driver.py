"""The driver of an arm: supervised moves and rests, a stream of states, and a stop at any time."""

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from rig.errors import Fault, Problem, Refused, RigError
from rig.motion.carried import FlangeLoad
from rig.motion.steps import Motion, travel
from rig.motion.turner_state import ArmState, RuntimeState
from rig.turners.stop_once import StopOnce, StopOutcome, stop_and_note, stopping_on_error
from rig.turners.turner import watch_nothing
from rig.turners.ur.arm_report import ArmReport
from rig.turners.ur.child.child_link import ChildLink
from rig.turners.ur.child.client_problems import link_lost
from rig.turners.ur.child_messages import (
    Braked,
    ChildHeartbeat,
    Connected,
    ControlTaken,
    Disturbed,
    Message,
    MoveFinished,
    MoveRequest,
    RequestFailed,
    ScriptStarted,
    TakeControl,
)
from rig.turners.ur.condition import SIMULATOR_HOSTS, local_control, payload_refused, readiness
from rig.turners.ur.control_watch import ControlWatch
from rig.turners.ur.controller.robot_api import PORT as ROBOT_API_PORT
from rig.turners.ur.controller.robot_api import RobotApi
from rig.turners.ur.controller_answers import OPEN_PORT_TIMEOUT_S, read_report, reports_local_control, stop_problem
from rig.turners.ur.identity import is_polyscope_x
from rig.turners.ur.stopping.stop import ArmStop, StopOrder
from rig.turners.ur.stopping.stop_paths import StopPath, stop_paths
from rig.turners.ur.stopping.stop_trial import stop_trial
from rig.turners.ur.supervision import ControlStage, Supervision, describe_early_end

WATCH_PERIOD_S = 0.02  # the caller's watch is called at least this often
ARRIVAL_TOLERANCE_RAD = 0.01  # the joint servo's ripple and lag stay below this
START_S = 5.0  # a move begins within this wall time, or not at all
LAST_STOP_S = 0.8  # time for one more stop order if no state has confirmed the stop
MAX_DURATION_RATIO = 1.1  # of a move to its planned duration
SETTLING_TIME_S = 1.0  # additional time of a move, on the controller's clock
MAX_REPORT_S = 5.0  # wall time to report a move, once the arm has reached its target
MAX_SILENCE_S = 0.8  # after a longer silence the controller may have lost the client
MAX_SETTLING_S = 2.0  # after this wall time an arm that was not at rest for a moment moves
MAX_REASON_WAIT_S = 0.2  # a failure waits this long (wall time) for its explanation
OUR_PROGRAM = "rtde_control"  # the client's name for it
START_REFUSALS = ("not_in_remote_control", "registers_in_use")  # for which the client could not start a program
NOT_CONTROLLED = StopOutcome(True, "the rig has not moved the arm")
NOT_ENDED = StopOutcome(False, "the stop has not ended", "Look at the arm")


class Arm:
    """The arm at `host`, a context manager that receives states and leaves the arm stopped.

    `on_state` gets every state in order, from a thread of this class. `state_rate_hz` is in the controller's time.
    `client_log` takes the output of the `ur_rtde` client; `robot_api_port` is for a PolyScope X. A failure of the arm
    or its driver first stops the arm; then every method raises a Fault that names the failure, or Refused if nothing
    has moved.
    """

    def __init__(
        self,
        host: str,
        on_state: Callable[[ArmState], None] = lambda state: None,
        state_rate_hz: float = 125.0,
        client_log: Path | None = None,
        *,
        robot_api_port: int = ROBOT_API_PORT,
    ) -> None:
        """Prepare the child process, the stop and the supervision; `start` connects."""
        self._host = host
        self._robot_api_port = robot_api_port
        self._on_state = on_state
        self._period_s = 1 / state_rate_hz
        self._link = ChildLink(
            host, state_rate_hz, self._take, self._fail, robot_api_port=robot_api_port, log=client_log
        )
        self._arm_stop = ArmStop(self._paths, self._link.send, lambda: self._braked, self._await_rest)
        self._stopper = StopOnce("arm stop", self._arm_stop.carry_out, NOT_ENDED)
        self._changed = threading.Condition()  # notified when anything below changes
        self._latest: ArmState | None = None
        self._connected: Connected | None = None
        self._answer: Message | None = None
        self._braked: Braked | None = None
        self._carried = FlangeLoad(0.0)
        self._sets_payload = False  # our program runs, and sets the payload
        self._problem: Problem | None = None
        self._doing = "the preparation"
        self._holds_arm = False  # a program of ours may run, so this driver has to stop the arm
        self._forwards_states = True  # whether states are passed to `on_state`; not after an impossible one
        self._supervision = Supervision()
        self._watch: ControlWatch | None = None
        self._silent_s = 0.0  # the controller's longest silence since the last move ended
        self.missed_states = 0  # gaps in the stream, counted in states

    # Looking ------------------------------------------------------------------------------------------------------

    def start(self) -> None:
        """Connect and start to receive states; nothing moves and no program is stopped.

        Raise Refused for the problems of `connection_failure` and `stop_problem`.
        """
        with self._link.patience():
            self._link.start()
            self._wait(lambda: self._latest is not None or self._answer is not None)
        if isinstance(self._answer, RequestFailed):
            raise Refused.from_problem(self._answer.problem)
        if problem := stop_problem(self._host, self._controller.version):
            raise Refused.from_problem(problem)

    @property
    def latest(self) -> ArmState:
        """The newest state."""
        if self._latest is None:
            raise RuntimeError("start() comes first")
        return self._latest

    def report(self) -> ArmReport:
        """Return what the controller reports about its arm, for the pre-flight check.

        An arm that settles or vibrates seems to move at moments. So wait up to `MAX_SETTLING_S` for a state at rest.
        """
        self.check()
        with self._changed:
            self._changed.wait_for(lambda: self.latest.at_rest or self._link.ended, MAX_SETTLING_S)
        return read_report(self._host, self._controller, self.latest, self._robot_api_port)

    def check(self) -> None:
        """Raise the problem that a supervising thread found, after an arm under control was stopped."""
        if self._problem is None and not self._stopper.begun:
            return
        problem = self._problem or Problem("arm_stopped", "the arm was stopped on request", "Start again when ready")
        if not self._holds_arm:
            raise Refused.from_problem(problem)
        outcome = self.stop()
        problem = self._explain(problem)
        remedy = f"{outcome.remedy}. {problem.remedy}" if outcome.remedy else problem.remedy
        # Before control is taken nothing has moved.
        kind = Fault if self._supervision.stage is ControlStage.CONTROLLED else Refused
        raise kind.from_problem(problem._replace(what=f"{problem.what}; {outcome.what}", remedy=remedy))

    # Moving -------------------------------------------------------------------------------------------------------

    def take_control(self, carried: FlangeLoad) -> None:
        """Upload the control script and set the payload.

        Raise Refused for the problems of `readiness` and `local_control`, and `program_running`, because the client
        would end that program.
        """
        self.check()
        problem = readiness(self.latest)
        if problem is None and self.latest.runtime_state != RuntimeState.STOPPED:
            problem = Problem("program_running", f"a program runs on the arm at {self._host}", "Stop it on the pendant")
        if problem is None and reports_local_control(self._host, self._controller.version):
            problem = local_control(self._host)
        if problem is not None:
            raise Refused.from_problem(problem)
        self._arm_stop.descriptors.keep()
        with stopping_on_error(self.stop):
            self._holds_arm = True
            with self._link.patience():
                if is_polyscope_x(self._controller.version):
                    self._prove_the_stop()
                self._watch_control()
                self._supervision.stage, self._carried = ControlStage.PREPARING, carried
                self._request(TakeControl(carried))
                self._await(ScriptStarted)
            self._await(ControlTaken)
            self._wait(lambda: self.latest.runtime_state == RuntimeState.PLAYING)
            self._supervision.stage = ControlStage.CONTROLLED
        self._silent_s = 0.0  # before this there was no client to lose

    def move(self, motion: Motion, watch: Callable[[], None] = watch_nothing) -> None:
        """Make one movement and return when the arm has arrived and is at rest.

        `watch` is called first and then at least every 20 ms; its exception stops the arm and is passed to the caller.
        """
        with stopping_on_error(self.stop):
            watch()
            self._doing = motion.name
            self._supervision.moving = True
            self._request(MoveRequest(motion.target_q_rad, motion.speed_rad_s, motion.acceleration_rad_s2))
            asked_s = time.monotonic()
            self._wait(lambda: self._answer is not None or time.monotonic() > asked_s + START_S, watch)
            if self._answer is None:
                self._fail(self._unbegun(_not_started(motion)))
            takes_s = motion.duration_s * MAX_DURATION_RATIO + SETTLING_TIME_S
            deadline_s, reported_s = self.latest.time_s + takes_s, time.monotonic() + takes_s + MAX_REPORT_S

            def is_late() -> bool:
                """Return whether the move takes too long on the controller's clock, allowing time for the report."""
                has_arrived = self._stands_at(motion) and time.monotonic() < reported_s
                return self.latest.time_s > deadline_s and not has_arrived

            self._wait(lambda: self._has_ended(motion) or is_late(), watch)
            if isinstance(self._answer, RequestFailed):
                self._wait_for_reason()
                self._fail(self._unbegun(self._answer.problem))
            elif not self._has_ended(motion):
                self._fail(
                    Problem(
                        "arm_slower_than_planned",
                        f"{motion.name} did not end within {takes_s:.1f} s; planned were {motion.duration_s:.1f} s",
                        "Look for a speed limit in the safety settings or a program that slows the arm down",
                    )
                )
            self.check()
            self._supervision.moving = False
            self._silent_s = 0.0

    def rest(self, duration_s: float, watch: Callable[[], None] = watch_nothing) -> None:
        """Stand still for `duration_s` of the controller's clock; `watch` is called as in `move`."""
        with stopping_on_error(self.stop):
            self._doing = "a rest"
            end_s = self.latest.time_s + duration_s
            self._wait(lambda: self.latest.time_s >= end_s, watch)

    def stop(self) -> StopOutcome:
        """Stop the arm and return its state; takes less than 1 s.

        Callable at any time, repeatedly, from any thread. A Ctrl-C during the stop is raised after it. Afterwards the
        control script has ended, and this object no longer moves the arm.
        """
        if not self._holds_arm:
            return NOT_CONTROLLED
        return self._stopper.outcome()

    def close(self) -> None:
        """Stop the arm if it is under control, and end the child process."""
        self._close()

    def _close(self) -> str | None:
        """Carry out `close`, and return a warning if a client's program may still run on the controller, else None."""
        try:
            outcome = self.stop()
        finally:
            if self._watch is not None:
                self._watch.close()
            self._link.close()
            self._arm_stop.descriptors.release()
        if not self._holds_arm or (self._problem is None and outcome.at_rest):
            return None
        # A client that lost the arm and reconnected may have restarted its program after that stop.
        order = StopOrder(self._paths(), LAST_STOP_S)
        if order.await_program_end():
            return None
        return f"the last stop is not confirmed either: {order.words}. Look at the arm: its program may still run"

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
        warning = self._close()
        if error is not None and warning is not None:
            error.add_note(warning)

    # Inside -------------------------------------------------------------------------------------------------------

    @property
    def _controller(self) -> Connected:
        if self._connected is None:
            raise RuntimeError("start() comes first")
        return self._connected

    def _paths(self) -> Sequence[StopPath]:
        return stop_paths(self._host, self._controller.version, self._robot_api_port)

    def _watch_control(self) -> None:
        if self._host not in SIMULATOR_HOSTS:
            version, newest_s = self._controller.version, lambda: self.latest.host_time_s
            self._watch = ControlWatch(self._host, version, self._robot_api_port, newest_s, self._fail_meanwhile)
            self._watch.start()

    def _prove_the_stop(self) -> None:
        """Test the stop. Raise Refused as `stop_trial` explains if the arm cannot be stopped without the client."""
        problem = stop_trial(self._host, RobotApi(self._host, self._robot_api_port, OPEN_PORT_TIMEOUT_S), self._shows)
        if problem is not None:
            self._holds_arm = False
            raise Refused.from_problem(readiness(self.latest) or problem)

    def _shows(self, runtime_state: RuntimeState, timeout_s: float) -> bool:
        """Return whether the arm's states report the given state of its program within `timeout_s`."""
        with self._changed:
            return self._changed.wait_for(lambda: self.latest.runtime_state == runtime_state, timeout_s)

    def _await(self, kind: type[ScriptStarted] | type[ControlTaken]) -> None:
        """Wait for the next step of the preparation, or raise the problem that prevented it."""
        self._wait(lambda: isinstance(self._answer, kind | RequestFailed | ControlTaken))
        if not isinstance(self._answer, RequestFailed):
            return
        problem = self._answer.problem
        if problem.name in START_REFUSALS:
            self._holds_arm = False
            raise Refused.from_problem(problem)
        if problem.name == "control_not_taken" and self._watch and OUR_PROGRAM in self._watch.stopped_programs:
            problem = describe_early_end(problem)  # too soon for a state to show it running
        self._fail(self._supervision.interruption or problem)
        self.check()

    def _explain(self, problem: Problem) -> Problem:
        """Return the problem of an ended program, with the controller's reason, if known, such as a refused payload."""
        watch = self._watch
        if watch is None or problem.name != "program_stopped":
            return problem
        with self._changed:
            self._changed.wait_for(lambda: watch.exception is not None, MAX_REASON_WAIT_S)
        if watch.exception is None:
            return problem
        if self._sets_payload and self._supervision.stage is ControlStage.PREPARING:
            problem = payload_refused(self._carried)
        return problem._replace(what=f'{problem.what}; the controller says: "{watch.exception}"')

    def _request(self, request: TakeControl | MoveRequest) -> None:
        self.check()
        self._answer = None
        self._link.send(request)

    def _wait(self, done: Callable[[], bool], watch: Callable[[], None] = watch_nothing) -> None:
        """Block until `done` is true; until then check the arm's faults and call the caller's `watch`."""
        finished = False
        while not finished:
            with self._changed:
                self._changed.wait_for(lambda: self._problem is not None or done(), WATCH_PERIOD_S)
                finished = done()
            self.check()
            watch()

    def _wait_for_reason(self) -> None:
        with self._changed:
            self._changed.wait_for(lambda: self._problem is not None, MAX_REASON_WAIT_S)

    def _unbegun(self, problem: Problem) -> Problem:
        """Return why a move did not begin: `problem`, or `link_lost` if the arm had been silent for too long."""
        if self._silent_s <= MAX_SILENCE_S:
            return problem
        what = f"the arm at {self._host} was silent for {self._silent_s:.1f} s, and {problem.what}"
        return link_lost(what)

    def _has_ended(self, motion: Motion) -> bool:
        if isinstance(self._answer, RequestFailed):
            return True
        return isinstance(self._answer, MoveFinished) and self._stands_at(motion)

    def _stands_at(self, motion: Motion) -> bool:
        """Return whether the arm is at rest at the end of the motion."""
        distance_rad = max(map(abs, travel(self.latest.q_rad, motion.target_q_rad)))
        return self.latest.at_rest and distance_rad < ARRIVAL_TOLERANCE_RAD

    def _take(self, message: Message) -> None:
        """Handle a message of the child, on the link's reader thread."""
        match message:
            case ChildHeartbeat():
                self._silent_s = max(self._silent_s, message.silent_s)
                for state in message.states:
                    self._take_state(state)
            case Connected():
                self._connected = message
            case Braked():
                self._braked = message
            case Disturbed():
                self._fail_meanwhile(message.problem)
                self._forwards_states = False
            case _:
                self._sets_payload = self._sets_payload or isinstance(message, ScriptStarted)
                self._answer = message
        with self._changed:
            self._changed.notify_all()

    def _take_state(self, state: ArmState) -> None:
        """Pass a state on and judge it; count the states that are missing before it."""
        before, self._latest = self._latest, state
        if not self._forwards_states:
            return
        if before is not None:
            self.missed_states += max(0, round((state.time_s - before.time_s) / self._period_s) - 1)
        try:
            self._on_state(state)
        except RigError as error:
            self._fail(error.problem)
        except Exception as error:
            self._fail(Problem("arm_state_not_taken", f"an arm state could not be passed on ({error})", "See the log"))
        if problem := self._supervision.judge(state):
            self._fail_meanwhile(problem)

    def _fail_meanwhile(self, problem: Problem) -> None:
        self._fail(problem._replace(what=f"{problem.what} during {self._doing}"))

    def _fail(self, problem: Problem) -> None:
        """Record the first problem and stop the arm; ignore problems after a requested stop."""
        with self._changed:
            if self._problem is not None or self._stopper.begun:
                return
            self._problem = problem
            self._changed.notify_all()
        if self._holds_arm:
            self._stopper.begin()

    def _await_rest(self, since_s: float, timeout_s: float) -> bool:
        def is_at_rest() -> bool:
            state = self.latest
            return state.host_time_s > since_s and state.at_rest and state.runtime_state == RuntimeState.STOPPED

        with self._changed:
            self._changed.wait_for(lambda: is_at_rest() or self._link.ended, timeout_s)
            return is_at_rest()


def _not_started(motion: Motion) -> Problem:
    return Problem(
        "move_refused", f"{motion.name} was not begun within {START_S:g} s", "Read the pendant's log, then start again"
    )


def look(host: str, robot_api_port: int = ROBOT_API_PORT) -> ArmReport:
    """Return the arm's report; nothing moves and no program is stopped. Raise as `Arm.start` and `read_report` do."""
    with Arm(host, robot_api_port=robot_api_port) as arm:
        return arm.report()
