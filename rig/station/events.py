"""The typed events of a run. Views convert them to words; no program parses sentences.

All events of a run come in order, from the thread that runs the procedure.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from firmware_host.client import BoardIdentity
from rig.analysis.check import Check
from rig.data.recording.recorded_events import Event
from rig.errors import RigError
from rig.motion.steps import Plan, Step
from rig.motion.turner_state import Report, State
from rig.observation.observe import Observation
from rig.observation.statistics.mean import ReadAtRest


@dataclass(frozen=True, slots=True)
class BoardConnected:
    """The board answered at `port`, and its firmware is the right one."""

    port: str
    identity: BoardIdentity


@dataclass(frozen=True, slots=True)
class SensorConnected:
    """The instrument `sensor` answered at a port of its own.

    `corrected` are settings in its memory that were changed: name → earlier value.
    """

    sensor: str
    part: str
    serial_number: str
    port: str
    corrected: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class ArmConnected:
    """The turner answered and reported its state; nothing has moved. `called` is the name of its kind for operators."""

    report: Report
    called: str = "arm"


@dataclass(frozen=True, slots=True)
class RunResumed:
    """An interrupted run continues: `done` of the `planned` sweeps and dwells count already."""

    done: int
    planned: int


@dataclass(frozen=True, slots=True)
class PhaseStarted:
    """The recording of a movement is about to start: its procedure, its steps, its sensors.

    `sensors`: name → "raw" or "calibrated" readings.
    """

    procedure: str
    plan: Plan
    sensors: dict[str, str]


@dataclass(frozen=True, slots=True)
class PreflightPassed:
    """Plan and turner passed all tests before the first movement; `called` is the name of the turner's kind."""

    plan: Plan
    report: Report
    called: str = "arm"


@dataclass(frozen=True, slots=True)
class Prompt:
    """A question to the operator.

    After the `announcement` it asks for agreement to the action `to_do`; a page also shows a box to tick, with the text
    `to_tick`. A question `for_a_person` cannot be agreed to in advance. Before a stage with a new mounting, `mounts` is
    the stage's number, from 0.
    """

    announcement: tuple[str, ...]
    to_do: str = "start"
    to_tick: str = "I have looked: nobody and nothing is within the arm's reach"
    for_a_person: bool = False
    mounts: int | None = None


@dataclass(frozen=True, slots=True)
class Answered:
    """The answer to the last `Prompt`."""

    agreed: bool


@dataclass(frozen=True, slots=True)
class SamplingStarted:
    """Every sensor sends readings."""


@dataclass(frozen=True, slots=True)
class StepStarted:
    """Step `number` (from 1) of `count` begins."""

    number: int
    count: int
    step: Step


@dataclass(frozen=True, slots=True)
class Progress:
    """The progress of the run, sent often: the `fraction` of the step (0 to 1), and times elapsed and remaining."""

    number: int
    count: int
    step: Step
    fraction: float
    elapsed_s: float
    remaining_s: float
    arm_speed_rad_s: float


@dataclass(frozen=True, slots=True)
class SensorSamples:
    """The samples of one sensor so far: numbers of received and `lost` ones, and the `latest` means by quantity.

    A mean reading is a number for each axis, or a single one, in the unit of the quantity.
    """

    sensor: str
    samples: int
    lost: int
    latest: Mapping[str, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class ArmSeen:
    """The arm's newest state, and the number of missed states (None: not counted).

    This event comes with every `Progress`, and once more when the arm is released.
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
    """A movement is recorded; `missed_states` counts gaps in the arm's states."""

    sensors: tuple[SensorSamples, ...]
    missed_states: int


@dataclass(frozen=True, slots=True)
class HandSeen:
    """The present movement of a hand as the first sensor to calibrate measures it, ten times a second.

    - time_s: the board's time.
    - doing: "starting", "resting", "moving" or "held".
    - since_s: the duration of that state.
    - turned_rad: the angle of the move so far.
    - peak_rad_s: the fastest reading of the move so far.
    - range_rad_s: the sensor's range.
    - expanded_scale: the largest U (k = 2) of the scale factors so far, None before a solution.
    - faces: the sides that have been up in a rest.
    - pairs: the pairs of sides between which moves remain; turns: axis and direction of the whole turns that remain.
    - accepted: the number of accepted moves.
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
    accepted: int


@dataclass(frozen=True, slots=True)
class ObservationMade:
    """The host has averaged a revolution of `sensor`; after the verdict, all revolutions are reported again."""

    sensor: str
    observation: Observation


@dataclass(frozen=True, slots=True)
class AttitudeRead:
    """The host has averaged one dwell of a sensor or, after the verdict, all its dwells."""

    read: ReadAtRest


@dataclass(frozen=True, slots=True)
class CalibrationStored:
    """The board has stored the sensor's new calibration, as its record number `record`."""

    sensor: str
    part: str
    serial_number: str
    record: int


@dataclass(frozen=True, slots=True)
class PhaseSkipped:
    """The verification is skipped: the calibration failed its limits and is not stored."""

    procedure: str


@dataclass(frozen=True, slots=True)
class UncertaintySoFar:
    """The expanded uncertainties after a repeat. If these are `as_wanted`, the other repeats are skipped.

    `scale_u` and `bias_u_rad_s` are the largest of all axes and sensors.
    """

    scale_u: float
    bias_u_rad_s: float
    repeats_left: int
    as_wanted: bool


@dataclass(frozen=True, slots=True)
class DocumentWritten:
    """A document of the outcome was written to `path`."""

    path: Path


@dataclass(frozen=True, slots=True)
class Plotted:
    """Plots were written to the run folder, each as PNG and as SVG; `names` are the file names without extension."""

    names: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class NotPlotted:
    """There are no plots: the library for them is not installed."""


@dataclass(frozen=True, slots=True)
class Checked:
    """A check with its limit."""

    check: Check


@dataclass(frozen=True, slots=True)
class VerdictReached:
    """The run's verdict, after its checks."""

    passed: bool


@dataclass(frozen=True, slots=True)
class ListenerDropped:
    """A listener raised `error` on an event, and gets no further events."""

    listener: str
    error: str


@dataclass(frozen=True, slots=True)
class RunFolderWritten:
    """The run is over, and its files are in `folder`."""

    folder: Path


@dataclass(frozen=True, slots=True)
class LastCalibration:
    """The last calibration of a sensor's `quantity` before this run, with its `number` in the history and its `day`.

    `before`: its values with their U, in SI units, by parameter (`kx`); `normalised_error`: E_n of the changes since
    then. `changed`: the parameters whose changes are significant among all values of the run.
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
    """The run was entered in `history` as the calibrations with these `numbers`, by which `rig history` finds them.

    `usual`: whether `history` is the user's default, which commands use if no history is named. `since`: each sensor's
    last calibration before this run, and the changes since then.
    """

    history: str
    numbers: tuple[int, ...]
    since: tuple[LastCalibration, ...] = ()
    usual: bool = True


@dataclass(frozen=True, slots=True)
class NotRemembered:
    """The reason why the run in `folder` could not be entered in the history. The run itself is not affected."""

    folder: Path
    why: str


@dataclass(frozen=True, slots=True)
class Advice:
    """The `command` to give after a failure with data in `folder`; `repeats`: whether it repeats refused sweeps."""

    folder: Path
    command: str
    repeats: bool


@dataclass(frozen=True, slots=True)
class Failed:
    """The run was refused or ended in a named fault. Recorded data are kept."""

    error: RigError


@dataclass(frozen=True, slots=True)
class Interrupted:
    """The run was interrupted; the text states how the arm was left and how to continue."""

    text: str


@dataclass(frozen=True, slots=True)
class Crashed:
    """A defect of the program ended the run."""

    traceback: str


# The recording's own events are included: sweeps, rests, and the board's observations and solutions.
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
