"""Errors of the six-observation method and of the vector model against mounting error and non-orthogonality.

Six averaged sweeps determine only ‖K (m + b)‖, so the sensor's mounting does not matter, but its axes must be
orthogonal: their non-orthogonality changes the scale factors. The change is of second order if the sensor is mounted
straight, otherwise it is of the order of the non-orthogonality times the mounting error. The vector model estimates
both angles.
"""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation_batch import BatchSolution, newton_batch
from rig.estimation.gyroscope.vector_model import VectorBatch, solve_vector_batch
from rig.study import simulation as sim
from rig.study.study_report import Settings, StudyFinding, StudyReport, table
from rig.study.work import run_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOUNTING_DEG = (0.0, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0)
SKEW_DEG = (0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0)
# The varied quantity, its angles, and the mounting error (None: the varied quantity itself).
SWEEPS: dict[str, tuple[tuple[float, ...], float | None]] = {
    "mounting": (MOUNTING_DEG, None),
    "non-orthogonality, mounted straight": (SKEW_DEG, 0.0),
    "non-orthogonality, mounted 5.7° askew": (SKEW_DEG, 5.7),  # SIX's 10 %
}
ESTIMATORS = ("six_observation", "vector_model")
NOISES_RAD_S = (0.0, sim.NOISE_LEVELS_RAD_S[0])


def study(settings: Settings) -> StudyReport:
    """Simulate 30 gyroscopes × 500 mountings at each angle, 60°/s, noise 0.035 rad/s, and again without noise."""
    task = partial(_simulate_gyroscope, settings.runs or sim.RUNS)
    squares = np.mean(run_parallel(task, range(sim.SETS), settings), axis=0)  # (sweeps, angles, noises, estimators, 2)
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
    return StudyReport(table(rows), _findings(rows), partial(_draw, rows), (13.0, 5.0))


def _simulate_gyroscope(runs: int, rng: np.random.Generator, _: int) -> Array:
    """Return mean squares of relative scale errors and of bias errors, (sweeps, angles, noises, estimators, 2)."""
    scale, bias = sim.NORMAL.draw(rng)
    squares = np.empty((len(SWEEPS), len(SKEW_DEG), len(NOISES_RAD_S), len(ESTIMATORS), 2))
    for v, (angles, askew) in enumerate(SWEEPS.values()):
        for a, angle in enumerate(angles):
            mounting = _draw_mountings(rng, runs, angle if askew is None else askew)
            skew = None if askew is None else _draw_axes(rng, runs, np.radians(angle))
            F = sim.build_sensitivity(scale, mounting, skew)
            for n, noise in enumerate(NOISES_RAD_S):
                sweep = sim.build_whole_turn(sim.ARM_SPEED_RAD_S, noise)
                means = sim.draw_mean_readings(rng, F, bias, sweep)
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


def _draw_mountings(rng: np.random.Generator, runs: int, angle_deg: float) -> Array:
    """Draw rotations (runs, 3, 3) by exactly this angle about random axes."""
    from scipy.spatial.transform import Rotation

    axis = rng.normal(size=(runs, 3))
    axis *= np.radians(angle_deg) / np.linalg.norm(axis, axis=1, keepdims=True)
    return np.asarray(Rotation.from_rotvec(axis).as_matrix(), dtype=np.float64)


def _draw_axes(rng: np.random.Generator, runs: int, angle_rad: float) -> Array:
    """Draw unit axes as rows (runs, 3, 3), all three angles ±`angle_rad` from 90°; x unchanged, y in the x–y plane."""
    sines = np.sin(angle_rad) * rng.choice([-1.0, 1.0], size=(runs, 3))
    gram = np.broadcast_to(np.eye(3), (runs, 3, 3)).copy()
    for pair, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        gram[:, i, j] = gram[:, j, i] = sines[:, pair]
    return np.asarray(np.linalg.cholesky(gram), dtype=np.float64)


def _findings(rows: list[dict[str, Any]]) -> tuple[StudyFinding, ...]:
    findings = []
    for row in rows:
        is_reported = row["angle_deg"] == 20.0 if row["varied"] == "mounting" else row["angle_deg"] in (1.0, 2.0)
        if is_reported and row["noise_rad_s"] == 0:
            name = f"RMS scale error without noise, {row['estimator']}, {row['varied']} {row['angle_deg']:g}°"
            findings.append(StudyFinding(name, row["scale_rms_percent"], "%"))
    return tuple(findings)


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
