"""The studies by name. Each has a function `study(settings) -> StudyReport` in a module imported only on request."""

from collections.abc import Callable
from dataclasses import dataclass
from pkgutil import resolve_name

from rig.errors import Refused
from rig.study.study_report import Settings, StudyReport


@dataclass(frozen=True, slots=True)
class StudyEntry:
    """A study: a summary, the function `module:name` that computes it, and its processor time on one core, s.

    `core_s` is the last result of `python benchmarks/solving/studies.py` on one machine; None if it was not measured.
    """

    summary: str
    function: str
    core_s: float | None = None

    def duration_s(self, jobs: int = 1) -> float | None:
        """Return the approximate duration with `jobs` processes, s; None if it was not measured."""
        return None if self.core_s is None else self.core_s / jobs

    def run(self, settings: Settings) -> StudyReport:
        """Compute the study."""
        study: Callable[[Settings], StudyReport] = resolve_name(f"rig.study.{self.function}")
        return study(settings)


STUDIES = {
    "normal": StudyEntry(
        "SIX Fig. 2: error bands of Algorithm 1 and Levenberg–Marquardt, usual gyroscopes", "bands:normal", 42
    ),
    "extreme": StudyEntry("SIX Fig. 5: the same for poor gyroscopes", "bands:extreme", 52),
    "speed": StudyEntry("SIX Fig. 4: mean squared error against the speed of the sweeps", "speed:study", 3),
    "convergence": StudyEntry("SIX Table I, and where Algorithm 1 stops converging", "convergence:study", 1),
    "sine": StudyEntry("SIX Fig. 3: readings before and after calibration in a swinging movement", "sine:study", 1),
    "averaging": StudyEntry("averaging before squaring against squaring before averaging", "averaging:study", 1),
    "estimators": StudyEntry("every estimator's mean squared error over its Cramér–Rao bound", "estimators:study"),
    "misalignment": StudyEntry("error against mounting error and non-orthogonality", "misalignment:study"),
    "budget": StudyEntry("coverage of the stated uncertainty when all effects occur", "budget:study"),
    "kvh-gyro": StudyEntry(
        "TRIAX III-A: fiber-optic gyroscope on a rate table, bias drift of Fig. 4", "kvh_gyro:study"
    ),
    "kvh-accelerometer": StudyEntry(
        "TRIAX III-B: accelerometer on a rate table, bias drift of Fig. 6", "kvh_accelerometer:study"
    ),
}


def find(name: str) -> StudyEntry:
    """Return the study called `name`. Raise Refused `unknown_study`."""
    if name not in STUDIES:
        raise Refused("unknown_study", f"there is no study {name!r}", f"Choose one of {', '.join(STUDIES)}")
    return STUDIES[name]
