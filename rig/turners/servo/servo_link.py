"""The thread that owns the servo's line: it polls states, runs jobs between two polls, and detects faults."""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from firmware_host import computer_load
from rig.errors import Problem
from rig.turners.servo import problems
from rig.turners.servo.packet_handler import Bus, BusError, InstructionDenied, PortGone, ReplyLost
from rig.turners.servo.servo_models import TICKS, ServoModel
from rig.turners.servo.servo_preflight import hardware_problem
from rig.turners.servo.servo_registers import HARDWARE_ERROR, STATE, TORQUE, WATCHDOG, WATCHDOG_TRIPPED
from rig.turners.servo.servo_state import ServoState, decode

MAX_LOST_STATES, MAX_SILENCE_S = 5, 0.4  # in a row, and time without a state, that are tolerated
SLOW_POLL_S = 0.1  # of what the state packet lacks: torque and watchdog, alternately
MAX_TRANSACTION_S = 0.05  # a longer one leaves the time of the position unknown
TICK_S, TICK_FRACTION = 0.005, 0.02  # by which the servo's clock may differ from ours, unless the reply is late
MAX_UNLIKE_REPLIES = 4  # then the servo's clock has restarted
MAX_JOB_WAIT_S = 5.0  # of a caller

Job = Callable[[Bus], Any]


class JobCancelled(BusError):
    """The end of a job that a stop has cancelled."""


class ServoLink:
    """A thread that polls `bus` every `period_s`, calls `on_state` and `on_problem`, and continues after a problem."""

    def __init__(
        self,
        bus: Bus,
        model: ServoModel,
        period_s: float,
        on_state: Callable[[ServoState], None],
        on_problem: Callable[[Problem], None],
    ) -> None:
        self._bus, self._clock, self._model, self._period_s = bus, bus.clock, model, period_s
        self._on_state, self._on_problem = on_state, on_problem
        self._jobs: deque[Callable[[], None]] = deque()
        self._closing = threading.Event()
        self._woken = threading.Event()
        self._thread = threading.Thread(target=self._run, name="servo", daemon=True)
        self._error_bits = 0
        self._latest: ServoState | None = None
        self._unlike = 0
        self._lost, self._damaged, self._heard_s = 0, 0, self._clock.now_s()
        self._looks = 0
        self._quiet_until_s = 0.0
        self._stopping = False
        self.torque_off = False  # not switched off by the rig
        self.supervising = False  # while torque is on and the watchdog armed: any other state is a problem
        self.turned_s = self._clock.now_s()  # time of the last loop

    def start(self) -> None:
        """Begin to poll."""
        self._thread.start()

    def close(self) -> None:
        """End the thread; the bus remains open. Wait at most 1 s for a thread that is busy."""
        self._closing.set()
        self._woken.set()
        if self._thread.ident is not None:
            self._thread.join(1.0)

    @property
    def alive(self) -> bool:
        """Whether the thread is polling."""
        return self._thread.is_alive()

    def stop(self, work: Callable[[Bus], None]) -> None:
        """Run `work`, which stops the shaft, before anything else, and cancel jobs that have not begun."""
        self._stopping = True
        self._jobs.appendleft(lambda: work(self._bus))
        self._woken.set()

    def keep_quiet(self, duration_s: float) -> None:
        """Send nothing for `duration_s`, so that the servo's watchdog stops it."""
        self._quiet_until_s = self._clock.now_s() + duration_s

    def call(self, job: Job, *, also_stopped: bool = False) -> Any:
        """Run a job between two polls; return its value or raise its error.

        Raise PortGone if the thread does not run the job, and JobCancelled after a stop unless `also_stopped`.
        """
        done = threading.Event()
        outcome: dict[str, Any] = {}

        def carry_out() -> None:
            try:
                if self._stopping and not also_stopped:
                    raise JobCancelled("a stop came first")
                outcome["value"] = job(self._bus)
            except Exception as error:
                outcome["error"] = error
            done.set()

        self._jobs.append(carry_out)
        self._woken.set()
        if not self._clock.wait(done, MAX_JOB_WAIT_S):
            raise PortGone("the thread that drives the line does not run")
        if "error" in outcome:
            raise outcome["error"]
        return outcome["value"]

    # Its thread -------------------------------------------------------------------------------------------------
    def _run(self) -> None:
        """Poll states and run jobs until the link is closed; pause during the time set by `keep_quiet`."""
        due_s = looked_s = self._clock.now_s()
        try:
            while not self._closing.is_set():
                self.turned_s = self._clock.now_s()
                self._woken.clear()
                if self.turned_s < self._quiet_until_s:
                    self._clock.wait(self._closing, self._period_s)
                    continue
                while self._jobs:
                    self._jobs.popleft()()
                self._poll()
                if self._clock.now_s() - looked_s > SLOW_POLL_S:
                    looked_s = self._clock.now_s()
                    self._look()
                due_s = max(due_s + self._period_s, self._clock.now_s() - self._period_s)
                if not self._jobs:
                    self._clock.wait(self._woken, max(0.0, due_s - self._clock.now_s()))
        except Exception as error:
            self._on_problem(problems.driver_died(error))

    def _poll(self) -> None:
        """Read one state and pass it on; count a lost reply, and report a hardware error."""
        clock = self._clock
        try:
            began_s = clock.reference_s()
            data = self._bus.read_bytes(STATE)
            ended_s, host_s = clock.reference_s(), time.monotonic()
            if self._bus.alert or self._error_bits:
                self.torque_off = True
                (self._error_bits,) = self._bus.read(HARDWARE_ERROR)
        except (ReplyLost, InstructionDenied) as error:
            self._count_lost(damaged=not isinstance(error, ReplyLost) or error.damaged)
            return
        except PortGone as error:
            self._fail(problems.port_lost(error))
            self._clock.wait(self._closing, self._period_s)
            return
        self._heard_s, self._lost, self._damaged = self._clock.now_s(), 0, 0
        state = decode(data, self._model, (began_s, ended_s), host_s, self._error_bits)
        if self._fresh(state):
            self._latest = state
            self._on_state(state)
        if self._error_bits and self.supervising:
            self._fail(hardware_problem(self._error_bits))

    def _fresh(self, state: ServoState) -> bool:
        """Return whether a reply is the answer to the latest request, not a late answer to an earlier one.

        The servo's clock must have advanced by the time between the requests. After many contradictions in a row the
        servo must have restarted; then the newest reply is trusted.
        """
        before = self._latest
        if state.took_s > MAX_TRANSACTION_S:
            return False
        if before is None:
            return True
        since_s = state.time_s - before.time_s
        counted_s = 1e-3 * ((state.tick - before.tick) % TICKS)
        wrap_s = 1e-3 * TICKS
        # The servo's counter, modulo its range, must have advanced by the time between the replies.
        unlike_s = abs((counted_s - since_s + wrap_s / 2) % wrap_s - wrap_s / 2)
        if unlike_s < TICK_S + TICK_FRACTION * since_s + state.took_s + before.took_s:
            self._unlike = 0
            return True
        self._unlike += 1
        self._bus.settle()
        if self._unlike > MAX_UNLIKE_REPLIES:
            self._unlike = 0
            if self.supervising:
                self._fail(problems.servo_restarted())
            return True
        return False

    def _look(self) -> None:
        """Check torque and watchdog, which a polled state does not contain."""
        if not self.supervising:
            return
        self._looks += 1
        register = WATCHDOG if self._looks % 2 else TORQUE
        try:
            (value,) = self._bus.read(register)
            if register is TORQUE and not value:  # usually a shutdown, whose reason may not have been read yet
                self.torque_off = True
                (self._error_bits,) = self._bus.read(HARDWARE_ERROR)
        except (ReplyLost, InstructionDenied):
            return  # `_poll` counts lost replies
        except PortGone as error:
            self._fail(problems.port_lost(error))
            return
        if register is TORQUE and not value:
            self._fail(hardware_problem(self._error_bits) if self._error_bits else problems.torque_lost())
        elif register is WATCHDOG and value == WATCHDOG_TRIPPED:
            self._fail(problems.watchdog_tripped())

    def _count_lost(self, damaged: bool) -> None:
        """Count a lost or damaged reply; report a problem if the servo has been silent too long."""
        self._lost += 1
        self._damaged += damaged
        silent_s = self._clock.now_s() - self._heard_s
        if self._lost > MAX_LOST_STATES and computer_load.exceeds(silent_s, MAX_SILENCE_S):
            self._fail(problems.silent(silent_s, mostly_damaged=2 * self._damaged > self._lost))
        try:
            self._bus.settle()
        except PortGone as error:
            self._fail(problems.port_lost(error))

    def _fail(self, problem: Problem) -> None:
        self._on_problem(problem)
