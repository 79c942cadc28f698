"""Calibrations over temperature: readings are corrected to one temperature by polynomials from repeated poses.

The solution that follows is an ordinary calibration, at the reference temperature.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.environment import MeasurementEnvironment, find_environment
from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.gyroscope.vector_inputs import collect_inputs
from rig.analysis.reference.accelerometer import AccelerometerResult
from rig.data.quantity import ACCELERATION, RATE, TEMPERATURE, Quantity
from rig.data.recording.settings import RunSettings
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.temperature.over_temperature import fit_over_temperature, group_by_input
from rig.estimation.temperature.polynomial_fits import RepeatedMeans
from rig.estimation.temperature.temperature_polynomials import (
    OverTemperature,
    TemperatureLine,
    combine_with_reference,
    powers_at,
)
from rig.observation.average import Average
from rig.observation.external.csv_import import ExternalData, stack_rows
from rig.observation.observe import Observation, SensorObservations
from rig.observation.observed_run import ObservedRun

CONTRIBUTOR = "polynomials over temperature"
GRADIENT_HALF_WIDTH_K = 0.1  # assumed if no configuration states it
NOT_RECORDED_FAULT = Fault(
    "temperature_not_recorded",
    "a calibration over temperature is requested, but the readings have no temperature",
    "Record the part's thermometer with its readings, column temperature_c",
)

Polynomials = Mapping[str, Mapping[Quantity, OverTemperature]]


@dataclass(frozen=True, slots=True)
class CorrectedRuns:
    """Recordings corrected to the reference temperature, and the polynomials that corrected them."""

    recordings: tuple[ObservedRun, ...]
    polynomials: Polynomials


def correct_recordings(recordings: Sequence[ObservedRun], settings: RunSettings, reference_c: float) -> CorrectedRuns:
    """Return the recordings with the means of sensors to calibrate corrected to the temperature `reference_c`.

    The means are those of gyroscopes in sweeps and rests, and of accelerometers in dwells and sweeps. Raise Fault
    `temperature_not_recorded`, and what `fit_over_temperature` raises.
    """
    environment = find_environment(recordings, settings)
    runs, polynomials = list(recordings), dict[str, dict[Quantity, OverTemperature]]()
    for name in settings.to_calibrate:
        if not recordings[0].run.sensors[name].measures(TEMPERATURE):
            raise NOT_RECORDED_FAULT
        polynomials[name] = {}
        if settings.planned_dwells and recordings[0].run.sensors[name].measures(ACCELERATION):
            runs, polynomials[name][ACCELERATION] = _correct_accelerations(runs, name, environment, reference_c)
        if settings.planned_sweeps:  # last: it sets the sweeps' temperatures to the reference
            runs, polynomials[name][RATE] = _correct_rates(runs, name, environment, reference_c)
    return CorrectedRuns(tuple(replace(recording, polynomials=polynomials) for recording in runs), polynomials)


def correct_files(data: ExternalData, reference_c: float) -> tuple[ExternalData, OverTemperature]:
    """Return sweeps and rests of files, with means corrected to `reference_c`, and the polynomials of the correction.

    Raise Fault as `correct_recordings` does.
    """
    averages, inputs = stack_rows(data.sweeps, data.rests)
    repeated = RepeatedMeans(
        means=np.array([average.mean_rad_s for average in averages]),
        variances=np.array([average.variance_rad2_s2 for average in averages]),
        inputs=inputs,
        poses=group_by_input(inputs, np.zeros((len(inputs), 0))),
        windows_s=np.array([(average.start_s, average.end_s) for average in averages]),
        temperature_c=np.array([average.temperature_c for average in averages]),
    )
    if np.isnan(repeated.temperature_c).any():
        raise NOT_RECORDED_FAULT
    polynomials = fit_over_temperature(repeated, reference_c, GRADIENT_HALF_WIDTH_K)
    means = polynomials.correct_to_reference(repeated.means, repeated.temperature_c)
    corrected = [_replace_mean(average, mean, reference_c) for average, mean in zip(averages, means, strict=True)]
    sweeps = tuple(replace(sweep, average=average) for sweep, average in zip(data.sweeps, corrected, strict=False))
    return ExternalData(sweeps, tuple(corrected[len(sweeps) :]), at_reference=True), polynomials


def add_rate_polynomials(result: SensorResult, polynomials: OverTemperature) -> tuple[SensorResult, OverTemperature]:
    """Return a gyroscope's calibration and polynomials; the uncertainty of each includes that of the other."""
    parameters = np.r_[result.scale, result.bias_rad_s]
    if result.uncertainty is None:
        return result, combine_with_reference(polynomials, np.diag(RATE.parameter_signs) @ parameters, ())
    budget, combined = _combine(RATE, polynomials, parameters, result.uncertainty)
    return replace(result, uncertainty=budget), combined


def add_acceleration_polynomials(
    result: AccelerometerResult, polynomials: OverTemperature
) -> tuple[AccelerometerResult, OverTemperature]:
    """Return an accelerometer's calibration and polynomials; the uncertainty of each includes that of the other."""
    budget, combined = _combine(ACCELERATION, polynomials, np.r_[result.triad.scale, result.bias_m_s2], result.budget)
    return replace(result, budget=budget), combined


def _combine(
    quantity: Quantity, polynomials: OverTemperature, parameters: Array, budget: Budget
) -> tuple[Budget, OverTemperature]:
    """Return the budget and the polynomials, after the uncertainty of each is added to the other.

    `parameters` (6,) are scale and bias at the reference temperature.
    """
    sign = np.diag(quantity.parameter_signs)
    values = sign @ parameters
    lines = tuple(
        TemperatureLine(
            contributor.name,
            contributor.kind,
            contributor.distribution,
            contributor.source,
            contributor.dof,
            sign @ contributor.covariance @ sign,
        )
        for contributor in budget.contributors
    )
    powers = powers_at(0.0)
    corrected = sign @ powers @ combine_with_reference(polynomials, values, ()).covariance @ powers.T @ sign
    source = "fit of the polynomials to the repeats"
    added = Contributor(CONTRIBUTOR, "A", "normal", None, "", source, float(polynomials.process.dof), corrected)
    return replace(budget, contributors=(*budget.contributors, added)), combine_with_reference(
        polynomials, values, lines
    )


def _correct_rates(
    recordings: Sequence[ObservedRun], name: str, environment: MeasurementEnvironment, reference_c: float
) -> tuple[list[ObservedRun], OverTemperature]:
    """Return the recordings with a gyroscope's means corrected to `reference_c`, and the polynomials."""
    inputs = collect_inputs(recordings, name, environment)
    parts = [recording.sensors[name] for recording in recordings]
    averages = [turn.average for part in parts for turn in part.revolutions]
    averages += [rest for part in parts for rest in part.rests]
    temperature_c = np.array([average.temperature_c for average in averages])
    repeated = RepeatedMeans(
        means=inputs.means_rad_s,
        variances=inputs.variances_rad2_s2,
        inputs=inputs.turns_rad_s,
        poses=group_by_input(inputs.turns_rad_s, inputs.gravity_m_s2),
        windows_s=inputs.windows_s,
        temperature_c=temperature_c,
        instability=0.0 if inputs.sensor is None else inputs.sensor.instability_rad_s,
    )
    polynomials = fit_over_temperature(repeated, reference_c, environment.uncertainty.thermometer_gradient_k)
    corrected = iter(polynomials.correct_to_reference(repeated.means, temperature_c))
    turns = [tuple(_correct_turn(turn, next(corrected), reference_c) for turn in part.revolutions) for part in parts]
    rests = [tuple(_replace_mean(rest, next(corrected), reference_c) for rest in part.rests) for part in parts]
    return _exchange(recordings, name, [
        replace(part, revolutions=swept, rests=still) for part, swept, still in zip(parts, turns, rests, strict=True)
    ]), polynomials  # fmt: skip


def _correct_accelerations(
    recordings: Sequence[ObservedRun], name: str, environment: MeasurementEnvironment, reference_c: float
) -> tuple[list[ObservedRun], OverTemperature]:
    """Return the recordings with an accelerometer's means corrected to `reference_c`, and the polynomials."""
    parts = [recording.sensors[name] for recording in recordings]
    timed = [(dwell, recording.clock_offset_s) for recording in recordings for dwell in recording.sensors[name].dwells]
    dwells = [dwell for dwell, _ in timed]
    attitudes = np.array([dwell.attitude for dwell in dwells])
    inputs = -(attitudes @ environment.site.down_m_s2)
    temperature_c = np.array([dwell.temperature_c for dwell in dwells])
    repeated = RepeatedMeans(
        means=np.array([dwell.reading.mean for dwell in dwells]),
        variances=np.array([dwell.reading.variance for dwell in dwells]),
        inputs=inputs,
        poses=group_by_input(inputs, attitudes.reshape(len(dwells), 9)),
        windows_s=np.array([(dwell.window.start_s + offset, dwell.window.end_s + offset) for dwell, offset in timed]),
        temperature_c=temperature_c,
    )
    polynomials = fit_over_temperature(repeated, reference_c, environment.uncertainty.thermometer_gradient_k)
    corrected = iter(polynomials.correct_to_reference(repeated.means, temperature_c))
    dwelt = [
        tuple(
            replace(dwell, reading=replace(dwell.reading, mean=next(corrected)), temperature_c=reference_c)
            for dwell in part.dwells
        )
        for part in parts
    ]
    turns = [tuple(_correct_wave(turn, polynomials) for turn in part.revolutions) for part in parts]
    return _exchange(recordings, name, [
        replace(part, dwells=still, revolutions=swept) for part, still, swept in zip(parts, dwelt, turns, strict=True)
    ]), polynomials  # fmt: skip


def _exchange(recordings: Sequence[ObservedRun], name: str, parts: Sequence[SensorObservations]) -> list[ObservedRun]:
    return [
        replace(recording, sensors={**recording.sensors, name: part})
        for recording, part in zip(recordings, parts, strict=True)
    ]


def _replace_mean(average: Average, mean_rad_s: Array, reference_c: float) -> Average:
    return replace(average, mean_rad_s=mean_rad_s, temperature_c=reference_c)


def _correct_turn(turn: Observation, mean_rad_s: Array, reference_c: float) -> Observation:
    return replace(turn, average=_replace_mean(turn.average, mean_rad_s, reference_c))


def _correct_wave(turn: Observation, polynomials: OverTemperature) -> Observation:
    """Return a revolution with its accelerations' mean, cosine and sine corrected to the reference temperature."""
    if turn.acceleration is None:
        return turn
    wave = turn.acceleration.harmonic
    warm = np.array([turn.average.temperature_c])
    mean, fraction = polynomials.correct_to_reference(wave.harmonic_m_s2[:1], warm), polynomials.changes(warm)[0]
    harmonic = np.vstack([mean, fraction * wave.harmonic_m_s2[1:]])
    return replace(turn, acceleration=replace(turn.acceleration, harmonic=replace(wave, harmonic_m_s2=harmonic)))
