"""The world's process: one thread, one loop, the laboratory in the middle and sockets around it."""

import gc
import json
import os
import selectors
import signal
import sys
import threading
import time
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from firmware_host.errors import BoardError
from rig.config.load import Loaded
from rig.config.models import ArmSection, RigConfig, TurnerSection
from rig.config.world.laboratory import SimulatedArmSection, WorldSection
from rig.errors import Refused
from rig.world.board.serial_line import SerialLine, SerialSession
from rig.world.clock import PATIENCE_S, Clock
from rig.world.fault_channel import KINDS, ControlSession
from rig.world.flight_recorder import FlightRecorder
from rig.world.laboratory import Laboratory
from rig.world.network import UNPACED, Listener, Network, Session
from rig.world.section import world_section
from rig.world.servo.bench import BEHIND_S, ServoBench
from rig.world.ur10e.interfaces import dashboard_server, primary, robot_api, rtde, script_socket
from rig.world.ur10e.robot import Robot

if TYPE_CHECKING:
    from rig.world.board.pty_port import PtyPort

IDLE_POLL_S = 0.2
BUSY_POLL_S = 0.001  # wall time for which the sockets are not looked at while ticks are due one after the other
# Objects made and not yet gone, between two looks for those that hold each other: ten clients leave so many.
GARBAGE = 5_000
LEAP = 4  # ticks at most that are made in one go: a packet's interval at 125 Hz
ARM_LAG_S = 0.04  # of the world's time, that a reader of the arm's states may be behind: five packets at 125 Hz
SERIAL_LAG_S = 1.0  # … and a reader of the serial line, where nothing is lost that the system can hold
ARM_PORTS: dict[int, tuple[Callable[[Robot], Session], float]] = {
    dashboard_server.PORT: (dashboard_server.DashboardSession, UNPACED),
    script_socket.PRIMARY_PORT: (primary.PrimarySession, UNPACED),
    script_socket.SECONDARY_PORT: (primary.PrimarySession, UNPACED),
    script_socket.REALTIME_PORT: (script_socket.ScriptSession, UNPACED),
    rtde.PORT: (rtde.RtdeSession, ARM_LAG_S),
}

SCRIPT_PORTS = (script_socket.PRIMARY_PORT, script_socket.SECONDARY_PORT, script_socket.REALTIME_PORT)


class World:
    """Laboratory, clock and sockets."""

    def __init__(self, loaded: Loaded) -> None:
        section = world_section(loaded)
        self.laboratory = Laboratory(loaded.config, section)
        self.line = SerialLine(lambda: self.laboratory.board)
        places = self.laboratory.instruments
        self.instrument_lines = {
            name: SerialLine(partial(getattr, place, "instrument"), section.seed) for name, place in places.items()
        }
        for name, line in self.instrument_lines.items():
            line.bit_error_rate, line.stolen = places[name].bit_error_rate, places[name].stolen
        turning = self.laboratory.turning
        self.servo_line = SerialLine(lambda: turning.bus, section.seed) if isinstance(turning, ServoBench) else None
        self.lines = (self.line, *self.instrument_lines.values(), *filter(None, [self.servo_line]))
        patience_s = PATIENCE_S if self.servo_line is None else BEHIND_S
        self.clock = Clock(section.time_scale, time.monotonic, self.laboratory.tick_s, patience_s)
        self.network = Network(self.clock.dialogue)
        self._silent_until_s = 0.0
        self._ended = False
        host, board = _host_of(loaded.config), loaded.config.board
        try:
            self.arm_listeners = self._listen_as_arm(loaded.config.turner, section)
            self.servo_listener = (
                None
                if self.servo_line is None
                else self._listen("turner.port", loaded.config.turner.address, self.servo_line, gathers=False)
            )
            self.board_listener = None if board is None else self._listen("board.port", board.port, self.line)
            for name, line in self.instrument_lines.items():
                self._listen(*_port_of(loaded.config, name), line)
            control_port = section.control_port
            self.network.listen(host, control_port, lambda: ControlSession(self))
        except Refused:
            self.network.close()
            raise
        pty = _open_pty(self.line, self.network.selector) if section.board.pty else None
        ptys = {
            name: _open_pty(line, self.network.selector)
            for name, line in self.instrument_lines.items()
            if places[name].pty
        }
        self._ptys = [*([pty] if pty else []), *ptys.values()]
        self._description = {
            "ready": True,
            "arm": loaded.config.turner.address or None,
            "board": None if board is None else board.port,
            "pty": pty.path if pty else None,
            "kvh_ports": {name: s.serial.port for name, s in loaded.config.sensors.items() if s.serial is not None},
            **{
                f"{kind}_ptys": {name: each.path for name, each in ptys.items() if places[name].kind == kind}
                for kind in KINDS
            },
            "control": f"{host}:{control_port}",
        }

    def describe(self) -> str:
        """The line that says where everything listens."""
        return json.dumps(self._description)

    def _listen_as_arm(self, turner: TurnerSection, section: WorldSection) -> list[Listener]:
        """The ports of the arm's controller, where an arm turns the sensors."""
        if not isinstance(turner, ArmSection):
            return []
        robot = self.laboratory.robot
        listeners = [
            self.network.listen(turner.host, port, partial(new_session, robot), lag_s=lag_s)
            for port, (new_session, lag_s) in ARM_PORTS.items()
            if port not in _closed_ports(section.arm, robot)
        ]
        if robot_api.offered(robot):
            new_session = partial(robot_api.RobotApiSession, robot)
            listeners.append(self.network.listen(turner.host, turner.robot_api_port, new_session))
        return listeners

    def _listen(self, key: str, url: str, line: SerialLine, *, gathers: bool = True) -> Listener:
        """The far end of a serial line; a client who opens what another has open is hung up on."""
        return self.network.listen(
            *_address(key, url), lambda: SerialSession(line), limit=1, lag_s=SERIAL_LAG_S, gathers=gathers
        )

    # -- faults that live in the wires -----------------------------------------------------------------------------
    def silence_arm(self, duration_s: float) -> None:
        """The controller neither sends nor reads for so long (wall time: a client's patience is wall time too)."""
        self._silent_until_s = time.monotonic() + duration_s
        for listener in self.arm_listeners:
            listener.set_silent(True)

    def close_arm(self, *, listen: bool) -> None:
        """The controller closes every connection; with `listen` it takes new ones."""
        for listener in self.arm_listeners:
            listener.hang_up() if listen else listener.close()

    def close_arm_port(self, port: int) -> None:
        """One of the controller's ports alone closes its connections and takes no new ones."""
        for listener in self.arm_listeners:
            if listener.port == port:
                listener.close()

    def set_remote_control(self, on: bool) -> None:
        """The pendant is switched to remote or to local control, which closes the connections that took scripts in."""
        robot = self.laboratory.robot
        before, robot.remote_control = robot.local_control, on
        if robot.local_control and not before:
            for listener in self.arm_listeners:
                if listener.port in SCRIPT_PORTS:
                    listener.hang_up()

    def servo_at_fault(self, *, silent: bool = False, listen: bool = True) -> None:
        """The servo's line carries nothing, or its port is gone."""
        if self.servo_line is not None and self.servo_listener is not None:
            self.servo_line.silent = bool(silent)
            self.servo_listener.open() if listen else self.servo_listener.close()

    def unplug_board(self) -> None:
        """Pull the board's cable: no power, no port."""
        if self.board_listener is not None:
            self.board_listener.close()
        self.laboratory.unplug()

    def plug_in_board(self) -> None:
        self.laboratory.plug_in()
        if self.board_listener is not None:
            self.board_listener.open()

    def fit_part(self, part: str) -> None:
        """Exchange the board for that of another part, as the simulated operator does."""
        self.unplug_board()
        gc.collect()  # an emulated board holds itself, and some megabytes: by itself it would stay for several parts
        if self.laboratory.fit(part):
            self.plug_in_board()

    # -- the loop ----------------------------------------------------------------------------------------------------
    def end(self) -> None:
        self._ended = True

    def run(self, alive: Callable[[], None] = lambda: None) -> None:
        """Serve until `end`. A tick ends when its clients have been given theirs, and they have their own pace.

        `alive` is called after every tick, and whenever none is due.
        """
        polled_s = 0.0
        while not self._ended:
            wait_s = self.clock.wait_s()
            due = wait_s <= 0.0
            behind_s = self.network.deliver(idle=not due, patient=self.clock.time_scale > 1.0)
            if behind_s or not due or time.monotonic() - polled_s >= BUSY_POLL_S:
                self.network.poll(behind_s or min(wait_s, IDLE_POLL_S))
                polled_s = time.monotonic()
                due = self.clock.wait_s() <= 0.0
            if self._silent_until_s and time.monotonic() >= self._silent_until_s:
                self._silent_until_s = 0.0
                for listener in self.arm_listeners:
                    listener.set_silent(False)
            if due and not behind_s and not self._ended:
                self._tick()
                alive()
            elif wait_s > 0.0:
                alive()

    def _tick(self) -> None:
        """One tick; while nothing but a client can let the arm move, all that are due now, `LEAP` at most.

        With a board one by one: its core runs as long in any case, and the clients would get their packets in heaps.
        What sensors feel of an arm that stands they can be asked at the end of all of them: their bytes are the same.
        Every session has its turn at every tick.
        """
        for left in reversed(range(LEAP if self.board_listener is None else 1)):
            self.clock.count()
            self.laboratory.turn()
            last = not (left and self.laboratory.turning.waiting and self.clock.wait_s() <= 0.0)
            if last:
                self._sense()
            for line in self.lines:
                line.tick()
            for pty in self._ptys:
                pty.tick()
            self.network.tick()
            if last:
                return

    def _sense(self) -> None:
        try:
            self.laboratory.sense()
        except BoardError as error:
            # The firmware broke a rule of the chip: the board is dead, and its cable with it.
            print(error, file=sys.stderr, flush=True)
            self.unplug_board()

    def close(self) -> None:
        for pty in self._ptys:
            pty.close()
        self.network.close()


def _host_of(config: RigConfig) -> str:
    """The address of the laboratory: that of what turns, or where a hand does that of the board or a sensor."""
    if config.turner.simulated_at is not None:
        return config.turner.simulated_at
    ports = [("board.port", config.board.port)] if config.board is not None else []
    ports += [sensor.own_port for sensor in config.sensors.values() if sensor.own_port is not None]
    return _address(*ports[0])[0]


def _port_of(config: RigConfig, name: str) -> tuple[str, str]:
    """The key of an instrument's port in the configuration, and the port; an autopilot has that for a name."""
    if name not in config.sensors:
        return "mavlink.port", name
    key, port = config.sensors[name].own_port or ("", "")
    return f"sensors.{name}.{key}", port


def _closed_ports(arm: SimulatedArmSection, robot: Robot) -> set[int]:
    """What the simulated controller does not offer."""
    closed = set() if arm.dashboard and not robot.is_polyscope_x else {dashboard_server.PORT}
    return closed if arm.primary else closed | {script_socket.PRIMARY_PORT}


def _address(key: str, url: str) -> tuple[str, int]:
    """Host and port of `socket://host:port`. Raises `Refused` for any other port."""
    parts = urlsplit(url)
    try:
        if parts.scheme == "socket" and parts.hostname and parts.port:
            return parts.hostname, parts.port
    except ValueError:
        pass  # a port that is no number
    raise Refused(
        "board_port",
        f"{key} {url!r} is no address to listen on",
        "Write socket://host:port",
    )


def _open_pty(line: SerialLine, selector: selectors.BaseSelector) -> "PtyPort":
    if os.name != "posix":
        raise Refused(
            "no_pty",
            "world: this system has no pseudo-terminals",
            "Leave every `pty: true` out, and use the socket:// port",
        )
    from rig.world.board.pty_port import PtyPort  # its modules exist on POSIX only

    return PtyPort(line, selector)


def serve(loaded: Loaded, until_eof: bool, late: Path | None = None) -> None:
    """Run the world until end of input (`until_eof`) or Ctrl-C. Raises `Refused` when a port cannot be had.

    What held steps that came late is written to the file `late`; to stderr where it is None.
    """
    world = World(loaded)
    try:
        # Also where who started us had it ignored. An exception would end nothing inside a call of the emulator's.
        for each in (signal.SIGTERM, signal.SIGINT):
            signal.signal(each, lambda *_: world.end())
        if until_eof:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            # A thread, because select() takes no pipe on Windows; it only waits.
            threading.Thread(target=_await_end_of_input, args=(world,), daemon=True).start()
        # What there is now stays: to look it through again and again for garbage would cost a twentieth of the pace.
        gc.collect()
        gc.freeze()
        gc.set_threshold(GARBAGE)
        with closing(FlightRecorder(late, world.network.waited_for)) as recorder:
            print(world.describe(), flush=True)
            world.run(recorder.alive)
    finally:
        world.close()


def _await_end_of_input(world: World) -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    world.end()
