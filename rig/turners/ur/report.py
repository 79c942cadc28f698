"""What a look at an arm of Universal Robots shows, and what its controller says that it is set up for."""

from dataclasses import dataclass

from rig.motion.geometry import DenavitHartenberg, Pose
from rig.motion.state import JOINT_NAMES, ArmState, JointLimits

MAKER = "Universal Robots"


@dataclass(frozen=True, slots=True)
class ArmSetup:
    """Which arm the controller is set up for: the maker's number of its type, its lengths, its joints' limits."""

    robot_type: int
    drawing: DenavitHartenberg
    limits: JointLimits


@dataclass(frozen=True, slots=True)
class ArmReport:
    """What a look at the arm shows; None where the controller does not tell.

    `version` is its software's (major, minor, bugfix, build), `polyscope` the same in its own words; `kinematics` is
    its arm's geometry as the factory has measured it, `tcp_offset` where its tool centre point stands in the flange's
    frame, `setup` the arm it is set up for, `called` that arm's name as the dashboard has it. `model` is which arm all
    of that means, in the maker's names. `registers_free` says whether the client finds room among the registers by
    which it speaks with its script. It is a `Report`.
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
        """The controller's software in its own words."""
        return self.polyscope

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of its joints."""
        return JOINT_NAMES

    @property
    def words(self) -> str:
        """The arm as a line of text names it: model, serial number, software."""
        named = "model not told" if self.model is None else f"{MAKER} {self.model}"
        return f"{named}, serial number {self.serial_number}, PolyScope {self.polyscope}"
