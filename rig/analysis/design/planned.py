"""What the checks of a run will tell, by its plan: the same checks, of readings that nothing is wrong with. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.consistency import reference_checks
from rig.analysis.consistency.alternatives import FAULT_MODES
from rig.analysis.consistency.contradictions import false_alarm_per_check
from rig.analysis.consistency.detection_limits import DetectionLimit, find_reference_limits
from rig.analysis.consistency.gyroscope_checks import predict_detection_limits
from rig.analysis.consistency.systematic_errors import build_error_patterns, build_known_errors, unknown_earth_rate
from rig.analysis.design.cut_plan import Planned, planned_segments
from rig.analysis.design.planned_motion import PlannedRun, planned_run
from rig.analysis.design.planned_reference import planned_accelerometers, planned_read
from rig.analysis.gyroscope.vector_inputs import known_sensor
from rig.config.models import ArmSection, RigConfig
from rig.config.sensors.sensor_catalogue import PARTS
from rig.config.sensors.sensor_sections import SensorSection, mounting_matrix
from rig.data.quantity import ACCELERATION, RATE
from rig.estimation.gyroscope.nonlinearity import distinct_speeds
from rig.motion.geometry import DenavitHartenberg
from rig.motion.steps import Plan, Rest


@dataclass(frozen=True, slots=True)
class Told:
    """What a plan tells by sensor: gyroscopes where anything is swept, accelerometers where attitudes are held."""

    rates: Mapping[str, tuple[DetectionLimit, ...]]
    accelerations: Mapping[str, tuple[DetectionLimit, ...]]


def planned_told_from(config: RigConfig, plan: Plan, turner: DenavitHartenberg) -> Told:
    """What the plan will tell of all that is to be calibrated but magnetometers; of accelerometers on an arm alone.

    For a `turner` made so, an arm as its model is drawn, and for a sensor as its data sheet has it, which nothing but
    its noise and its flicker makes wander. Of a plan over temperature one set is reckoned.
    """
    if turner.joints == 0:
        return Told({}, {})
    run = planned_run(config, _one_set(plan), turner)
    kinds = sum(1 + (each.acceleration is not None) for each in config.to_calibrate.values())
    rate = false_alarm_per_check(kinds + len(config.all_sensors) - len(config.sensors))
    rates: dict[str, tuple[DetectionLimit, ...]] = {}
    if run.plan.sweeps and not run.plan.stages:  # what several mountings tell together is not foretold
        turned = planned_segments(run)
        rates = {name: _told_from(run, name, each, turned, rate) for name, each in config.to_calibrate.items()}
    on_arm = isinstance(config.turner, ArmSection) and run.plan.dwells
    read = {each.name: planned_read(each) for each in planned_accelerometers(config, run)} if on_arm else {}
    found = {name: reference_checks.predict_detection_limits(each, rate) for name, each in read.items()}
    return Told(rates, {name: find_reference_limits(each, ACCELERATION) for name, each in found.items()})


def _one_set(plan: Plan) -> Plan:
    """The plan until it waits for the second temperature."""
    waits = [place for place, step in enumerate(plan.steps) if isinstance(step, Rest) and step.for_temperature]
    return replace(plan, steps=plan.steps[: waits[1]]) if len(waits) > 1 else plan


def _told_from(
    run: PlannedRun, name: str, sensor: SensorSection, turned: Planned, rate: float
) -> tuple[DetectionLimit, ...]:
    matrix, full_scale_rad_s = mounting_matrix(sensor.mounting), float(np.radians(sensor.range_deg_s))
    seen = turned.read_by(matrix, PARTS[sensor.part].angle_random_walk_rad_sqrt_s, sensor.rate_hz)
    at_s = seen.segments.times_s.mean(axis=1)
    speeds = distinct_speeds(np.array([sweep.speed_rad_s for sweep in run.plan.sweeps]))
    allowed = build_known_errors(
        run.known,
        name,
        full_scale_rad_s,
        finds_curve=len(speeds) > 1,
        arcs=run.settings.has_arcs,
        jitter_s=0.0,
        earth_rad_s=unknown_earth_rate(is_known=run.site.earth_rate_rad_s is not None or run.settings.finds_earth_rate),
        sensor=known_sensor(run.known, name, full_scale_rad_s, np.zeros(len(at_s)), 0.0),
        temperature_times_s=at_s,
    )
    found = predict_detection_limits(
        seen.segments, matrix, rate, build_error_patterns(allowed, seen.segments, seen.ways, matrix)
    )
    return tuple(
        DetectionLimit(each.what, each.check, found[each.what], each.unit or RATE.unit)
        for each in FAULT_MODES
        if each.what in found
    )
