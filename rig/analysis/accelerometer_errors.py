"""What an accelerometer may add to its readings by its part's data sheet, in one run: for the solve and its budget."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rig.analysis.arm_patterns import Stood
from rig.analysis.seen import since_first_s
from rig.arm.kinematics import WRIST_1
from rig.config.sensor_catalogue import PARTS
from rig.data.run_file import RecordedSensor
from rig.estimation.accelerometer_errors import AccelerometerErrors
from rig.estimation.arrays import Array
from rig.estimation.attitude_error import AttitudeError
from rig.estimation.budget import Contributor
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.estimation.felt import Movement
from rig.estimation.imu import ImuSolution
from rig.estimation.imu_fit import covariance_bound
from rig.estimation.reading_errors import noise
from rig.estimation.reference_budget import Spread, freedom_of, scale_and_bias
from rig.observation.acceleration import DwellReading
from rig.observation.observed_run import ObservedRun

NONLINEARITY, WITHIN_RUN, INSTABILITY = "nonlinearity", "temperature within the run", "bias instability"
SMALL = 1e-3  # share of the arm in a variance that is not worth its degrees of freedom
STANDARD = np.sqrt(3)  # a half-width is so many standard uncertainties


@dataclass(frozen=True, slots=True)
class Piece:
    """A dwell or a sweep: when, on the clock of the first recording, how warm the sensor was, where the arm stood."""

    window_s: tuple[float, float]
    temperature_c: float
    stood: Stood


def pieces_of(name: str, recordings: Sequence[ObservedRun], dwells: Sequence[DwellReading]) -> list[Piece]:
    """Of the sensor `name`: these dwells, then all sweeps."""
    timed, used = list(zip(recordings, since_first_s(recordings), strict=True)), {dwell.index for dwell in dwells}
    found = [
        _piece(each, since_s, (dwell.window.start_s, dwell.window.end_s), dwell.temperature_c)
        for each, since_s in timed
        for dwell in each.sensors[name].dwells
        if dwell.index in used
    ]
    return found + [
        _piece(each, since_s, (turn.average.start_s, turn.average.end_s), turn.average.temperature_c, joint)
        for each, since_s in timed
        for turn in each.sensors[name].revolutions
        for joint in ([] if turn.acceleration is None else [turn.acceleration.joint])
    ]


def errors_of(sensor: RecordedSensor, pieces: Sequence[Piece], *, second_order: bool) -> AccelerometerErrors:
    """Of a sensor in these pieces; an even part is not among them where it is looked for."""
    even, odd = bending_of(sensor)
    sheet = PARTS[sensor.part].accelerometer
    warm_c = np.array([each.temperature_c for each in pieces])
    standing = [each.temperature_c for each in pieces if each.stood.wrist is None]
    return AccelerometerErrors(
        even_s2_m=0.0 if second_order else even / STANDARD,
        odd_s4_m2=odd / STANDARD,
        norm_m_s2=STANDARD_GRAVITY_M_S2,
        bias_m_s2_k=1e-3 * sheet.bias_mg_k * STANDARD_GRAVITY_M_S2 / STANDARD,
        scale_per_k=1e-6 * sheet.scale_ppm_k / STANDARD,
        warmer_k=warm_c - float(np.mean(standing)),
        windows_s=np.array([each.window_s for each in pieces]),
    )


def bending_of(sensor: RecordedSensor) -> tuple[float, float]:
    """Half-widths of φ, s²/m, and χ, s⁴/m², each as if it were all that the part is not linear by.

    Over ± V the best line misses φ v² by φ V²/2, χ v³ by χ V³/4.
    """
    sheet, whole_m_s2 = PARTS[sensor.part].accelerometer, sensor.range_m_s2
    assert whole_m_s2 is not None, "or it has no accelerometer"
    if sheet.nonlinear_over_g is not None:
        whole_m_s2 = sheet.nonlinear_over_g * STANDARD_GRAVITY_M_S2
    return 0.02 * sheet.nonlinearity_percent / whole_m_s2, 0.04 * sheet.nonlinearity_percent / whole_m_s2**2


def of_its_own(
    spread: Spread, solution: ImuSolution, movement: Movement, part: str
) -> tuple[Spread, list[Contributor]]:
    """The `spread` of a sensor of which all of this were known, and what each adds because it is not.

    One after the other in the readings' covariance. A bent sensor's noise counts for more, because the readings must
    tell the bending as well: that is in the line of the bending.
    """
    found = solution.own
    assert found is not None, "or there is nothing"
    straight = found.straight()
    steps = [
        _known(spread, solution, replace(movement, own=own))
        for own in (straight.as_warm().standing(), straight.as_warm(), straight, found)
    ]
    sheet = PARTS[part].accelerometer
    by_sheet = f"{sheet.bias_mg_k:g} mg/K", f"{sheet.nonlinearity_percent:g} %"
    sources = {
        INSTABILITY: "how the readings scatter",
        WITHIN_RUN: f"recorded temperature, {by_sheet[0]} by the data sheet at most",
        NONLINEARITY: f"what attitudes tell of it, {by_sheet[1]} by the data sheet at most",
    }
    lines = [
        Contributor(name, "A", "normal", None, "", source, after.freedom_since(before), after.beyond(before))
        for (name, source), (before, after) in zip(sources.items(), pairwise(steps), strict=True)
    ]
    return replace(spread, covariance=steps[0].covariance, response=steps[0].response), lines


@dataclass(frozen=True, slots=True)
class _Known:
    """Covariance (6, 6) of scale and bias, what of it the arm's `error` makes, and the response (6, n)."""

    error: AttitudeError
    covariance: Array
    of_arm: Array
    response: Array

    def beyond(self, before: "_Known") -> Array:
        """(6, 6) what is added to the covariance."""
        return self.covariance - before.covariance

    def freedom_since(self, before: "_Known") -> float:
        """Of that: as the arm's for the share that it makes of it."""
        added, of_arm = np.diag(self.beyond(before)), np.diag(self.of_arm - before.of_arm)
        share = float(np.max(of_arm[added > 0] / added[added > 0], initial=0.0))
        return freedom_of(self.error) / share**2 if share > SMALL else np.inf


def _known(spread: Spread, solution: ImuSolution, movement: Movement) -> _Known:
    second_order, theta = solution.second_order_s2_m is not None, solution.theta
    told = scale_and_bias(solution.matrix, spread.scale, len(solution.covariance))
    covariance, response = covariance_bound(theta, movement, solution.attitude_error.std_rad, second_order=second_order)
    whole, response = told @ covariance @ told.T, told @ response
    return _Known(solution.attitude_error, whole, whole - response @ noise(theta, movement) @ response.T, response)


def _piece(
    recording: ObservedRun,
    since_s: float,
    window_s: tuple[float, float],
    temperature_c: float,
    joint: int | None = None,
) -> Piece:
    start_s, end_s = window_s
    stands_s = (start_s + end_s) / 2 if joint is None else start_s
    stood = Stood(recording.motion.angles(stands_s), None if joint is None else joint - WRIST_1)
    return Piece((start_s + since_s, end_s + since_s), temperature_c, stood)
