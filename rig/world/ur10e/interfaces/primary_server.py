"""The primary and secondary interfaces, ports 30001 and 30002, which send the robot's state and its messages.

The state is sent ten times a second. Source: the maker's client interface description for PolyScope 5. A package is a
big-endian size (i32), a type (u8) and a payload. The payload of type 16, a robot state, consists of sub-packages of the
same form; that of type 20, a robot message, begins with time stamp, source and kind.
"""

import struct
from collections.abc import Callable

from rig.world.clock import TICKS_PER_SECOND
from rig.world.ur10e.controller_messages import Message, MessageKind
from rig.world.ur10e.interfaces.script_socket import ScriptSession
from rig.world.ur10e.interfaces.variables import joint_modes
from rig.world.ur10e.modes import RobotMode, RuntimeState, SafetyMode
from rig.world.ur10e.motion.links import Links, links
from rig.world.ur10e.robot import Robot

STATE_HZ = 10
ROBOT_STATE, ROBOT_MESSAGE = 16, 20
VERSION_MESSAGE = 3
ACCELERATION_LIMIT_RAD_S2 = 40.0  # for every joint
NOT_CALIBRATED, CALIBRATED = 0, 2  # state of the links in KinematicsInfo: those of the model, or those of this arm
PROJECT, BUILT = b"URControl", b"simulated"  # in place of a date, as at the dashboard


def build_package(kind: int, payload: bytes) -> bytes:
    return struct.pack(">iB", 5 + len(payload), kind) + payload


class PrimarySession:
    """The world's side of one connection: programs come in, states and messages go out."""

    dialogue = True

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._script = ScriptSession(robot)
        self._last_sent = robot.messages.last

    def greeting(self) -> bytes:
        major, minor, bugfix, build = self._robot.identity.polyscope
        name = bytes([len(PROJECT)]) + PROJECT
        version = name + struct.pack(">BBii", major, minor, bugfix, build) + BUILT
        return _message(self._robot, VERSION_MESSAGE, version) + _state(self._robot, (*STATE, *CONFIGURATION))

    @property
    def closing(self) -> bool:
        return self._script.closing

    def receive(self, data: bytes) -> bytes:
        return self._script.receive(data)

    def tick(self) -> bytes:
        data = b""
        for message in self._robot.messages.after(self._last_sent):
            data += _message(self._robot, message.kind, _content(message))
            self._last_sent = message.number
        if self._robot.tick % (TICKS_PER_SECOND // STATE_HZ) == 0:
            data += _state(self._robot, STATE)
        return data

    def handle_close(self) -> None:
        pass


def _timestamp_us(robot: Robot) -> int:
    """Return the controller's time in a message, µs; zero if the clock was set back to before its start."""
    return max(int(robot.reported_time_s * 1e6), 0)


def _message(robot: Robot, kind: int, payload: bytes) -> bytes:
    return build_package(ROBOT_MESSAGE, struct.pack(">QbB", _timestamp_us(robot), -1, kind) + payload)


def _content(message: Message) -> bytes:
    """Return the body of a robot message, whose form depends on its kind."""
    text = message.text.encode(errors="replace")  # a program's text may hold half a character
    if message.kind == MessageKind.KEY:
        title = message.title.encode()
        return struct.pack(">iiB", 0, 0, len(title)) + title + text
    if message.kind == MessageKind.SAFETY_MODE:
        return struct.pack(">iiBII", 0, 0, SafetyMode[message.text], 0, 0)  # the codes of causes are not simulated
    if message.error is not None:
        return struct.pack(">iiiII", *(message.error.code, message.error.argument, message.error.level), 0, 0) + text
    if message.kind == MessageKind.EXCEPTION:
        return struct.pack(">ii", *message.position) + text
    return text


Part = tuple[int, Callable[[Robot], bytes]]


def _state(robot: Robot, parts: tuple[Part, ...]) -> bytes:
    return build_package(ROBOT_STATE, b"".join(build_package(kind, content(robot)) for kind, content in parts))


def _robot_mode(robot: Robot) -> bytes:
    """Return the sub-package of robot mode data."""
    playing = robot.runtime_state in (RuntimeState.PLAYING, RuntimeState.RESUMING, RuntimeState.STOPPING)
    return struct.pack(
        ">Q7?BB3dB",
        _timestamp_us(robot),
        True,
        True,
        robot.robot_mode != RobotMode.POWER_OFF,
        robot.safety_mode == SafetyMode.ROBOT_EMERGENCY_STOP,
        robot.safety_mode == SafetyMode.PROTECTIVE_STOP,
        playing,
        robot.runtime_state in (RuntimeState.PAUSING, RuntimeState.PAUSED),
        robot.robot_mode,
        0,  # control mode: position
        robot.speed_slider,
        robot.speed_scaling,
        1.0,
        0,
    )


def _joints(robot: Robot) -> bytes:
    motion, modes = robot.motion, joint_modes(robot)
    columns = zip(motion.actual_q_rad, motion.now.target_q_rad, motion.actual_qd_rad_s, modes, strict=True)
    return b"".join(
        struct.pack(">3d4fB", q, target, qd, 0.0, 48.0, 28.0, 28.0, mode) for q, target, qd, mode in columns
    )


def _masterboard(robot: Robot) -> bytes:
    inputs = struct.pack(">iiBBdd", 0, robot.digital_outputs, 0, 0, 0.0, 0.0)
    outputs = struct.pack(">bbdd", 0, 0, *robot.analog_outputs)
    return inputs + outputs + struct.pack(">4f3BIBBB", 30.0, 48.0, 0.6, 0.0, robot.safety_mode, 0, 0, 0, 0, 0, 0)


def _cartesian(robot: Robot) -> bytes:
    return struct.pack(">12d", *robot.tcp_pose(robot.motion.actual_q_rad), *robot.tcp_offset)


def _list_parameters(links: Links) -> list[float]:
    """Return the Denavit–Hartenberg parameters of all links: every a, then every d, then every alpha."""
    return [*(link.a_m for link in links), *(link.d_m for link in links), *(link.alpha_rad for link in links)]


def _kinematics(robot: Robot) -> bytes:
    """Return the sub-package of the arm's own links with their calibration, and whether they are calibrated."""
    angles = [link.theta_rad for link in robot.links]
    status = CALIBRATED if robot.links != links(nominal=robot.model.nominal) else NOT_CALIBRATED
    return struct.pack(">6I24dI", *[1] * 6, *angles, *_list_parameters(robot.links), status)


def _configuration(robot: Robot) -> bytes:
    """Return the sub-package of the nominal geometry, and of joint limits as restricted by the safety settings."""
    model = robot.model
    positions = [value for limit in model.limit_rad for value in (-limit, limit)]
    speeds = [value for speed in model.speed_rad_s for value in (speed, ACCELERATION_LIMIT_RAD_S2)]
    defaults = [1.05, 1.4, 0.25, 1.2, 0.5]  # joint speed and acceleration, tool speed and acceleration, radius
    nominal = _list_parameters(links(nominal=model.nominal))
    numbers = [*positions, *speeds, *defaults, *nominal, *[0.0] * 6]
    return struct.pack(f">{len(numbers)}d4i", *numbers, 0, 0, model.robot_type, 0)


STATE: tuple[Part, ...] = ((0, _robot_mode), (1, _joints), (3, _masterboard), (4, _cartesian))
CONFIGURATION: tuple[Part, ...] = ((5, _kinematics), (6, _configuration))
