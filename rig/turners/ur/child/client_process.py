"""The supervised process, the only place of the `ur_rtde` client.

After a lost connection the client can block for minutes, loop or crash the interpreter, which here harms only this
process. The main thread reads states and sends heartbeats, and never waits for the client. Other threads serve the
parent's requests, so that a stop is served during a move, and await the end of moves. If the parent is gone, the arm is
stopped and the process ends.
"""

import os
import signal
import sys
import threading
import time
import traceback
from multiprocessing.connection import Connection
from typing import Any, NoReturn

from rig.config.files.safe_writing import open_to_append
from rig.data.processes.ending_signals import ENDING_SIGNALS
from rig.data.processes.process_silence import Silence
from rig.errors import Problem
from rig.motion.turner_state import ArmState
from rig.turners.ur.child.client_problems import (
    connection_failure,
    control_failure,
    link_lost,
    move_failure,
    payload_changed,
    payload_failure,
)
from rig.turners.ur.child_messages import (
    Braked,
    BrakeRequest,
    ChildHeartbeat,
    Connected,
    ControlTaken,
    Disturbed,
    Message,
    MoveFinished,
    MoveRequest,
    MoveStarted,
    Request,
    RequestFailed,
    ScriptStarted,
    TakeControl,
)
from rig.turners.ur.controller.free_registers import UPPER_FIRST, find_free_half, registers_in_use
from rig.turners.ur.controller.state_stream import StatePacket, StateStream
from rig.turners.ur.stopping.stop import BRAKE_RAD_S2, MAX_STOP_S, StopOrder
from rig.turners.ur.stopping.stop_paths import stop_paths

HEARTBEAT_S = 0.01
MOVE_POLL_S = 0.003
MAX_FIRST_PACKET_S = 5.0
TICK_S = 0.1
PARENT_TICKS = 20  # 2 s without a sign of life from the parent
MAX_PARENT_FACTOR = 2  # factor on that limit while the parent gets no processor
MAX_LAST_STOP_S = 5.0  # time for the last stop, over the controller's own ports or over the client
MAX_PAYLOAD_WAIT_S = 1.0  # time until states show the payload, by the controller's clock and by this machine's
PAYLOAD_TRIES = 3  # a try ends after 4 s if the client's script is not ready
PAYLOAD_TOLERANCE_KG, CENTRE_TOLERANCE_M = 0.01, 0.001
MAX_REGISTER_WAIT_S = 2.0  # time for the controller to report its free registers
MAX_SILENCE_S = 0.8  # after a longer silence the controller may have lost the client


def main(
    pipe: "Connection[Message, Request]", host: str, state_rate_hz: float, robot_api_port: int, log: str | None
) -> None:
    """Run until the parent ends the process or disappears. `log` names the file for the client's own output."""
    _outlive_the_parent()
    _send_output_to(log)
    child = _Child(pipe, host, state_rate_hz, robot_api_port)
    signal.signal(signal.SIGTERM, lambda *_: child.abandon())
    requests = threading.Thread(target=child.serve, name="requests", daemon=True)
    requests.start()
    threading.Thread(target=child.watch_parent, name="parent watch", daemon=True).start()
    threading.Thread(target=child.watch_move, name="move watch", daemon=True).start()
    try:
        try:
            child.connect()
        except OSError as error:
            child.send(RequestFailed(connection_failure(host, error)))
            requests.join()  # the parent reads this and ends the process
        child.stream()
    except BaseException:
        traceback.print_exc()
        child.abandon()


class _Child:
    def __init__(
        self, pipe: "Connection[Message, Request]", host: str, state_rate_hz: float, robot_api_port: int
    ) -> None:
        self._pipe = pipe
        self._host = host
        self._robot_api_port = robot_api_port
        self._state_rate_hz = state_rate_hz
        self._sending = threading.Lock()
        self._states: StateStream  # this and the next are set once connected
        self._latest: StatePacket
        self._control: Any = None
        self._carried: StatePacket | None = None  # the state that shows the payload of the controller, once set
        self._beats = 0  # heartbeats sent
        self._holds_arm = False  # whether our program may run on the controller
        self._operations_before: int | None = None  # change count before the running move; None when none runs
        # Whether a request is being served: other messages, and the parent's signs of life, wait in the pipe.
        self._serving = False
        self._parent = Silence(os.getppid(), spared=MAX_PARENT_FACTOR)

    def send(self, message: Message) -> None:
        with self._sending:
            self._pipe.send(message)

    def connect(self) -> None:
        """Subscribe to the controller's states and wait for the first. Raise `OSError` if none comes."""
        self._states = StateStream(self._host, self._state_rate_hz, MAX_FIRST_PACKET_S)
        first = self._latest = self._states.first
        self.send(Connected(self._states.version))
        self.send(ChildHeartbeat((first.state,)))

    def stream(self) -> NoReturn:
        """Send every state to the parent, in order, until the parent is gone."""
        batch: list[ArmState] = []
        beat_s = time.monotonic()
        reported = False
        while True:
            problem: Problem | None = None
            for packet in self._states.read(HEARTBEAT_S):
                self._latest = packet
                batch.append(packet.state)
                problem = problem or self._payload_changed(packet)
            problem = None if reported else problem or self._states.problem
            if time.monotonic() - beat_s >= HEARTBEAT_S or problem is not None:
                beat_s = time.monotonic()
                try:
                    self.send(ChildHeartbeat(tuple(batch), self._states.silent_s))
                    if problem is not None:
                        reported = True
                        self.send(Disturbed(problem))
                except OSError:
                    self.abandon()
                self._beats += 1
                batch.clear()

    def _payload_changed(self, packet: StatePacket) -> Problem | None:
        """Return the problem if another program has set a payload after this one."""
        ours = self._carried
        if ours is None:
            return None
        centre_change_m = max(abs(a - b) for a, b in zip(packet.payload_centre_m, ours.payload_centre_m, strict=True))
        if abs(packet.payload_kg - ours.payload_kg) <= PAYLOAD_TOLERANCE_KG and centre_change_m <= CENTRE_TOLERANCE_M:
            return None
        return payload_changed(ours, packet)

    def serve(self) -> None:
        """Serve the parent's requests one after the other."""
        try:
            while True:
                request = self._pipe.recv()
                self._serving = True
                self._handle(request)
                self._parent.heard()
                self._serving = False
        except (EOFError, OSError):  # the parent is gone
            self.abandon()
        except BaseException:  # without this thread no stop would be served
            traceback.print_exc()
            self.abandon()

    def watch_parent(self) -> None:
        """Stop the arm if the parent, which supervises it, is silent for too long.

        The watch needs a thread of its own, because sending states to a parent that does not read them finally blocks.
        """
        while True:
            time.sleep(TICK_S)
            self._parent.tick()
            if self._holds_arm and not self._serving and self._parent.lasts_over(PARENT_TICKS):
                print(f"nobody supervises: silent for {self._parent.ticks} ticks of {TICK_S} s", file=sys.stderr)
                self.abandon()

    def watch_move(self) -> NoReturn:
        """Report the end of a move, in a thread of its own because heartbeats cannot wait for the client's answers."""
        while True:
            time.sleep(MOVE_POLL_S)
            changes_before = self._operations_before
            if changes_before is None:
                continue
            status = self._control.getAsyncOperationProgressEx()
            if status.changeCount() != changes_before and not status.isAsyncOperationRunning():
                self._operations_before = None
                self.send(MoveFinished())

    def _handle(self, request: Request) -> None:
        match request:
            case TakeControl():
                self.send(self._take_control(request))
            case MoveRequest():
                self._move(request)
            case BrakeRequest():
                self._operations_before = None
                self.send(Braked(self._brake(request.deceleration_rad_s2)))

    def _take_control(self, request: TakeControl) -> Message:
        """Upload the control script, set the payload, wait until the states show it, and return the answer."""
        from rtde_control import RTDEControlInterface

        flags = RTDEControlInterface.FLAG_UPLOAD_SCRIPT.value | RTDEControlInterface.FLAG_NO_EXT_FT.value
        try:
            half = find_free_half(self._host, self._states.version, MAX_REGISTER_WAIT_S)
        except OSError as error:
            return RequestFailed(link_lost(f"the arm at {self._host} no longer answers ({error})"))
        if half is None:
            return RequestFailed(registers_in_use(self._host, self._states.version))
        if half == UPPER_FIRST:
            flags |= RTDEControlInterface.FLAG_UPPER_RANGE_REGISTERS.value
        self._holds_arm = True
        try:
            self._control = RTDEControlInterface(self._host, self._state_rate_hz, flags)
        except RuntimeError as error:
            self._let_parent_see()
            silent = self._states.silent_s > MAX_SILENCE_S
            return RequestFailed(
                self._link_problem(silent=silent) or control_failure(self._host, self._states.version, str(error))
            )
        self.send(ScriptStarted())
        for _ in range(PAYLOAD_TRIES):
            if self._control.setPayload(request.carried.payload_kg, list(request.carried.centre_m)):
                break
        return self._await_payload(request.carried.payload_kg)

    def _await_payload(self, wanted_kg: float) -> Message:
        """Wait until the states show the payload, and return the answer; the parent judges all else in the states.

        States from before the payload was set may still be unread, because the client's constructor blocked the
        interpreter or this process got no processor. So the payload counts as refused only if the first state on a new
        connection does not show it.
        """
        host_s, arm_s = time.monotonic(), self._latest.state.time_s
        while abs((latest := self._latest).payload_kg - wanted_kg) > PAYLOAD_TOLERANCE_KG:
            if (lost := self._link_problem()) is not None:
                return RequestFailed(lost)
            if min(time.monotonic() - host_s, latest.state.time_s - arm_s) > MAX_PAYLOAD_WAIT_S:
                try:
                    reported_kg = self._read_payload_kg()
                except OSError as error:
                    return RequestFailed(connection_failure(self._host, error))
                if abs(reported_kg - wanted_kg) > PAYLOAD_TOLERANCE_KG:
                    self._let_parent_see()
                    return RequestFailed(payload_failure(reported_kg, wanted_kg))
                host_s = time.monotonic()
            time.sleep(HEARTBEAT_S)
        self._carried = latest
        return ControlTaken()

    def _read_payload_kg(self) -> float:
        """Return the payload that the controller uses now."""
        with StateStream(self._host, self._state_rate_hz, MAX_FIRST_PACKET_S) as states:
            return states.first.payload_kg

    def _link_problem(self, *, silent: bool = False) -> Problem | None:
        """Return the problem of the stream of states, or `link_lost` if it is closed or found `silent`, else None."""
        if self._states.problem is not None or not (self._states.closed or silent):
            return self._states.problem
        return link_lost(f"no new state arrives from the arm at {self._host}")

    def _let_parent_see(self) -> None:
        """Wait until all states so far have been sent to the parent."""
        beats, began_s = self._beats, time.monotonic()
        while self._beats < beats + 2 and time.monotonic() - began_s < MAX_LAST_STOP_S:
            time.sleep(HEARTBEAT_S)

    def _move(self, move: MoveRequest) -> None:
        """Start a movement, and answer whether the controller has begun it."""
        changes_before = self._control.getAsyncOperationProgressEx().changeCount()
        try:
            started = self._control.moveJ(list(move.target_q_rad), move.speed_rad_s, move.acceleration_rad_s2, True)
        except (RuntimeError, ValueError) as error:
            self.send(RequestFailed(move_failure(f"the client refused the move ({error})")))
            return
        if started:
            self.send(MoveStarted())
            self._operations_before = changes_before
        else:
            self._await_state()
            self.send(RequestFailed(move_failure("the controller did not start the move")))

    def _await_state(self) -> None:
        """Wait for a new state after a move that did not begin, to learn whether the lost link is the cause.

        If no state comes, the parent process, which waits for a shorter time, reports the lost link before this method
        returns.
        """
        latest, began_s = self._latest, time.monotonic()
        while self._latest is latest and time.monotonic() - began_s < MAX_LAST_STOP_S:
            time.sleep(HEARTBEAT_S)

    def _brake(self, deceleration_rad_s2: float) -> bool:
        """Stop the joints and the script; return whether the client confirms it."""
        if self._control is None:
            return False
        try:
            confirmed = bool(self._control.stopJ(deceleration_rad_s2))
            self._control.stopScript()
        except RuntimeError as error:
            print(f"the client could not brake: {error}", file=sys.stderr)
            return False
        return confirmed

    def abandon(self) -> NoReturn:
        """Stop the arm, which is no longer supervised, and exit.

        The program is stopped over the controller's ports. If no path confirms it, the RTDE client brakes the arm.
        """
        if self._holds_arm:
            # The client's stop may wait forever for a controller that is gone; the system's alarm ends that.
            signal.setitimer(signal.ITIMER_REAL, MAX_LAST_STOP_S)
            order = StopOrder(stop_paths(self._host, self._states.version, self._robot_api_port), MAX_STOP_S)
            if not order.await_program_end():
                print(f"{order.words}; the client brakes", file=sys.stderr)
                self._brake(BRAKE_RAD_S2)
        _exit_at_once(1)


def _exit_at_once(status: int) -> NoReturn:
    """Exit at once, because the client's destructors may block or abort; the system closes sockets."""
    sys.stderr.flush()
    os._exit(status)


def _outlive_the_parent() -> None:
    """Ignore signals to the process group, because this process has to stop the arm.

    A closed pipe ends the process, as does SIGALRM if the stop in `_Child.abandon` hangs. SIGTERM stops the arm.
    """
    for number in ENDING_SIGNALS:
        if number not in (signal.SIGTERM, getattr(signal, "SIGALRM", None)):
            signal.signal(number, signal.SIG_IGN)
    if hasattr(os, "setsid"):  # POSIX: a session of its own, out of reach of keys and of a closed terminal
        os.setsid()


def _send_output_to(log: str | None) -> None:
    """Redirect stdout and stderr to the log, because the client prints to both and stdout is reserved for results.

    If the run folder has been removed, nothing is logged; the parent reports this.
    """
    try:
        sink = os.open(os.devnull, os.O_WRONLY) if log is None else open_to_append(log)
    except FileNotFoundError:
        sink = os.open(os.devnull, os.O_WRONLY)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
        os.dup2(sink, stream.fileno())
    os.close(sink)
