"""The state of a turner with any number of joints, and the report on a turner.

The state of Universal Robots' arms is also here, because the page shows its modes.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import IntEnum
from operator import attrgetter
from typing import Protocol

from rig.motion.chain import DenavitHartenberg, Pose

JOINT_NAMES = ("base", "shoulder", "elbow", "wrist_1", "wrist_2", "wrist_3")  # joints of an arm of Universal Robots

Joints = tuple[float, ...]  # a value for each joint, beginning with the joint on the ground
Row = tuple[float | int | Joints, ...]


REST_SPEED_RAD_S = 5e-3  # 0.3°/s, above the noise of the velocity signal


class State(Protocol):
    """The state of a turner at one moment.

    `time_s` is the turner's own time, the reference clock of a recording; `host_time_s` is `time.monotonic()` at the
    reading; `q_rad` (n,) and `qd_rad_s` (n,) are the joints' measured angles and speeds.
    """

    @property
    def time_s(self) -> float: ...
    @property
    def host_time_s(self) -> float: ...
    @property
    def q_rad(self) -> Joints: ...
    @property
    def qd_rad_s(self) -> Joints: ...
    def to_record(self) -> Row:
        """Return the values in the order of `state_dtype`. This method is called for hundreds of states a second."""
        ...


@dataclass(frozen=True, slots=True)
class JointState:
    """A `State` with only times and joints."""

    time_s: float
    host_time_s: float
    q_rad: Joints
    qd_rad_s: Joints

    def to_record(self) -> Row:
        """Return the values in the order of `state_dtype`."""
        return self.time_s, self.host_time_s, self.q_rad, self.qd_rad_s


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
    """The state of the controller's program, `runtime_state` (RTDE guide)."""

    STOPPING = 0
    STOPPED = 1
    PLAYING = 2
    PAUSING = 3
    PAUSED = 4
    RESUMING = 5


@dataclass(frozen=True, slots=True)
class ArmState:
    """One packet of the controller: a `State` with six joints, base to wrist 3.

    - target_speed_fraction: the speed slider (1 = 100 %); speed_scaling: the actual scaling.
    - robot_mode, safety_mode, runtime_state: the controller's numbers: `RobotMode`, `SafetyMode`, `RuntimeState`.

    The field names are those of `ARM_STATE_DTYPE`.
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
        """Return the values in the order of `ARM_STATE_DTYPE`, as one row for `np.array([...], ARM_STATE_DTYPE)`."""
        return _IN_ORDER(self)  # `astuple` would copy every value: 10 % of a run's computing

    @property
    def at_rest(self) -> bool:
        """Whether no joint moves."""
        return max(map(abs, self.qd_rad_s)) < REST_SPEED_RAD_S


_IN_ORDER: Callable[[ArmState], Row] = attrgetter(*(field.name for field in fields(ArmState)))


@dataclass(frozen=True, slots=True)
class JointLimits:
    """The controller's joint limits, base to wrist 3 (6,): least and greatest angle, speed, acceleration.

    The angles of a joint that turns endlessly may be infinite.
    """

    least_rad: Joints
    greatest_rad: Joints
    speed_rad_s: Joints
    acceleration_rad_s2: Joints


@dataclass(frozen=True, slots=True)
class TurnerIdentity:
    """A turner's maker and model (None if unknown), and the geometry with which results are computed.

    `tcp_offset`: an arm's tool centre point in the flange's frame, for information. `reading_std_rad`: the standard
    deviation of one reading of an angle, 0 if negligible. If it is not 0, a revolution ends when its first reading
    recurs (`rig.observation.motion.arm_motion`).
    """

    maker: str
    model: str | None
    kinematics: DenavitHartenberg
    tcp_offset: Pose | None = None
    reading_std_rad: float = 0.0


class Report(Protocol):
    """A turner's report about itself.

    `host`: the turner's address or port; `software`: the controller's version; `model`: None if unknown; `kinematics`:
    the reported geometry, or None; `joints`: the joints' names, from the ground on; `words`: a name for sentences.
    """

    @property
    def host(self) -> str: ...
    @property
    def serial_number(self) -> str: ...
    @property
    def software(self) -> str: ...
    @property
    def model(self) -> str | None: ...
    @property
    def state(self) -> State: ...
    @property
    def kinematics(self) -> DenavitHartenberg | None: ...
    @property
    def joints(self) -> tuple[str, ...]: ...
    @property
    def words(self) -> str: ...
