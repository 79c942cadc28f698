"""The supervised process: the only place where the `ur_rtde` client lives.

The client can block for minutes, loop or crash the interpreter when a connection is lost; here that harms nothing but
this process. The main thread reads states and sends heartbeats and never waits for the client; other threads serve the
parent's requests, so that a stop is heard while a move runs, and watch for the end of a move. When the parent is gone
the arm is stopped and the process ends.
"""

import os
import signal
import sys
import threading
import time
import traceback
from multiprocessing.connection import Connection
from typing import Any, NoReturn

from rig.config.written_file import opened_to_append
from rig.data.silence import Silence
from rig.errors import Problem
from rig.motion.state import ArmState
from rig.turners.ur.controller_answers import no_states
from rig.turners.ur.identity import series_problem, version_text
from rig.turners.ur.messages import (
    Connected,
    ControlTaken,
    Failed,
    Heartbeat,
    Message,
    Move,
    MoveFinished,
    MoveStarted,
    Request,
    Stop,
    TakeControl,
)
from rig.turners.ur.state_stream import NotSpoken, Packet, StateStream
from rig.turners.ur.stopping import BRAKE_RAD_S2, STOP_S, Order, independent_ways

HEARTBEAT_S = 0.01
MOVE_POLL_S = 0.003
FIRST_PACKET_S = 5.0
TICK_S = 0.1
PARENT_TICKS = 20  # 2 s without a sign of the parent's life
PARENT_SPARED = 2  # … and at most so many times that on a machine that has no processor for it
ABANDON_S = 5.0  # the last stop, over the controller's own ports or else over the client, has so long
PAYLOAD_S = 1.0  # the payload shows in the states within this, by the controller's clock and by this machine's
PAYLOAD_TOLERANCE_KG = 0.01


def main(pipe: "Connection[Message, Request]", host: str, state_rate_hz: float, log: str | None) -> None:
    """Run until the parent ends the process or disappears. `log` names the file that takes the client's own output."""
    _outlive_the_parent()
    _send_output_to(log)
    child = _Child(pipe, host, state_rate_hz)
    signal.signal(signal.SIGTERM, lambda *_: child.abandon())
    requests = threading.Thread(target=child.serve, name="requests", daemon=True)
    requests.start()
    threading.Thread(target=child.watch_parent, name="parent watch", daemon=True).start()
    threading.Thread(target=child.watch_move, name="move watch", daemon=True).start()
    try:
        try:
            child.connect()
        except OSError as error:
            child.send(Failed(_connection_failure(host, error)))
            requests.join()  # the parent reads this and ends the process
        child.stream()
    except BaseException:
        traceback.print_exc()
        child.abandon()


class _Child:
    def __init__(self, pipe: "Connection[Message, Request]", host: str, state_rate_hz: float) -> None:
        self._pipe = pipe
        self._host = host
        self._state_rate_hz = state_rate_hz
        self._sending = threading.Lock()
        self._states: StateStream  # these two once it is connected
        self._latest: Packet
        self._control: Any = None
        self._holds_arm = False  # our program may run on the controller
        self._operations_before: int | None = None  # change count before the running move; None when none runs
        self._serving = False  # a request is being served: others, and the parent's signs of life, wait in the pipe
        self._parent = Silence(os.getppid(), spared=PARENT_SPARED)

    def send(self, message: Message) -> None:
        with self._sending:
            self._pipe.send(message)

    def connect(self) -> None:
        """Let the controller send its states and wait for the first; `OSError` when none comes."""
        self._states = StateStream(self._host, self._state_rate_hz, FIRST_PACKET_S)
        first = self._latest = self._states.first
        self.send(Connected(self._states.version))
        self.send(Heartbeat((first.state,)))

    def stream(self) -> NoReturn:
        """Send every state to the parent, in order, until the parent is gone."""
        batch: list[ArmState] = []
        beat_s = time.monotonic()
        while True:
            for packet in self._states.read(HEARTBEAT_S):
                self._latest = packet
                batch.append(packet.state)
            if time.monotonic() - beat_s >= HEARTBEAT_S:
                beat_s = time.monotonic()
                try:
                    self.send(Heartbeat(tuple(batch), self._states.silent_s))
                except OSError:
                    self.abandon()
                batch.clear()

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
        except BaseException:  # without this thread nobody would hear a stop
            traceback.print_exc()
            self.abandon()

    def watch_parent(self) -> None:
        """Stop the arm when the parent has been silent for too long: it hangs, and nobody watches the arm.

        A thread of its own, because sending states to a parent that does not read them blocks in the end.
        """
        while True:
            time.sleep(TICK_S)
            self._parent.tick()
            if self._holds_arm and not self._serving and self._parent.lasts_over(PARENT_TICKS):
                print(f"nobody supervises: silent for {self._parent.ticks} ticks of {TICK_S} s", file=sys.stderr)
                self.abandon()

    def watch_move(self) -> NoReturn:
        """Report the end of a move.

        A thread of its own: the client answers only when none of its own threads holds it up, and heartbeats must not
        wait for that.
        """
        while True:
            time.sleep(MOVE_POLL_S)
            before = self._operations_before
            if before is None:
                continue
            status = self._control.getAsyncOperationProgressEx()
            if status.changeCount() != before and not status.isAsyncOperationRunning():
                self._operations_before = None
                self.send(MoveFinished())

    def _handle(self, request: Request) -> None:
        match request:
            case TakeControl():
                self.send(self._take_control(request))
            case Move():
                self._move(request)
            case Stop():
                self._operations_before = None
                self._brake(request.deceleration_rad_s2)

    def _take_control(self, request: TakeControl) -> Message:
        from rtde_control import RTDEControlInterface

        self._holds_arm = True
        try:
            self._control = RTDEControlInterface(self._host, self._state_rate_hz)
        except RuntimeError as error:
            self._holds_arm = False
            return Failed(_control_failure(self._host, str(error)))
        self._control.setPayload(request.carried.payload_kg, list(request.carried.centre_m))
        return self._await_payload(request.carried.payload_kg)

    def _await_payload(self, wanted_kg: float) -> Message:
        """Wait until the states show the payload."""
        host_s, arm_s = time.monotonic(), self._latest.state.time_s
        while abs((latest := self._latest).payload_kg - wanted_kg) > PAYLOAD_TOLERANCE_KG:
            if min(time.monotonic() - host_s, latest.state.time_s - arm_s) > PAYLOAD_S:
                self._control.stopScript()
                return Failed(_payload_failure(latest.payload_kg, wanted_kg))
            time.sleep(HEARTBEAT_S)
        return ControlTaken()

    def _move(self, move: Move) -> None:
        before = self._control.getAsyncOperationProgressEx().changeCount()
        try:
            started = self._control.moveJ(list(move.target_q_rad), move.speed_rad_s, move.acceleration_rad_s2, True)
        except (RuntimeError, ValueError) as error:
            self.send(Failed(_move_failure(f"the client refused the move ({error})")))
            return
        if started:
            self.send(MoveStarted())
            self._operations_before = before
        else:
            self._await_state()
            self.send(Failed(_move_failure("the controller did not start the move")))

    def _await_state(self) -> None:
        """Wait for another state: a link that is lost, and not the controller, may be why a move was not begun.

        Without one the parent names the link before this ends.
        """
        latest, began_s = self._latest, time.monotonic()
        while self._latest is latest and time.monotonic() - began_s < ABANDON_S:
            time.sleep(HEARTBEAT_S)

    def _brake(self, deceleration_rad_s2: float) -> None:
        if self._control is not None:
            self._control.stopJ(deceleration_rad_s2)
            self._control.stopScript()

    def abandon(self) -> NoReturn:
        """Stop the arm that nobody supervises any more, and leave.

        Over the client where no port of the controller's own says that the program has ended.
        """
        if self._holds_arm:
            # The client's own stop may wait for ever for a controller that is gone; the system's alarm ends that.
            signal.setitimer(signal.ITIMER_REAL, ABANDON_S)
            if not Order(self._host, independent_ways(self._states.version), STOP_S).program_ended():
                self._brake(BRAKE_RAD_S2)
        _leave(1)


def _leave(status: int) -> NoReturn:
    """End at once: the client's destructors may block or abort after a lost connection; the system closes sockets."""
    sys.stderr.flush()
    os._exit(status)


def _outlive_the_parent() -> None:
    """Signals meant for the whole group must not end the process that has to stop the arm; a closed pipe does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "setsid"):  # POSIX: a session of its own, which no key and no closed terminal reaches
        os.setsid()


def _send_output_to(log: str | None) -> None:
    """The client writes to stdout and stderr as it likes; stdout belongs to results."""
    sink = os.open(os.devnull, os.O_WRONLY) if log is None else opened_to_append(log)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
        os.dup2(sink, stream.fileno())
    os.close(sink)


def _move_failure(what: str) -> Problem:
    return Problem("move_refused", what, "Read the pendant's log and check the configured speed and acceleration")


def _payload_failure(reported_kg: float, wanted_kg: float) -> Problem:
    return Problem(
        "payload_not_set",
        f"the controller uses a payload of {reported_kg:g} kg instead of {wanted_kg:g} kg",
        "Read the pendant's log, and correct the payload in the arm's installation",
    )


def _connection_failure(host: str, error: OSError) -> Problem:
    if isinstance(error, NotSpoken):
        return series_problem(host, error.version) or Problem(
            "controller_too_old",
            f"the controller at {host} does not know {error.what}; its software is {version_text(error.version)}",
            "Update it: the rig was tested with PolyScope 5.14",
        )
    return no_states(host, error)


def _control_failure(host: str, reason: str) -> Problem:
    if "remote control" in reason:
        return Problem(
            "not_in_remote_control",
            f"the arm at {host} is not in remote control",
            "Switch the pendant to remote control (top right corner)",
        )
    if "already in use" in reason:
        return Problem(
            "registers_in_use",
            f"another client or a fieldbus holds the input registers of the arm at {host}",
            "Close the other client, or disable EtherNet/IP, PROFINET and MODBUS in the installation",
        )
    return Problem(
        "control_not_taken",
        f"the arm at {host} did not start the control script ({reason})",
        "Clear any stop on the pendant, switch it to remote control, close other programs, then start again",
    )
