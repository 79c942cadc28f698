"""The report of an arm of Universal Robots, and its controller's setup."""

from dataclasses import dataclass

from rig.motion.chain import DenavitHartenberg, Pose
from rig.motion.turner_state import JOINT_NAMES, ArmState, JointLimits

MAKER = "Universal Robots"


@dataclass(frozen=True, slots=True)
class ArmSetup:
    """The arm for which the controller is set up: the maker's type number, lengths, joint limits."""

    robot_type: int
    nominal: DenavitHartenberg
    limits: JointLimits


@dataclass(frozen=True, slots=True)
class ArmReport:
    """The arm's `Report` of itself; None for items that the controller does not report.

    - host: its address.
    - version: its software (major, minor, bugfix, build).
    - polyscope: the software in its own words.
    - serial_number: the arm's serial number, or "not reported".
    - remote_control: whether the pendant's mode is remote control.
    - program_running: whether the controller runs a program.
    - state: the arm's state at the time of the report.
    - kinematics: the arm's geometry as measured in the factory.
    - tcp_offset: the pose of its tool centre point in the flange's frame.
    - setup: the arm for which the controller is set up.
    - called: the dashboard's name for it.
    - model: the maker's name of the arm, found from the other items.
    - registers_free: whether a half of the registers is free for the client's script.
    """

    host: str
    version: tuple[int, ...]
    polyscope: str
    serial_number: str
    remote_control: bool | None
    program_running: bool
    state: ArmState
    kinematics: DenavitHartenberg | None = None
    tcp_offset: Pose | None = None
    setup: ArmSetup | None = None
    called: str | None = None
    model: str | None = None
    registers_free: bool | None = None

    @property
    def software(self) -> str:
        """The controller's software version, in its own words."""
        return self.polyscope

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of its joints."""
        return JOINT_NAMES

    @property
    def words(self) -> str:
        """The arm described in a line of text: model, serial number, software."""
        model = "model not reported" if self.model is None else f"{MAKER} {self.model}"
        return f"{model}, serial number {self.serial_number}, PolyScope {self.polyscope}"
