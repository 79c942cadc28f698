"""The separation of a magnetometer's bias from the arm's field, by runs with the sensor turned over between them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.outcome import Outcome
from rig.analysis.reference.magnetometer import MagnetometerResult
from rig.analysis.reference.reference_budgets import SIZE_OF_FIELD
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.estimation.reference.reversal import Reversal, separate

REMEDY = (
    "Give runs of one magnetometer on one arm, in the same attitudes and at the same position, turned over in between"
)


@dataclass(frozen=True, slots=True)
class ReversalRun:
    """A magnetometer's `result` in the run named `run`, and the `outcome` of that run."""

    run: str
    outcome: Outcome
    result: MagnetometerResult


@dataclass(frozen=True, slots=True)
class MagnetometerReversal:
    """One magnetometer in several runs: its bias separated from the arm's field (`separation`).

    `scale`, `scale_std` (3,) and `correction_matrix` (3, 3) are those of the mean over all runs.
    """

    runs: tuple[ReversalRun, ...]
    separation: Reversal
    scale: Array
    scale_std: Array
    correction_matrix: Array


def reversals(runs: Sequence[tuple[str, Outcome]]) -> dict[str, MagnetometerReversal]:
    """Return the bias and the arm's field for each magnetometer of the first run, by its name.

    `runs` are the names and outcomes of two or more runs. Raise Refused `too_few_runs`; `no_magnetometer` if a run did
    not record or calibrate a magnetometer of the first run; `runs_do_not_match`, whose message says in what they
    differ; and what `separate` raises.
    """
    if len(runs) < 2:
        raise Refused("too_few_runs", "one run cannot separate the bias from the arm's field", REMEDY)
    first = runs[0][1].magnetometers
    names = [*first.results, *first.faults]
    if not names:
        raise Refused("no_magnetometer", f"{runs[0][0]} has no recording of a magnetometer", "Give runs with one")
    return {name: _reversal([_require_calibrated(run, outcome, name) for run, outcome in runs]) for name in names}


def _require_calibrated(run: str, outcome: Outcome, name: str) -> ReversalRun:
    magnetometers = outcome.magnetometers
    if name in magnetometers.results:
        return ReversalRun(run, outcome, magnetometers.results[name])
    if name in magnetometers.faults:
        why = f"in {run} {name} was not calibrated: {magnetometers.faults[name]}"
        raise Refused("no_magnetometer", why, "Correct that, and run again")
    raise Refused("no_magnetometer", f"{run} has no recording of a magnetometer {name}", REMEDY)


def _reversal(runs: Sequence[ReversalRun]) -> MagnetometerReversal:
    """Return one magnetometer's bias, separated from the arm's field. Raise Refused `runs_do_not_match`."""
    first = _list_common(runs[0])
    for other in runs[1:]:
        for what, value in _list_common(other).items():
            if value != first[what]:
                raise Refused("runs_do_not_match", f"{runs[0].run} and {other.run} differ in {what}", REMEDY)
    results = [run.result for run in runs]
    separation = separate(
        np.array([result.solution.bias for result in results]),
        np.array([result.budget.covariance[3:, 3:] for result in results]),
        np.array([result.solution.matrix for result in results]),
        np.array([result.sensor.mounting for result in results]),
    )
    return MagnetometerReversal(
        tuple(runs),
        separation,
        np.mean([result.triad.scale for result in results], axis=0),
        _scale_std(results),
        np.mean([result.triad.correction_matrix for result in results], axis=0),
    )


def _scale_std(results: Sequence[MagnetometerResult]) -> Array:
    """Return the standard deviations (3,) of the mean scale factors; all runs share the error of the field's size."""
    shared = results[0].budget.std_of(SIZE_OF_FIELD)[:3]
    independent = [result.budget.std[:3] ** 2 - result.budget.std_of(SIZE_OF_FIELD)[:3] ** 2 for result in results]
    std: Array = np.sqrt(np.sum(independent, axis=0) / len(results) ** 2 + shared**2)
    return std


def _list_common(run: ReversalRun) -> dict[str, object]:
    """Return the values that must be the same in all runs of a reversal, by the words for them in messages."""
    sensor, settings = run.result.sensor, run.outcome.settings
    return {
        "the magnetometer": (sensor.part, sensor.serial_number),
        "the arm": run.outcome.provenance.recorded.arm_serial_number,
        "the attitudes": settings.planned_dwells,
        "its position on the flange (arm.extension_mm)": run.result.extension_m,
        "the size of the field (site.magnetic_field_ut)": run.result.field_t,
    }
