"""Eq. (8) of the paper SIX: squaring every sample before averaging, against averaging the revolution before squaring.

Taken literally, Eq. (8) averages the squares of the readings. The mean of squares contains the variance σ² of the noise
on all three axes, and that of the vibration along the turn (a fraction ε = 0.05 of the speed ω). The estimated scale
factors k therefore shrink by about 3 k² σ² / (2 ω²) + ε²/2.
"""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation import design
from rig.study import simulation as sim
from rig.study.study_report import Settings, StudyFinding, StudyReport, table
from rig.study.work import run_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOISES_RAD_S = (0.01, 0.02, 0.035, 0.05, 0.07, 0.1, 0.15, 0.2)
ORDERS = ("mean_then_square", "square_then_mean")  # of averaging the readings and squaring them


def study(settings: Settings) -> StudyReport:
    """Compare the errors of a calibration by either order, squaring or averaging first, at each noise level.

    30 gyroscopes are simulated, by default in 500 runs each, with sweeps at 60°/s that are sampled at 200 Hz.
    """
    task = partial(_simulate_gyroscope, settings.runs or sim.RUNS)
    errors = np.concatenate(run_parallel(task, range(sim.SETS), settings), axis=2)  # (noises, orders, all runs, 6)
    rows: list[dict[str, Any]] = [
        {
            "noise_rad_s": noise,
            "order": order,
            "scale_bias_percent": 100 * float(errors[n, o, :, :3].mean()),
            "scale_rms_percent": 100 * float(np.sqrt(np.mean(errors[n, o, :, :3] ** 2))),
            "bias_rms_rad_s": float(np.sqrt(np.mean(errors[n, o, :, 3:] ** 2))),
        }
        for n, noise in enumerate(NOISES_RAD_S)
        for o, order in enumerate(ORDERS)
    ]
    findings = tuple(
        StudyFinding(
            f"mean error of the scale factor, {row['order']}, noise {noise:g} rad/s", row["scale_bias_percent"], "%"
        )
        for noise in sim.NOISE_LEVELS_RAD_S
        for row in rows
        if row["noise_rad_s"] == noise
    )
    return StudyReport(table(rows), findings, partial(_draw, rows), (10.0, 5.0))


def _simulate_gyroscope(runs: int, rng: np.random.Generator, _: int) -> Array:
    """Return relative errors of scale factors and errors of biases in rad/s, (noises, orders, runs, 6).

    The first of the two orders is to average the readings and then to square them, the second is the reverse."""
    scale, bias = sim.NORMAL.draw(rng)
    F = sim.build_sensitivity(scale, sim.draw_mountings(rng, runs))
    errors = np.empty((len(NOISES_RAD_S), len(ORDERS), runs, 6))
    for n, noise in enumerate(NOISES_RAD_S):
        means, squares = sim.draw_means_and_squares(rng, F, bias, sim.build_whole_turn(sim.ARM_SPEED_RAD_S, noise))
        for o, x in enumerate((design(means), np.concatenate([squares, means], axis=-1))):
            k, b = _solve_closed_form(x, sim.ARM_SPEED_RAD_S)
            errors[n, o] = np.concatenate([k / scale - 1, b - bias], axis=-1)
    return errors


def _solve_closed_form(x: Array, speed_rad_s: float) -> tuple[Array, Array]:
    """Return scale factors and biases (runs, 3) from designs (runs, 6, 6) of squared averages or averaged squares."""
    q = np.linalg.solve(x, np.ones((*x.shape[:-1], 1)))[..., 0]
    total = np.sum(q[:, 3:] ** 2 / (4 * q[:, :3]), axis=1, keepdims=True)
    beta = speed_rad_s**2 / (1 + total) * q
    return np.sqrt(beta[:, :3]), beta[:, 3:] / (2 * beta[:, :3])


def _draw(rows: list[dict[str, Any]], figure: "Figure") -> None:
    panel = figure.subplots()
    for order, label in zip(ORDERS, ("average, then square (the rig)", "square, then average (Eq. 8)"), strict=True):
        chosen = [row for row in rows if row["order"] == order]
        noises = [row["noise_rad_s"] for row in chosen]
        panel.plot(noises, [row["scale_bias_percent"] for row in chosen], "o-", label=label)
    noise = np.linspace(0, 0.2)
    expected = -50 * (3 * noise**2 / sim.ARM_SPEED_RAD_S**2 + sim.VIBRATION_FRACTION**2)  # in %
    panel.plot(noise, expected, "k:", label="−(3 σ²/ω² + ε²) / 2")
    panel.set(xlabel="noise of one sample, rad/s", ylabel="mean error of the scale factor, %")
    panel.set_title("averaging and squaring at 60°/s, 200 Hz")
    panel.legend()
