"""The errors of an accelerometer's readings in one run, from the part's data sheet, for the solution and its budget."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.reference.arm_patterns import Posture, list_arm_rotations
from rig.config.judging.judging_keys import ExternalResult
from rig.data.entries.budget import INCLUDED_IN_U
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import RunSettings, Uncertainty
from rig.estimation.arrays import Array
from rig.estimation.earth import MICRO_G_M_S2, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.budget import BIAS_DRIFT, FLICKER, Contributor
from rig.estimation.gyroscope.own_errors import (
    BIAS_OVER_TEMPERATURE,
    NONLINEARITY,
    PART_SOURCE,
    SCALE_OVER_TEMPERATURE,
    subtract_mean,
    unseen_k,
)
from rig.estimation.reference.accelerometer_errors import AccelerometerErrors
from rig.estimation.reference.accelerometer_model import Movement
from rig.estimation.reference.reading_errors import (
    bias_flicker,
    bias_warming,
    find_drift_covariance,
    nonlinearity_patterns,
    scale_warming,
)
from rig.estimation.reference.reference_budget import FitUncertainty
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import WRIST_1
from rig.observation.average import Average
from rig.observation.observed_run import ObservedRun
from rig.observation.reference.dwell_acceleration import DwellReading

RECTANGULAR_RATIO = np.sqrt(3)  # half-width over standard uncertainty of a rectangular distribution
MICRO_G_PER_MILLI_G = 1000


@dataclass(frozen=True, slots=True)
class Datasheet:
    """The errors of an accelerometer in its data sheet: half-widths, and an Allan deviation.

    - nonlinearity_percent: nonlinearity from −`over_g` to `over_g`, in % of `over_g`.
    - bias_mg_k, scale_ppm_k: the temperature coefficients of bias and scale.
    - bias_instability_ug: the minimum of the Allan deviation.
    - temperature_words: the source of the temperatures, if it is not a thermometer.
    """

    nonlinearity_percent: float
    over_g: float
    bias_mg_k: float
    scale_ppm_k: float
    bias_instability_ug: float
    temperature_words: str = ""

    @property
    def even_s2_m(self) -> float:
        """The half-width of the quadratic term φ if this term alone causes the nonlinearity.

        Up to the force V = `over_g`, φ v² deviates from its best line by φ V²/2.
        """
        return 0.02 * self.nonlinearity_percent / (self.over_g * STANDARD_GRAVITY_M_S2)

    @property
    def odd_s4_m2(self) -> float:
        """The half-width of the cubic term χ if no other term is nonlinear.

        Up to the force V = `over_g`, χ v³ deviates from its best line by χ V³/4.
        """
        return 0.04 * self.nonlinearity_percent / (self.over_g * STANDARD_GRAVITY_M_S2) ** 2


def read_datasheet(uncertainty: Uncertainty, name: str, range_m_s2: float) -> Datasheet:
    """Return the errors of the accelerometer of sensor `name`: those in the configuration, else in the data sheet."""

    def read_size(what: ExternalResult) -> float:
        return uncertainty.find_stated_size(what, name)

    return Datasheet(
        nonlinearity_percent=read_size("acceleration_nonlinearity_percent"),
        over_g=read_size("acceleration_nonlinear_over_g") or range_m_s2 / STANDARD_GRAVITY_M_S2,
        bias_mg_k=read_size("acceleration_bias_mg_k"),
        scale_ppm_k=read_size("acceleration_scale_ppm_k"),
        bias_instability_ug=read_size("acceleration_bias_instability_ug"),
    )


@dataclass(frozen=True, slots=True)
class ReferenceWindow:
    """A dwell or a sweep, with the arm's `posture`.

    - `number`: its index in the plan; `window_s`: its start and end on the clock of the first recording.
    - `samples`: the number of its samples; `temperature_c`: the sensor's mean temperature over them.
    """

    number: int
    window_s: tuple[float, float]
    samples: int
    temperature_c: float
    posture: Posture


def list_windows(name: str, recordings: Sequence[ObservedRun], dwells: Sequence[DwellReading]) -> list[ReferenceWindow]:
    """Return the windows of the calibration of sensor `name`: the given dwells, then all sweeps."""
    used = {dwell.index for dwell in dwells}
    return [
        *(
            _describe_dwell(recording, dwell)
            for recording in recordings
            for dwell in recording.sensors[name].dwells
            if dwell.index in used
        ),
        *(
            _describe_sweep(recording, turn.sweep, turn.average, turn.acceleration.joint)
            for recording in recordings
            for turn in recording.sensors[name].revolutions
            if turn.acceleration is not None
        ),
    ]


def mean_temperature_c(windows: Sequence[ReferenceWindow]) -> float:
    """Return the mean temperature of all samples, °C, to which scale and bias refer."""
    samples = [window.samples for window in windows]
    return float(np.average([window.temperature_c for window in windows], weights=samples))


def list_sensor_errors(
    datasheet: Datasheet, windows: Sequence[ReferenceWindow], temperature_step_k: float, *, second_order: bool
) -> AccelerometerErrors:
    """Return the errors of a sensor in these windows.

    If `second_order`, quadratic terms are estimated, so the even part of the nonlinearity is not among the errors.
    `temperature_step_k` is the thermometer's resolution.
    """
    windows_s = np.array([window.window_s for window in windows])
    samples = np.array([window.samples for window in windows])
    return AccelerometerErrors(
        even_s2_m=0.0 if second_order else datasheet.even_s2_m / RECTANGULAR_RATIO,
        odd_s4_m2=datasheet.odd_s4_m2 / RECTANGULAR_RATIO,
        norm_m_s2=STANDARD_GRAVITY_M_S2,
        bias_m_s2_k=MICRO_G_PER_MILLI_G * MICRO_G_M_S2 * datasheet.bias_mg_k / RECTANGULAR_RATIO,
        scale_per_k=1e-6 * datasheet.scale_ppm_k / RECTANGULAR_RATIO,
        warmer_k=subtract_mean(np.array([window.temperature_c for window in windows]), samples),
        unseen_k=unseen_k(temperature_step_k, windows_s, samples),
        windows_s=windows_s,
        instability_m_s2=MICRO_G_M_S2 * datasheet.bias_instability_ug,
    )


def add_errors(
    movement: Movement,
    windows: Sequence[ReferenceWindow],
    sensor: RecordedSensor,
    datasheet: Datasheet,
    arm: DenavitHartenberg,
    *,
    settings: RunSettings,
) -> Movement:
    """Return the movement, to which the modelled errors of the sensor and of the arm in its `windows` are added."""
    sensor_errors = list_sensor_errors(datasheet, windows, sensor.unseen_change_k, second_order=settings.second_order)
    rotations = list_arm_rotations([window.posture for window in windows], arm, np.array(sensor.mounting))
    return replace(movement, sensor_errors=sensor_errors, arm_turns=rotations)


def separate_sensor_errors(
    spread: FitUncertainty, theta: Array, movement: Movement, datasheet: Datasheet
) -> tuple[FitUncertainty, list[Contributor]]:
    """Return the part of the uncertainty `spread` that is due to noise and arm, and the sensor's own contributors.

    `spread` is the uncertainty of a fit of the `movement` with the solution `theta`, which includes all these parts.
    """
    drift, flicker = (
        spread.response @ shared @ spread.response.T
        for shared in (find_drift_covariance(movement), bias_flicker(movement))
    )
    warm = "; ".join(filter(None, (PART_SOURCE, datasheet.temperature_words)))
    of_range = f"% of {datasheet.over_g:.3g} g"
    by_sheet = {
        BIAS_OVER_TEMPERATURE: (datasheet.bias_mg_k, "mg/K", warm, bias_warming(movement)),
        SCALE_OVER_TEMPERATURE: (datasheet.scale_ppm_k, "ppm/K", warm, scale_warming(theta, movement)),
        NONLINEARITY: (datasheet.nonlinearity_percent, of_range, PART_SOURCE, nonlinearity_patterns(theta, movement)),
    }
    stability = f"least Allan deviation: {datasheet.bias_instability_ug:.3g} µg"
    lines = [
        Contributor(BIAS_DRIFT, "A", "normal", None, "", f"how the readings scatter, {INCLUDED_IN_U}", np.inf, drift),
        Contributor(FLICKER, "B", "normal", None, "", stability, np.inf, flicker),
        *(
            Contributor(name, "B", "rectangular", half_width, unit, source, np.inf, spread.covariance_of(patterns))
            for name, (half_width, unit, source, patterns) in by_sheet.items()
        ),
    ]
    by_sensor = np.sum([line.covariance for line in lines], axis=0)
    return replace(spread, covariance=spread.covariance - by_sensor), lines


def _describe_dwell(recording: ObservedRun, dwell: DwellReading) -> ReferenceWindow:
    start_s, end_s = dwell.window.start_s, dwell.window.end_s
    posture = Posture(recording.motion.angles((start_s + end_s) / 2), None)
    window_s = start_s + recording.clock_offset_s, end_s + recording.clock_offset_s
    return ReferenceWindow(dwell.index, window_s, dwell.reading.samples, dwell.temperature_c, posture)


def _describe_sweep(recording: ObservedRun, sweep: int, average: Average, joint: int) -> ReferenceWindow:
    posture = Posture(recording.motion.angles(average.start_s), joint - WRIST_1)
    offset_s = recording.clock_offset_s
    window_s = average.start_s + offset_s, average.end_s + offset_s
    return ReferenceWindow(sweep, window_s, average.samples, average.temperature_c, posture)
