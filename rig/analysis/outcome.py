"""The outcome of a run: solved, verified, judged. `rig.report` makes documents of it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from rig.errors.attempts import Attempts

if TYPE_CHECKING:
    from rig.analysis.check import Check
    from rig.analysis.clock_comparison import ClockCheck
    from rig.analysis.consistency.detection_limits import DetectionLimit
    from rig.analysis.external.external_recordings import ExternalResult
    from rig.analysis.gyroscope.calibration import SensorResult
    from rig.analysis.gyroscope.onboard_check import Agreement
    from rig.analysis.gyroscope.stage_mounts import EstimatedMount
    from rig.analysis.gyroscope.verification import Verification
    from rig.analysis.installed_solvers import KindFound
    from rig.analysis.reference.accelerometer import AccelerometerResult
    from rig.analysis.reference.magnetometer import MagnetometerResult
    from rig.analysis.temperature.bias_drift import Drifts
    from rig.analysis.temperature.over_temperature import Polynomials
    from rig.data.recording.provenance import Provenance
    from rig.data.recording.run_data import RunData
    from rig.data.recording.settings import RunSettings
    from rig.data.result_file import StoredCalibrationEntry
    from rig.errors import Fault
    from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class Origin:
    """The equipment and times of the measurements.

    - `recorded`: those of the run's first recording.
    - `stored_calibrations`: the calibrations that the board had stored in the last recording, by sensor.
    - `resumed_utc`, `verified_utc`: when the run was resumed, and when its verifications began.
    """

    recorded: "Provenance"
    stored_calibrations: "Mapping[str, StoredCalibrationEntry]"
    resumed_utc: tuple[str, ...]
    verified_utc: tuple[str, ...]
    solved_utc: datetime


def origin_of(runs: "Sequence[RunData]") -> Origin:
    """Return the equipment and the times of a run, from at least one recording; the time of the solution is now.

    `resumed_utc` does not list recordings that begin a new stage, in which the item was remounted.
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
    """The results of a run's recordings, by sensor name.

    - settings: the settings of the run.
    - provenance: the equipment and times of the measurements.
    - recordings: the observed recordings of the calibration; empty if stored calibrations were verified.
    - checks: the checks of the verdict.
    - results: the calibrations of gyroscopes; empty if stored calibrations were verified.
    - onboard: the board's own calibrations, compared with the host's; empty if stored ones were verified.
    - verifications: the verifications of those sensors that could be verified.
    - clock: comparison of the controller's clock with other clocks, None if no sweeps were solved.
    - accelerometers: the calibrations of accelerometers.
    - magnetometers: the calibrations of magnetometers, whose scale and bias are not checked against limits.
    - drifts: biases by repeat, if attitudes were repeated to show bias drift.
    - detection_limits: the detection limits of the gyroscopes' checks.
    - reference_detection_limits: the detection limits of the checks of accelerometers and magnetometers.
    - external: the results of external recordings; their gyroscopes are in results too.
    - installed_kinds: the results for sensors of kinds that plug-ins add and solve.
    - mounts: the item's mount in each stage after the first.
    - polynomials: those of a calibration over temperature; all other results then refer to the reference temperature.
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
    accelerometer_faults: "Mapping[str, Fault]" = field(default_factory=dict)
    magnetometers: "Attempts[str, MagnetometerResult]" = field(default_factory=Attempts)
    drifts: "Drifts" = field(default_factory=dict)
    detection_limits: "Mapping[str, tuple[DetectionLimit, ...]]" = field(default_factory=dict)
    reference_detection_limits: "Mapping[str, tuple[DetectionLimit, ...]]" = field(default_factory=dict)
    external: "Mapping[str, ExternalResult]" = field(default_factory=dict)
    installed_kinds: "tuple[KindFound, ...]" = ()
    mounts: "tuple[EstimatedMount, ...]" = ()
    polynomials: "Polynomials" = field(default_factory=dict)

    @property
    def verdict(self) -> Literal["pass", "fail"]:
        """The verdict: "pass" if there are checks and all passed, else "fail"."""
        from rig.analysis.verdict import verdict

        return verdict(self.checks)

    @property
    def passed(self) -> bool:
        """Whether the verdict is a pass."""
        return self.verdict == "pass"
