"""The detection limits of a plan's checks, for faultless readings. Pure functions."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.consistency.alternatives import FAULT_MODES
from rig.analysis.consistency.detection_limits import DetectionLimit, find_reference_limits
from rig.analysis.consistency.false_alarms import false_alarm_per_check
from rig.analysis.consistency.gyroscope_checks import predict_detection_limits
from rig.analysis.consistency.systematic_errors import build_error_patterns, build_known_errors, unknown_earth_rate
from rig.analysis.design.cut_plan import PlannedSegments, plan_segments
from rig.analysis.design.planned_motion import ENCODER_NOISE_RAD, PlannedRun, plan_run, predict_state_jitter
from rig.analysis.environment import SPLINE_NOISE_RATIO
from rig.analysis.gyroscope.vector_inputs import describe_sensor
from rig.config.models import ArmSection, RigConfig
from rig.config.sensors.sensor_catalogue import PARTS
from rig.config.sensors.sensor_sections import SensorSection, mounting_matrix
from rig.data.quantity import ACCELERATION, RATE
from rig.estimation.gyroscope.nonlinearity import distinct_speeds
from rig.motion.chain import DenavitHartenberg
from rig.motion.steps import Plan, Rest


@dataclass(frozen=True, slots=True)
class DetectionLimits:
    """The detection limits of gyroscopes, from sweeps (`rates`), and of accelerometers, from attitudes, by sensor."""

    rates: Mapping[str, tuple[DetectionLimit, ...]]
    accelerations: Mapping[str, tuple[DetectionLimit, ...]]


def predict_limits(config: RigConfig, plan: Plan, turner: DenavitHartenberg) -> DetectionLimits:
    """Return the predicted detection limits of the gyroscopes to calibrate and, on an arm, of the accelerometers.

    The `turner` is nominal, the noise is that of the data sheet, and flicker is the only bias drift. If a plan visits
    several temperatures, only the steps at the first one are used.
    """
    if turner.joints == 0:
        return DetectionLimits({}, {})
    run = plan_run(config, _one_set(plan), turner)
    kinds = sum(1 + (sensor.acceleration is not None) for sensor in config.to_calibrate.values())
    false_alarm_probability = false_alarm_per_check(kinds + len(config.all_sensors) - len(config.sensors))
    rates: dict[str, tuple[DetectionLimit, ...]] = {}
    by_arm = isinstance(config.turner, ArmSection)
    if run.plan.sweeps and not run.plan.stages:  # the limits of several mountings together are not predicted
        segments = plan_segments(run)
        rates = {
            name: _gyroscope_limits(run, name, sensor, segments, false_alarm_probability, by_arm=by_arm)
            for name, sensor in config.to_calibrate.items()
        }
    if not (by_arm and run.plan.dwells):
        return DetectionLimits(rates, {})
    from rig.analysis.consistency import reference_checks
    from rig.analysis.design.planned_reference import list_accelerometers, predict_readings

    models = {accelerometer.name: predict_readings(accelerometer) for accelerometer in list_accelerometers(config, run)}
    limits = {
        name: reference_checks.predict_detection_limits(model, false_alarm_probability)
        for name, model in models.items()
    }
    return DetectionLimits(rates, {name: find_reference_limits(limit, ACCELERATION) for name, limit in limits.items()})


def _one_set(plan: Plan) -> Plan:
    """Return the plan's steps at its first temperature: those before the wait for the second."""
    waits = [index for index, step in enumerate(plan.steps) if isinstance(step, Rest) and step.for_temperature]
    return replace(plan, steps=plan.steps[: waits[1]]) if len(waits) > 1 else plan


def _gyroscope_limits(
    run: PlannedRun,
    name: str,
    sensor: SensorSection,
    segments: PlannedSegments,
    false_alarm_probability: float,
    *,
    by_arm: bool,
) -> tuple[DetectionLimit, ...]:
    """Return the detection limits of one gyroscope, from the plan's segments with the data sheet's noise."""
    matrix, full_scale_rad_s = mounting_matrix(sensor.mounting), float(np.radians(sensor.range_deg_s))
    readings = segments.read_with(matrix, PARTS[sensor.part].angle_random_walk_rad_sqrt_s, sensor.rate_hz)
    times_s = readings.segments.times_s.mean(axis=1)
    speeds = distinct_speeds(np.array([sweep.speed_rad_s for sweep in run.plan.sweeps]))
    known_errors = build_known_errors(
        run.uncertainty,
        name,
        full_scale_rad_s,
        finds_curve=len(speeds) > 1,
        arcs=run.settings.has_arcs,
        jitter_s=predict_state_jitter(run.plan) if by_arm else 0.0,
        reading_rad=ENCODER_NOISE_RAD * SPLINE_NOISE_RATIO if by_arm else 0.0,
        earth_rad_s=unknown_earth_rate(is_known=run.site.earth_rate_rad_s is not None or run.settings.finds_earth_rate),
        sensor=describe_sensor(run.uncertainty, name, full_scale_rad_s, np.zeros(len(times_s)), 0.0),
        temperature_times_s=times_s,
    )
    limits = predict_detection_limits(
        readings.segments,
        matrix,
        false_alarm_probability,
        build_error_patterns(known_errors, readings.segments, readings.with_transfers, matrix),
    )
    return tuple(
        DetectionLimit(mode.what, mode.check, limits[mode.what], mode.unit or RATE.unit)
        for mode in FAULT_MODES
        if mode.what in limits
    )
