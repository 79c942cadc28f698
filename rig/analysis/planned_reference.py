"""What an accelerometer would read in a plan's dwells and sweeps, with nothing wrong with it. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.accelerometer_errors import Piece, Sheet, errors_of, sheet_of
from rig.analysis.arm_patterns import Known, Stood, arm_patterns, arm_turns
from rig.analysis.planned_motion import Timed, timed_of
from rig.analysis.reference_budgets import lag_pattern
from rig.analysis.reference_suspected import Read
from rig.config.models import RigConfig
from rig.config.sensor_catalogue import PARTS
from rig.config.sensor_sections import SensorSection, mounting_matrix
from rig.data.recorded_sensor import range_m_s2
from rig.data.settings import RunSettings, Site, Uncertainty, settings_of, site_of, uncertainty_of
from rig.estimation.accelerometer_model import NO_SWEEPS, PARAMETERS, Dwells, Movement, Sweeps, predicted
from rig.estimation.arrays import Array
from rig.estimation.earth import MICRO_G_M_S2
from rig.estimation.reference_model import REFERENCE
from rig.motion.geometry import WRIST_1, DenavitHartenberg, flange_arm, flange_attitude
from rig.motion.steps import Dwell, Plan, Sweep


@dataclass(frozen=True, slots=True)
class PlannedAccelerometer:
    """An accelerometer that goes through a plan on an `arm` made so, and what is known there."""

    name: str
    sensor: SensorSection
    range_m_s2: float
    plan: Plan
    settings: RunSettings
    site: Site
    known: Uncertainty
    arm: DenavitHartenberg

    @property
    def sheet(self) -> Sheet:
        """What the data sheet lets the accelerometer do beside the model."""
        return sheet_of(self.known, self.name, self.sensor.part, self.range_m_s2)


def planned_accelerometers(config: RigConfig, plan: Plan, arm: DenavitHartenberg) -> list[PlannedAccelerometer]:
    """The accelerometers of the sensors to calibrate, as the plan moves them."""
    settings = settings_of(config, plan)
    site, known = site_of(config.site), uncertainty_of(config)
    return [
        PlannedAccelerometer(name, each, range_m_s2(each.acceleration), plan, settings, site, known, arm)
        for name, each in config.to_calibrate.items()
        if each.acceleration is not None
    ]


def planned_read(of: PlannedAccelerometer) -> Read:
    """What an accelerometer would read, with noise as its data sheet has it.

    Of attitudes that are gone through several times the last is held out, as in a run.
    """
    sensor, plan, settings, arm = of.sensor, of.plan, of.settings, of.arm
    mounting, noise = mounting_matrix(sensor.mounting), PARTS[sensor.part].acceleration_noise_ug_sqrt_hz * MICRO_G_M_S2
    repeats = {dwell.index: dwell.repeat for dwell in settings.planned_dwells}
    last = max(repeats.values())
    dwells = [each for each in timed_of(plan, Dwell) if last == 0 or repeats[each.step.index] < last]
    sweeps = timed_of(plan, Sweep)
    theta = np.zeros(PARAMETERS)
    theta[:9], theta[REFERENCE] = np.eye(3).ravel(), of.site.gravity_m_s2 * np.array(of.site.up)
    repeatability_rad = of.known.repeatability_std_rad
    movement = Movement(_dwells(dwells, mounting, noise), _sweeps(sweeps, mounting, noise, arm), repeatability_rad)
    # At a temperature that stays.
    pieces = [Piece(each.step.index, each.window_s, 1, 0.0, Stood(np.array(each.step.q_rad))) for each in dwells]
    pieces += [
        Piece(each.step.index, each.window_s, 1, 0.0, Stood(_began(each.step), each.step.joint - WRIST_1))
        for each in sweeps
    ]
    stood = [each.stood for each in pieces]
    movement = replace(
        _reading(theta, movement),
        own=errors_of(of.sheet, pieces, 0.0, second_order=settings.second_order),
        arm_turns=arm_turns(stood, arm, mounting),
    )
    lag = lag_pattern(movement, 1e-3 * of.known.acceleration_lag_ms) / np.sqrt(3)
    off = arm_patterns(theta, movement, stood, Known(arm, of.known.axis_deg, mounting, 0.0))
    middles_s = np.array([sum(each.window_s) / 2 for each in pieces])
    return Read(theta, movement, np.concatenate([lag, off]), middles_s, second_order=settings.second_order)


def _dwells(dwells: Sequence[Timed[Dwell]], mounting: Array, noise_m_s2_sqrt_hz: float) -> Dwells:
    attitudes = np.array([(mounting @ flange_attitude(np.array(each.step.q_rad))).T for each in dwells])
    lasting_s = np.array([each.end_s - each.start_s for each in dwells])
    variances = noise_m_s2_sqrt_hz**2 / lasting_s[:, None] * np.ones(3)
    return Dwells(np.zeros((len(dwells), 3)), variances, attitudes)


def _sweeps(
    sweeps: Sequence[Timed[Sweep]], mounting: Array, noise_m_s2_sqrt_hz: float, arm: DenavitHartenberg
) -> Sweeps:
    if not sweeps:
        return NO_SWEEPS
    steps = [each.step for each in sweeps]
    began = [_began(step) for step in steps]
    growing = np.array([1.0 if step.direction == "ccw" else -1.0 for step in steps])
    stood = [tuple(np.round(q_rad, 2).tolist()) for q_rad in began]
    stations = [(step.joint, *q[: step.joint], *q[step.joint + 1 :]) for step, q in zip(steps, stood, strict=True)]
    places = list(dict.fromkeys(stations))
    waves = np.diag(np.repeat([1.0, 2.0, 2.0], 3))  # mean, cosine and sine of so many readings
    lasting_s = np.array([np.subtract(*each.window_s[::-1]) for each in sweeps])
    arms_m = np.array([flange_arm(q_rad, step.joint, arm) for q_rad, step in zip(began, steps, strict=True)])
    return Sweeps(
        harmonics_m_s2=np.zeros((len(sweeps), 3, 3)),
        covariances_m2_s4=noise_m_s2_sqrt_hz**2 / lasting_s[:, None, None] * waves,
        axes_flange=(growing[:, None] * np.array([step.axis_flange for step in steps])) @ mounting.T,
        speeds_rad_s=growing * np.array([step.speed_rad_s for step in steps]),
        attitudes=np.array([(mounting @ flange_attitude(q_rad)).T for q_rad in began]),
        arms_m=arms_m @ mounting.T,
        stations=np.array([places.index(each) for each in stations], dtype=np.intp),
    )


def _began(step: Sweep) -> Array:
    """(6,) joint angles, rad, where the revolution of a sweep begins."""
    began = np.array(step.start_q_rad)
    began[step.joint] = step.revolution_rad[0 if step.direction == "ccw" else 1]
    return began


def _reading(theta: Array, movement: Movement) -> Movement:
    """The movement with the readings that the model predicts."""
    read = predicted(theta, movement)
    count = len(movement.dwells.readings_m_s2)
    return replace(
        movement,
        dwells=replace(movement.dwells, readings_m_s2=read[:count]),
        sweeps=replace(movement.sweeps, harmonics_m_s2=read[count:].reshape(-1, 3, 3)),
    )
