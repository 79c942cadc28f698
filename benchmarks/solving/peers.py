"""Errors and time of imucal and of the rig's vector model, for the same simulated Ferraris session.

python benchmarks/solving/peers.py          # needs the extra `bench`

The session is imucal's: six still holds with ±x, ±y, ±z upwards, and one turn of −360° about each axis, 6 × 1000 and 3
× 600 samples at 100 Hz. The sensor is mounted 3° askew, its accelerometer is ideal except for noise. imucal's reading =
K_g R_g ω + b_g + K_ga a is the vector model with g-sensitivity; its 1/K_g is our scale, −b_g our bias.
"""

import sys
import timeit
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from imucal import FerrarisCalibration, FerrarisSignalRegions

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import solve_vector_model
from rig.study import simulation as sim

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import GOALS, record

Session = dict[str, Array]

RATE_HZ, HOLD_SAMPLES, TURN_SAMPLES = 100.0, 1000, 600
SCALE = np.array([1.1771, 1.1554, 1.1440])  # SIX, table II: the turntable's LSM9DS1
BIAS_RAD_S = np.array([0.0077, -0.0100, -0.0051])
NOISE_RAD_S, ACCELEROMETER_NOISE_M_S2 = 0.035, 0.02
GRAVITY_M_S2 = 9.81
SPEED_RAD_S = 2 * np.pi * RATE_HZ / TURN_SAMPLES
HOLDS = [f"{axis}_{side}" for axis in "xyz" for side in "pa"]
UP = {f"{axis}_{side}": sign * np.eye(3)[i] for i, axis in enumerate("xyz") for side, sign in (("p", 1), ("a", -1))}
RATES_RAD_S = np.concatenate([np.zeros((6, 3)), -SPEED_RAD_S * np.eye(3)])  # of the sections, and the gravity in them
GRAVITIES_M_S2 = GRAVITY_M_S2 * np.concatenate([list(UP.values()), np.eye(3)])
RUNS, ROUNDS = 300, 10


def session(seed: int) -> Session:
    """Simulate samples by imucal's section names: `gyr_…` in rad/s, `acc_…` in m/s², each (n, 3)."""
    rng = np.random.default_rng(seed)
    mounting = sim.draw_mountings(rng, 1, float(np.sin(np.radians(3))))[0]
    F = sim.build_sensitivity(SCALE, mounting)
    samples = {}
    for hold in HOLDS:
        samples[f"gyr_{hold}"] = NOISE_RAD_S * rng.normal(size=(HOLD_SAMPLES, 3)) - BIAS_RAD_S
        samples[f"acc_{hold}"] = _accelerations(rng, mounting @ UP[hold], HOLD_SAMPLES)
    for i, axis in enumerate("xyz"):
        turn = -SPEED_RAD_S * F[:, i] - BIAS_RAD_S
        samples[f"gyr_{axis}_rot"] = turn + NOISE_RAD_S * rng.normal(size=(TURN_SAMPLES, 3))
        samples[f"acc_{axis}_rot"] = _accelerations(rng, mounting @ UP[f"{axis}_p"], TURN_SAMPLES)
    return samples


def _accelerations(rng: np.random.Generator, up: Array, count: int) -> Array:
    return GRAVITY_M_S2 * up + ACCELEROMETER_NOISE_M_S2 * rng.normal(size=(count, 3))


def convert_to_degrees(samples: Session) -> Session:
    """Convert rates to °/s, the unit of imucal."""
    return {name: np.degrees(data) if name.startswith("gyr") else data for name, data in samples.items()}


def solve_by_imucal(samples: Session) -> Array:
    """Return the parameters (6,) kx, ky, kz, bx, by, bz. Meanwhile imucal also solves the accelerometer."""
    regions = FerrarisSignalRegions(**samples)
    solution = FerrarisCalibration(grav=GRAVITY_M_S2).compute(
        regions, RATE_HZ, from_acc_unit="m/s^2", from_gyr_unit="deg/s"
    )
    return np.concatenate([1 / np.diag(solution.K_g), -np.radians(solution.b_g)])


def solve_by_vector_model(samples: Session, *, with_gravity: bool = False) -> Array:
    """Return the parameters (6,) from averages of the same gyroscope samples, with covariance and all gates."""
    sections = [samples[f"gyr_{name}"] for name in (*HOLDS, "x_rot", "y_rot", "z_rot")]
    counts = np.array([len(section) for section in sections])
    begins = np.cumsum(counts) - counts
    by_axis = np.concatenate([section.T for section in sections], axis=1)  # contiguous sums are four times as fast
    means = np.add.reduceat(by_axis, begins, axis=1) / counts
    squares = (by_axis - np.repeat(means, counts, axis=1)) ** 2
    variances = np.add.reduceat(squares, begins, axis=1) / counts**2
    gravity = GRAVITIES_M_S2 if with_gravity else None
    solved = solve_vector_model(means.T, RATES_RAD_S, variances.T, gravity_m_s2=gravity)
    return np.concatenate([solved.scale, solved.bias_rad_s])


def main() -> None:
    """Print errors over 300 sessions and the median time of one, in turns, so that a busy computer slows all alike."""
    truth = np.concatenate([SCALE, BIAS_RAD_S])
    sessions = [session(seed) for seed in range(RUNS)]
    converted = [convert_to_degrees(samples) for samples in sessions]
    solvers: dict[str, tuple[Callable[[Session], Array], list[Session]]] = {
        "imucal, with its accelerometer": (solve_by_imucal, converted),
        "vector model with g-sensitivity": (
            lambda samples: solve_by_vector_model(samples, with_gravity=True),
            sessions,
        ),
        "vector model": (solve_by_vector_model, sessions),
    }
    durations_s = np.empty((len(solvers), ROUNDS, RUNS // ROUNDS))
    for round_ in range(ROUNDS):
        for solver, (solve, inputs) in enumerate(solvers.values()):
            durations_s[solver, round_] = timeit.repeat(partial(solve, inputs[0]), number=1, repeat=RUNS // ROUNDS)
    medians_s = np.median(durations_s, axis=(1, 2))
    measured = f"{'RMS scale error':>18}{'RMS bias error rad/s':>23}{'covariance':>12}"
    print(f"{'solver':34}{'median µs':>12}{'ratio':>8}{measured}")
    for (name, (solve, inputs)), seconds in zip(solvers.items(), medians_s, strict=True):
        errors = np.array([solve(samples) for samples in inputs]) - truth
        scale, bias = np.sqrt(np.mean(errors[:, :3] ** 2)), np.sqrt(np.mean(errors[:, 3:] ** 2))
        if name in GOALS:
            record(name, seconds * 1e6, "µs", peer="imucal", peer_value=float(medians_s[0]) * 1e6)
        stated = "no" if name.startswith("imucal") else "yes"
        print(f"{name:34}{seconds * 1e6:12.0f}{seconds / medians_s[0]:8.2f}{scale:18.2e}{bias:23.2e}{stated:>12}")


if __name__ == "__main__":
    main()
