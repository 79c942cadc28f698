"""What recordings amount to: they are solved, verified and judged here for `rig.analysis.analyses`."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeVar

import numpy as np

from rig.analysis.check import Check, unsolved_checks
from rig.analysis.clock import ClockCheck
from rig.analysis.consistency.contradictions import check_references, contradictions
from rig.analysis.consistency.detection_limits import DetectionLimit
from rig.analysis.estimators import Estimator, find_estimator
from rig.analysis.gyroscope.board_averages import board_averages
from rig.analysis.gyroscope.calibration import SensorResult, solve_observed
from rig.analysis.gyroscope.comparison import Reference, list_revolutions
from rig.analysis.gyroscope.mounts import observe_as_mounted
from rig.analysis.gyroscope.onboard_check import Agreement, check_arithmetic
from rig.analysis.gyroscope.vector_inputs import lever_arms_m
from rig.analysis.gyroscope.verification import Verification, verify
from rig.analysis.installed_kinds import KindFound, kinds_on_arm
from rig.analysis.outcome import Outcome, origin_of
from rig.analysis.reference.acceleration import AccelerometerResult, calibrate_accelerometers
from rig.analysis.reference.magnetic_field import MagnetometerResult, calibrate_magnetometers
from rig.analysis.surroundings import surroundings_of
from rig.analysis.temperature.bias_drift import estimate_bias_drifts
from rig.analysis.temperature.over_temperature import (
    Polynomials,
    add_acceleration_polynomials,
    add_rate_polynomials,
    correct_recordings,
)
from rig.analysis.verdict import acceleration_checks, clock_checks, drift_checks, judge, verification_checks
from rig.config.judging.judged_by import DecisionRule
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import RunSettings
from rig.errors import Fault
from rig.errors.attempts import Attempts
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_fit import centripetal_m_s2
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.estimation.temperature.over_temperature import OverTemperature
from rig.observation.observed_run import ObservedRun, observe_runs

ResultT = TypeVar("ResultT")


def calibrated(runs: Sequence[RunData], estimator: str, *, drifting: bool) -> Outcome:
    """Solve and judge the recordings of a calibration, as `rig.analysis.analyses.calibrate` says."""
    settings = runs[0].settings
    chosen = find_estimator(estimator)
    recordings, mounts = observe_as_mounted(runs, settings)
    averages = [board_averages(name, recordings) for name in settings.to_calibrate] if settings.planned_sweeps else []
    if not recordings:
        raise Fault(
            "too_few_observations",
            "no finished sweep is recorded, and a calibration needs sweeps in six directions, or dwells in attitudes",
            "Record the movement; resume the run if it was interrupted",
        )
    found: Polynomials = {}
    if settings.reference_c is not None:
        taken = correct_recordings(recordings, settings, settings.reference_c)
        recordings, found = taken.recordings, taken.polynomials
    swept = _swept(runs, recordings, settings, chosen, found) if settings.planned_sweeps else _Swept(polynomials=found)
    accelerometers = calibrate_accelerometers(recordings, settings, swept.results)
    accelerometers, found = _over_temperature(
        accelerometers, ACCELERATION, add_acceleration_polynomials, swept.polynomials
    )
    magnetometers = calibrate_magnetometers(recordings, settings, accelerometers)
    of_kinds = kinds_on_arm(recordings, settings)
    among_dwells = check_references(recordings, accelerometers, magnetometers.results, settings, drifting=drifting)
    return Outcome(
        recordings=recordings,
        settings=settings,
        results=swept.results,
        onboard=swept.onboard,
        checks=(
            *swept.checks,
            *(check for average in averages for check in average),
            *_acceleration_checks(accelerometers, settings),
            *among_dwells.checks,
            *(check for kind in of_kinds for check in kind.checks),
            *_unsolved(magnetometers, of_kinds),
        ),
        of_kinds=of_kinds,
        mounts=mounts,
        provenance=origin_of(runs),
        clock=swept.clock,
        accelerometers=accelerometers,
        magnetometers=magnetometers,
        told_from=swept.told_from,
        told_from_in_reference=among_dwells.detection_limits,
        polynomials=found,
    )


def _unsolved(magnetometers: Attempts[str, MagnetometerResult], of_kinds: Sequence[KindFound]) -> Iterator[Check]:
    """The checks of what was to be calibrated and is not."""
    yield from unsolved_checks((name, FIELD.name, fault) for name, fault in magnetometers.faults.items())
    yield from unsolved_checks((kind.name, kind.quantity.name, kind.fault) for kind in of_kinds if kind.fault)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Swept:
    """What sweeps tell of gyroscopes; nothing where none was planned."""

    polynomials: Polynomials
    results: Mapping[str, SensorResult] = field(default_factory=dict)
    onboard: Mapping[str, Agreement] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()
    clock: ClockCheck | None = None
    told_from: Mapping[str, tuple[DetectionLimit, ...]] = field(default_factory=dict)


def _swept(
    runs: Sequence[RunData],
    recordings: tuple[ObservedRun, ...],
    settings: RunSettings,
    estimator: Estimator,
    polynomials: Polynomials,
) -> _Swept:
    surroundings = surroundings_of(recordings, settings)
    results = solve_observed(runs[0].measuring(RATE), recordings, surroundings, estimator, settings.matrix_corrected)
    results, polynomials = _over_temperature(results, RATE, add_rate_polynomials, polynomials)
    among_rates = contradictions(recordings, results, settings.to_calibrate, surroundings, settings)
    onboard = {name: check_arithmetic(runs, name) for name in settings.to_calibrate if runs[0].sensors[name].on_board}
    checks = judge(
        {name: results[name].solution for name in settings.to_calibrate},
        settings.limits,
        {name: result.uncertainty for name, result in results.items() if result.uncertainty is not None},
        _decision_rule(settings),
    )
    return _Swept(
        polynomials=polynomials,
        results=results,
        onboard=onboard,
        checks=(
            *checks,
            *(check for name, agreed in onboard.items() for check in agreed.checks(name)),
            *among_rates.checks,
            *clock_checks(surroundings.clocks),
        ),
        clock=surroundings.clock,
        told_from=among_rates.detection_limits,
    )


def _over_temperature(
    results: Mapping[str, ResultT],
    quantity: Quantity,
    together: Callable[[ResultT, OverTemperature], tuple[ResultT, OverTemperature]],
    polynomials: Polynomials,
) -> tuple[dict[str, ResultT], Polynomials]:
    """Results of a quantity with what polynomials over temperature add to them, and these settled by them."""
    settled = {name: together(results[name], of[quantity]) for name, of in polynomials.items() if quantity in of}
    added = {name: result for name, (result, _) in settled.items()}
    known = {name: {**polynomials[name], quantity: found} for name, (_, found) in settled.items()}
    return {**results, **added}, {**polynomials, **known}


def drifted(runs: Sequence[RunData], estimator: str) -> Outcome:
    """Solve and judge attitudes gone through again and again, as `rig.analysis.analyses.estimate_bias_drift` says."""
    outcome = calibrated(runs, estimator, drifting=True)
    settings = outcome.settings
    found, rule = estimate_bias_drifts(outcome.recordings, settings), _decision_rule(settings)
    checks = [check for name, each in found.items() for check in drift_checks(name, each, settings.limits, rule)]
    return replace(outcome, drifts=found, checks=(*outcome.checks, *checks))


def _acceleration_checks(results: Mapping[str, AccelerometerResult], settings: RunSettings) -> tuple[Check, ...]:
    rule = _decision_rule(settings)
    return tuple(
        check for name, result in results.items() for check in acceleration_checks(name, result, settings.limits, rule)
    )


def _decision_rule(settings: RunSettings) -> DecisionRule:
    return settings.stated_uncertainty.decision_rule


def verified(outcome: Outcome, repeated: Sequence[RunData]) -> Outcome:
    """Verify a calibration by `repeated`, as `rig.analysis.analyses.verify_calibration` says."""
    settings = outcome.settings
    known = settings.reference
    found: dict[str, Verification | None] = dict.fromkeys(settings.to_calibrate)
    if repeated and known is not None:
        after = observe_runs(repeated)
        reference = Reference(known.name, np.array(known.scale), np.array(known.bias_rad_s))
        found = {
            name: verify(
                name,
                reference,
                after,
                outcome.recordings,
                outcome.results.get(name),
                gravity_rad_s=_gravity_left(outcome.results, (name, reference), after, settings),
            )
            for name in settings.to_calibrate
        }
    checks = [check for name, each in found.items() for check in verification_checks(name, each, settings.limits)]
    return replace(
        outcome,
        verifications={name: each for name, each in found.items() if each is not None},
        checks=(*outcome.checks, *checks),
        provenance=replace(
            outcome.provenance,
            stored_calibrations=(repeated[-1] if repeated else outcome).provenance.stored_calibrations,
            verified_utc=tuple(run.provenance.started_utc for run in repeated),
        ),
    )


def _gravity_left(
    results: Mapping[str, SensorResult],
    pair: tuple[str, Reference],
    after: Sequence[ObservedRun],
    settings: RunSettings,
) -> tuple[Array, Array] | None:
    """(N, 3) what gravity adds to the corrected readings of sensor and reference, neither of which knows where down is.

    With what their circling adds, which is felt as gravity is. None where the calibration did not find it.
    """
    name, reference = pair
    corrections = {name: results[name].correction_matrix} if name in results else {}
    corrections[reference.name] = reference.correction_matrix
    left = []
    for each, matrix in corrections.items():
        solution = results[each].vector_model if each in results else None
        if not isinstance(solution, VectorSolution) or solution.g_sensitivity is None:
            return None
        turns = list_revolutions(each, after)
        attitudes = np.array([turn.average.attitude for turn in turns], dtype=np.float64)
        turned = np.array([turn.speed_rad_s * turn.axis_flange for turn in turns])
        pull = attitudes @ settings.site.down_m_s2 - centripetal_m_s2(
            turned, lever_arms_m(turns, np.array(settings.extension_m))
        )
        left.append(pull @ (matrix @ solution.g_sensitivity).T)
    of_sensor, of_reference = left
    return of_sensor, of_reference


def verified_alone(repeated: Sequence[RunData]) -> Outcome:
    """Verify what the board had stored before, as `rig.analysis.analyses.verify_stored_calibrations` says."""
    nothing_calibrated = Outcome(settings=repeated[0].settings, provenance=origin_of(repeated[:1]))
    return verified(nothing_calibrated, repeated)
