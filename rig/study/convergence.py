"""Table I of the paper SIX: passes of Algorithm 1, and the bias at which the algorithm stops converging.

β0 = Σ k² b² is the constant of the paper's Eq. (4) for scale factors k and biases b, ω the speed. The first pass omits
β0; without noise it gives k₁² = k² / (1 − β0/ω²), and already the right biases. So the first line of each example in
Table I determines the speed, which the paper does not state. Each further pass multiplies the error by −Γ, with
Γ = β0 / (ω² − β0): k_n ≈ k (1 ± Γⁿ/2). So Algorithm 1 needs β0 < ω²/2 (at 1 rad/s this is the paper's "β0 < 0.5").
Table I counts passes until its four decimals stop changing, long before Σ|Δβ| ≤ 1e-6.
"""

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation_batch import algorithm_1_batch, newton_batch
from rig.study import simulation as sim
from rig.study.study_report import Settings, StudyFinding, StudyReport, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class _Example:
    """An example of Table I of the paper SIX: true parameters, and estimates after the last and the first pass."""

    scale: tuple[float, float, float]
    bias_rad_s: tuple[float, float, float]
    last_scale: tuple[float, float, float]
    last_bias_rad_s: tuple[float, float, float]
    first_scale: tuple[float, float, float]
    passes: int

    @property
    def speed_rad_s(self) -> float:
        """The speed ω for which the first pass gives Table I's values: ω² = β0 / (1 − (k/k₁)²); see the module."""
        scale, bias, first = np.array(self.last_scale), np.array(self.last_bias_rad_s), np.array(self.first_scale)
        missing = 1 - np.sum(scale**2) / np.sum(first**2)
        return float(np.sqrt(np.sum((scale * bias) ** 2) / missing))


TABLE_I = {
    "high scale factor error": _Example(
        (1.9074, 1.9529, 1.5635),
        (0.0827, 0.0265, -0.0805),
        (1.9071, 1.9539, 1.5640),
        (0.0822, 0.0243, -0.0797),
        (1.9102, 1.9571, 1.5665),
        2,
    ),
    "high bias": _Example(
        (1.0979, 1.1052, 0.9851),
        (-0.1046, 0.1995, 0.1565),
        (1.0962, 1.1036, 0.9840),
        (-0.1057, 0.1971, 0.1545),
        (1.1029, 1.1103, 0.9900),
        3,
    ),
    "high scale factor error and bias": _Example(
        (1.5044, 1.6494, 1.5282),
        (0.1483, -0.1282, 0.1794),
        (1.5055, 1.6523, 1.5304),
        (0.1469, -0.1285, 0.1803),
        (1.5173, 1.6652, 1.5423),
        3,
    ),
}
FOUR_DECIMALS = 5e-5
RATIOS = np.round(np.concatenate([np.arange(0.02, 0.48, 0.02), np.arange(0.48, 0.5301, 0.004), [0.7, 2, 8, 32]]), 3)


def study(settings: Settings) -> StudyReport:
    """Show the estimators' convergence without noise; no random numbers are drawn, so `settings` have no effect."""
    rows = []
    for name, example in TABLE_I.items():
        for speed in (sim.FAST_SPEED_RAD_S, example.speed_rad_s, sim.ARM_SPEED_RAD_S):
            rows.extend(_build_rows(name, np.array([example.scale]), np.array([example.bias_rad_s]), speed))
    growing = np.repeat(sim.ARM_SPEED_RAD_S * np.sqrt(RATIOS / 3)[:, None], 3, axis=1)
    rows.extend(_build_rows("growing bias", np.ones_like(growing), growing, sim.ARM_SPEED_RAD_S))
    return StudyReport(table(rows), _findings(rows), partial(_draw, rows), (10.0, 5.0))


def _build_rows(example: str, scale: Array, bias_rad_s: Array, speed_rad_s: float) -> list[dict[str, Any]]:
    """Return the convergence of both estimators, a row for each gyroscope."""
    means = speed_rad_s * sim.DIRECTIONS / scale[:, None] - bias_rad_s[:, None]
    published = algorithm_1_batch(means, speed_rad_s)
    newton = newton_batch(means, speed_rad_s)
    errors = np.concatenate([newton.scale - scale, newton.bias_rad_s - bias_rad_s], axis=1)
    ratios = np.sum((scale * bias_rad_s) ** 2, axis=1) / speed_rad_s**2
    return [
        {
            "example": example,
            "speed_rad_s": speed_rad_s,
            "beta0_over_speed_squared": float(ratio),
            "algorithm_1_converged": bool(published.converged[i]),
            "algorithm_1_passes": int(published.iterations[i]),
            "algorithm_1_passes_to_four_decimals": _count_passes(float(scale[i].max()), float(ratio)),
            "newton_steps": int(newton.iterations[i]),
            "newton_largest_error": float(np.abs(errors[i]).max()),
        }
        for i, ratio in enumerate(ratios)
    ]


def _count_passes(scale: float, ratio: float) -> int | None:
    """Return the number n of passes until four decimals of `scale` (1 ± `ratio`ⁿ/2) stay the same; None if never."""
    factor = ratio / (1 - ratio) if ratio < 0.5 else 1.0
    return None if factor == 1 else int(np.ceil(np.log(2 * FOUR_DECIMALS / scale) / np.log(factor)))


def _findings(rows: list[dict[str, Any]]) -> tuple[StudyFinding, ...]:
    findings = []
    for name, example in TABLE_I.items():
        findings.append(StudyFinding(f"speed that the first pass implies, {name}", example.speed_rad_s, "rad/s"))
        for row in rows:
            if row["example"] == name and row["speed_rad_s"] == example.speed_rad_s:
                passes = row["algorithm_1_passes_to_four_decimals"]
                findings.append(
                    StudyFinding(f"passes to four decimals at that speed, {name}", passes, "1", example.passes)
                )
                findings.append(StudyFinding(f"passes to Σ|Δβ| ≤ 1e-6, {name}", row["algorithm_1_passes"], "1"))
    growing = [row for row in rows if row["example"] == "growing bias"]
    last = max(row["beta0_over_speed_squared"] for row in growing if row["algorithm_1_converged"])
    worst = max(row["newton_largest_error"] for row in growing)
    findings.append(StudyFinding("largest β0/ω² at which Algorithm 1 converges", last, "1", 0.5))
    findings.append(StudyFinding("largest error of the closed form, β0/ω² up to 32", worst, "1 or rad/s"))
    return tuple(findings)


def _draw(rows: list[dict[str, Any]], figure: "Figure") -> None:
    panel = figure.subplots()
    growing = [row for row in rows if row["example"] == "growing bias" and row["beta0_over_speed_squared"] < 0.6]
    for converged, label, style in ((True, "converges", "o-"), (False, "diverges, stopped", "x")):
        chosen = [row for row in growing if row["algorithm_1_converged"] is converged]
        ratios = [row["beta0_over_speed_squared"] for row in chosen]
        panel.plot(ratios, [row["algorithm_1_passes"] for row in chosen], style, label=f"Algorithm 1 {label}")
    ratios = [row["beta0_over_speed_squared"] for row in growing]
    panel.plot(ratios, [row["newton_steps"] for row in growing], ".-", label="closed form with Newton: steps")
    panel.axvline(0.5, color="grey", linestyle="--", label="limit β0 = ω²/2")
    for row in rows:
        if row["example"] != "growing bias":
            panel.plot(row["beta0_over_speed_squared"], row["algorithm_1_passes"], "k+", markersize=10)
    panel.plot([], [], "k+", label="SIX Table I, at 3 rad/s, its implied speed and 60°/s")
    panel.set(xlabel="β0/ω²", ylabel="passes to Σ|Δβ| ≤ 1e-6", yscale="log", title="convergence of SIX, Algorithm 1")
    panel.legend()
