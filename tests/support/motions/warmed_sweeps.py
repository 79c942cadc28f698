"""Sweeps and rests of a drawn gyroscope that warms and cools, as files and as observations."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.analysis.external.external_recordings import budget_of, solve_swept
from rig.analysis.temperature.over_temperature import correct_files
from rig.data.quantity import RATE
from rig.estimation.arrays import Array
from rig.estimation.temperature.polynomial_fits import RepeatedMeans
from rig.estimation.temperature.temperature_polynomials import OverTemperature, TemperatureLine, combine_with_reference
from rig.observation.average import Average
from rig.observation.external.csv_import import ExternalData
from rig.observation.observe import Observation, nearest_axis

REFERENCE_C = 25.0
FROM_C, TO_C = 20.0, 60.0
SWEPT_S, RESTED_S, BETWEEN_S = 6.0, 3.0, 10.0
SPEED_RAD_S = np.radians(60.0)
DATA_SHEET_BIAS_K, DATA_SHEET_SCALE_K = np.radians(0.03), 3e-4  # rad/s and a share for a kelvin; MPU-9250, LSM9DS1


@dataclass(frozen=True)
class Drawn:
    """A gyroscope: k(T) = k₀ (1 + s₁ d + s₂ d²), the addition to a reading c(T) = c₀ + c₁ d + c₂ d², d = T − 25 °C.

    `hysteresis` (3,): the addition half-way during warming; `lag_s`: the thermometer's lag; `gradient_k`: the excess of
    the sensor's temperature over its thermometer's in use, compared with the run: at the middle of the range, and in
    addition at its upper end. `leaning` (P, 3): the addition in each pose, such as by an arm's tilted axis.
    """

    scale: Array
    bias: Array
    hysteresis: Array
    lag_s: float
    gradient_k: tuple[float, float]
    leaning: Array
    noise: float
    walk: float

    def evaluate(self, temperature_c: float) -> Array:
        """Return k and c (6,) at that temperature of the thermometer, in use."""
        even, tilted = self.gradient_k
        warmer_k = even + tilted * (2 * temperature_c - FROM_C - TO_C) / (TO_C - FROM_C)
        powers = (temperature_c + warmer_k - REFERENCE_C) ** np.arange(3)
        return np.concatenate([powers @ self.scale, powers @ self.bias])


POSE_RATES = np.array([rate for axis in np.eye(3) for rate in (axis, 0 * axis, -axis, 0 * axis)]) * SPEED_RAD_S


def drawn(
    rng: np.random.Generator,
    *,
    hysteresis: float = 0.0,
    lag_s: float = 0.0,
    gradient_k: float = 0.1,
    noise: float = 3e-4,
    walk: float = 2e-6,
) -> Drawn:
    """Draw a gyroscope with slopes and curvatures of the size in a data sheet."""
    first = rng.uniform(1.1, 1.2, 3)
    scale = np.array([first, first * rng.uniform(-1, 1, 3) * DATA_SHEET_SCALE_K, first * rng.uniform(-1, 1, 3) * 3e-6])
    directions = rng.uniform(-1, 1, (2, 3))
    bias = np.array([rng.normal(0, 0.01, 3), directions[0] * DATA_SHEET_BIAS_K, directions[1] * DATA_SHEET_BIAS_K / 80])
    return Drawn(
        scale, bias, hysteresis * rng.uniform(-1, 1, 3), lag_s * rng.uniform(-1, 1),
        (gradient_k * rng.uniform(-1, 1), gradient_k * rng.uniform(-1, 1)),
        rng.normal(0, 3e-4, POSE_RATES.shape), noise, walk,
    )  # fmt: skip


@dataclass(frozen=True)
class Session:
    """Sets of sweeps and rests: `windows_s` (N, 2), `felt` (N, 3), the thermometer's `temperature_c` (N,)."""

    windows_s: Array
    true_rates: Array
    places: NDArray[np.intp]
    temperature_c: Array
    warming_k_s: Array


def session(repeats: int = 14, *, both_directions: bool = True) -> Session:
    """Return a session from 20 to 60 °C and, if `both_directions`, back again."""
    rates = np.tile(POSE_RATES, (repeats, 1))
    lasted = np.where(rates.any(axis=1), SWEPT_S, RESTED_S)
    ends = np.cumsum(lasted + BETWEEN_S)
    windows = np.column_stack([ends - lasted, ends])
    middle = windows.mean(axis=1)
    done = (middle - middle[0]) / (middle[-1] - middle[0])
    temperature_c = FROM_C + (TO_C - FROM_C) * (1 - np.abs(1 - 2 * done) if both_directions else done)
    places = np.tile(np.arange(len(POSE_RATES)), repeats)
    return Session(windows, rates, places, temperature_c, np.gradient(temperature_c, middle))


def readings(sensor: Drawn, course: Session, rng: np.random.Generator) -> Array:
    """Return the mean readings (N, 3)."""
    warm = course.temperature_c + sensor.lag_s * course.warming_k_s - REFERENCE_C
    powers = np.vander(warm, 3, increasing=True)
    within = (course.temperature_c - FROM_C) / (TO_C - FROM_C)
    loop = np.outer(np.sign(course.warming_k_s) * 4 * within * (1 - within), sensor.hysteresis)
    wandered = np.cumsum(
        rng.normal(0, 1, course.true_rates.shape) * np.sqrt(np.diff(course.windows_s[:, 0], prepend=0.0))[:, None],
        axis=0,
    )
    wandered -= wandered.mean(axis=0)  # a bias is that of the whole run
    white = rng.normal(0, 1, course.true_rates.shape) * sensor.noise
    noisy: Array = (
        course.true_rates / (powers @ sensor.scale) + powers @ sensor.bias + loop
        + sensor.leaning[course.places] + sensor.walk * wandered + white
    )  # fmt: skip
    return noisy


def repeat_means(means: Array, course: Session, noise: float) -> RepeatedMeans:
    """Return the estimator's input."""
    return RepeatedMeans(
        means, np.full(means.shape, noise**2), course.true_rates, course.places, course.windows_s, course.temperature_c
    )


def write_files(
    sensor: Drawn, course: Session, rng: np.random.Generator, folder: Path, rate_hz: float = 20.0
) -> tuple[Path, Path]:
    """Write the sweeps and the samples with a column of temperature, as `rig solve --sweeps` takes them."""
    means = readings(sensor, course, rng)
    rows = []
    for mean, (start_s, end_s), warm in zip(means, course.windows_s, course.temperature_c, strict=True):
        times = np.arange(start_s + 0.5 / rate_hz, end_s, 1 / rate_hz)
        noise = rng.normal(0, sensor.noise * np.sqrt(len(times)), (len(times), 3))
        rows.append(np.column_stack([times, mean + noise - noise.mean(axis=0), np.full(len(times), warm)]))
    samples, sweeps = folder / "samples.csv", folder / "sweeps.csv"
    header = "time_s,x_rad_s,y_rad_s,z_rad_s,temperature_c"
    np.savetxt(samples, np.vstack(rows), fmt="%.10g", delimiter=",", header=header, comments="")
    speeds = np.linalg.norm(course.true_rates, axis=1)
    axes = np.where(speeds[:, None] > 0, course.true_rates / np.maximum(speeds, 1e-9)[:, None], np.eye(3)[0])
    header = "start_s,end_s,axis_x,axis_y,axis_z,speed_rad_s"
    table = np.column_stack([course.windows_s, axes, speeds])
    np.savetxt(sweeps, table, fmt="%.12g", delimiter=",", header=header, comments="")
    return samples, sweeps


def external(means: Array, course: Session, noise: float) -> ExternalData:
    """Return the same as `averaged` makes of files."""
    averages = [
        Average(mean, np.full(3, noise**2), np.full(3, noise), 100, start_s, end_s, warm, dof=np.full(3, 99.0))
        for mean, (start_s, end_s), warm in zip(
            means, course.windows_s.tolist(), course.temperature_c.tolist(), strict=True
        )
    ]
    sweeps = [
        Observation(
            row,
            None,
            None,
            *nearest_axis(rate),
            rate / np.linalg.norm(rate),
            float(np.linalg.norm(rate)),
            0.0,
            0,
            average,
        )
        for row, (rate, average) in enumerate(zip(course.true_rates, averages, strict=True), start=1)
        if rate.any()
    ]
    rests = [average for rate, average in zip(course.true_rates, averages, strict=True) if not rate.any()]
    return ExternalData(tuple(sweeps), tuple(rests))


def calibrate(sensor: Drawn, course: Session, rng: np.random.Generator) -> OverTemperature:
    """Return polynomials with the whole uncertainty of sweeps from files."""
    moved, polynomials = correct_files(external(readings(sensor, course, rng), course, sensor.noise), REFERENCE_C)
    solution = solve_swept(moved, "vector")
    sign = np.diag(RATE.parameter_signs)
    lines = tuple(
        TemperatureLine(
            contributor.name,
            contributor.kind,
            contributor.distribution,
            contributor.source,
            contributor.dof,
            sign @ contributor.covariance @ sign,
        )
        for contributor in budget_of(solution, moved).contributors
    )
    return combine_with_reference(polynomials, np.r_[solution.scale, -solution.bias_rad_s], lines)
