"""15,000 six-observation runs (30 gyroscopes × 500) at once, compared with a loop of SciPy's Levenberg–Marquardt.

python benchmarks/solving/batch.py

The loop goes through every thirtieth run and its time is scaled; both see the same readings.
"""

import sys
import time
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation_batch import algorithm_1_batch, newton_batch
from rig.study import simulation as sim

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

EVERY = 30  # of the runs go through the loop


def simulate_mean_readings(speed_rad_s: float) -> Array:
    """Return mean readings (15000, 6, 3), rad/s, simulated as in section III-A of the paper SIX, with less noise."""
    rng = np.random.default_rng(1)
    means = []
    for _ in range(sim.SETS):
        scale, bias = sim.NORMAL.draw(rng)
        F = sim.build_sensitivity(scale, sim.draw_mountings(rng, sim.RUNS))
        means.append(sim.draw_mean_readings(rng, F, bias, sim.build_whole_turn(speed_rad_s, sim.NOISE_LEVELS_RAD_S[0])))
    return np.concatenate(means)


def solve_in_loop(means: Array, speed_rad_s: float) -> Array:
    """Return the parameters (n, 6), scale and bias of each run, by one `least_squares` after another."""

    def residuals(parameters: Array, readings: Array) -> Array:
        corrected = parameters[:3] * (readings + parameters[3:])
        residual: Array = np.sum(corrected * corrected, axis=1) - speed_rad_s**2
        return residual

    start = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    return np.array([least_squares(residuals, start, method="lm", args=(m,)).x for m in means])


def main() -> None:
    """Print times, ratios and differences, at both speeds."""
    print(f"{'15,000 runs':44}{'seconds':>10}{'µs a run':>10}{'times batch':>13}{'largest difference':>20}")
    for speed, name in ((sim.ARM_SPEED_RAD_S, "60°/s"), (sim.FAST_SPEED_RAD_S, "3 rad/s")):
        means = simulate_mean_readings(speed)
        batch_s = np.inf
        for _ in range(5):
            start = time.perf_counter()
            solved = newton_batch(means, speed)
            batch_s = min(batch_s, time.perf_counter() - start)
        exact = np.concatenate([solved.scale, solved.bias_rad_s], axis=1)
        assert solved.converged.all()
        _print_line(f"closed form, batch, {name}", batch_s, len(means), batch_s, None)
        start = time.perf_counter()
        published = algorithm_1_batch(means, speed)
        passed = time.perf_counter() - start
        differences = np.abs(np.concatenate([published.scale, published.bias_rad_s], axis=1) - exact)[
            published.converged
        ]
        _print_line(f"Algorithm 1, batch, {name}", passed, len(means), batch_s, float(differences.max()))
        start = time.perf_counter()
        looped = solve_in_loop(means[::EVERY], speed)
        passed = (time.perf_counter() - start) * EVERY
        differences = np.abs(looped - exact[::EVERY])
        if speed == sim.ARM_SPEED_RAD_S:
            batch_us, loop_us = (1e6 * seconds / len(means) for seconds in (batch_s, passed))
            record("batch, a run", batch_us, "µs", peer="least_squares, looped", peer_value=loop_us)
        _print_line(f'least_squares("lm"), scaled loop, {name}', passed, len(means), batch_s, float(differences.max()))


def _print_line(name: str, seconds: float, runs: int, batch_s: float, differences: float | None) -> None:
    largest_difference = "" if differences is None else f"{differences:.1e}"
    print(f"{name:44}{seconds:10.3f}{seconds / runs * 1e6:10.2f}{seconds / batch_s:13.0f}{largest_difference:>20}")


if __name__ == "__main__":
    main()
