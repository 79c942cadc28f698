"""The data of a run over temperature with a gyroscope on the simulated heated board, without a laboratory in real time.

The world's thermal model and the run's own course and ramp take the board of configs/thermal.yaml through its range.
The means of readings over sweeps and rests are computed from the world's sensor at these temperatures.
"""

from dataclasses import dataclass

import numpy as np

from firmware_host.emulator.parts.drift import Drift
from rig.config.world.thermal import SimulatedThermalSection
from rig.data.recording.thermal_events import SetMeasured
from rig.estimation.arrays import Array
from rig.estimation.temperature.polynomial_fits import RepeatedMeans
from rig.plans.motions.temperature_course import Ramp, TemperatureCourse
from rig.world.board.heat import HeatedBody

REFERENCE_C, FROM_C, TO_C, GAP_K = 35.0, 25.0, 45.0, 5.0
BOARD = SimulatedThermalSection(
    start_c=23, air_c=((0.0, 22.0),), capacity_j_k=6, loss_w_k=0.1, own_w=0.1, heater_w=5,
    thermometer_lag_s=1, element_lag_s=1, gradient_k_w=0.05,
)  # fmt: skip
TICK_S, LOOK_S = 0.05, 0.25
SET_S, SWEPT_S, RESTED_S, SWEEP_AT_S = 37.8, 3.0, 1.4, (2.15, 7.18, 14.16, 19.16, 26.06, 31.06)
SPEED_RAD_S, RATE_HZ = np.radians(120), 238.0
TURNS = SPEED_RAD_S * np.array([(0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])

SCALE = np.array([(1.1771, 1.1554, 1.1440), (3e-4, -2e-4, 2e-4), (2e-6, 1e-6, -1e-6)])  # the changes as shares
BIAS_RAD_S = np.array([(0.0077, -0.0100, -0.0051), (5e-4, -4e-4, 3e-4), (5e-6, 3e-6, -4e-6)])
HYSTERESIS_RAD_S = np.array([2e-5, 1e-5, -2e-5])
NOISE_RAD_S, INSTABILITY_RAD_S, WALK_RAD_S_SQRT_S = 0.004, 4.8e-5, 1e-5


@dataclass(frozen=True)
class Warmed:
    """The board's course: by ticks (n,) the time, thermometer, sensor's temperature and branch; the sets' starts."""

    time_s: Array
    thermometer_c: Array
    element_c: Array
    branch: Array
    starts_s: tuple[float, ...]


def warm_board() -> Warmed:
    """Take the board by its heater up through its range and down again."""
    body, course = HeatedBody(BOARD), TemperatureCourse(FROM_C, TO_C, GAP_K, both_directions=True)
    part, ramp, rows, starts, duty = (
        body.part("gyro"),
        Ramp(0.6 * GAP_K / SET_S, 1.0),
        list[Array](),
        list[float](),
        0.0,
    )
    course.begin(BOARD.start_c)
    began: int | None = None
    while course.missing() is not None:
        now_s = (len(rows) + 1) * TICK_S
        body.advance(now_s, duty, powered=True)
        now_c = part.thermometer_c(now_s)
        rows.append(np.array([now_s, now_c, part.temperature_c(now_s), part.branch(now_s)]))
        if len(rows) % round(LOOK_S / TICK_S) == 0:
            duty = ramp.power(now_s, now_c, TO_C + 1 if course.warming else FROM_C - 1)
        if began is None and course.is_due({"gyro": now_c}):
            began = len(rows)
            starts.append(now_s)
        elif began is not None and now_s >= starts[-1] + SET_S:
            mean_c = float(np.mean([row[1] for row in rows[began:]]))
            course.add_set(SetMeasured(6 * len(starts) - 6, 6 * len(starts), bool(course.warming), {"gyro": mean_c}))
            began = None
    time_s, thermometer_c, element_c, branch = np.array(rows).T
    return Warmed(time_s, thermometer_c, element_c, branch, tuple(starts))


def repeat_means(warmed: Warmed, seed: int) -> RepeatedMeans:
    """Return the estimator's input for one sensor, with drawn noise, drift and tilt of the arm's axes."""
    rng = np.random.default_rng([31, seed])
    windows = np.array([
        (start + offset_s + after, start + offset_s + after + lasts)
        for start in warmed.starts_s
        for offset_s in SWEEP_AT_S for after, lasts in ((0.0, SWEPT_S), (SWEPT_S + 0.4, RESTED_S))
    ])  # fmt: skip
    rates = np.tile(np.stack([TURNS, np.zeros((6, 3))], axis=1).reshape(12, 3), (len(warmed.starts_s), 1))
    places = np.tile(np.arange(12), len(warmed.starts_s))
    drift = Drift(INSTABILITY_RAD_S, 100.0, WALK_RAD_S_SQRT_S, np.random.SeedSequence([31, seed]))
    powers = (warmed.element_c[:, None] - REFERENCE_C) ** np.arange(3)
    bias = powers @ BIAS_RAD_S + warmed.branch[:, None] * HYSTERESIS_RAD_S + drift.evaluate_all(warmed.time_s)
    inverse = 1 / (SCALE[0] * (1 + powers[:, 1:] @ SCALE[1:]))

    def mean(values: Array) -> Array:
        summed = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
        first, end = np.searchsorted(warmed.time_s, windows.T)
        return np.asarray((summed[end] - summed[first]) / (end - first).reshape(-1, *[1] * (values.ndim - 1)))

    variances = np.repeat(NOISE_RAD_S**2 / (RATE_HZ * np.diff(windows, axis=1)), 3, axis=1)
    means = rates * mean(inverse) - mean(bias) + rng.normal(0, 3e-4, (12, 3))[places]
    means += rng.normal(0, 1, means.shape) * np.sqrt(variances)
    return RepeatedMeans(means, variances, rates, places, windows, mean(warmed.thermometer_c), INSTABILITY_RAD_S)
