"""What an accelerometer would read in a plan's dwells and sweeps, with nothing wrong with it. Pure."""

from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.consistency.reference_alternatives import ReferenceModel
from rig.analysis.design.planned_motion import PlannedRun, Timed, planned_attitude, planned_turn, timed_of
from rig.analysis.reference.acceleration import held_out, sweeps_of
from rig.analysis.reference.accelerometer_errors import Piece, Sheet, errors_of, sheet_of
from rig.analysis.reference.arm_patterns import Known, Stood, arm_patterns, arm_turns
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
from rig.motion.geometry import WRIST_1, DenavitHartenberg
from rig.motion.steps import Dwell, Sweep
from rig.observation.reference.swept_acceleration import SweptAcceleration, of_turn


@dataclass(frozen=True, slots=True)
class PlannedAccelerometer:
    """An accelerometer that goes through a run."""

    run: PlannedRun
    name: str
    sensor: SensorSection
    range_m_s2: float

    @property
    def sheet(self) -> Sheet:
        """What the data sheet lets the accelerometer do beside the model."""
        return sheet_of(self.run.known, self.name, self.range_m_s2)


def planned_accelerometers(config: RigConfig, run: PlannedRun) -> list[PlannedAccelerometer]:
    """The accelerometers of the sensors to calibrate, in a run."""
    return [
        PlannedAccelerometer(run, name, each, range_m_s2(each.acceleration))
        for name, each in config.to_calibrate.items()
        if each.acceleration is not None
    ]


def planned_read(of: PlannedAccelerometer) -> ReferenceModel:
    """What an accelerometer would read, with noise as its data sheet has it.

    Of attitudes that are gone through several times the last is held out, as in a run.
    """
    run, mounting, second_order = of.run, mounting_matrix(of.sensor.mounting), of.run.settings.second_order
    noise_m_s2_sqrt_hz = PARTS[of.sensor.part].acceleration_noise_ug_sqrt_hz * MICRO_G_M_S2
    last = held_out(run.settings.planned_dwells)
    dwells = [each for each in timed_of(run.plan, Dwell) if each.step.index not in last]
    sweeps = timed_of(run.plan, Sweep)
    swept = [_swept(each, run.arm, noise_m_s2_sqrt_hz) for each in sweeps]
    theta = np.zeros(PARAMETERS)
    theta[:9], theta[REFERENCE] = np.eye(3).ravel(), run.site.gravity_m_s2 * np.array(run.site.up)
    movement = Movement(
        Dwells(
            readings_m_s2=np.zeros((len(dwells), 3)),
            variances_m2_s4=np.array([np.full(3, noise_m_s2_sqrt_hz**2 / each.step.duration_s) for each in dwells]),
            attitudes=np.array([planned_attitude(each, run.arm, mounting).T for each in dwells]),
        ),
        sweeps_of(swept, mounting),
        run.known.repeatability_std_rad,
    )
    pieces = [*map(_piece, dwells), *map(_piece, sweeps)]
    stood = [each.stood for each in pieces]
    movement = replace(
        _reading(theta, movement),
        own=errors_of(of.sheet, pieces, 0.0, second_order=second_order),
        arm_turns=arm_turns(stood, run.arm, mounting),
    )
    lag = lag_pattern(movement, 1e-3 * run.known.acceleration_lag_ms) / np.sqrt(3)
    off = arm_patterns(theta, movement, stood, Known(run.arm, run.known.axis_deg, mounting, 0.0))
    middles_s = np.array([sum(each.window_s) / 2 for each in pieces])
    return ReferenceModel(theta, movement, np.concatenate([lag, off]), middles_s, second_order=second_order)


def _piece(at: Timed[Dwell] | Timed[Sweep]) -> Piece:
    """A dwell or a sweep at a temperature that stays."""
    step = at.step
    wrist = step.joint - WRIST_1 if isinstance(step, Sweep) else None
    q_rad = step.began_q_rad if isinstance(step, Sweep) else step.q_rad
    return Piece(step.index, at.window_s, 1, 0.0, Stood(np.array(q_rad), wrist))


def _swept(at: Timed[Sweep], arm: DenavitHartenberg, noise_m_s2_sqrt_hz: float) -> SweptAcceleration:
    turn = planned_turn(at, arm, np.eye(3))
    waves = np.diag(np.repeat([1.0, 2.0, 2.0], 3))  # mean, cosine and sine of so many readings
    harmonic = FirstHarmonic(
        harmonic_m_s2=np.zeros((3, 3)),
        covariance_m2_s4=noise_m_s2_sqrt_hz**2 / turn.duration_s * waves,
        speed_rad_s=at.step.growing * turn.speed_rad_s,
        noise_m_s2=np.zeros(3),
        freedom=0,
        residuals_m_s2=np.zeros((0, 3)),
        vibration_m_s2=np.zeros(3),
        turning_rad2_s2=evenly_turning(turn.speed_rad_s),
    )
    return of_turn(at.step, turn, harmonic)


def _reading(theta: Array, movement: Movement) -> Movement:
    """The movement with the readings that the model predicts."""
    read = predicted(theta, movement)
    count = len(movement.dwells.readings_m_s2)
    return replace(
        movement,
        dwells=replace(movement.dwells, readings_m_s2=read[:count]),
        sweeps=replace(movement.sweeps, harmonics_m_s2=read[count:].reshape(-1, 3, 3)),
    )
