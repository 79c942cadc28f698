"""Figs. 2 and 5 of the paper SIX: error bands of 30 gyroscopes × 500 runs under normal and extreme conditions."""

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.levenberg_marquardt import solve_levenberg_marquardt
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.estimation.gyroscope.six_observation_batch import algorithm_1_batch
from rig.study import simulation as sim
from rig.study.study_report import Settings, StudyFinding, StudyReport, table
from rig.study.work import run_parallel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# (scale factors, biases in rad/s) by noise level: "the majority of estimations had an error within ±…", sections III-A
# and III-C. The latter states one band for both.
PUBLISHED = {
    "normal": {0.035: (9.3e-4, 3.0e-3), 0.2: (5.4e-3, 1.7e-2)},
    "extreme": {0.035: (3.0e-3, 3.0e-3), 0.2: (1.8e-2, 1.8e-2)},
}
SPEEDS = {"3 rad/s": sim.FAST_SPEED_RAD_S, "60°/s": sim.ARM_SPEED_RAD_S}
WHISKER = 1.5  # length of a box plot's whiskers, in interquartile ranges


@dataclass(frozen=True, slots=True)
class _Condition:
    speed: str
    noise_rad_s: float
    vibration: sim.Vibration
    estimator: str


def _list_conditions() -> list[_Condition]:
    """Return all conditions: at each speed and noise both estimators, and Algorithm 1 again with white vibration."""
    kinds: tuple[tuple[sim.Vibration, str], ...] = (
        ("whole_turns", "algorithm_1"),
        ("whole_turns", "levenberg_marquardt"),
        ("white", "algorithm_1"),
    )
    return [_Condition(speed, noise, *kind) for speed in SPEEDS for noise in sim.NOISE_LEVELS_RAD_S for kind in kinds]


def normal(settings: Settings) -> StudyReport:
    """Reproduce Fig. 2 of the paper SIX: scale factors U(0.8, 1.2), biases U(−0.1, 0.1) rad/s."""
    return _study(sim.NORMAL, settings)


def extreme(settings: Settings) -> StudyReport:
    """Reproduce Fig. 5 of the paper SIX: scale factors U(1.2, 2), biases ±U(0.1, 0.2) rad/s."""
    return _study(sim.EXTREME, settings)


def _study(population: sim.Population, settings: Settings) -> StudyReport:
    """Return the report of a study of all conditions for one population of gyroscopes."""
    task = partial(_simulate_gyroscope, population, settings.runs or sim.RUNS)
    errors = np.concatenate(run_parallel(task, range(sim.SETS), settings), axis=1)  # (conditions, all runs, 6)
    rows = [
        {
            "speed_rad_s": SPEEDS[condition.speed],
            "noise_rad_s": condition.noise_rad_s,
            "vibration": condition.vibration,
            "estimator": condition.estimator,
            "parameter": parameter,
            "unit": "1" if column < 3 else "rad/s",
            **_summarise(errors[i, :, column]),
            "published_band": PUBLISHED[population.name][condition.noise_rad_s][column // 3],
        }
        for i, condition in enumerate(_list_conditions())
        for column, parameter in enumerate(PARAMETERS)
    ]
    columns = table(rows)
    return StudyReport(columns, _findings(rows), partial(_draw, population, rows), (12.0, 8.0))


def _simulate_gyroscope(population: sim.Population, runs: int, rng: np.random.Generator, _: int) -> Array:
    """Return estimated minus true parameters (conditions, runs, 6); both estimators use the same readings."""
    scale, bias = population.draw(rng)
    truth = np.concatenate([scale, bias])
    mounting = sim.draw_mountings(rng, runs)
    means: dict[tuple[str, float, str], Array] = {}
    errors = []
    for condition in _list_conditions():
        key = (condition.speed, condition.noise_rad_s, condition.vibration)
        speed = SPEEDS[condition.speed]
        if key not in means:
            sweep = sim.build_whole_turn(speed, condition.noise_rad_s, condition.vibration)
            means[key] = sim.draw_mean_readings(rng, sim.build_sensitivity(scale, mounting), bias, sweep)
        solve = _solve_algorithm_1 if condition.estimator == "algorithm_1" else _solve_levenberg_marquardt
        errors.append(solve(means[key], sim.build_whole_turn(speed, condition.noise_rad_s)) - truth)
    return np.array(errors)


def _solve_algorithm_1(means: Array, sweep: sim.SimulatedSweep) -> Array:
    solved = algorithm_1_batch(means, sweep.speed_rad_s)
    return np.concatenate([solved.scale, solved.bias_rad_s], axis=-1)


def _solve_levenberg_marquardt(means: Array, sweep: sim.SimulatedSweep) -> Array:
    speeds, variances = np.full(6, sweep.speed_rad_s), np.full((6, 3), sweep.variance_rad2_s2)
    solved = [solve_levenberg_marquardt(mean, speeds, variances, weighted=False) for mean in means]
    return np.array([np.concatenate([solution.scale, solution.bias_rad_s]) for solution in solved])


def _summarise(errors: Array) -> dict[str, float]:
    """Return a box plot's numbers: quartiles, and whiskers at the last errors within 1.5 interquartile ranges."""
    low, median, high = np.percentile(errors, [25, 50, 75])
    reach = WHISKER * (high - low)
    inside = errors[(errors >= low - reach) & (errors <= high + reach)]
    return {
        "median": float(median),
        "quartile_1": float(low),
        "quartile_3": float(high),
        "whisker_low": float(inside.min()),
        "whisker_high": float(inside.max()),
        "std": float(errors.std()),
    }


def _findings(rows: list[dict[str, Any]]) -> tuple[StudyFinding, ...]:
    """Return the width of each error band, and how far the two estimators differ."""
    findings = []
    for condition in _list_conditions():
        if condition.estimator != "algorithm_1":
            continue
        for group, first, unit in (("scale", "k", "1"), ("bias", "b", "rad/s")):
            group_rows = [row for row in _select(rows, condition) if row["parameter"].startswith(first)]
            band = np.mean([(row["whisker_high"] - row["whisker_low"]) / 2 for row in group_rows])
            name = f"{group} band, {condition.speed}, noise {condition.noise_rad_s:g} rad/s, {condition.vibration}"
            findings.append(StudyFinding(name, float(band), unit, group_rows[0]["published_band"]))
    ratios = [
        abs(a["std"] - b["std"]) / a["std"]
        for speed in SPEEDS
        for noise in sim.NOISE_LEVELS_RAD_S
        for a, b in zip(
            _select(rows, _Condition(speed, noise, "whole_turns", "algorithm_1")),
            _select(rows, _Condition(speed, noise, "whole_turns", "levenberg_marquardt")),
            strict=True,
        )
    ]
    findings.append(
        StudyFinding("largest difference of std, Algorithm 1 and Levenberg–Marquardt", max(ratios), "relative")
    )
    return tuple(findings)


def _select(rows: list[dict[str, Any]], condition: _Condition) -> list[dict[str, Any]]:
    """Return the rows of one condition."""
    return [
        row
        for row in rows
        if row["speed_rad_s"] == SPEEDS[condition.speed]
        and row["noise_rad_s"] == condition.noise_rad_s
        and row["vibration"] == condition.vibration
        and row["estimator"] == condition.estimator
    ]


def _draw(population: sim.Population, rows: list[dict[str, Any]], figure: "Figure") -> None:
    panels = figure.subplots(len(sim.NOISE_LEVELS_RAD_S), 3, sharey="row")
    kinds = (
        ("3 rad/s", "levenberg_marquardt", "Levenberg–Marquardt, 3 rad/s"),
        ("3 rad/s", "algorithm_1", "Algorithm 1, 3 rad/s"),
        ("60°/s", "algorithm_1", "Algorithm 1, 60°/s"),
    )
    for row_of_panels, noise in zip(panels, sim.NOISE_LEVELS_RAD_S, strict=True):
        for panel, (speed, estimator, title) in zip(row_of_panels, kinds, strict=True):
            _draw_boxes(panel, _select(rows, _Condition(speed, noise, "whole_turns", estimator)))
            panel.set_title(f"{title}\nnoise {noise:g} rad/s")
        row_of_panels[0].set_ylabel("estimated − true\n(scale factors: 1, biases: rad/s)")
    panels[0, 0].legend(loc="upper left")
    figure.suptitle(f"{population.name} conditions: {sim.SETS} gyroscopes, boxes with whiskers at 1.5 boxes")


def _draw_boxes(panel: "Axes", rows: list[dict[str, Any]]) -> None:
    boxes = [
        {
            "med": row["median"],
            "q1": row["quartile_1"],
            "q3": row["quartile_3"],
            "whislo": row["whisker_low"],
            "whishi": row["whisker_high"],
            "label": row["parameter"],
        }
        for row in rows
    ]
    panel.bxp(boxes, showfliers=False, medianprops={"color": "tab:orange"})
    for first, band in ((1, rows[0]["published_band"]), (4, rows[3]["published_band"])):
        label = "published band, SIX" if first == 1 else None
        panel.fill_between([first - 0.45, first + 2.45], -band, band, color="tab:blue", alpha=0.2, label=label)
