"""The dashboard server, port 29999: one line in, one line out.

Source: the maker's Dashboard Server manual, e-Series. In local control the server answers questions and refuses every
order, including `stop`. A connection that was opened in local control never accepts orders, so the client must open a
new one (Universal Robots ROS Driver, issues 125 and 262). A CB3 has neither local control nor operational modes, nor
the commands about them; it has user roles, which the e-Series lacks (the maker's client library,
`dashboard_client_implementation_g5.cpp`).
"""

from collections.abc import Callable
from pathlib import PurePosixPath

from rig.world.ur10e.interfaces.stored_programs import WAIT_PROGRAM, WaitProgram
from rig.world.ur10e.modes import RobotMode, RuntimeState, SafetyMode
from rig.world.ur10e.robot import E_SERIES, Robot

PORT = 29999
LINE_BYTES = 1 << 16  # longer than any command
UNLOCK_AFTER_S = 5.0
PROGRAMS = (f"{WAIT_PROGRAM}.urp",)
OPERATIONAL_MODES = ("MANUAL", "AUTOMATIC")
MIN_VERSIONS = {  # the first versions of the e-Series with these commands, which no CB3 has
    "version": E_SERIES,
    "safetystatus": (5, 4),
    "is in remote control": (5, 6),
    "get operational mode": (5, 6),
    "set operational mode": E_SERIES,
    "clear operational mode": E_SERIES,
}
CB3_COMMANDS = ("setuserrole", "getuserrole")
SAFETY_REFUSAL = "Command is not allowed due to safety reasons"
REMOTE_CONTROL_REFUSAL = f"{SAFETY_REFUSAL}, please switch robot to Remote Control mode and reconnect to port {PORT}"
UNLOCK_REFUSAL = (
    "Cannot unlock protective stop until 5s after occurrence. Always inspect cause of protective stop before unlocking"
)


class DashboardSession:
    """The world's side of one connection to the dashboard."""

    dialogue = True

    def __init__(self, robot: Robot) -> None:
        """Fill the tables of commands: questions and orders, without and with an argument."""
        self._robot = robot
        self._opened_in_local_control = robot.local_control
        self.closing = False
        self._buffer = bytearray()
        self._role = "none"
        self._mode: str | None = None  # as set by the dashboard; None: the pendant controls it
        self._questions: dict[str, Callable[[], str]] = {
            "polyscopeversion": self._polyscope,
            "version": self._version,
            "robotmode": self._robotmode,
            "safetymode": lambda: f"Safetymode: {robot.safety_mode.name}",
            "safetystatus": lambda: f"Safetystatus: {robot.safety_mode.name}",
            "running": lambda: f"Program running: {str(self._playing).lower()}",
            "programstate": self._program_state,
            "get loaded program": self._get_loaded_program,
            "isprogramsaved": lambda: f"true {robot.loaded_program}",
            "get serial number": lambda: robot.identity.serial_number,
            "get robot model": lambda: robot.model.name,
            "is in remote control": lambda: str(robot.remote_control).lower(),
            "get operational mode": lambda: self._mode or "NONE",  # no password for modes is set
            "getuserrole": self._get_role,
            "popup": lambda: "showing popup",
            "close popup": lambda: "closing popup",
            "close safety popup": lambda: "closing safety popup",
            "addtolog": lambda: "Added log message",
            "generate flight report": lambda: "Flight Report generated with id: 1",
            "generate support file": lambda: "Completed successfully: ur_support.zip",
            "savelog": lambda: "Log saved to disk",
            "clear operational mode": self._clear_mode,
        }
        self._orders: dict[str, Callable[[], str]] = {
            "play": self._play,
            "stop": self._stop,
            "pause": lambda: "Pausing program" if robot.pause() else "Failed to execute: pause",
            "power off": self._power_off,
            "shutdown": self._shutdown,
            "power on": self._power_on,
            "brake release": self._brake_release,
            "unlock protective stop": self._unlock,
            "restart safety": self._restart_safety,
        }
        self._orders_with_text: dict[str, Callable[[str], str]] = {
            "load installation": lambda name: f"Loading installation: {name}" if name else "File not found: ",
            "load": self._load,
        }
        self._questions_with_text: dict[str, Callable[[str], str]] = {
            "popup": lambda text: "showing popup",
            "addtolog": lambda text: "Added log message",
            "set operational mode": self._set_mode,
            "setuserrole": self._set_role,
            "generate flight report": lambda kind: "Flight Report generated with id: 1",
            "generate support file": lambda folder: f"Completed successfully: {folder}/ur_support.zip",
        }

    def greeting(self) -> bytes:
        return b"Connected: Universal Robots Dashboard Server\n"

    def receive(self, data: bytes) -> bytes:
        self._buffer += data
        *lines, rest = self._buffer.split(b"\n")
        self._buffer = bytearray(rest)
        answers = [self.answer(line.decode(errors="replace").strip()) for line in lines]
        if len(self._buffer) > LINE_BYTES:
            self._buffer.clear()
            self.closing = True
            answers.append(f"could not understand: a line of more than {LINE_BYTES} bytes")
        return b"".join(answer.encode() + b"\n" for answer in answers)

    def tick(self) -> bytes:
        return b""

    def handle_close(self) -> None:
        pass

    def answer(self, line: str) -> str:
        """Return the reply to one command."""
        key = line.lower()
        if key == "quit":
            self.closing = True
            return "Disconnected"
        if key in self._questions and self._has(key):
            return self._questions[key]()
        if key in self._orders:
            return self._orders[key]() if self._may_order else REMOTE_CONTROL_REFUSAL
        for words, handler in {**self._orders_with_text, **self._questions_with_text}.items():
            if (key == words or key.startswith(words + " ")) and self._has(words):
                allowed = self._may_order or words not in self._orders_with_text
                return handler(line[len(words) :].strip()) if allowed else REMOTE_CONTROL_REFUSAL
        return f"could not understand: '{line}'"

    def _has(self, command: str) -> bool:
        """Return whether the controller's software has a command."""
        version = self._robot.identity.polyscope
        return version < E_SERIES if command in CB3_COMMANDS else version >= MIN_VERSIONS.get(command, (0,))

    @property
    def _may_order(self) -> bool:
        """Whether the dashboard accepts orders."""
        return not (self._opened_in_local_control or self._robot.local_control)

    # -- questions ---------------------------------------------------------------------------------------------
    @property
    def _playing(self) -> bool:
        return self._robot.runtime_state in (RuntimeState.PLAYING, RuntimeState.RESUMING)

    def _version(self) -> str:
        return ".".join(str(part) for part in self._robot.identity.polyscope)

    def _polyscope(self) -> str:
        return f"URSoftware {self._version()} (simulated)"

    def _robotmode(self) -> str:
        return f"Robotmode: {self._robot.robot_mode.name}"

    def _program_state(self) -> str:
        name = PurePosixPath(self._robot.program_name).name or "<unnamed>"
        paused = self._robot.runtime_state in (RuntimeState.PAUSING, RuntimeState.PAUSED)
        return f"{'PLAYING' if self._playing else 'PAUSED' if paused else 'STOPPED'} {name}"

    def _get_loaded_program(self) -> str:
        name = self._robot.loaded_program
        return f"Loaded program: {name}" if name else "No program loaded"

    # -- orders ------------------------------------------------------------------------------------------------
    def _stop(self) -> str:
        self._robot.stop_program("stopped from the dashboard")
        return "Stopped"

    def _play(self) -> str:
        if self._robot.resume():
            return "Starting program"
        if self._robot.runtime_state == RuntimeState.STOPPED and self._robot.loaded_program and self._robot.ready:
            self._robot.start_program(WaitProgram(self._robot.loaded_program))
            return "Starting program"
        return "Failed to execute: play"

    def _load(self, name: str) -> str:
        if PurePosixPath(name).name not in PROGRAMS:
            return f"File not found: {name}"
        self._robot.loaded_program = name
        return f"Loading program: {name}"

    def _power_on(self) -> str:
        self._robot.power_on()
        return "Powering on"

    def _power_off(self) -> str:
        self._robot.power_off()
        return "Powering off"

    def _brake_release(self) -> str:
        self._robot.brake_release()
        return "Brake releasing"

    def _unlock(self) -> str:
        """Unlock a protective stop that has lasted 5 s (only pendant and dashboard require this); return the answer."""
        if self._robot.safety_mode == SafetyMode.PROTECTIVE_STOP and self._robot.stopped_for_s < UNLOCK_AFTER_S:
            return UNLOCK_REFUSAL
        self._robot.unlock_protective_stop()
        return "Protective stop releasing"

    def _restart_safety(self) -> str:
        self._robot.restart_safety()
        return "Restarting safety"

    def _shutdown(self) -> str:
        if self._robot.robot_mode != RobotMode.POWER_OFF:
            self._robot.power_off()
        return "Shutting down"

    def _set_mode(self, name: str) -> str:
        if name.upper() not in OPERATIONAL_MODES:
            return f"Failed setting operational mode: '{name}'"
        self._mode = name.upper()
        return f"Operational mode '{self._mode}' is set"

    def _clear_mode(self) -> str:
        self._mode = None
        return "No longer controlling the operational mode. Current operational mode: 'NONE'."

    def _get_role(self) -> str:
        return self._role.upper()

    def _set_role(self, role: str) -> str:
        self._role = role
        return f"Setting user role: {role}"
