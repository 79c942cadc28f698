"""The world's process: one thread, one loop, the simulated laboratory in the middle and sockets around it."""

import gc
import json
import os
import selectors
import signal
import sys
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from firmware_host.errors import BoardError
from rig.config.files.safe_writing import write_new
from rig.config.load import Loaded
from rig.config.models import ArmSection, RigConfig, TurnerSection
from rig.config.world.laboratory import SimulatedArmSection, WorldSection
from rig.errors import Refused
from rig.world.board.serial_line import SerialLine, SerialSession
from rig.world.board.windowed_truth import SimulatedTruth, truth_document
from rig.world.clock import PATIENCE_S, WorldClock
from rig.world.fault_channel import KINDS, ControlSession
from rig.world.flight_recorder import FlightRecorder
from rig.world.laboratory import Laboratory
from rig.world.network import UNPACED_LAG, ClientSession, Network, PortListener
from rig.world.servo.servo_bench import MAX_LAG_S, ServoBench
from rig.world.ur10e.interfaces import dashboard_server, primary_server, robot_api_server, rtde, script_socket
from rig.world.ur10e.interfaces.stored_programs import StoredPrograms
from rig.world.ur10e.robot import Robot
from rig.world.world_section import read_world_section

if TYPE_CHECKING:
    from rig.world.board.pty_port import PtyPort

IDLE_POLL_S = 0.2
BUSY_POLL_S = 0.001  # wall time between two polls of the sockets while ticks are due one after the other
GARBAGE_THRESHOLD = 5_000  # of Python's cyclic collection: about the objects that ten clients leave behind
MAX_LEAP_TICKS = 4  # in one go: a packet's interval at 125 Hz
ARM_LAG_S = 0.04  # virtual time by which a reader of the arm's states may lag: five packets at 125 Hz
SERIAL_LAG_S = 1.0  # virtual time by which a reader of a serial line may lag: the system buffers the bytes
ARM_PORTS: dict[int, tuple[Callable[[Robot], ClientSession], float]] = {
    dashboard_server.PORT: (dashboard_server.DashboardSession, UNPACED_LAG),
    script_socket.PRIMARY_PORT: (primary_server.PrimarySession, UNPACED_LAG),
    script_socket.SECONDARY_PORT: (primary_server.PrimarySession, UNPACED_LAG),
    script_socket.REALTIME_PORT: (script_socket.ScriptSession, UNPACED_LAG),
    rtde.PORT: (rtde.RtdeSession, ARM_LAG_S),
}

SCRIPT_PORTS = (script_socket.PRIMARY_PORT, script_socket.SECONDARY_PORT, script_socket.REALTIME_PORT)


class World:
    """The simulated laboratory with its clock, and the sockets at which clients reach its devices."""

    def __init__(self, loaded: Loaded, truth_file: Path | None = None) -> None:
        """Open all ports. The world may write its truth into `truth_file`, if given."""
        section = read_world_section(loaded)
        self._truth, self._truth_file = SimulatedTruth(loaded.config, section), truth_file
        self.laboratory = Laboratory(loaded.config, section)
        self.line = SerialLine(lambda: self.laboratory.board)
        mounts = self.laboratory.instruments
        self.instrument_lines = {
            name: SerialLine(partial(getattr, mount, "instrument"), section.seed) for name, mount in mounts.items()
        }
        for name, line in self.instrument_lines.items():
            line.bit_error_rate, line.stolen = mounts[name].bit_error_rate, mounts[name].stolen
        source = self.laboratory.motion_source
        self.servo_line = SerialLine(lambda: source.bus, section.seed) if isinstance(source, ServoBench) else None
        self.lines = (self.line, *self.instrument_lines.values(), *filter(None, [self.servo_line]))
        patience_s = PATIENCE_S if self.servo_line is None else MAX_LAG_S
        self.clock = WorldClock(section.time_scale, time.monotonic, self.laboratory.tick_s, patience_s)
        self.network = Network(self.clock.dialogue)
        self._silent_until_s = 0.0
        self._is_ended = False
        host, board = _find_host(loaded.config), loaded.config.board
        try:
            self.arm_listeners = self._listen_as_arm(loaded.config.turner, section)
            self.servo_listener = (
                None
                if self.servo_line is None
                else self._listen("turner.port", loaded.config.turner.address, self.servo_line, gathers=False)
            )
            self.board_listener = None if board is None else self._listen("board.port", board.port, self.line)
            for name, line in self.instrument_lines.items():
                self._listen(*_find_port(loaded.config, name), line)
            control_port = section.control_port
            self.network.listen(host, control_port, lambda: ControlSession(self))
        except Refused:
            self.network.close()
            raise
        pty = _open_pty(self.line, self.network.selector) if section.board.pty else None
        ptys = {
            name: _open_pty(line, self.network.selector)
            for name, line in self.instrument_lines.items()
            if mounts[name].pty
        }
        self._ptys = [*([pty] if pty else []), *ptys.values()]
        paths = {name: port.path for name, port in ptys.items()}
        self._description = {
            "ready": True,
            "arm": loaded.config.turner.address or None,
            "board": None if board is None else board.port,
            "pty": pty.path if pty else None,
            **self._describe_instruments(loaded.config, paths),
            "control": f"{host}:{control_port}",
        }

    def describe(self) -> str:
        """Return the line of JSON with the addresses of all ports."""
        return json.dumps(self._description)

    def _describe_instruments(self, config: RigConfig, paths: Mapping[str, str]) -> dict[str, dict[str, str]]:
        """Return the instruments' ports by name, and for each kind of instrument the `paths` of pseudo-terminals."""
        mounts = self.laboratory.instruments
        ports = {name: sensor.serial.port for name, sensor in config.sensors.items() if sensor.serial is not None}
        return {
            "kvh_ports": ports,
            **{
                f"{kind}_ptys": {name: path for name, path in paths.items() if mounts[name].kind == kind}
                for kind in KINDS
            },
        }

    def _listen_as_arm(self, turner: TurnerSection, section: WorldSection) -> list[PortListener]:
        """Open and return the ports of the arm's controller, if an arm turns the sensors."""
        if not isinstance(turner, ArmSection):
            return []
        robot = self.laboratory.robot
        listeners = [
            self.network.listen(turner.host, port, partial(new_session, robot), lag_s=lag_s)
            for port, (new_session, lag_s) in ARM_PORTS.items()
            if port not in _find_closed_ports(section.arm, robot)
        ]
        if robot_api_server.has_robot_api(robot):
            new_session = partial(robot_api_server.RobotApiSession, robot, programs=StoredPrograms())
            listeners.append(self.network.listen(turner.host, turner.robot_api_port, new_session))
        return listeners

    def _listen(self, key: str, url: str, line: SerialLine, *, gathers: bool = True) -> PortListener:
        """Open and return the port of a serial line, which accepts one client and hangs up on a second one."""
        return self.network.listen(
            *_parse_address(key, url), lambda: SerialSession(line), limit=1, lag_s=SERIAL_LAG_S, gathers=gathers
        )

    # -- faults of the wires ---------------------------------------------------------------------------------------
    def silence_arm(self, duration_s: float) -> None:
        """Let the controller neither send nor read for `duration_s` of wall time, in which clients' time-outs run."""
        self._silent_until_s = time.monotonic() + duration_s
        for listener in self.arm_listeners:
            listener.set_silent(True)

    def close_arm(self, *, listen: bool) -> None:
        """Close all connections of the controller; if `listen`, the controller then accepts new ones."""
        for listener in self.arm_listeners:
            listener.hang_up() if listen else listener.close()

    def close_arm_port(self, port: int) -> None:
        """Close the connections of one port of the controller, which then accepts no new ones."""
        for listener in self.arm_listeners:
            if listener.port == port:
                listener.close()

    def set_remote_control(self, on: bool) -> None:
        """Switch the pendant to remote or local control. Local control closes the connections for scripts."""
        robot = self.laboratory.robot
        before, robot.remote_control = robot.local_control, on
        if robot.local_control and not before:
            for listener in self.arm_listeners:
                if listener.port in SCRIPT_PORTS:
                    listener.hang_up()

    def set_servo_line_fault(self, *, silent: bool = False, listen: bool = True) -> None:
        """Make the servo's line silent, or close its port."""
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
        gc.collect()  # an emulated board is a reference cycle of some megabytes; free it before the next one
        if self.laboratory.fit(part):
            self.plug_in_board()

    # -- the truth -------------------------------------------------------------------------------------------------
    def write_truth(self, windows: Mapping[str, Any]) -> None:
        """Write the truth over the windows of a run (`truth_document`) into the world's file.

        Raise ValueError if this world has no such file, if its board is heated, or if the file cannot be written.
        """
        if self._truth_file is None or self.laboratory.body is not None:
            raise ValueError("this world was given no file for its truth, or is heated")
        document = truth_document(self._truth, windows, self.clock.time_s)
        try:
            write_new(self._truth_file, json.dumps(document, indent=1) + "\n")
        except OSError as error:
            raise ValueError(str(error)) from error

    # -- the loop ----------------------------------------------------------------------------------------------------
    def end(self) -> None:
        self._is_ended = True

    def run(self, alive: Callable[[], None] = lambda: None) -> None:
        """Serve until `end`. A tick ends when its bytes have been delivered to the clients, which set the pace.

        While no client is connected, the world runs no faster than a real laboratory, because more speed would only
        waste processor time. `alive` is called after every tick, and whenever none is due.
        """
        polled_s = 0.0
        while not self._is_ended:
            if not (self.network.connections or self._ptys):  # no client waits for the next ticks
                self.clock.dialogue()
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
            if due and not behind_s and not self._is_ended:
                self._tick()
                alive()
            elif wait_s > 0.0:
                alive()

    def _tick(self) -> None:
        """Simulate one tick; if only a client can make the arm move, simulate up to `MAX_LEAP_TICKS` that are due.

        An emulated board makes a tick slow. With one, ticks are therefore simulated one at a time, and clients do not
        receive packets in bursts. If the arm is at rest, its motion is sensed once at the end of several ticks, with
        the same bytes as a result. Every session is called at every tick.
        """
        for remaining in reversed(range(MAX_LEAP_TICKS if self.board_listener is None else 1)):
            self.clock.count()
            self.laboratory.turn()
            last = not (remaining and self.laboratory.motion_source.waiting and self.clock.wait_s() <= 0.0)
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
            # The firmware broke a rule of the chip: the board is dead, and its port with it.
            print(error, file=sys.stderr, flush=True)
            self.unplug_board()

    def close(self) -> None:
        for pty in self._ptys:
            pty.close()
        self.network.close()


def _find_host(config: RigConfig) -> str:
    """Return the simulated devices' host: the turner's or, if a hand turns the item, the board's or a sensor's."""
    if config.turner.simulated_at is not None:
        return config.turner.simulated_at
    ports = [("board.port", config.board.port)] if config.board is not None else []
    ports += [sensor.own_port for sensor in config.sensors.values() if sensor.own_port is not None]
    return _parse_address(*ports[0])[0]


def _find_port(config: RigConfig, name: str) -> tuple[str, str]:
    """Return an instrument's configuration key and port. An autopilot is named by its port."""
    if name not in config.sensors:
        return "mavlink.port", name
    key, port = config.sensors[name].own_port or ("", "")
    return f"sensors.{name}.{key}", port


def _find_closed_ports(arm: SimulatedArmSection, robot: Robot) -> set[int]:
    """Return the ports that the simulated controller keeps closed."""
    closed = set() if arm.dashboard and not robot.is_polyscope_x else {dashboard_server.PORT}
    return closed if arm.primary else closed | {script_socket.PRIMARY_PORT}


def _parse_address(key: str, url: str) -> tuple[str, int]:
    """Return host and port of `socket://host:port`. Raise Refused `board_port` for any other port."""
    parts = urlsplit(url)
    try:
        if parts.scheme == "socket" and parts.hostname and parts.port:
            return parts.hostname, parts.port
    except ValueError:
        pass  # the port is not a number
    raise Refused("board_port", f"{key} {url!r} is not an address to listen on", "Write socket://host:port")


def _open_pty(line: SerialLine, selector: selectors.BaseSelector) -> "PtyPort":
    if os.name != "posix":
        raise Refused(
            "no_pty",
            "world: this system has no pseudo-terminals",
            "Leave every `pty: true` out, and use the socket:// port",
        )
    from rig.world.board.pty_port import PtyPort  # its modules exist on POSIX only

    return PtyPort(line, selector)


def serve(loaded: Loaded, until_eof: bool, late: Path | None = None, truth: Path | None = None) -> None:
    """Run the world until end of input (`until_eof`) or Ctrl-C. Raise Refused if a port is not available.

    Reports of late steps are written to the file `late`, or to stderr if `late` is None. The truth is written to the
    file `truth`, if one is given.
    """
    world = World(loaded, truth)
    try:
        # Set even if the parent process ignores these. An exception would be lost inside a call of the emulator.
        for number in (signal.SIGTERM, signal.SIGINT):
            signal.signal(number, lambda *_: world.end())
        if until_eof:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            # A thread, because select() does not accept a pipe on Windows; it only waits.
            threading.Thread(target=_await_end_of_input, args=(world,), daemon=True).start()
        # All objects so far are permanent. To search them for garbage again and again costs 5 % of the pace.
        gc.collect()
        gc.freeze()
        gc.set_threshold(GARBAGE_THRESHOLD)
        with closing(FlightRecorder(late, world.network.describe_lagging_clients)) as recorder:
            print(world.describe(), flush=True)
            world.run(recorder.alive)
    finally:
        world.close()


def _await_end_of_input(world: World) -> None:
    while os.read(sys.stdin.fileno(), 4096):
        pass
    world.end()
