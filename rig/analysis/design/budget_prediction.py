"""The prediction of a plan's uncertainty: the budget of a simulated recording. Pure functions.

The plan determines the joints' motion, the configuration determines the known errors of turner, site and sensor, and
the data sheet determines the sensor's noise. Two parts of a budget cannot be predicted and are left out, because only
readings show them: the bias drift beyond flicker, and the temperature change.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rig.analysis.clock_comparison import COMPUTER_CLOCK, CRYSTAL_CLOCK, PPM, ClockCheck, ClockComparison
from rig.analysis.design.planned_motion import (
    END_REST_S,
    PlannedRun,
    Timed,
    measuring_steps,
    plan_run,
    predict_attitude,
    predict_revolution,
    predict_state_jitter,
    time_steps_of,
)
from rig.analysis.environment import MeasurementEnvironment
from rig.analysis.gyroscope.calibration import solve_six_observation
from rig.analysis.gyroscope.vector_inputs import RecordingPart, combine_recordings, describe_sensor, list_uncertainties
from rig.config.models import RigConfig
from rig.config.procedures.servo_section import ServoSection
from rig.config.procedures.stage_section import rotation_by
from rig.config.sensors.sensor_catalogue import PARTS
from rig.config.sensors.sensor_sections import SensorSection, mounting_matrix
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget, budget
from rig.estimation.gyroscope.six_observation_budget import six_observation_budget
from rig.estimation.gyroscope.vector_fit import VectorInputs, explain
from rig.estimation.statistics.bias_process import BiasProcess
from rig.motion.steps import TURN_RAD, Plan, Step, Sweep
from rig.motion.turner_state import TurnerIdentity
from rig.observation.arm_rests import MIN_SAMPLES_AT_REST, REST_SETTLING_S
from rig.observation.average import Average
from rig.observation.motion.even_turn import GUARD_RAD
from rig.observation.observe import Observation, nearest_axis

ROOM_C = 22.0  # assumed constant, because nobody knows beforehand how much a run warms the sensor
STEP_K = 1 / 16  # resolution of a thermometer, assumed
REMOUNTING_S = 60.0  # duration between two stages, assumed
# Angle between a sensor and its nominal mounting, assumed if no `uncertainty.mount_deg` states it for an item that is
# remounted. The larger it is, the more the axes of arm and sensor matter.
MOUNTING_OFFSET_DEG = 5.0
READING_TIME_STD_S = 0.9e-3  # standard deviation of the time of a reading within the 3 ms of a servo's reply


def predict_budgets(config: RigConfig, plan: Plan, turner: TurnerIdentity) -> dict[str, Budget]:
    """Return the predicted budget of each sensor to calibrate, by sensor name.

    The method is the one that solves runs of this turner: if readings of its angle scatter, the six-observation method,
    which uses only the speeds, else the vector model. Raise Fault as these do, Refused as `settings_of` does.
    """
    run = plan_run(config, plan, turner.kinematics)
    return {name: _budget(config, run, turner, name, sensor) for name, sensor in config.to_calibrate.items()}


def _budget(config: RigConfig, run: PlannedRun, turner: TurnerIdentity, name: str, sensor: SensorSection) -> Budget:
    """Return the predicted budget of a gyroscope, from an analysis of readings that are simulated for the plan."""
    uncertainty, mounting = run.uncertainty, mounting_matrix(sensor.mounting)
    noisy_angles = turner.reading_std_rad > 0
    # The scatter of the readings already includes the jitter.
    jitter_s = 0.0 if noisy_angles else predict_state_jitter(run.plan)
    environment = MeasurementEnvironment(
        run.site, uncertainty, _clock(uncertainty, on_board=sensor.on_board), jitter_s, run.settings.extension_m
    )
    parts = [_plan_recording_part(config, stage, sensor, turner) for stage in _stages(run)]
    inputs = combine_recordings(parts, environment)
    constant_sensor = describe_sensor(
        uncertainty, name, float(np.radians(sensor.range_deg_s)), np.full(len(inputs.windows_s), ROOM_C), STEP_K
    )
    # A nominal mounting would be too good: then errors of the axes have no first-order effect on the scale factors.
    off_deg = MOUNTING_OFFSET_DEG if inputs.mount_turns_rad is None else uncertainty.mount_deg
    inputs = replace(
        inputs, means_rad_s=_simulate_readings(inputs, _mounting_rotation(off_deg) @ mounting), sensor=constant_sensor
    )
    explained = explain(inputs, mounting, BiasProcess(instability_rad_s=constant_sensor.instability_rad_s))
    uncertainty_inputs = list_uncertainties(environment, name, None)
    # Only a servo's angles are noisy. Its procedure solves by the speeds alone, because hands mount the item inexactly.
    if not noisy_angles:
        return budget(explained, uncertainty_inputs)
    turns = [turn for part in parts for turn in part.turns]
    readings = [
        replace(turn, average=replace(turn.average, mean_rad_s=mean))
        for turn, mean in zip(turns, inputs.means_rad_s, strict=False)  # the rests come after them
    ]
    axes_rad = float(np.radians(uncertainty.find_stated_size("non_orthogonality_deg", name)))
    return six_observation_budget(explained, solve_six_observation(readings, "newton"), uncertainty_inputs, axes_rad)


def _mounting_rotation(angle_deg: float) -> Array:
    """Return the rotation (3, 3) by an angle about the axis (1, −1, 1)/√3."""
    return rotation_by(np.radians(angle_deg) / np.sqrt(3) * np.array([1.0, -1.0, 1.0]))


def _simulate_readings(inputs: VectorInputs, matrix: Array) -> Array:
    """Return simulated mean readings (N, 3) of a sensor with matrix F (3, 3), with noise, so that no two are equal."""
    noise = np.random.default_rng(len(inputs.windows_s)).standard_normal((len(inputs.windows_s), 3))
    readings: Array = inputs.rates_rad_s @ matrix.T + np.sqrt(inputs.variances_rad2_s2) * noise
    return readings


def _clock(uncertainty: Uncertainty, *, on_board: bool) -> ClockCheck:
    """Return the clock comparison that a run would have if the controller's clock agreed with all other clocks."""
    stated = {
        COMPUTER_CLOCK: uncertainty.computer_clock_ppm,
        **({CRYSTAL_CLOCK: uncertainty.crystal_ppm} if on_board else {}),
    }
    compared = tuple(ClockComparison(by, 0.0, ppm * PPM, 0.0) for by, ppm in stated.items())
    half_width = uncertainty.controller_clock_ppm * PPM
    weights = 3 / half_width**2 + sum(1 / comparison.std**2 for comparison in compared)
    return ClockCheck(0.0, float(weights**-0.5), compared, half_width)


def _stages(run: PlannedRun) -> Iterator[PlannedRun]:
    """Yield one recording for each stage of the plan; the run itself if it has no stages."""
    begins, clock_offset_s = [stage.begins for stage in run.plan.stages] or [0], 0.0
    for number, (first, last) in enumerate(zip(begins, [*begins[1:], len(run.plan.steps)], strict=True)):
        stage_plan = replace(run.plan, steps=run.plan.steps[first:last], stages=())
        yield replace(run, plan=stage_plan, settings=replace(run.settings, stage=number), clock_offset_s=clock_offset_s)
        clock_offset_s += stage_plan.duration_s + 2 * END_REST_S + REMOUNTING_S


def _plan_recording_part(
    config: RigConfig, run: PlannedRun, sensor: SensorSection, turner: TurnerIdentity
) -> RecordingPart:
    """Return the revolutions and rests of a planned recording, in the form that estimators take."""
    turns = [
        _plan_observation(sweep, run, sensor, _scatter(config, sweep.step, turner))
        for sweep in time_steps_of(run.plan, Sweep)
    ]
    at_rest = [
        replace(
            measuring_step,
            start_s=measuring_step.start_s + REST_SETTLING_S,
            end_s=measuring_step.end_s - REST_SETTLING_S,
        )
        for measuring_step in measuring_steps(run.plan)
        if not isinstance(measuring_step.step, Sweep)
    ]
    usable = [rest for rest in at_rest if (rest.end_s - rest.start_s) * sensor.rate_hz >= MIN_SAMPLES_AT_REST]
    rests = [_average(rest, run, sensor) for rest in usable]
    return RecordingPart(turns, rests, run.clock_offset_s, run.settings.stage, np.array(run.settings.mount))


def _average(timed: Timed[Step], run: PlannedRun, sensor: SensorSection) -> Average:
    """Return a planned average over a step: its mean is zero, its variance that of the data sheet's white noise."""
    start_s, end_s = timed.window_s
    lasting_s, walk_rad_sqrt_s = end_s - start_s, PARTS[sensor.part].angle_random_walk_rad_sqrt_s
    samples = max(round(lasting_s * sensor.rate_hz), 2)
    return Average(
        mean_rad_s=np.zeros(3),
        variance_rad2_s2=np.full(3, walk_rad_sqrt_s**2 / lasting_s),
        noise_rad_s=np.full(3, walk_rad_sqrt_s * sensor.rate_hz**0.5),
        samples=samples,
        start_s=start_s,
        end_s=end_s,
        temperature_c=ROOM_C,
        attitude=predict_attitude(timed, run.arm, np.array(run.settings.mount)),
        dof=float(samples - 1),
    )


def _plan_observation(timed: Timed[Sweep], run: PlannedRun, sensor: SensorSection, speed_std: float) -> Observation:
    """Return the observation that a planned sweep would give, with zero mean; `speed_std` is relative to its speed."""
    sweep, turn = timed.step, predict_revolution(timed, run.arm, np.array(run.settings.mount))
    axis, sign = nearest_axis(mounting_matrix(sensor.mounting) @ turn.axis_flange)
    return Observation(
        sweep=sweep.index,
        joint_name=sweep.joint_name,
        direction=sweep.direction,
        axis=axis,
        sign=sign,
        axis_flange=turn.axis_flange,
        speed_rad_s=sweep.speed_rad_s,
        speed_std_rad_s=speed_std * sweep.speed_rad_s,
        lost=0,
        average=_average(timed, run, sensor),
        axis_errors=turn.axis_errors,
        arm_m=turn.arm_m,
        angle_rad=turn.angle_rad,
        arc_rad=None if turn.closed else sweep.revolution_rad,
    )


def _scatter(config: RigConfig, sweep: Sweep, turner: TurnerIdentity) -> float:
    """Return the relative standard deviation of a sweep's mean speed, due to the scatter of a servo's angle readings.

    The speed is computed from readings one revolution apart (`rig.observation.motion.turn_speed`). It is 0 for other
    turners.
    """
    if not turner.reading_std_rad or not isinstance(config.turner, ServoSection):
        return 0.0
    ramp_rad = sweep.speed_rad_s**2 / (2 * sweep.acceleration_rad_s2) + GUARD_RAD
    whole_rad = abs(sweep.end_q_rad[sweep.joint] - sweep.start_q_rad[sweep.joint])
    repeats = (whole_rad - 2 * ramp_rad - TURN_RAD) / sweep.speed_rad_s * config.turner.state_rate_hz
    scatter_rad = np.hypot(turner.reading_std_rad, READING_TIME_STD_S * sweep.speed_rad_s)
    return float(scatter_rad * np.sqrt(2 / max(repeats, 1.0)) / TURN_RAD)
