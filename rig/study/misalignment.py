"""Errors of the six-observation method and of the vector model against mounting error and non-orthogonality.

Six averaged sweeps tell ‖K (m + b)‖ alone, so how the sensor is mounted does not matter, but its axes must stand at
right angles: what they miss goes into the scale factors, to second order where the sensor is mounted straight, but
times the mounting error, hence to first order, where it is not. The vector model finds both angles instead.
"""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.batch import BatchSolution, newton_batch
from rig.estimation.gyroscope.vector_model import VectorBatch, solve_vector_batch
from rig.study import simulation as sim
from rig.study.report import Finding, Report, Settings, table
from rig.study.work import in_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOUNTING_DEG = (0.0, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0)
SKEW_DEG = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0)
# What is varied, through which angles, and how far askew the sensor is mounted meanwhile (None: by these angles).
SWEEPS: dict[str, tuple[tuple[float, ...], float | None]] = {
    "mounting": (MOUNTING_DEG, None),
    "non-orthogonality, mounted straight": (SKEW_DEG, 0.0),
    "non-orthogonality, mounted 5.7° askew": (SKEW_DEG, 5.7),  # SIX's 10 %
}
ESTIMATORS = ("six_observation", "vector_model")
NOISES_RAD_S = (0.0, sim.NOISE_LEVELS_RAD_S[0])


def study(settings: Settings) -> Report:
    """30 gyroscopes × 500 mountings at each angle, 60°/s, noise 0.035 rad/s, and once more without noise."""
    task = partial(_errors_of_one_gyroscope, settings.runs or sim.RUNS)
    squares = np.mean(in_parallel(task, range(sim.SETS), settings), axis=0)  # (sweeps, angles, noises, estimators, 2)
    rows = [
        {
            "varied": varied,
            "angle_deg": angle,
            "noise_rad_s": noise,
            "estimator": estimator,
            "scale_rms_percent": 100 * float(np.sqrt(squares[v, a, n, e, 0])),
            "bias_rms_rad_s": float(np.sqrt(squares[v, a, n, e, 1])),
        }
        for v, (varied, (angles, _)) in enumerate(SWEEPS.items())
        for a, angle in enumerate(angles)
        for n, noise in enumerate(NOISES_RAD_S)
        for e, estimator in enumerate(ESTIMATORS)
    ]
    return Report(table(rows), _findings(rows), partial(_draw, rows), (13.0, 5.0))


def _errors_of_one_gyroscope(runs: int, rng: np.random.Generator, _: int) -> Array:
    """Mean squares (sweeps, angles, noises, estimators, 2) of relative scale errors and of bias errors."""
    scale, bias = sim.NORMAL.draw(rng)
    squares = np.empty((len(SWEEPS), len(SKEW_DEG), len(NOISES_RAD_S), len(ESTIMATORS), 2))
    for v, (angles, askew) in enumerate(SWEEPS.values()):
        for a, angle in enumerate(angles):
            mounting = _mounted(rng, runs, angle if askew is None else askew)
            skew = None if askew is None else _skewed(rng, runs, np.radians(angle))
            F = sim.sensitivity(scale, mounting, skew)
            for n, noise in enumerate(NOISES_RAD_S):
                sweep = sim.whole_turn(sim.ARM_RAD_S, noise)
                means = sim.mean_readings(rng, F, bias, sweep)
                rates = sweep.speed_rad_s * sim.DIRECTIONS
                solved: tuple[BatchSolution | VectorBatch, ...] = (
                    newton_batch(means, sweep.speed_rad_s),
                    solve_vector_batch(means, rates, np.ones((6, 3))),
                )
                for e, estimate in enumerate(solved):
                    squares[v, a, n, e] = (
                        np.mean((estimate.scale / scale - 1) ** 2),
                        np.mean((estimate.bias_rad_s - bias) ** 2),
                    )
    return squares


def _mounted(rng: np.random.Generator, runs: int, angle_deg: float) -> Array:
    """Rotations (runs, 3, 3) by exactly this angle about any axis."""
    from scipy.spatial.transform import Rotation

    axis = rng.normal(size=(runs, 3))
    axis *= np.radians(angle_deg) / np.linalg.norm(axis, axis=1, keepdims=True)
    return np.asarray(Rotation.from_rotvec(axis).as_matrix(), dtype=np.float64)


def _skewed(rng: np.random.Generator, runs: int, angle_rad: float) -> Array:
    """Unit axes as rows (runs, 3, 3), all three angles off 90° by `angle_rad` either way; x straight, y in x–y."""
    sines = np.sin(angle_rad) * rng.choice([-1.0, 1.0], size=(runs, 3))
    gram = np.broadcast_to(np.eye(3), (runs, 3, 3)).copy()
    for pair, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        gram[:, i, j] = gram[:, j, i] = sines[:, pair]
    return np.asarray(np.linalg.cholesky(gram), dtype=np.float64)


def _findings(rows: list[dict[str, Any]]) -> tuple[Finding, ...]:
    found = []
    for row in rows:
        shown = row["angle_deg"] == 20.0 if row["varied"] == "mounting" else row["angle_deg"] in (1.0, 2.0)
        if shown and row["noise_rad_s"] == 0:
            name = f"RMS scale error without noise, {row['estimator']}, {row['varied']} {row['angle_deg']:g}°"
            found.append(Finding(name, row["scale_rms_percent"], "%"))
    return tuple(found)


def _draw(rows: list[dict[str, Any]], figure: "Figure") -> None:
    panels = figure.subplots(1, len(SWEEPS), sharey=True)
    for panel, varied in zip(panels, SWEEPS, strict=True):
        for estimator, colour in zip(ESTIMATORS, ("tab:blue", "tab:orange"), strict=True):
            for noise, style in zip(NOISES_RAD_S, ("--", "-"), strict=True):
                chosen = [
                    row
                    for row in rows
                    if row["varied"] == varied and row["estimator"] == estimator and row["noise_rad_s"] == noise
                ]
                text = f"{estimator.replace('_', ' ')}, " + (f"noise {noise:g} rad/s" if noise else "no noise")
                values = [row["scale_rms_percent"] for row in chosen]
                panel.plot([row["angle_deg"] for row in chosen], values, style, color=colour, marker="o", label=text)
        panel.set(xlabel="mounting error, °" if varied == "mounting" else "each axis pair off 90° by, °", title=varied)
        panel.set_yscale("symlog", linthresh=1e-2)
    panels[0].set_ylabel("RMS error of the scale factors, %")
    panels[0].legend()
