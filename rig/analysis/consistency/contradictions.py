"""The checks of the verdict that compare a recording with itself."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.check import Check, fitness
from rig.analysis.consistency import converter_tests, gyroscope_checks
from rig.analysis.consistency.detection_limits import DetectionLimit, find_gyroscope_limits, find_reference_limits
from rig.analysis.consistency.false_alarms import FALSE_ALARM_PROBABILITY, NON_ORTHOGONALITY, false_alarm_per_check
from rig.analysis.consistency.frozen_axis import find_longest_frozen
from rig.analysis.consistency.gyroscope_checks import DISTURBED_SWEEP
from rig.analysis.consistency.residual_tests import Statistic, TestResults
from rig.analysis.consistency.systematic_errors import build_error_patterns, collect_known_errors
from rig.analysis.environment import MeasurementEnvironment, find_environment
from rig.analysis.gyroscope.calibration import SensorResult, solve_observed
from rig.analysis.gyroscope.segment_table import Segments, append_transfers, stack_segments
from rig.analysis.numeric_errors import solvable
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import RunSettings
from rig.errors import RigError
from rig.estimation.gyroscope.vector_fit import VectorFit
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.observation.consistency.segments import segment_recordings
from rig.observation.consistency.transfers import average_transfers
from rig.observation.observed_run import ObservedRun

if TYPE_CHECKING:
    from rig.analysis.reference.accelerometer import AccelerometerResult
    from rig.analysis.reference.magnetometer import MagnetometerResult


@dataclass(frozen=True, slots=True)
class ConsistencyChecks:
    """The checks, in order, and the detection limits of each sensor."""

    checks: tuple[Check, ...]
    detection_limits: Mapping[str, tuple[DetectionLimit, ...]] = field(default_factory=dict)

    @property
    def disturbed(self) -> frozenset[int]:
        """The indices of the plan's sweeps that the checks name as disturbed."""
        return frozenset(check.means.sweep for check in self.checks if check.means.sweep is not None)


NO_CHECKS = ConsistencyChecks(())


def contradictions(
    recordings: Sequence[ObservedRun],
    results: Mapping[str, SensorResult],
    sensors: Sequence[str],
    environment: MeasurementEnvironment,
    settings: RunSettings,
    *,
    false_alarms: float = FALSE_ALARM_PROBABILITY,
    has_limits: bool = True,
) -> ConsistencyChecks:
    """Return the checks for contradictions in the gyroscopes' recordings.

    `false_alarms` is the probability that any check fails in a run without a fault. The check of a disturbed sweep has
    the sweep's index in its name, `gyro.disturbed_sweep.3`, and in its meaning. `has_limits`: whether to compute the
    detection limits, which takes a third of the time.
    """
    checks: list[Check] = []
    detection_limits: dict[str, tuple[DetectionLimit, ...]] = {}
    false_alarm_probability = _false_alarm_probability(recordings[0].run, sensors, settings, false_alarms)
    for name in sensors:
        result = results[name]
        if (explained := result.explained) is None:
            continue
        segments, tested = _test_segments(
            name,
            recordings,
            result,
            explained,
            environment=environment,
            settings=settings,
            false_alarm_probability=false_alarm_probability,
        )
        of_readings = _test_readings(name, recordings, segments, false_alarm_probability)
        checks += _check_sweeps(name, result, tested)
        checks += [
            fitness(name, "rate", what, *statistic) for what, statistic in {**tested.statistics, **of_readings}.items()
        ]
        stated_deg = environment.uncertainty.find_stated_size("non_orthogonality_deg", name)
        non_orthogonality = _non_orthogonality_deg(explained.solution, stated_deg, false_alarm_probability)
        checks.append(fitness(name, "rate", NON_ORTHOGONALITY, *non_orthogonality, unit="°"))
        if has_limits:
            detection_limits[name] = tuple(find_gyroscope_limits(tested.detection_limits, name, result, environment))
    return ConsistencyChecks(tuple(checks), detection_limits)


def _test_segments(
    name: str,
    recordings: Sequence[ObservedRun],
    result: SensorResult,
    explained: VectorFit,
    *,
    environment: MeasurementEnvironment,
    settings: RunSettings,
    false_alarm_probability: float,
) -> tuple[Segments, TestResults]:
    """Return the segments of a gyroscope's sweeps and rests, and the tests of whether one model explains them all."""
    matrix, windows = explained.solution.matrix, segment_recordings(name, recordings)
    segments = stack_segments(windows, explained, settings.site)
    # All sweeps about one axis follow each other, so they do not show a change of that axis before or after them. The
    # transfers between them do, so lasting changes are tested with the transfers as further segments.
    transfers = average_transfers(name, recordings, matrix, settings.site, np.array(settings.extension_m))
    with_transfers = append_transfers(segments, transfers, windows, explained)
    # The effects of known errors of arm and sensor are allowed: the tests do not count them as contradictions.
    known_errors = collect_known_errors(environment, name, result, recordings[0].run.sensors[name].stamp_std_s)
    allowance = build_error_patterns(known_errors, segments, with_transfers, matrix)
    return segments, gyroscope_checks.check_gyroscope(segments, matrix, false_alarm_probability, allowance)


def _check_sweeps(name: str, result: SensorResult, tested: TestResults) -> list[Check]:
    """Return a failing check for each disturbed sweep; if there is none, a single check, of the worst sweep."""
    disturbed = {result.observations[index].sweep: statistic for index, statistic in tested.disturbed.items()}
    if not disturbed:
        return [fitness(name, "rate", DISTURBED_SWEEP, *tested.worst)]
    return [fitness(name, "rate", DISTURBED_SWEEP, *disturbed[sweep], sweep=sweep) for sweep in sorted(disturbed)]


def _test_readings(
    name: str, recordings: Sequence[ObservedRun], segments: Segments, false_alarm_probability: float
) -> Mapping[str, Statistic]:
    """Return the tests of a gyroscope's analogue-to-digital converter, from single readings, by the check's name."""
    sensor = recordings[0].run.sensors[name]
    samples = [recording.run.samples[name] for recording in recordings]
    return converter_tests.judge_readings(
        [sensor.channel(RATE).counts(recorded).astype(np.int64) for recorded in samples],
        segments.readings,
        false_alarm_probability,
        digits=converter_tests.find_digits(sensor, RATE, samples),
        frozen=max(find_longest_frozen(recording, name) for recording in recordings),
    )


def _non_orthogonality_deg(solution: VectorSolution, stated_deg: float, false_alarm_probability: float) -> Statistic:
    """Return the non-orthogonality that exceeds its limit most or comes nearest to it, and this limit, in degrees.

    The limit is the stated half-width `stated_deg` plus the angle's uncertainty at this false-alarm probability. The
    check is needed because no residual shows a zero error of a wrist: with sweeps about three axes, the error looks
    like a tilted sensor axis. Yet it makes the scale factors wrong if the sensor is mounted askew.
    """
    from scipy.special import ndtri

    angles_deg = np.degrees(np.abs(solution.non_orthogonality_rad))
    std_deg = np.degrees(np.sqrt(np.diag(solution.angles_covariance_rad2)[:3]))
    limits_deg = stated_deg + std_deg * float(ndtri(1 - false_alarm_probability / 6))
    worst = int(np.argmax(angles_deg - limits_deg))
    return float(angles_deg[worst]), float(limits_deg[worst])


def check_references(
    recordings: Sequence[ObservedRun],
    accelerometers: "Mapping[str, AccelerometerResult]",
    magnetometers: "Mapping[str, MagnetometerResult]",
    settings: RunSettings,
    *,
    drifting: bool = False,
) -> ConsistencyChecks:
    """Return the checks for contradictions within the readings of each accelerometer and magnetometer.

    A check of a disturbed dwell or sweep has the index of this dwell or sweep at the end of its name, as in
    `gyro.acceleration_disturbed_dwell.13`. If `drifting`, a steady drift of the bias is no contradiction.
    """
    from rig.analysis.consistency.reference_contradictions import (
        ReferenceReadings,
        compute_reference_statistics,
        read_accelerometer,
        read_magnetometer,
    )

    known_errors = settings.stated_uncertainty
    readings_of: dict[tuple[str, Quantity], ReferenceReadings] = {
        **{(name, ACCELERATION): read_accelerometer(name, recordings, result, known_errors)
           for name, result in accelerometers.items()},
        **{(name, FIELD): read_magnetometer(name, recordings, result, known_errors)
           for name, result in magnetometers.items()}}  # fmt: skip
    false_alarm_probability = _false_alarm_probability(
        recordings[0].run, settings.to_calibrate, settings, FALSE_ALARM_PROBABILITY
    )
    checks: list[Check] = []
    detection_limits: dict[str, tuple[DetectionLimit, ...]] = {}
    for (name, quantity), sensor_readings in readings_of.items():
        tested = compute_reference_statistics(sensor_readings, false_alarm_probability, drifting=drifting)
        for segment, statistic in tested.segments:
            checks.append(
                fitness(name, quantity.name, segment.what, *statistic, sweep=segment.sweep, dwell=segment.dwell)
            )
        checks += [fitness(name, quantity.name, what, *statistic) for what, statistic in tested.statistics.items()]
        detection_limits[name] = find_reference_limits(tested.detection_limits, quantity)
    return ConsistencyChecks(tuple(checks), detection_limits)


def _false_alarm_probability(run: RunData, sensors: Sequence[str], settings: RunSettings, false_alarms: float) -> float:
    """Return the false-alarm probability of one check, if all checks of a run share the probability `false_alarms`."""
    accelerometers = run.measuring(ACCELERATION).keys() & settings.to_calibrate
    return false_alarm_per_check(len(sensors) + len(accelerometers) + len(run.measuring(FIELD)), of_all=false_alarms)


def contradicting_sweeps(runs: Sequence[RunData]) -> frozenset[int]:
    """Return the indices of the sweeps of an unfinished run that, for any sensor, contradict the other sweeps.

    They are judged as in the verdict. Sensors that cannot be solved so far are left out.
    """
    settings = runs[0].settings if runs else None
    if settings is None or not settings.planned_sweeps:
        return frozenset()
    from rig.analysis.gyroscope.stage_mounts import observe_as_mounted
    from rig.analysis.reference.accelerometer import calibrate_accelerometers

    disturbed = frozenset[int]()
    with suppress(RigError), solvable():
        recordings, _ = observe_as_mounted(runs, settings)
        if not recordings:
            return disturbed
        if settings.reference_c is not None:
            from rig.analysis.temperature.over_temperature import correct_recordings

            recordings = correct_recordings(recordings, settings, settings.reference_c).recordings
        chosen = {name: runs[0].sensors[name] for name in settings.to_calibrate}
        environment = find_environment(recordings, settings)
        results = solve_observed(chosen, recordings, environment)
        disturbed = contradictions(
            recordings, results, settings.to_calibrate, environment, settings, has_limits=False
        ).disturbed
        accelerometers = calibrate_accelerometers(recordings, settings, results).results
        disturbed |= check_references(recordings, accelerometers, {}, settings).disturbed
    return disturbed
