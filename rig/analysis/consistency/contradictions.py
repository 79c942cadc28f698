"""What contradicts itself does not pass: the checks of the verdict that hold a recording against itself."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np

from rig.analysis.check import Check, fitness
from rig.analysis.consistency import gyroscope_checks, readings
from rig.analysis.consistency.detection_limits import ToldFrom, of_gyroscope, of_reference
from rig.analysis.consistency.frozen_axis import longest_frozen
from rig.analysis.consistency.reference_contradictions import (
    DISTURBED_SWEEP,
    ReadInReference,
    of_accelerometer,
    of_magnetometer,
    reference_statistics,
)
from rig.analysis.consistency.residual_tests import Statistic
from rig.analysis.consistency.systematic_errors import allow, allowed
from rig.analysis.gyroscope.calibration import SensorResult, solve_observed
from rig.analysis.gyroscope.mounts import observe_as_mounted
from rig.analysis.gyroscope.segments import stack_segments, with_transfers
from rig.analysis.reference.acceleration import AccelerometerResult, calibrate_accelerometers
from rig.analysis.reference.magnetic_field import MagnetometerResult
from rig.analysis.solvable import solvable
from rig.analysis.surroundings import Surroundings, surroundings_of
from rig.analysis.temperature.over_temperature import taken_to_reference
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import RunSettings
from rig.errors import RigError
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.estimation.statistics import coverage
from rig.observation.consistency.segments import segment_recordings
from rig.observation.consistency.transfers import average_transfers
from rig.observation.observed_run import ObservedRun

FALSE_ALARMS = 0.001  # how often one of these checks, of any sensor, fails an undamaged run, at most
NON_ORTHOGONALITY = "non_orthogonality"
# Of a gyroscope: they share the false alarms. Other kinds of readings count as many.
CHECKS = (*gyroscope_checks.CHECKS, DISTURBED_SWEEP, *readings.CHECKS, NON_ORTHOGONALITY)


@dataclass(frozen=True, slots=True)
class Contradictions:
    """The checks, in order, and what of each sensor is told."""

    checks: tuple[Check, ...]
    told_from: Mapping[str, tuple[ToldFrom, ...]] = field(default_factory=dict)

    @property
    def disturbed(self) -> frozenset[int]:
        """The sweeps of the plan, by index, that the checks name."""
        return frozenset(check.means.sweep for check in self.checks if check.means.sweep is not None)


NOTHING = Contradictions(())


def contradictions(
    recordings: Sequence[ObservedRun],
    results: Mapping[str, SensorResult],
    sensors: Sequence[str],
    surroundings: Surroundings,
    settings: RunSettings,
    *,
    false_alarms: float = FALSE_ALARMS,
) -> Contradictions:
    """Return what contradicts itself in these sensors' results.

    `surroundings` are those of the recordings, `false_alarms` is the share of undamaged runs that may fail. A sweep
    that is named is part of the name, `gyro.disturbed_sweep.3`, and of what the check means.
    """
    checks: list[Check] = []
    told_from: dict[str, tuple[ToldFrom, ...]] = {}
    rate = _rate(recordings[0].run, sensors, settings, false_alarms)
    for name in sensors:
        explained = results[name].explained
        if explained is None:
            continue
        windows = segment_recordings(name, recordings)
        segments = stack_segments(windows, explained, settings.site)
        known = allowed(surroundings, name, results[name], recordings[0].run.sensors[name].stamp_std_s)
        matrix, extension_m = explained.solution.matrix, np.array(settings.extension_m)
        transfers = average_transfers(name, recordings, matrix, settings.site, extension_m)
        ways = with_transfers(segments, transfers, windows, explained)
        allowance = allow(known, segments, ways, matrix)
        found = gyroscope_checks.consistency(segments, matrix, rate, allowance)
        sensor = recordings[0].run.sensors[name]
        gyroscope = sensor.channel(RATE)
        counts = [gyroscope.counts(recording.run.samples[name]).astype(np.int64) for recording in recordings]
        named = {results[name].observations[place].sweep: each for place, each in found.disturbed.items()}
        sweeps = [fitness(name, "rate", DISTURBED_SWEEP, *named[sweep], sweep=sweep) for sweep in sorted(named)]
        checks += sweeps or [fitness(name, "rate", DISTURBED_SWEEP, *found.piece)]
        of_readings = readings.judge_readings(
            counts,
            segments.readings,
            rate,
            digits=readings.digits_of(sensor, RATE, [recording.run.samples[name] for recording in recordings]),
            frozen=max(longest_frozen(recording, name) for recording in recordings),
        )
        checks += [fitness(name, "rate", what, *each) for what, each in {**found.statistics, **of_readings}.items()]
        stated_deg = surroundings.uncertainty.of("non_orthogonality_deg", name)
        leaning = _leaning_deg(explained.solution, stated_deg, rate)
        checks.append(fitness(name, "rate", NON_ORTHOGONALITY, *leaning, unit="°"))
        told_from[name] = tuple(of_gyroscope(found.told_from, name, results[name], surroundings))
    return Contradictions(tuple(checks), told_from)


def _leaning_deg(solution: VectorSolution, stated_deg: float, rate: float) -> Statistic:
    """The angle between two axes that is farthest off 90° for what is stated, and its limit, in degrees.

    `stated_deg` is a half-width; beside it stands what of the angle is not known, so that chance is beyond the limit in
    a share `rate` of recordings at most. Sweeps about three axes do not tell a wrist whose zero is off from a sensor's
    axis that leans: no residual shows it, and the scale factors of a sensor that is mounted askew are off by it.
    """
    from scipy.special import ndtri

    off_deg = np.degrees(np.abs(solution.non_orthogonality_rad))
    std_deg = np.degrees(np.sqrt(np.diag(solution.angles_covariance_rad2)[:3]))
    limits_deg = stated_deg + std_deg * float(ndtri(1 - rate / 6))
    worst = int(np.argmax(off_deg - limits_deg))
    return float(off_deg[worst]), float(limits_deg[worst])


def in_reference(
    recordings: Sequence[ObservedRun],
    accelerometers: Mapping[str, AccelerometerResult],
    magnetometers: Mapping[str, MagnetometerResult],
    settings: RunSettings,
    *,
    drifting: bool = False,
) -> Contradictions:
    """Return what contradicts itself in readings of gravity and field.

    Dwell and sweep are named as a gyroscope's sweep is: `gyro.acceleration_disturbed_dwell.13`. The bias may change
    steadily where it is `drifting`.
    """
    known = settings.stated_uncertainty
    asked: dict[tuple[str, Quantity], ReadInReference] = {
        **{(name, ACCELERATION): of_accelerometer(name, recordings, each, known)
           for name, each in accelerometers.items()},
        **{(name, FIELD): of_magnetometer(name, recordings, each, known)
           for name, each in magnetometers.items()}}  # fmt: skip
    rate = _rate(recordings[0].run, settings.to_calibrate, settings, FALSE_ALARMS)
    checks: list[Check] = []
    told_from: dict[str, tuple[ToldFrom, ...]] = {}
    for (name, quantity), held in asked.items():
        found = reference_statistics(held, rate, drifting=drifting)
        for at, statistic in found.pieces:
            checks.append(fitness(name, quantity.name, at.what, *statistic, sweep=at.sweep, dwell=at.dwell))
        checks += [fitness(name, quantity.name, what, *each) for what, each in found.statistics.items()]
        told_from[name] = of_reference(found.told_from, quantity)
    return Contradictions(tuple(checks), told_from)


def _rate(run: RunData, sensors: Sequence[str], settings: RunSettings, false_alarms: float) -> float:
    """Rate of false alarms for each statistic: all kinds of readings that are held against themselves share them."""
    accelerometers = run.measuring(ACCELERATION).keys() & settings.to_calibrate
    return rate_of_each(len(sensors) + len(accelerometers) + len(run.measuring(FIELD)), of_all=false_alarms)


def rate_of_each(kinds: int, *, of_all: float = FALSE_ALARMS) -> float:
    """Rate of false alarms for each statistic, where so many kinds of readings are held against themselves."""
    return coverage.false_alarm_of_each(of_all, len(CHECKS) * kinds)


def disturbed_sweeps(runs: Sequence[RunData]) -> frozenset[int]:
    """The sweeps in the recordings of a run so far that contradict the others by what any sensor felt in them.

    Those that the verdict names; none of gyroscopes or of accelerometers where these cannot be solved yet.
    """
    settings = runs[0].settings if runs else None
    if settings is None or not settings.planned_sweeps:
        return frozenset()
    named = frozenset[int]()
    with suppress(RigError), solvable():
        recordings, _ = observe_as_mounted(runs, settings)
        if not recordings:
            return named
        if settings.reference_c is not None:
            recordings = taken_to_reference(recordings, settings, settings.reference_c).recordings
        chosen = {name: runs[0].sensors[name] for name in settings.to_calibrate}
        surroundings = surroundings_of(recordings, settings)
        results = solve_observed(chosen, recordings, surroundings)
        named = contradictions(recordings, results, settings.to_calibrate, surroundings, settings).disturbed
        accelerometers = calibrate_accelerometers(recordings, settings, results)
        named |= in_reference(recordings, accelerometers, {}, settings).disturbed
    return named
