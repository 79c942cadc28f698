"""What an accelerometer may add to its readings by its part's data sheet, in one run: for the solve and its budget."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.reference.arm_patterns import Stood, arm_turns
from rig.config.judging.judged_by import OfSensor
from rig.data.entries.budget import IN_U
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import RunSettings, Uncertainty
from rig.estimation.arrays import Array
from rig.estimation.earth import MICRO_G_M_S2, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.budget import FLICKER, WANDERING, Contributor
from rig.estimation.gyroscope.own_errors import (
    BIAS_OVER_TEMPERATURE,
    NONLINEARITY,
    OF_THE_PART,
    SCALE_OVER_TEMPERATURE,
    subtract_mean,
    unseen_k,
)
from rig.estimation.reference.accelerometer_errors import AccelerometerErrors
from rig.estimation.reference.accelerometer_model import Movement
from rig.estimation.reference.reading_errors import bending, bias_warming, flickering, scale_warming, wandering
from rig.estimation.reference.reference_budget import Spread
from rig.motion.geometry import WRIST_1, DenavitHartenberg
from rig.observation.average import Average
from rig.observation.observed_run import ObservedRun
from rig.observation.reference.acceleration import DwellReading

STANDARD = np.sqrt(3)  # a half-width is so many standard uncertainties
MILLI_G = 1000  # µg


@dataclass(frozen=True, slots=True)
class Sheet:
    """What is stated of one accelerometer, or known of its part: half-widths, but for the least Allan deviation.

    `nonlinearity_percent` of `over_g`, either way. `temperature_words` are as of `KnownSensor`.
    """

    nonlinearity_percent: float
    over_g: float
    bias_mg_k: float
    scale_ppm_k: float
    bias_instability_ug: float
    temperature_words: str = ""

    @property
    def even_s2_m(self) -> float:
        """Half-width of φ, if nothing else bends the sensor: the best line over ± V misses φ v² by φ V²/2."""
        return 0.02 * self.nonlinearity_percent / (self.over_g * STANDARD_GRAVITY_M_S2)

    @property
    def odd_s4_m2(self) -> float:
        """Half-width of χ, if nothing else bends the sensor: the best line misses χ v³ by χ V³/4."""
        return 0.04 * self.nonlinearity_percent / (self.over_g * STANDARD_GRAVITY_M_S2) ** 2


def sheet_of(known: Uncertainty, name: str, range_m_s2: float) -> Sheet:
    """What is known of the accelerometer of the sensor `name`, as its data sheet or the configuration has it."""

    def of(what: OfSensor) -> float:
        return known.stated_size(what, name)

    return Sheet(
        nonlinearity_percent=of("acceleration_nonlinearity_percent"),
        over_g=of("acceleration_nonlinear_over_g") or range_m_s2 / STANDARD_GRAVITY_M_S2,
        bias_mg_k=of("acceleration_bias_mg_k"),
        scale_ppm_k=of("acceleration_scale_ppm_k"),
        bias_instability_ug=of("acceleration_bias_instability_ug"),
    )


@dataclass(frozen=True, slots=True)
class Piece:
    """A dwell or a sweep: its `number` in the plan, when, on the clock of the first recording, where the arm stood.

    And how warm the sensor was, in the mean over so many `samples`.
    """

    number: int
    window_s: tuple[float, float]
    samples: int
    temperature_c: float
    stood: Stood


def pieces_of(name: str, recordings: Sequence[ObservedRun], dwells: Sequence[DwellReading]) -> list[Piece]:
    """The pieces that the sensor `name` is calibrated from: these dwells, then all sweeps."""
    used = {dwell.index for dwell in dwells}
    return [
        *(
            _dwelt(recording, dwell)
            for recording in recordings
            for dwell in recording.sensors[name].dwells
            if dwell.index in used
        ),
        *(
            _swept(recording, turn.sweep, turn.average, turn.acceleration.joint)
            for recording in recordings
            for turn in recording.sensors[name].revolutions
            if turn.acceleration is not None
        ),
    ]


def mean_temperature_c(pieces: Sequence[Piece]) -> float:
    """Mean temperature of the pieces' readings, which `rig.analysis.read_when` too says that scale and bias hold at."""
    return float(np.average([piece.temperature_c for piece in pieces], weights=[piece.samples for piece in pieces]))


def errors_of(
    sheet: Sheet, pieces: Sequence[Piece], temperature_step_k: float, *, second_order: bool
) -> AccelerometerErrors:
    """Errors of a sensor in these pieces, with a thermometer of such steps; no even part where that is looked for."""
    windows_s, samples = np.array([piece.window_s for piece in pieces]), np.array([piece.samples for piece in pieces])
    return AccelerometerErrors(
        even_s2_m=0.0 if second_order else sheet.even_s2_m / STANDARD,
        odd_s4_m2=sheet.odd_s4_m2 / STANDARD,
        norm_m_s2=STANDARD_GRAVITY_M_S2,
        bias_m_s2_k=MILLI_G * MICRO_G_M_S2 * sheet.bias_mg_k / STANDARD,
        scale_per_k=1e-6 * sheet.scale_ppm_k / STANDARD,
        warmer_k=subtract_mean(np.array([piece.temperature_c for piece in pieces]), samples),
        unseen_k=unseen_k(temperature_step_k, windows_s, samples),
        windows_s=windows_s,
        instability_m_s2=MICRO_G_M_S2 * sheet.bias_instability_ug,
    )


def with_errors(
    movement: Movement,
    pieces: Sequence[Piece],
    sensor: RecordedSensor,
    sheet: Sheet,
    arm: DenavitHartenberg,
    *,
    settings: RunSettings,
) -> Movement:
    """The movement with what is known of the sensor's errors and of the arm's in these pieces of it."""
    own = errors_of(sheet, pieces, sensor.unseen_change_k, second_order=settings.second_order)
    turns = arm_turns([piece.stood for piece in pieces], arm, np.array(sensor.mounting))
    return replace(movement, own=own, arm_turns=turns)


def of_its_own(spread: Spread, theta: Array, movement: Movement, sheet: Sheet) -> tuple[Spread, list[Contributor]]:
    """What of the `spread` noise and arm make, and the lines of what the sensor itself does in this `movement`.

    The response is that of a solution which looks for all of it, so a bent sensor's noise counts for more.
    """
    wandered, flickered = (
        spread.response @ each @ spread.response.T for each in (wandering(movement), flickering(movement))
    )
    warm = "; ".join(filter(None, (OF_THE_PART, sheet.temperature_words)))
    by_sheet = {
        BIAS_OVER_TEMPERATURE: (sheet.bias_mg_k, "mg/K", warm, bias_warming(movement)),
        SCALE_OVER_TEMPERATURE: (sheet.scale_ppm_k, "ppm/K", warm, scale_warming(theta, movement)),
        NONLINEARITY: (sheet.nonlinearity_percent, f"% of {sheet.over_g:.3g} g", OF_THE_PART, bending(theta, movement)),
    }
    stability = f"least Allan deviation: {sheet.bias_instability_ug:.3g} µg"
    lines = [
        Contributor(WANDERING, "A", "normal", None, "", f"how the readings scatter, {IN_U}", np.inf, wandered),
        Contributor(FLICKER, "B", "normal", None, "", stability, np.inf, flickered),
        *(
            Contributor(name, "B", "rectangular", half_width, unit, source, np.inf, spread.of(patterns))
            for name, (half_width, unit, source, patterns) in by_sheet.items()
        ),
    ]
    own = np.sum([line.covariance for line in lines], axis=0)
    return replace(spread, covariance=spread.covariance - own), lines


def _dwelt(recording: ObservedRun, dwell: DwellReading) -> Piece:
    start_s, end_s = dwell.window.start_s, dwell.window.end_s
    stood = Stood(recording.motion.angles((start_s + end_s) / 2), None)
    window_s = start_s + recording.clock_offset_s, end_s + recording.clock_offset_s
    return Piece(dwell.index, window_s, dwell.reading.samples, dwell.temperature_c, stood)


def _swept(recording: ObservedRun, sweep: int, average: Average, joint: int) -> Piece:
    stood = Stood(recording.motion.angles(average.start_s), joint - WRIST_1)
    offset_s = recording.clock_offset_s
    window_s = average.start_s + offset_s, average.end_s + offset_s
    return Piece(sweep, window_s, average.samples, average.temperature_c, stood)
