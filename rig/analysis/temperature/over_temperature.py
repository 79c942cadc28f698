"""Calibrations over temperature: readings are taken to one temperature by polynomials that their repeats tell. Pure.

What is solved afterwards is an ordinary calibration, at the reference temperature.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.gyroscope.vector_inputs import collect_inputs
from rig.analysis.reference.acceleration import AccelerometerResult
from rig.analysis.surroundings import Surroundings, surroundings_of
from rig.data.quantity import ACCELERATION, RATE, TEMPERATURE, Quantity
from rig.data.recording.settings import RunSettings
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.temperature.over_temperature import (
    OverTemperature,
    RepeatedMeans,
    TemperatureLine,
    combine_with_reference,
    fit_over_temperature,
    group_by_input,
    powers_at,
)
from rig.observation.average import Average
from rig.observation.external.csv_import import ExternalData
from rig.observation.observe import Observation, SensorObservations
from rig.observation.observed_run import ObservedRun
from rig.observation.reference.acceleration import DwellReading

CONTRIBUTOR = "polynomials over temperature"
ASSUMED_GRADIENT_K = 0.1  # half a width, where no configuration states it
NOT_RECORDED = Fault(
    "temperature_not_recorded",
    "a calibration over temperature is asked for, and the readings have no temperature",
    "Record the part's thermometer with its readings, column temperature_c",
)

Polynomials = Mapping[str, Mapping[Quantity, OverTemperature]]


@dataclass(frozen=True, slots=True)
class AtReference:
    """Recordings whose readings are those at the reference temperature, and the polynomials that took them there."""

    recordings: tuple[ObservedRun, ...]
    polynomials: Polynomials


def taken_to_reference(recordings: Sequence[ObservedRun], settings: RunSettings, reference_c: float) -> AtReference:
    """Every sensor to calibrate, its rates and what its accelerometer read in dwells.

    Raises Fault as `fit_over_temperature` does, and `temperature_not_recorded`.
    """
    surroundings = surroundings_of(recordings, settings)
    moved, found = list(recordings), dict[str, dict[Quantity, OverTemperature]]()
    for name in settings.to_calibrate:
        if not recordings[0].run.sensors[name].measures(TEMPERATURE):
            raise NOT_RECORDED
        found[name] = {}
        if settings.planned_dwells and recordings[0].run.sensors[name].measures(ACCELERATION):
            moved, found[name][ACCELERATION] = _accelerations(moved, name, surroundings, reference_c)
        if settings.planned_sweeps:  # last, for the sweeps' temperatures are the reference's afterwards
            moved, found[name][RATE] = _rates(moved, name, surroundings, reference_c)
    return AtReference(tuple(replace(each, polynomials=found) for each in moved), found)


def files_to_reference(data: ExternalData, reference_c: float) -> tuple[ExternalData, OverTemperature]:
    """Sweeps and rests of files at the reference temperature. Raises Fault as `taken_to_reference` does."""
    averages = [*(sweep.average for sweep in data.sweeps), *data.rests]
    turned = [sweep.speed_rad_s * sweep.axis_flange for sweep in data.sweeps]
    felt = np.array([*turned, *np.zeros((len(data.rests), 3))])
    seen = RepeatedMeans(
        means=np.array([each.mean_rad_s for each in averages]),
        variances=np.array([each.variance_rad2_s2 for each in averages]),
        inputs=felt,
        poses=group_by_input(felt, np.zeros((len(felt), 0))),
        windows_s=np.array([(each.start_s, each.end_s) for each in averages]),
        temperature_c=np.array([each.temperature_c for each in averages]),
    )
    if np.isnan(seen.temperature_c).any():
        raise NOT_RECORDED
    found = fit_over_temperature(seen, reference_c, ASSUMED_GRADIENT_K)
    means = found.correct_to_reference(seen.means, seen.temperature_c)
    moved = [_average(each, mean, reference_c) for each, mean in zip(averages, means, strict=True)]
    sweeps = tuple(replace(sweep, average=average) for sweep, average in zip(data.sweeps, moved, strict=False))
    return ExternalData(sweeps, tuple(moved[len(sweeps) :]), at_reference=True), found


def with_rate_polynomials(result: SensorResult, polynomials: OverTemperature) -> tuple[SensorResult, OverTemperature]:
    """A gyroscope's calibration with what the polynomials add to its uncertainty, and these with all of its budget."""
    parameters = np.r_[result.scale, result.bias_rad_s]
    if result.uncertainty is None:
        return result, combine_with_reference(polynomials, np.diag(RATE.parameter_signs) @ parameters, ())
    budget, whole = _together(RATE, polynomials, parameters, result.uncertainty)
    return replace(result, uncertainty=budget), whole


def with_acceleration_polynomials(
    result: AccelerometerResult, polynomials: OverTemperature
) -> tuple[AccelerometerResult, OverTemperature]:
    """An accelerometer's, as a gyroscope's."""
    budget, whole = _together(ACCELERATION, polynomials, np.r_[result.triad.scale, result.bias_m_s2], result.budget)
    return replace(result, budget=budget), whole


def _together(
    quantity: Quantity, polynomials: OverTemperature, parameters: Array, budget: Budget
) -> tuple[Budget, OverTemperature]:
    """A budget of scale factors and biases (6,) with the polynomials' part, and these, whose bias is in the reading."""
    sign = np.diag(quantity.parameter_signs)
    values = sign @ parameters
    lines = tuple(
        TemperatureLine(
            contributor.name,
            contributor.kind,
            contributor.distribution,
            contributor.source,
            contributor.freedom,
            sign @ contributor.covariance @ sign,
        )
        for contributor in budget.contributors
    )
    at = powers_at(0.0)
    moved = sign @ at @ combine_with_reference(polynomials, values, ()).covariance @ at.T @ sign
    source = "what the repeats tell of the way to the reference temperature"
    added = Contributor(CONTRIBUTOR, "A", "normal", None, "", source, float(polynomials.process.freedom), moved)
    return replace(budget, contributors=(*budget.contributors, added)), combine_with_reference(
        polynomials, values, lines
    )


def _rates(
    recordings: Sequence[ObservedRun], name: str, surroundings: Surroundings, reference_c: float
) -> tuple[list[ObservedRun], OverTemperature]:
    known = collect_inputs(recordings, name, surroundings)
    parts = [recording.sensors[name] for recording in recordings]
    averages = [turn.average for part in parts for turn in part.revolutions]
    averages += [rest for part in parts for rest in part.rests]
    temperature_c = np.array([average.temperature_c for average in averages])
    seen = RepeatedMeans(
        means=known.means_rad_s,
        variances=known.variances_rad2_s2,
        inputs=known.turns_rad_s,
        poses=group_by_input(known.turns_rad_s, known.gravity_m_s2),
        windows_s=known.windows_s,
        temperature_c=temperature_c,
        instability=0.0 if known.sensor is None else known.sensor.instability_rad_s,
    )
    found = fit_over_temperature(seen, reference_c, surroundings.uncertainty.thermometer_gradient_k)
    moved = iter(found.correct_to_reference(seen.means, temperature_c))
    turns = [[_turn(turn, next(moved), reference_c) for turn in part.revolutions] for part in parts]
    rests = [[_average(rest, next(moved), reference_c) for rest in part.rests] for part in parts]
    return _replaced(recordings, name, [
        replace(part, revolutions=tuple(of), rests=tuple(at)) for part, of, at in zip(parts, turns, rests, strict=True)
    ]), found  # fmt: skip


def _accelerations(
    recordings: Sequence[ObservedRun], name: str, surroundings: Surroundings, reference_c: float
) -> tuple[list[ObservedRun], OverTemperature]:
    parts = [recording.sensors[name] for recording in recordings]
    placed = [(dwell, recording.clock_offset_s) for recording in recordings for dwell in recording.sensors[name].dwells]
    dwells = [dwell for dwell, _ in placed]
    attitudes = np.array([dwell.attitude for dwell in dwells])
    felt = -(attitudes @ surroundings.site.down_m_s2)
    temperature_c = np.array([dwell.temperature_c for dwell in dwells])
    seen = RepeatedMeans(
        means=np.array([dwell.reading.mean for dwell in dwells]),
        variances=np.array([dwell.reading.variance for dwell in dwells]),
        inputs=felt,
        poses=group_by_input(felt, attitudes.reshape(len(dwells), 9)),
        windows_s=np.array([(each.window.start_s + since, each.window.end_s + since) for each, since in placed]),
        temperature_c=temperature_c,
    )
    found = fit_over_temperature(seen, reference_c, surroundings.uncertainty.thermometer_gradient_k)
    moved = iter(found.correct_to_reference(seen.means, temperature_c))
    stood = [tuple(_dwell(dwell, next(moved), reference_c) for dwell in part.dwells) for part in parts]
    turns = [tuple(_waved(turn, turn.average.temperature_c, found) for turn in part.revolutions) for part in parts]
    return _replaced(recordings, name, [
        replace(part, dwells=at, revolutions=of) for part, at, of in zip(parts, stood, turns, strict=True)
    ]), found  # fmt: skip


def _replaced(recordings: Sequence[ObservedRun], name: str, parts: Sequence[SensorObservations]) -> list[ObservedRun]:
    return [
        replace(recording, sensors={**recording.sensors, name: part})
        for recording, part in zip(recordings, parts, strict=True)
    ]


def _average(average: Average, mean_rad_s: Array, reference_c: float) -> Average:
    return replace(average, mean_rad_s=mean_rad_s, temperature_c=reference_c)


def _turn(turn: Observation, mean_rad_s: Array, reference_c: float) -> Observation:
    return replace(turn, average=_average(turn.average, mean_rad_s, reference_c))


def _waved(turn: Observation, warmed_c: float, polynomials: OverTemperature) -> Observation:
    """A turn with the mean and the wave of what its accelerometer read, at the reference temperature."""
    if turn.acceleration is None:
        return turn
    wave = turn.acceleration.harmonic
    warm = np.array([warmed_c])
    mean, share = polynomials.correct_to_reference(wave.harmonic_m_s2[:1], warm), polynomials.changes(warm)[0]
    harmonic = np.vstack([mean, share * wave.harmonic_m_s2[1:]])
    return replace(turn, acceleration=replace(turn.acceleration, harmonic=replace(wave, harmonic_m_s2=harmonic)))


def _dwell(dwell: DwellReading, mean: Array, reference_c: float) -> DwellReading:
    return replace(dwell, reading=replace(dwell.reading, mean=mean), temperature_c=reference_c)
