"""Faultless readings of an accelerometer in a plan's dwells and sweeps. Pure functions."""

from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.consistency.reference_alternatives import ReferenceModel
from rig.analysis.design.planned_motion import PlannedRun, Timed, predict_attitude, predict_revolution, time_steps_of
from rig.analysis.reference.accelerometer import select_validation, stack_sweeps
from rig.analysis.reference.arm_patterns import Posture, StatedArm, arm_patterns, list_arm_rotations
from rig.analysis.reference.datasheet_errors import Datasheet, ReferenceWindow, list_sensor_errors, read_datasheet
from rig.analysis.reference.reference_budgets import lag_pattern
from rig.config.models import RigConfig
from rig.config.sensors.sensor_catalogue import PARTS
from rig.config.sensors.sensor_sections import SensorSection, mounting_matrix
from rig.data.recording.recorded_sensor import range_m_s2
from rig.estimation.arrays import Array
from rig.estimation.earth import MICRO_G_M_S2
from rig.estimation.reference.accelerometer_model import PARAMETERS, Dwells, Movement, predicted
from rig.estimation.reference.reference_model import REFERENCE
from rig.estimation.reference.sweep_harmonics import FirstHarmonic, evenly_turning
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import WRIST_1
from rig.motion.steps import Dwell, Sweep
from rig.observation.reference.swept_acceleration import SweptAcceleration, turn_harmonic


@dataclass(frozen=True, slots=True)
class PlannedAccelerometer:
    """An accelerometer in a planned run."""

    run: PlannedRun
    name: str
    sensor: SensorSection
    range_m_s2: float

    @property
    def datasheet(self) -> Datasheet:
        """The stated errors of the sensor that the calibration does not estimate."""
        return read_datasheet(self.run.uncertainty, self.name, self.range_m_s2)


def list_accelerometers(config: RigConfig, run: PlannedRun) -> list[PlannedAccelerometer]:
    """Return the accelerometers of all sensors to calibrate in a run."""
    return [
        PlannedAccelerometer(run, name, sensor, range_m_s2(sensor.acceleration))
        for name, sensor in config.to_calibrate.items()
        if sensor.acceleration is not None
    ]


def predict_readings(accelerometer: PlannedAccelerometer) -> ReferenceModel:
    """Return an accelerometer's predicted readings, with the variances due to the noise of its data sheet.

    As in the solution of a run, the last repeat of the attitudes is left out.
    """
    run, mounting, second_order = (
        accelerometer.run,
        mounting_matrix(accelerometer.sensor.mounting),
        accelerometer.run.settings.second_order,
    )
    walk_m_s_sqrt_s = PARTS[accelerometer.sensor.part].velocity_random_walk_ug_sqrt_s * MICRO_G_M_S2
    validation_dwells = select_validation(run.settings.planned_dwells)
    dwells = [dwell for dwell in time_steps_of(run.plan, Dwell) if dwell.step.index not in validation_dwells]
    sweeps = time_steps_of(run.plan, Sweep)
    swept = [_predict_sweep(sweep, run.arm, walk_m_s_sqrt_s) for sweep in sweeps]
    theta = np.zeros(PARAMETERS)
    theta[:9], theta[REFERENCE] = np.eye(3).ravel(), run.site.gravity_m_s2 * np.array(run.site.up)
    movement = Movement(
        Dwells(
            readings_m_s2=np.zeros((len(dwells), 3)),
            variances_m2_s4=np.array([np.full(3, walk_m_s_sqrt_s**2 / dwell.step.duration_s) for dwell in dwells]),
            attitudes=np.array([predict_attitude(dwell, run.arm, mounting).T for dwell in dwells]),
        ),
        stack_sweeps(swept, mounting),
        run.uncertainty.repeatability_std_rad,
    )
    segments = [*map(_segment, dwells), *map(_segment, sweeps)]
    poses = [segment.posture for segment in segments]
    movement = replace(
        _add_predicted_readings(theta, movement),
        sensor_errors=list_sensor_errors(accelerometer.datasheet, segments, 0.0, second_order=second_order),
        arm_turns=list_arm_rotations(poses, run.arm, mounting),
    )
    lag = lag_pattern(movement, 1e-3 * run.uncertainty.acceleration_lag_ms) / np.sqrt(3)
    arm_errors = arm_patterns(theta, movement, poses, StatedArm(run.arm, run.uncertainty.axis_deg, mounting, 0.0))
    middles_s = np.array([sum(segment.window_s) / 2 for segment in segments])
    return ReferenceModel(theta, movement, np.concatenate([lag, arm_errors]), middles_s, second_order=second_order)


def _segment(timed_step: Timed[Dwell] | Timed[Sweep]) -> ReferenceWindow:
    """Return the window of a planned dwell or sweep, at constant temperature."""
    step = timed_step.step
    wrist = step.joint - WRIST_1 if isinstance(step, Sweep) else None
    q_rad = step.first_q_rad if isinstance(step, Sweep) else step.q_rad
    return ReferenceWindow(step.index, timed_step.window_s, 1, 0.0, Posture(np.array(q_rad), wrist))


def _predict_sweep(timed_step: Timed[Sweep], arm: DenavitHartenberg, walk_m_s_sqrt_s: float) -> SweptAcceleration:
    """Return a sweep's first harmonic, zero, with the covariance due to the velocity random walk `walk_m_s_sqrt_s`."""
    turn = predict_revolution(timed_step, arm, np.eye(3))
    waves = np.diag(np.repeat([1.0, 2.0, 2.0], 3))  # weights of the mean, the cosine and the sine over a revolution
    harmonic = FirstHarmonic(
        harmonic_m_s2=np.zeros((3, 3)),
        swayed_m_s2=np.zeros((3, 3)),
        covariance_m2_s4=walk_m_s_sqrt_s**2 / turn.duration_s * waves,
        speed_rad_s=timed_step.step.growing * turn.speed_rad_s,
        noise_m_s2=np.zeros(3),
        dof=0,
        residuals_m_s2=np.zeros((0, 3)),
        vibration_m_s2=np.zeros(3),
        turning_rad2_s2=evenly_turning(turn.speed_rad_s),
    )
    return turn_harmonic(timed_step.step, turn, harmonic)


def _add_predicted_readings(theta: Array, movement: Movement) -> Movement:
    """Return the movement with the readings that the model predicts."""
    readings = predicted(theta, movement)
    count = len(movement.dwells.readings_m_s2)
    return replace(
        movement,
        dwells=replace(movement.dwells, readings_m_s2=readings[:count]),
        sweeps=replace(movement.sweeps, harmonics_m_s2=readings[count:].reshape(-1, 3, 3)),
    )
