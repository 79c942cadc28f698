"""The mean squared error of every estimator over its own Cramér–Rao bound.

The gyroscope's estimators use the same runs. The six-observation estimators and the vector model have different bounds,
because the vector model knows the directions of the turns and uses the rests too. The tri-axial estimators use the rate
table's data.
"""

from collections.abc import Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.design.bounds import efficiency, six_observation_bound, triaxial_bound, vector_bound
from rig.estimation.gyroscope.levenberg_marquardt import LevenbergMarquardtSolution, solve_levenberg_marquardt
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.estimation.gyroscope.six_observation_batch import BatchSolution, algorithm_1_batch, newton_batch
from rig.estimation.gyroscope.vector_model import VectorBatch, solve_vector_batch
from rig.estimation.reference.reference_model import KnownNorm, KnownVector
from rig.estimation.reference.triaxial import EqualWeights, solve_triaxial_batch
from rig.study import rate_table as rt
from rig.study import simulation as sim
from rig.study.study_report import Settings, StudyFinding, StudyReport, table
from rig.study.work import run_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOISE_RAD_S = sim.NOISE_LEVELS_RAD_S[0]
SPEEDS = {"60°/s": sim.ARM_SPEED_RAD_S, "3 rad/s": sim.FAST_SPEED_RAD_S}
RESTS, REST_SAMPLES = 6, round(3 * sim.RATE_HZ)  # SIX, section IV: 3 s after each sweep
GYRO_ESTIMATORS = ("closed form", "Algorithm 1", "Levenberg–Marquardt", "vector model", "vector model with rests")
METHODS: tuple[EqualWeights, ...] = ("as_published", "maximum_likelihood")
TABLE_POSES = 40


def study(settings: Settings) -> StudyReport:
    """Simulate 30 mounted gyroscopes × 500 runs at each speed, and 30 tri-axial sensors × 500 runs in 40 poses."""
    runs = settings.runs or sim.RUNS
    ratios = run_parallel(partial(_simulate_gyroscope, runs), range(sim.SETS), settings)
    rows = list(_gyroscope_rows(np.mean(ratios, axis=0)))
    errors = run_parallel(partial(_simulate_rate_table, runs), range(sim.SETS), settings)
    rows += list(_rate_table_rows({name: np.mean([run[name] for run in errors], axis=0) for name in errors[0]}))
    return StudyReport(table(rows), _findings(rows), partial(_draw, rows), (12.0, 6.0))


def _simulate_gyroscope(runs: int, rng: np.random.Generator, _: int) -> Array:
    """Return mean squared errors (speeds, estimators, 2, 6) of kx ky kz bx by bz: over the bound, then absolute."""
    scale, bias = sim.NORMAL.draw(rng)
    mounting = sim.draw_mountings(rng, 1)[0]
    F = sim.build_sensitivity(scale, mounting)
    truth = np.concatenate([scale, bias])
    ratios = []
    for speed in SPEEDS.values():
        sweep = sim.build_whole_turn(speed, NOISE_RAD_S)
        rates = speed * sim.DIRECTIONS
        turns = sim.draw_mean_readings(rng, np.broadcast_to(F, (runs, 3, 3)), bias, sweep)
        rest_std = NOISE_RAD_S / np.sqrt(REST_SAMPLES)
        all_means = np.concatenate([turns, rest_std * rng.normal(size=(runs, RESTS, 3)) - bias], axis=1)
        all_rates = np.concatenate([rates, np.zeros((RESTS, 3))])
        variances = np.full((6, 3), sweep.variance_rad2_s2)
        all_variances = np.concatenate([variances, np.full((RESTS, 3), rest_std**2)])
        marquardt = [solve_levenberg_marquardt(mean, np.full(6, speed), variances, weighted=False) for mean in turns]
        estimates = (
            _stack_parameters(newton_batch(turns, speed)),
            _stack_parameters(algorithm_1_batch(turns, speed)),
            np.array([_stack_parameters(solution) for solution in marquardt]),
            _stack_parameters(solve_vector_batch(turns, rates, variances)),
            _stack_parameters(solve_vector_batch(all_means, all_rates, all_variances)),
        )
        six = six_observation_bound(scale, rates @ mounting.T, variances)
        bounds = (six, six, six, vector_bound(F, rates, variances), vector_bound(F, all_rates, all_variances))
        ratios.extend(_compare(estimate - truth, bound) for estimate, bound in zip(estimates, bounds, strict=True))
    return np.array(ratios).reshape(len(SPEEDS), len(GYRO_ESTIMATORS), 2, 6)


def _stack_parameters(solution: BatchSolution | VectorBatch | LevenbergMarquardtSolution) -> Array:
    """Return kx ky kz bx by bz, (…, 6)."""
    return np.concatenate([solution.scale, solution.bias_rad_s], axis=-1)


def _gyroscope_rows(ratios: Array) -> Iterator[dict[str, Any]]:
    for s, speed in enumerate(SPEEDS):
        for e, estimator in enumerate(GYRO_ESTIMATORS):
            for p, parameter in enumerate(PARAMETERS):
                yield _row(f"{estimator}, {speed}", parameter, ratios[s, e, 0, p], ratios[s, e, 1, p])


def _simulate_rate_table(runs: int, rng: np.random.Generator, _: int) -> dict[str, Array]:
    """Return, by estimator, mean squared errors (2, p) of p = 15 or 18 parameters: relative to the bound, absolute."""
    attitudes = rt.draw_attitudes(TABLE_POSES)
    ratios = {}
    rates = 0.5 * np.random.default_rng(TABLE_POSES).normal(size=(TABLE_POSES, 3))  # rad/s, the same in every run
    noise = np.full((TABLE_POSES, 3), rt.GYRO_RANDOM_WALK * np.sqrt(rt.RATE_HZ))
    model = (rt.project(attitudes, rt.GYRO_REFERENCE_RAD_S) + rates) @ rt.GYRO_MATRIX.T + rt.GYRO_BIAS_RAD_S
    readings = model + noise * rng.normal(size=(runs, *model.shape))
    truth = np.concatenate([rt.GYRO_MATRIX.ravel(), rt.GYRO_REFERENCE_RAD_S, rt.GYRO_BIAS_RAD_S])
    gyroscope = rt.GYRO_MATRIX, rt.GYRO_REFERENCE_RAD_S, rt.GYRO_BIAS_RAD_S
    bound = triaxial_bound(*gyroscope, attitudes, noise**2, known_references=rates)
    for method in METHODS:
        theta = solve_triaxial_batch(readings, attitudes, noise**2, KnownVector(rates), method=method)
        ratios[f"TRIAX gyroscope, {method}"] = _compare(theta - truth, bound)
    reference = rt.ACCELEROMETER_REFERENCE_M_S2
    for order in (1, 2):
        second = rt.ACCELEROMETER_SECOND_ORDER if order == 2 else np.zeros(3)
        force = rt.project(attitudes, reference)
        model = (force + second * force**2) @ rt.ACCELEROMETER_MATRIX.T + rt.ACCELEROMETER_BIAS_M_S2
        noise = np.full((TABLE_POSES, 3), rt.ACCELEROMETER_RANDOM_WALK / np.sqrt(60))  # means over a minute
        readings = model + noise * rng.normal(size=(runs, *model.shape))
        truth = np.concatenate([rt.ACCELEROMETER_MATRIX.ravel(), reference, rt.ACCELEROMETER_BIAS_M_S2])
        if order == 2:
            truth = np.concatenate([truth, second])
        bound = triaxial_bound(
            rt.ACCELEROMETER_MATRIX,
            reference,
            rt.ACCELEROMETER_BIAS_M_S2,
            attitudes,
            noise**2,
            second_order=second if order == 2 else None,
        )
        for method in METHODS:
            theta = solve_triaxial_batch(
                readings,
                attitudes,
                noise**2,
                KnownNorm(float(np.linalg.norm(reference)), reference),
                second_order=order == 2,
                method=method,
            )
            ratios[f"TRIAX accelerometer, order {order}, {method}"] = _compare(theta - truth, bound)
    return ratios


def _compare(errors: Array, bound: Array) -> Array:
    """Return mean squares (2, p) of `errors` (R, p) over R runs: first over the bound's diagonal, then absolute."""
    return np.array([efficiency(errors, bound), np.mean(errors**2, axis=0)])


def _rate_table_rows(ratios: dict[str, Array]) -> Iterator[dict[str, Any]]:
    names = [*(f"F{i}{j}" for i in "xyz" for j in "xyz"), *(f"reference_{i}" for i in "xyz"), *("bx", "by", "bz")]
    names += [f"second_order_{i}" for i in "xyz"]
    for estimator, both in ratios.items():
        for name, ratio, square in zip(names, *both, strict=False):
            yield _row(estimator, name, ratio, square)


def _row(estimator: str, parameter: str, ratio: float, square: float) -> dict[str, Any]:
    return {
        "estimator": estimator,
        "parameter": parameter,
        "mse_over_bound": float(ratio),
        "mse_si_units_squared": float(square),
    }


def _findings(rows: list[dict[str, Any]]) -> tuple[StudyFinding, ...]:
    """Return each estimator's efficiency, and the gain of the vector model over Algorithm 1."""

    def mean(estimator: str, first: str, column: str) -> float:
        chosen = [row[column] for row in rows if row["estimator"] == estimator and row["parameter"].startswith(first)]
        return float(np.mean(chosen))

    findings = [
        StudyFinding(f"MSE/bound, mean over parameters: {estimator}", mean(estimator, "", "mse_over_bound"), "1")
        for estimator in dict.fromkeys(row["estimator"] for row in rows)
    ]
    for speed in SPEEDS:
        published, ours = f"Algorithm 1, {speed}", f"vector model with rests, {speed}"
        for name, first in (("bias", "b"), ("scale", "k")):
            ratio = mean(published, first, "mse_si_units_squared") / mean(ours, first, "mse_si_units_squared")
            findings.append(StudyFinding(f"{name} MSE, Algorithm 1 over vector model with rests, {speed}", ratio, "1"))
    return tuple(findings)


def _draw(rows: list[dict[str, Any]], figure: "Figure") -> None:
    panel = figure.subplots()
    names = list(dict.fromkeys(row["estimator"] for row in rows))
    for position, name in enumerate(names):
        ratios = [row["mse_over_bound"] for row in rows if row["estimator"] == name]
        panel.plot(ratios, np.full(len(ratios), position), ".", color="tab:blue", alpha=0.5)
        panel.plot(np.mean(ratios), position, "|", color="tab:orange", markersize=18, markeredgewidth=3)
    panel.axvline(1.0, color="k", label="Cramér–Rao bound")
    panel.axvline(1.05, color="grey", linestyle="--", label="efficient: within 1.05")
    panel.plot([], [], ".", color="tab:blue", label="one parameter")
    panel.plot([], [], "|", color="tab:orange", markersize=12, markeredgewidth=3, label="mean over parameters")
    panel.set_yticks(range(len(names)), [name.replace("_", " ") for name in names])
    panel.invert_yaxis()
    panel.set(xlabel="mean squared error / bound", title="efficiency of the estimators, each against its own bound")
    panel.legend(loc="lower right")
