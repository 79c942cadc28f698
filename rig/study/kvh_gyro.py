"""Section III-A of the paper TRIAX: a fiber-optic gyroscope on an oscillating rate table; Earth's rate; bias by repeat.

The paper reports residuals of up to 0.0475 °/s and considers them consistent with the angle random walk of 0.012 °/√h,
but at 25 Hz that random walk gives 0.001 °/s. The remainder must be the table's vibration, as the paper suspects for
the x axis. Both levels are simulated, as white noise: `random_walk` and `residual`.
"""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import KnownVector
from rig.estimation.reference.triaxial import solve_triaxial
from rig.study import rate_table as rt
from rig.study.study_report import Settings, StudyFinding, StudyReport, table
from rig.study.work import run_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DURATION_S = 1200.0  # not stated by TRIAX, whose Fig. 2 shows a motion of minutes
RUNS = 20
NOISES_RAD_S = {
    "random_walk": rt.GYRO_RANDOM_WALK * np.sqrt(rt.RATE_HZ),
    "residual": rt.GYRO_RESIDUAL_RAD_S,
}
TRUTH = np.concatenate([rt.GYRO_MATRIX.ravel(), rt.GYRO_REFERENCE_RAD_S, rt.GYRO_BIAS_RAD_S])
PARAMETERS = {
    **{f"F{i}{j}": ("1", 1.0) for i in "xyz" for j in "xyz"},
    **{f"earth_rate_{i}": ("deg/h", rt.DEG_H) for i in "xyz"},
    **{f"bias_{i}": ("deg/h", rt.DEG_H) for i in "xyz"},
}


def study(settings: Settings) -> StudyReport:
    """Simulate the calibration in oscillation, 20 times at either noise, and ten repeats of ten attitudes at rest."""
    rows: list[dict[str, Any]] = []
    findings = []
    for kind, noise in NOISES_RAD_S.items():
        solved = run_parallel(partial(_calibrate, noise), range(settings.runs or RUNS), settings)
        estimates = np.array([theta for theta, _, _ in solved])
        kind_rows = rt.build_parameter_rows(kind, PARAMETERS, TRUTH, estimates, solved[0][1])
        rows += kind_rows
        norms = np.linalg.norm(estimates[:, 9:12], axis=1) / rt.DEG_H
        residual = np.degrees(np.max([residual for _, _, residual in solved]))
        norm_std = float(norms.std(ddof=1))
        findings.extend(
            [
                StudyFinding(f"largest residual std, {kind}", float(residual), "deg/s", 0.0475),
                StudyFinding(f"norm of the Earth's rate, {kind}, mean", float(norms.mean()), "deg/h", 15.4035),
                StudyFinding(f"norm of the Earth's rate, {kind}, std of one calibration", norm_std, "deg/h"),
                StudyFinding(f"largest error of F, {kind}", float(np.abs(estimates[0, :9] - TRUTH[:9]).max()), "1"),
            ]
        )
    true_norm = rt.EARTH_RATE_RAD_S / rt.DEG_H
    printed = float(np.linalg.norm(rt.GYRO_REFERENCE_RAD_S)) / rt.DEG_H
    drift = _simulate_drift(settings.seed)
    findings.extend(
        [
            StudyFinding("printed Earth rate against 7.2921159e-5 rad/s", 100 * (printed / true_norm - 1), "%", 2.69),
            StudyFinding("printed Earth rate against 15 deg/h", 100 * (printed / 15 - 1), "%", 2.69),
            *rt.find_drift_errors(drift, "deg_h", "deg/h"),
        ]
    )
    return StudyReport(table(rows), tuple(findings), partial(_draw, rows, drift), (12.0, 5.0))


def _calibrate(noise_rad_s: float, rng: np.random.Generator, _: int) -> tuple[Array, Array, float]:
    """Return the parameters θ (15,), their stds, and the std of the corrected readings' errors on the worst axis."""
    attitudes, rates = rt.simulate_oscillation(DURATION_S)
    truth = rt.project(attitudes, rt.GYRO_REFERENCE_RAD_S) + rates
    readings = truth @ rt.GYRO_MATRIX.T + rt.GYRO_BIAS_RAD_S + noise_rad_s * rng.normal(size=truth.shape)
    solved = solve_triaxial(readings, attitudes, np.full(readings.shape, noise_rad_s**2), KnownVector(rates))
    corrected = (readings - solved.bias) @ np.linalg.inv(solved.matrix).T
    theta = np.concatenate([solved.matrix.ravel(), solved.reference, solved.bias])
    return theta, np.sqrt(np.diag(solved.covariance)), float((corrected - truth).std(axis=0).max())


def _simulate_drift(seed: int) -> list[dict[str, Any]]:
    """Return repeats as in the paper's Fig. 4, with a bias below 1 deg/h, which steps by 0.1 deg/h every hour."""
    sensor = rt.DriftingSensor(
        rt.GYRO_MATRIX,
        rt.GYRO_REFERENCE_RAD_S * (rt.EARTH_RATE_RAD_S / np.linalg.norm(rt.GYRO_REFERENCE_RAD_S)),
        np.zeros(3),
        rt.GYRO_BIAS_RAD_S,
        np.repeat([0.0, 0.1 * rt.DEG_H], [1, rt.REPEATS - 1]),
        rt.GYRO_RANDOM_WALK,
    )
    return sensor.simulate_repeats(np.random.default_rng([seed, rt.REPEATS]), rt.DEG_H, "deg_h")


def _draw(rows: list[dict[str, Any]], drift: list[dict[str, Any]], figure: "Figure") -> None:
    """Draw the errors of the Earth's rate and bias at both noise levels, and the bias by repeat."""
    first, second = figure.subplots(1, 2)
    chosen = [row for row in rows if row["unit"] == "deg/h"]
    names = list(dict.fromkeys(row["parameter"] for row in chosen))
    for shift, kind, colour in ((-0.12, "random_walk", "tab:blue"), (0.12, "residual", "tab:orange")):
        noise_rows = [row for row in chosen if row["noise"] == kind]
        first.errorbar(
            np.arange(len(names)) + shift,
            [row["mean_estimate"] - row["true"] for row in noise_rows],
            [row["std_over_runs"] for row in noise_rows],
            fmt="o",
            color=colour,
            label=f"noise {np.degrees(NOISES_RAD_S[kind]):.4f} °/s ({kind.replace('_', ' ')})",
        )
    first.set_xticks(range(len(names)), [name.replace("_", " ") for name in names], rotation=30)
    first.set(ylabel="estimated − true, deg/h; bars: σ of one calibration")
    first.set_title(f"swinging for {DURATION_S / 60:.0f} min, 25 Hz")
    first.legend()
    rt.draw_drift(second, drift, "deg_h", 1.0, "bias, deg/h")
    second.set_title("TRIAX Fig. 4: bias by repeat")
