"""The outcome of a run: solved, verified, judged. The documents made of it are `rig.report`'s."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from rig.errors.attempts import Attempts

if TYPE_CHECKING:
    from rig.analysis.check import Check
    from rig.analysis.clock import ClockCheck
    from rig.analysis.consistency.detection_limits import DetectionLimit
    from rig.analysis.external.elsewhere import OfSensor
    from rig.analysis.gyroscope.calibration import SensorResult
    from rig.analysis.gyroscope.mounts import EstimatedMount
    from rig.analysis.gyroscope.onboard_check import Agreement
    from rig.analysis.gyroscope.verification import Verification
    from rig.analysis.installed_kinds import KindFound
    from rig.analysis.reference.acceleration import AccelerometerResult
    from rig.analysis.reference.magnetic_field import MagnetometerResult
    from rig.analysis.temperature.bias_drift import Drifts
    from rig.analysis.temperature.over_temperature import Polynomials
    from rig.data.recording.provenance import Provenance
    from rig.data.recording.run_file import RunData
    from rig.data.recording.settings import RunSettings
    from rig.data.result_file import StoredCalibrationEntry
    from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class Origin:
    """What was measured with what, and when: `recorded` is that of the run's first recording."""

    recorded: "Provenance"
    stored_calibrations: "Mapping[str, StoredCalibrationEntry]"
    resumed_utc: tuple[str, ...]
    verified_utc: tuple[str, ...]
    solved_utc: datetime


def origin_of(runs: "Sequence[RunData]") -> Origin:
    """Return where and when the recordings of a run were made, at least one; they are solved now.

    A recording of another stage does not resume the one before it: the item was mounted anew between them.
    """
    return Origin(
        recorded=runs[0].provenance,
        stored_calibrations=runs[-1].provenance.stored_calibrations,
        resumed_utc=tuple(
            run.provenance.started_utc for before, run in pairwise(runs) if run.settings.stage == before.settings.stage
        ),
        verified_utc=(),
        solved_utc=datetime.now(UTC),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """What a run's recordings amount to, by sensor name.

    `recordings` are those of the calibration with a finished sweep. `results` hold every recorded sensor's calibration
    and `onboard` the board's own of the sensors on it to calibrate; all three are empty where stored calibrations were
    verified. `verifications` hold those that could be made. `clock` is the controller's, None where recordings of
    before say nothing of its uncertainty. Where no sweep was planned there are `accelerometers` alone, and beside them
    the `magnetometers`, which no limit of scale and bias judges.
    `drifts` are there where attitudes were repeated to watch the bias. `told_from` says of gyroscopes what may happen
    in the run and from what size on the checks tell it, `told_from_in_reference` of accelerometers and magnetometers.
    `elsewhere` is what readings gave whose motion is a file: gyroscopes are in `results` too. `of_kinds` is what the
    solvers of installed kinds of sensors found. `mounts` say how the item sat in the stages after the first.
    `polynomials` are there of a calibration over temperature: then all else is of readings taken to the reference.
    """

    settings: "RunSettings"
    provenance: Origin
    recordings: "tuple[ObservedRun, ...]" = ()
    checks: "tuple[Check, ...]" = ()
    results: "Mapping[str, SensorResult]" = field(default_factory=dict)
    onboard: "Mapping[str, Agreement]" = field(default_factory=dict)
    verifications: "Mapping[str, Verification]" = field(default_factory=dict)
    clock: "ClockCheck | None" = None
    accelerometers: "Mapping[str, AccelerometerResult]" = field(default_factory=dict)
    magnetometers: "Attempts[str, MagnetometerResult]" = field(default_factory=Attempts)
    drifts: "Drifts" = field(default_factory=dict)
    told_from: "Mapping[str, tuple[DetectionLimit, ...]]" = field(default_factory=dict)
    told_from_in_reference: "Mapping[str, tuple[DetectionLimit, ...]]" = field(default_factory=dict)
    elsewhere: "Mapping[str, OfSensor]" = field(default_factory=dict)
    of_kinds: "tuple[KindFound, ...]" = ()
    mounts: "tuple[EstimatedMount, ...]" = ()
    polynomials: "Polynomials" = field(default_factory=dict)

    @property
    def verdict(self) -> Literal["pass", "fail"]:
        """ "pass" when there are checks and all of them passed."""
        from rig.analysis.verdict import verdict

        return verdict(self.checks)

    @property
    def passed(self) -> bool:
        """Whether the verdict is a pass."""
        return self.verdict == "pass"
