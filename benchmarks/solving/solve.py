"""The time to solve one calibration, compared with Levenberg–Marquardt on the same six averaged readings.

python benchmarks/solving/solve.py
"""

import sys
import timeit
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator
from rig.estimation.gyroscope.six_observation import closed_form

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

SPEED_RAD_S = np.pi / 3
DIRECTIONS = np.array([[0, 0, -1], [0, 0, 1], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]], dtype=np.float64)
SCALE = np.array([1.1771, 1.1554, 1.1440])  # SIX, table II: the turntable's LSM9DS1
BIAS_RAD_S = np.array([0.0077, -0.0100, -0.0051])
NOISE_RAD_S, SAMPLES = 0.035, 1428


def simulate_mean_readings(seed: int) -> Array:
    """Return simulated means (6, 3), rad/s, of a turn each at 60°/s with samples at 238 Hz and 5° of mounting error."""
    x, y, z = np.radians(5) * np.array([1, 1, 1]) / np.sqrt(3)
    mounting = np.eye(3) + np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    mounting /= np.linalg.norm(mounting, axis=0)
    noise = np.random.default_rng(seed).normal(size=(6, 3)) * NOISE_RAD_S / np.sqrt(SAMPLES)
    means: Array = SPEED_RAD_S * DIRECTIONS @ mounting.T / SCALE - BIAS_RAD_S + noise
    return means


def solve_by_closed_form(means: Array) -> Array:
    """Solve by the core alone: one linear system."""
    return np.concatenate(closed_form(means, SPEED_RAD_S))


def solve_by_accumulator(means: Array) -> Array:
    """Solve as a run does: gates, measured speeds, covariance."""
    accumulated = Accumulator.empty()
    for mean in means:
        accumulated = accumulated.add(mean, np.full(3, NOISE_RAD_S**2 / SAMPLES), SPEED_RAD_S)
    solution = accumulated.solve()
    return np.concatenate([solution.scale, solution.bias_rad_s])


def solve_by_levenberg_marquardt(means: Array) -> Array:
    """Solve by SciPy's `lm` on ‖K (m + b)‖² − ω², from k = 1, b = 0."""

    def residuals(parameters: Array) -> Array:
        corrected = parameters[:3] * (means + parameters[3:])
        residual: Array = np.sum(corrected * corrected, axis=1) - SPEED_RAD_S**2
        return residual

    solution: Array = least_squares(residuals, [1, 1, 1, 0, 0, 0], method="lm").x
    return solution


def measure_seconds(solve: Callable[[Array], Array], means: Array) -> float:
    """Return the median time of many single solves, s."""
    return float(np.median(timeit.repeat(lambda: solve(means), number=1, repeat=2000)))


def main() -> None:
    """Print time and accuracy of each solver, and how many times as long Levenberg–Marquardt takes."""
    solvers = {
        "closed form": solve_by_closed_form,
        "accumulator with covariance": solve_by_accumulator,
        'least_squares(method="lm")': solve_by_levenberg_marquardt,
    }
    truth = np.concatenate([SCALE, BIAS_RAD_S])
    times = {}
    print(f"{'solver':30}{'median µs':>12}{'RMS scale error':>18}{'RMS bias error rad/s':>23}")
    for name, solve in solvers.items():
        errors = np.array([solve(simulate_mean_readings(seed)) for seed in range(200)]) - truth
        times[name] = measure_seconds(solve, simulate_mean_readings(0))
        scale, bias = np.sqrt(np.mean(errors[:, :3] ** 2)), np.sqrt(np.mean(errors[:, 3:] ** 2))
        print(f"{name:30}{times[name] * 1e6:12.1f}{scale:18.2e}{bias:23.2e}")
    difference = np.abs(
        solve_by_closed_form(simulate_mean_readings(0)) - solve_by_levenberg_marquardt(simulate_mean_readings(0))
    ).max()
    ratio = times['least_squares(method="lm")'] / times["closed form"]
    ours_us, theirs_us = (1e6 * times[name] for name in ("closed form", 'least_squares(method="lm")'))
    record("closed form, a run", ours_us, "µs", peer="least_squares", peer_value=theirs_us)
    print(f"Levenberg–Marquardt takes {ratio:.0f} times as long; the two answers differ by {difference:.0e} at most.")


if __name__ == "__main__":
    main()
