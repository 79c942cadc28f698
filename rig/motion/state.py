"""What the arm says about itself: one state per controller packet, and the report a look at the arm gives."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import IntEnum
from operator import attrgetter

import numpy as np

from rig.motion.geometry import DenavitHartenberg, Pose

JOINT_NAMES = ("base", "shoulder", "elbow", "wrist_1", "wrist_2", "wrist_3")

Joints = tuple[float, ...]  # six values, base to wrist 3
Row = tuple[float | int | Joints, ...]

ARM_STATE_DTYPE = np.dtype(
    [
        ("time_s", "f8"),
        ("host_time_s", "f8"),
        ("q_rad", "f8", (6,)),
        ("qd_rad_s", "f8", (6,)),
        ("target_speed_fraction", "f8"),
        ("speed_scaling", "f8"),
        ("robot_mode", "i4"),
        ("safety_mode", "i4"),
        ("runtime_state", "i4"),
        ("robot_status_bits", "u4"),
        ("safety_status_bits", "u4"),
    ]
)

# A joint slower than this stands still: above the noise of the velocity signal, 0.3° a second.
REST_SPEED_RAD_S = 5e-3


class RobotMode(IntEnum):
    """`robot_mode` of the controller (RTDE guide)."""

    NO_CONTROLLER = -1
    DISCONNECTED = 0
    CONFIRM_SAFETY = 1
    BOOTING = 2
    POWER_OFF = 3
    POWER_ON = 4
    IDLE = 5
    BACKDRIVE = 6
    RUNNING = 7
    UPDATING_FIRMWARE = 8


class SafetyMode(IntEnum):
    """`safety_mode` of the controller (RTDE guide)."""

    NORMAL = 1
    REDUCED = 2
    PROTECTIVE_STOP = 3
    RECOVERY = 4
    SAFEGUARD_STOP = 5
    SYSTEM_EMERGENCY_STOP = 6
    ROBOT_EMERGENCY_STOP = 7
    VIOLATION = 8
    FAULT = 9


class RuntimeState(IntEnum):
    """`runtime_state` of the controller: what its program does (RTDE guide)."""

    STOPPING = 0
    STOPPED = 1
    PLAYING = 2
    PAUSING = 3
    PAUSED = 4
    RESUMING = 5


@dataclass(frozen=True, slots=True)
class ArmState:
    """One packet of the controller.

    `time_s` is the controller's time stamp (the reference clock), `host_time_s` is `time.monotonic()` when the
    packet was read. `q_rad` and `qd_rad_s` are the six measured joint angles (rad) and speeds (rad/s), base to
    wrist 3. `target_speed_fraction` is the speed slider (1 = 100 %), `speed_scaling` what the controller makes of it.
    Modes are the controller's numbers: see `RobotMode`, `SafetyMode`, `RuntimeState`. The field names are those of
    `ARM_STATE_DTYPE`.
    """

    time_s: float
    host_time_s: float
    q_rad: Joints
    qd_rad_s: Joints
    target_speed_fraction: float
    speed_scaling: float
    robot_mode: int
    safety_mode: int
    runtime_state: int
    robot_status_bits: int
    safety_status_bits: int

    def to_record(self) -> Row:
        """The values in the order of `ARM_STATE_DTYPE`: one row for `np.array([...], ARM_STATE_DTYPE)`."""
        return _IN_ORDER(self)  # `astuple` copies every value: a tenth of a run's computing

    @property
    def at_rest(self) -> bool:
        """Whether no joint moves."""
        return max(map(abs, self.qd_rad_s)) < REST_SPEED_RAD_S


_IN_ORDER: Callable[[ArmState], Row] = attrgetter(*(each.name for each in fields(ArmState)))


@dataclass(frozen=True, slots=True)
class JointLimits:
    """What the controller lets the joints do, base to wrist 3 (6,): angles from least to greatest, speed, acceleration.

    A joint that turns without end has none of the first two: they may be infinite.
    """

    least_rad: Joints
    greatest_rad: Joints
    speed_rad_s: Joints
    acceleration_rad_s2: Joints


@dataclass(frozen=True, slots=True)
class ArmSetup:
    """Which arm the controller is set up for: the maker's number of its type, its lengths, its joints' limits."""

    robot_type: int
    drawing: DenavitHartenberg
    limits: JointLimits


@dataclass(frozen=True, slots=True)
class Made:
    """Who made what turns, which model it is (None where it does not tell), and the geometry reckoned with."""

    maker: str
    model: str | None
    kinematics: DenavitHartenberg


@dataclass(frozen=True, slots=True)
class ArmReport:
    """What a look at the arm shows; None where the controller does not tell.

    `version` is its software's (major, minor, bugfix, build), `polyscope` the same in its own words; `payload_kg` and
    `payload_centre_m` (3,) are what the controller reckons with at present, `kinematics` is its arm's geometry as the
    factory has measured it, `tcp_offset` where its tool centre point stands in the flange's frame, `setup` the arm it
    is set up for, `called` that arm's name as the dashboard has it.
    """

    host: str
    version: tuple[int, ...]
    polyscope: str
    serial_number: str
    remote_control: bool | None
    program_running: bool
    payload_kg: float | None
    payload_centre_m: tuple[float, float, float] | None
    state: ArmState
    kinematics: DenavitHartenberg | None = None
    tcp_offset: Pose | None = None
    setup: ArmSetup | None = None
    called: str | None = None
