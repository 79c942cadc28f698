"""The implementation of `rig.analysis.analyses`: recordings are solved, verified and judged."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from rig.analysis.check import Check, list_unsolved
from rig.analysis.consistency.contradictions import NO_CHECKS, ConsistencyChecks, check_references, contradictions
from rig.analysis.consistency.detection_limits import DetectionLimit
from rig.analysis.environment import find_environment
from rig.analysis.estimator_names import Estimator, find_estimator
from rig.analysis.gyroscope.board_averages import board_averages
from rig.analysis.gyroscope.calibration import SensorResult, solve_observed
from rig.analysis.gyroscope.onboard_check import Agreement, check_arithmetic
from rig.analysis.gyroscope.stage_mounts import observe_as_mounted
from rig.analysis.gyroscope.vector_inputs import lever_arms_m
from rig.analysis.installed_solvers import KindFound, kinds_on_arm
from rig.analysis.outcome import Outcome, origin_of
from rig.analysis.verdict import acceleration_checks, clock_checks, drift_checks, judge, verification_checks
from rig.config.judging.judging_keys import DecisionRule
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import RunSettings
from rig.errors import Fault
from rig.errors.attempts import Attempts
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_fit import centripetal_m_s2
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.observation.observed_run import ObservedRun, observe_runs

if TYPE_CHECKING:
    from rig.analysis.clock_comparison import ClockCheck
    from rig.analysis.gyroscope.comparison import Reference
    from rig.analysis.gyroscope.verification import Verification
    from rig.analysis.reference.accelerometer import AccelerometerResult
    from rig.analysis.reference.magnetometer import MagnetometerResult
    from rig.analysis.temperature.over_temperature import Polynomials
    from rig.estimation.temperature.temperature_polynomials import OverTemperature

ResultT = TypeVar("ResultT")


def calibrate(runs: Sequence[RunData], estimator: str, *, drifting: bool) -> Outcome:
    """Return the outcome of a calibration, as `rig.analysis.analyses.calibrate` describes it."""
    settings = runs[0].settings
    chosen = find_estimator(estimator)
    recordings, mounts = observe_as_mounted(runs, settings)
    averages = [board_averages(name, recordings) for name in settings.to_calibrate] if settings.planned_sweeps else []
    if not recordings:
        raise Fault(
            "too_few_observations",
            "no finished sweep is recorded, but a calibration needs sweeps in six directions, or dwells in attitudes",
            "Record the movement; resume the run if it was interrupted",
        )
    polynomials: Polynomials = {}
    if settings.reference_c is not None:
        from rig.analysis.temperature.over_temperature import correct_recordings

        corrected = correct_recordings(recordings, settings, settings.reference_c)
        recordings, polynomials = corrected.recordings, corrected.polynomials
    swept = _GyroscopeOutcome(polynomials=polynomials)
    if settings.planned_sweeps:
        swept = _judge_gyroscopes(runs, recordings, settings, chosen, polynomials)
    dwells = _DwellOutcome(polynomials=swept.polynomials)
    if settings.planned_dwells or runs[0].measuring(FIELD):
        dwells = _judge_dwells(recordings, settings, swept, drifting=drifting)
    installed_kinds = tuple(kinds_on_arm(recordings, settings))
    return Outcome(
        recordings=recordings,
        settings=settings,
        results=swept.results,
        onboard=swept.onboard,
        checks=(
            *swept.checks,
            *(check for average in averages for check in average),
            *(
                check
                for name, result in dwells.accelerometers.results.items()
                for check in acceleration_checks(name, result, settings.limits, _decision_rule(settings))
            ),
            *dwells.contradictions.checks,
            *(check for kind in installed_kinds for check in kind.checks),
            *_check_unsolved(dwells, installed_kinds),
        ),
        installed_kinds=installed_kinds,
        mounts=mounts,
        provenance=origin_of(runs),
        clock=swept.clock,
        accelerometers=dwells.accelerometers.results,
        accelerometer_faults=dwells.accelerometers.faults,
        magnetometers=dwells.magnetometers,
        detection_limits=swept.detection_limits,
        reference_detection_limits=dwells.contradictions.detection_limits,
        polynomials=dwells.polynomials,
    )


def _check_unsolved(dwells: "_DwellOutcome", installed_kinds: Sequence[KindFound]) -> Iterator[Check]:
    """Yield a failing check for each sensor that was to be calibrated and has no solution."""
    for quantity, attempts in ((ACCELERATION, dwells.accelerometers), (FIELD, dwells.magnetometers)):
        yield from list_unsolved((name, quantity.name, fault) for name, fault in attempts.faults.items())
    yield from list_unsolved((kind.name, kind.quantity.name, kind.fault) for kind in installed_kinds if kind.fault)


@dataclass(frozen=True, slots=True, kw_only=True)
class _GyroscopeOutcome:
    """The part of an outcome that is about gyroscopes, from sweeps; empty if no sweep was planned."""

    polynomials: "Polynomials"
    results: Mapping[str, SensorResult] = field(default_factory=dict)
    onboard: Mapping[str, Agreement] = field(default_factory=dict)
    checks: tuple[Check, ...] = ()
    clock: "ClockCheck | None" = None
    detection_limits: Mapping[str, tuple[DetectionLimit, ...]] = field(default_factory=dict)


def _judge_gyroscopes(
    runs: Sequence[RunData],
    recordings: tuple[ObservedRun, ...],
    settings: RunSettings,
    estimator: Estimator,
    polynomials: "Polynomials",
) -> _GyroscopeOutcome:
    """Return the part of an outcome that is about gyroscopes: their calibrations, their checks, and those of clocks."""
    environment = find_environment(recordings, settings)
    results = solve_observed(runs[0].measuring(RATE), recordings, environment, estimator, settings.matrix_corrected)
    if polynomials:
        from rig.analysis.temperature.over_temperature import add_rate_polynomials

        results, polynomials = _add_polynomials(results, RATE, add_rate_polynomials, polynomials)
    among_rates = contradictions(recordings, results, settings.to_calibrate, environment, settings)
    onboard = {name: check_arithmetic(runs, name) for name in settings.to_calibrate if runs[0].sensors[name].on_board}
    checks = judge(
        {name: results[name].solution for name in settings.to_calibrate},
        settings.limits,
        {name: result.uncertainty for name, result in results.items() if result.uncertainty is not None},
        _decision_rule(settings),
    )
    return _GyroscopeOutcome(
        polynomials=polynomials,
        results=results,
        onboard=onboard,
        checks=(
            *checks,
            *(check for name, agreed in onboard.items() for check in agreed.checks(name)),
            *among_rates.checks,
            *clock_checks(environment.clocks),
        ),
        clock=environment.clock,
        detection_limits=among_rates.detection_limits,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _DwellOutcome:
    """The part of an outcome that is about accelerometers and magnetometers; empty if no attitude was planned."""

    polynomials: "Polynomials"
    accelerometers: "Attempts[str, AccelerometerResult]" = field(default_factory=Attempts)
    magnetometers: "Attempts[str, MagnetometerResult]" = field(default_factory=Attempts)
    contradictions: ConsistencyChecks = NO_CHECKS


def _judge_dwells(
    recordings: tuple[ObservedRun, ...], settings: RunSettings, swept: _GyroscopeOutcome, *, drifting: bool
) -> _DwellOutcome:
    """Return the part of an outcome about accelerometers, aligned to the gyroscopes of `swept`, and magnetometers."""
    from rig.analysis.reference.accelerometer import calibrate_accelerometers
    from rig.analysis.reference.magnetometer import calibrate_magnetometers

    attempts, polynomials = calibrate_accelerometers(recordings, settings, swept.results), swept.polynomials
    others_are_solved = bool(attempts.results or swept.results) and not (polynomials or drifting)
    for fault in attempts.faults.values():
        if not others_are_solved or fault.name == "not_all_attitudes":  # the latter are made when the run is resumed
            raise fault
    accelerometers = attempts.results
    if polynomials:
        from rig.analysis.temperature.over_temperature import add_acceleration_polynomials

        accelerometers, polynomials = _add_polynomials(
            accelerometers, ACCELERATION, add_acceleration_polynomials, polynomials
        )
    magnetometers = calibrate_magnetometers(recordings, settings, accelerometers)
    return _DwellOutcome(
        polynomials=polynomials,
        accelerometers=replace(attempts, results=accelerometers),
        magnetometers=magnetometers,
        contradictions=check_references(recordings, accelerometers, magnetometers.results, settings, drifting=drifting),
    )


def _add_polynomials(
    results: Mapping[str, ResultT],
    quantity: Quantity,
    add: Callable[[ResultT, "OverTemperature"], tuple[ResultT, "OverTemperature"]],
    polynomials: "Polynomials",
) -> tuple[dict[str, ResultT], "Polynomials"]:
    """Return the results of a quantity, and all polynomials, after each has got contributions to U from the other.

    `add` includes them in one sensor's result and in its polynomials of this quantity, and returns both.
    """
    settled = {name: add(results[name], fits[quantity]) for name, fits in polynomials.items() if quantity in fits}
    added = {name: result for name, (result, _) in settled.items()}
    combined = {name: {**polynomials[name], quantity: fit} for name, (_, fit) in settled.items()}
    return {**results, **added}, {**polynomials, **combined}


def estimate_bias_drift(runs: Sequence[RunData], estimator: str) -> Outcome:
    """Return the outcome of attitudes visited several times, as `rig.analysis.analyses` describes it."""
    from rig.analysis.temperature.bias_drift import estimate_bias_drifts

    outcome = calibrate(runs, estimator, drifting=True)
    settings = outcome.settings
    drifts, rule = estimate_bias_drifts(outcome.recordings, settings), _decision_rule(settings)
    checks = [check for name, drift in drifts.items() for check in drift_checks(name, drift, settings.limits, rule)]
    return replace(outcome, drifts=drifts, checks=(*outcome.checks, *checks))


def _decision_rule(settings: RunSettings) -> DecisionRule:
    return settings.stated_uncertainty.decision_rule


def verify_calibration(outcome: Outcome, repeated: Sequence[RunData]) -> Outcome:
    """Return the outcome with a verification by `repeated`, as `rig.analysis.analyses` describes it."""
    from rig.analysis.gyroscope.comparison import Reference
    from rig.analysis.gyroscope.verification import verify

    settings = outcome.settings
    reference = settings.reference
    verifications: dict[str, Verification | None] = dict.fromkeys(settings.to_calibrate)
    if repeated and reference is not None:
        after = observe_runs(repeated)
        standard = Reference(reference.name, np.array(reference.scale), np.array(reference.bias_rad_s))
        verifications = {
            name: verify(
                name,
                standard,
                after,
                outcome.recordings,
                outcome.results.get(name),
                gravity_rad_s=_gravity_effects(outcome.results, (name, standard), after, settings),
            )
            for name in settings.to_calibrate
        }
    checks = [check for name, one in verifications.items() for check in verification_checks(name, one, settings.limits)]
    return replace(
        outcome,
        verifications={name: one for name, one in verifications.items() if one is not None},
        checks=(*outcome.checks, *checks),
        provenance=replace(
            outcome.provenance,
            stored_calibrations=(repeated[-1] if repeated else outcome).provenance.stored_calibrations,
            verified_utc=tuple(run.provenance.started_utc for run in repeated),
        ),
    )


def _gravity_effects(
    results: Mapping[str, SensorResult],
    pair: "tuple[str, Reference]",
    after: Sequence[ObservedRun],
    settings: RunSettings,
) -> tuple[Array, Array] | None:
    """Return gravity's effects on the corrected readings of sensor and of reference in N revolutions, (N, 3) each.

    `pair` is the name of the sensor, and the reference. The centripetal acceleration acts like gravity. Return None if
    g-sensitivities were not estimated for both.
    """
    from rig.analysis.gyroscope.comparison import list_revolutions

    name, reference = pair
    corrections = {name: results[name].correction_matrix} if name in results else {}
    corrections[reference.name] = reference.correction_matrix
    effects = []
    for sensor, matrix in corrections.items():
        solution = results[sensor].vector_model if sensor in results else None
        if not isinstance(solution, VectorSolution) or solution.g_sensitivity is None:
            return None
        turns = list_revolutions(sensor, after)
        attitudes = np.array([turn.average.attitude for turn in turns], dtype=np.float64)
        rates_rad_s = np.array([turn.speed_rad_s * turn.axis_flange for turn in turns])
        gravity = attitudes @ settings.site.down_m_s2 - centripetal_m_s2(
            rates_rad_s, lever_arms_m(turns, np.array(settings.extension_m))
        )
        effects.append(gravity @ (matrix @ solution.g_sensitivity).T)
    on_sensor, on_reference = effects
    return on_sensor, on_reference


def verify_stored(repeated: Sequence[RunData]) -> Outcome:
    """Return the outcome of a verification of stored calibrations, as `rig.analysis.analyses` describes it."""
    nothing_calibrated = Outcome(settings=repeated[0].settings, provenance=origin_of(repeated[:1]))
    return verify_calibration(nothing_calibrated, repeated)
