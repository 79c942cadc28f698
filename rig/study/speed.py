"""Fig. 4 of the paper SIX: mean squared error of the parameters against the speed of the sweeps.

In the paper the biases' error is the same at every speed. This needs the same number of samples in every sweep, whereas
a slower revolution has more samples. Both cases are shown: `whole_turn` samples one revolution at 200 Hz,
`fixed_samples` takes as many samples as a revolution at 3 rad/s has.
"""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation_batch import newton_batch
from rig.study import simulation as sim
from rig.study.study_report import Settings, StudyFinding, StudyReport, table
from rig.study.work import run_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SPEEDS_RAD_S = np.round(np.arange(0.3, 3.05, 0.1), 1)
DURATIONS: dict[str, Callable[[float], int]] = {
    "whole_turn": sim.count_turn_samples,
    "fixed_samples": lambda speed_rad_s: sim.count_turn_samples(sim.FAST_SPEED_RAD_S),
}


def study(settings: Settings) -> StudyReport:
    """Simulate 30 gyroscopes × 500 runs at each speed and noise level."""
    task = partial(_simulate_gyroscope, settings.runs or sim.RUNS)
    squares = np.mean(run_parallel(task, range(sim.SETS), settings), axis=0)  # (durations, noises, speeds, 2)
    rows = [
        {
            "samples": duration,
            "noise_rad_s": noise,
            "speed_rad_s": float(speed),
            "scale_mse": float(squares[d, n, s, 0]),
            "bias_mse_rad2_s2": float(squares[d, n, s, 1]),
            "mean_of_both": float(squares[d, n, s].mean()),
        }
        for d, duration in enumerate(DURATIONS)
        for n, noise in enumerate(sim.NOISE_LEVELS_RAD_S)
        for s, speed in enumerate(SPEEDS_RAD_S)
    ]
    return StudyReport(table(rows), _findings(rows), partial(_draw, rows), (12.0, 5.5))


def _simulate_gyroscope(runs: int, rng: np.random.Generator, _: int) -> Array:
    """Return mean squared errors of scale factors and biases, (durations, noises, speeds, 2)."""
    scale, bias = sim.NORMAL.draw(rng)
    F = sim.build_sensitivity(scale, sim.draw_mountings(rng, runs))
    squares = np.empty((len(DURATIONS), len(sim.NOISE_LEVELS_RAD_S), len(SPEEDS_RAD_S), 2))
    for d, samples in enumerate(DURATIONS.values()):
        for n, noise in enumerate(sim.NOISE_LEVELS_RAD_S):
            for s, speed in enumerate(SPEEDS_RAD_S):
                sweep = sim.SimulatedSweep(speed, noise, samples(speed))
                solved = newton_batch(sim.draw_mean_readings(rng, F, bias, sweep), speed)
                squares[d, n, s] = np.mean((solved.scale - scale) ** 2), np.mean((solved.bias_rad_s - bias) ** 2)
    return squares


def _findings(rows: list[dict[str, Any]]) -> tuple[StudyFinding, ...]:
    """Return the slopes of the doubly logarithmic plot: errors are powers of the speed; the paper says exponentials."""
    findings = []
    for duration in DURATIONS:
        chosen = [row for row in rows if row["samples"] == duration and row["noise_rad_s"] == sim.NOISE_LEVELS_RAD_S[0]]
        for column, name, published in (("scale_mse", "scale", None), ("bias_mse_rad2_s2", "bias", 0.0)):
            slope = np.polyfit(np.log(SPEEDS_RAD_S), np.log([row[column] for row in chosen]), 1)[0]
            findings.append(StudyFinding(f"power of speed in the {name} MSE, {duration}", float(slope), "1", published))
        mse = {row["speed_rad_s"]: row["mean_of_both"] for row in chosen}
        findings.append(
            StudyFinding(f"mean MSE at 0.3 rad/s over that at 1 rad/s, {duration}", mse[0.3] / mse[1.0], "1")
        )
        findings.append(StudyFinding(f"mean MSE at 1 rad/s over that at 3 rad/s, {duration}", mse[1.0] / mse[3.0], "1"))
    return tuple(findings)


def _draw(rows: list[dict[str, Any]], figure: "Figure") -> None:
    """Draw the errors over the speed, for one revolution and for a fixed number of samples."""
    panels = figure.subplots(1, 2, sharey=True)
    styles = {"whole_turn": "-", "fixed_samples": "--"}
    series = {"scale_mse": ("scale factors (1)", "tab:blue"), "bias_mse_rad2_s2": ("biases (rad²/s²)", "tab:orange")}
    for panel, noise in zip(panels, sim.NOISE_LEVELS_RAD_S, strict=True):
        for duration, style in styles.items():
            chosen = [row for row in rows if row["samples"] == duration and row["noise_rad_s"] == noise]
            for column, (label, colour) in series.items():
                values = [row[column] for row in chosen]
                text = f"{label}, {duration.replace('_', ' ')}"
                panel.plot(SPEEDS_RAD_S, values, style, color=colour, label=text, marker=".", markersize=4)
        panel.set(title=f"noise {noise:g} rad/s", xlabel="speed of the sweeps, rad/s", yscale="log")
    panels[0].set_ylabel("mean squared error")
    panels[0].legend()
    figure.suptitle("SIX Fig. 4: error against speed; SIX has the biases level, as with a fixed number of samples")
