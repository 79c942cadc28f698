"""What happens in a run, as typed events. Words are made of them where they are read; nothing parses sentences.

All events of a run come in order, from the thread that runs the procedure.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from firmware_host.client import BoardIdentity
from rig.analysis.check import Check
from rig.data.recording.events import Event
from rig.errors import RigError
from rig.motion.state import Report, State
from rig.motion.steps import Plan, Step
from rig.observation.observe import Observation
from rig.observation.statistics.mean import ReadAtRest


@dataclass(frozen=True, slots=True)
class BoardConnected:
    """The board answered at `port`, and its firmware is the right one."""

    port: str
    identity: BoardIdentity


@dataclass(frozen=True, slots=True)
class SensorConnected:
    """The instrument `sensor` answered at a port of its own; `corrected` settings in its memory were not as needed:
    name → what was there."""

    sensor: str
    part: str
    serial_number: str
    port: str
    corrected: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class ArmConnected:
    """What turns answered and said how it stands; nothing has moved. `called` is its kind's name among operators."""

    report: Report
    called: str = "arm"


@dataclass(frozen=True, slots=True)
class RunResumed:
    """An interrupted run goes on: `done` of the `planned` sweeps and dwells count already."""

    done: int
    planned: int


@dataclass(frozen=True, slots=True)
class PhaseStarted:
    """A movement is about to be recorded: by which procedure, the steps it has, the sensors (name → "raw" or
    "calibrated" readings)."""

    procedure: str
    plan: Plan
    sensors: dict[str, str]


@dataclass(frozen=True, slots=True)
class PreflightPassed:
    """All that can be known beforehand is right with the plan and what turns, `called` as its kind is."""

    plan: Plan
    report: Report
    called: str = "arm"


@dataclass(frozen=True, slots=True)
class Prompt:
    """The operator is told `announcement` and asked to agree `to_do` it, which a page has them tick first.

    What is `for_a_person` is not agreed to beforehand: nobody but somebody who is asked can say yes to it. Before a
    stage for which the item is mounted, `mounts` is its number, from 0.
    """

    announcement: tuple[str, ...]
    to_do: str = "start"
    to_tick: str = "I have looked: nobody and nothing is within the arm's reach"
    for_a_person: bool = False
    mounts: int | None = None


@dataclass(frozen=True, slots=True)
class Answered:
    """What came of the last `Prompt`."""

    agreed: bool


@dataclass(frozen=True, slots=True)
class SamplingStarted:
    """Every sensor delivers."""


@dataclass(frozen=True, slots=True)
class StepStarted:
    """Step `number` (from 1) of `count` begins."""

    number: int
    count: int
    step: Step


@dataclass(frozen=True, slots=True)
class Progress:
    """How far the run is, many times in each step: the `fraction` of the step from 0 to 1, times of the whole plan."""

    number: int
    count: int
    step: Step
    fraction: float
    elapsed_s: float
    remaining_s: float
    arm_speed_rad_s: float


@dataclass(frozen=True, slots=True)
class SensorSamples:
    """What one sensor has delivered so far: samples, gaps in their numbers, the newest mean readings by quantity.

    A reading has a number for each axis, or one, in the quantity's unit (`rig.data.installed_kinds.measured`).
    """

    sensor: str
    samples: int
    lost: int
    latest: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class ArmSeen:
    """How the arm stands by its newest state, and how many states it sent that were missed (None: nobody counted).

    Comes with every `Progress`, and once more when the arm was let go.
    """

    state: State
    missed_states: int | None


@dataclass(frozen=True, slots=True)
class SamplesTaken:
    """The samples of every sensor so far; comes with every `Progress`."""

    sensors: tuple[SensorSamples, ...]


@dataclass(frozen=True, slots=True)
class StepFinished:
    """Step `number` of `count` has ended; it took `took_s` of the controller's time."""

    number: int
    count: int
    step: Step
    took_s: float


@dataclass(frozen=True, slots=True)
class PhaseRecorded:
    """A movement is done and recorded; `missed_states` are gaps in what the arm said of itself."""

    sensors: tuple[SensorSamples, ...]
    missed_states: int


@dataclass(frozen=True, slots=True)
class HandSeen:
    """What a hand does at this moment, ten times a second, by the first sensor to calibrate.

    `time_s` counts by the board's clock. `doing` is "starting", "resting", "moving" or "held" for `since_s`; the move
    has `turned_rad` so far, its fastest reading was `peak_rad_s` of the `range_rad_s`. `expanded_scale` is U (k = 2) of
    the scale factors so far, the largest, None before anything is known; `faces` lay up already, `pairs` and `turns`
    are still open.
    """

    time_s: float
    doing: str
    since_s: float
    turned_rad: float
    peak_rad_s: float
    range_rad_s: float
    expanded_scale: float | None
    faces: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    turns: tuple[tuple[str, int], ...]
    taken: int


@dataclass(frozen=True, slots=True)
class ObservationMade:
    """The host has averaged a revolution of `sensor`: once a phase is judged, each that its calibration rests on."""

    sensor: str
    observation: Observation


@dataclass(frozen=True, slots=True)
class AttitudeRead:
    """The host has averaged what a sensor read in a dwell: once a phase is judged, every one."""

    read: ReadAtRest


@dataclass(frozen=True, slots=True)
class CalibrationStored:
    """The board keeps the sensor's new calibration, as its record number `record`."""

    sensor: str
    part: str
    serial_number: str
    record: int


@dataclass(frozen=True, slots=True)
class PhaseSkipped:
    """What was to follow, the verification, does not: the calibration failed its limits and is not stored."""

    procedure: str


@dataclass(frozen=True, slots=True)
class UncertaintySoFar:
    """The expanded uncertainties after a repeat. If they are `as_wanted`, the other repeats are left out.

    `scale_u` and `bias_u_rad_s` are those of the axis and the sensor that is known worst.
    """

    scale_u: float
    bias_u_rad_s: float
    repeats_left: int
    as_wanted: bool


@dataclass(frozen=True, slots=True)
class DocumentWritten:
    """A document of the outcome lies at `path`."""

    path: Path


@dataclass(frozen=True, slots=True)
class Plotted:
    """Plots lie in the run folder, each as PNG and SVG under these names without their endings."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NotPlotted:
    """There are no plots: what draws them is not installed."""


@dataclass(frozen=True, slots=True)
class Checked:
    """One limit beside what was measured."""

    check: Check


@dataclass(frozen=True, slots=True)
class VerdictReached:
    """The run's verdict; its checks came before it."""

    passed: bool


@dataclass(frozen=True, slots=True)
class ListenerDropped:
    """A listener raised `error` when it was told something; it hears nothing more."""

    listener: str
    error: str


@dataclass(frozen=True, slots=True)
class RunFolderWritten:
    """The run is over, and all of it lies in `folder`."""

    folder: Path


@dataclass(frozen=True, slots=True)
class Since:
    """What the calibration before, its number and day, found of the `quantity` of a `sensor`, by parameter (`kx`).

    `before` has values with their U, in SI units; `normalised_error` is E_n of the changes since. `changed` are those
    that have changed by more than chance explains, among all values of the run.
    """

    sensor: str
    quantity: str
    number: int
    day: str
    before: Mapping[str, tuple[float, float]]
    normalised_error: Mapping[str, float]
    changed: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Remembered:
    """The run stands in `history` as the calibrations of these `numbers`, by which `rig history` finds them.

    `usual` is whether the command looks there by itself. `since` are the calibrations before of the sensors that had
    any.
    """

    history: str
    numbers: tuple[int, ...]
    since: tuple[Since, ...] = ()
    usual: bool = True


@dataclass(frozen=True, slots=True)
class NotRemembered:
    """The run in `folder` could not be entered in the history, and why. It is none the worse."""

    folder: Path
    why: str


@dataclass(frozen=True, slots=True)
class Advice:
    """What to do after a failure: the data are in `folder`; `command` goes on there, or `repeats` refused sweeps."""

    folder: Path
    command: str
    repeats: bool


@dataclass(frozen=True, slots=True)
class Failed:
    """The run was refused or ended in a fault, named. The data are kept if there are any."""

    error: RigError


@dataclass(frozen=True, slots=True)
class Interrupted:
    """Somebody ended the run; the text says how the arm was left and how to go on."""

    text: str


@dataclass(frozen=True, slots=True)
class Crashed:
    """A defect of the program ended the run."""

    traceback: str


# What the recording keeps is told as well: sweeps, rests, and what the board observed and solved.
RunEvent = (
    Event
    | BoardConnected
    | SensorConnected
    | ArmConnected
    | RunResumed
    | PhaseStarted
    | PreflightPassed
    | Prompt
    | Answered
    | SamplingStarted
    | StepStarted
    | Progress
    | ArmSeen
    | SamplesTaken
    | StepFinished
    | PhaseRecorded
    | HandSeen
    | ObservationMade
    | AttitudeRead
    | CalibrationStored
    | PhaseSkipped
    | UncertaintySoFar
    | DocumentWritten
    | Plotted
    | NotPlotted
    | Checked
    | VerdictReached
    | ListenerDropped
    | Remembered
    | NotRemembered
    | RunFolderWritten
    | Advice
    | Failed
    | Interrupted
    | Crashed
)
