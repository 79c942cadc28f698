"""Section III-B of the paper TRIAX: an accelerometer at rest in attitudes, with second-order terms; bias by repeat."""

from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import TriaxialSolution, solve_triaxial
from rig.study import rate_table as rt
from rig.study.study_report import Settings, StudyFinding, StudyReport, table
from rig.study.work import run_parallel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REST_ATTITUDES, REST_S = 24, 60.0  # TRIAX states only N ≥ 5 attitudes
REST_SAMPLES = round(REST_S * rt.RATE_HZ)
RUNS = 500
TRUTH = np.concatenate(
    [
        rt.ACCELEROMETER_MATRIX.ravel(),
        rt.ACCELEROMETER_REFERENCE_M_S2,
        rt.ACCELEROMETER_BIAS_M_S2,
        rt.ACCELEROMETER_SECOND_ORDER,
    ]
)
PARAMETERS = {
    **{f"F{i}{j}": ("1", 1.0) for i in "xyz" for j in "xyz"},
    **{f"felt_gravity_{i}": ("m/s²", 1.0) for i in "xyz"},
    **{f"bias_{i}": ("mg", rt.MG) for i in "xyz"},
    **{f"second_order_{i}": ("1e-4 s²/m", 1e-4) for i in "xyz"},
}


def study(settings: Settings) -> StudyReport:
    """Simulate a calibration from 24 attitudes at rest, 500 times, and ten repeats of ten attitudes."""
    runs = range(settings.runs or RUNS)
    solved = run_parallel(_calibrate, runs, settings)
    estimates = np.array([theta for theta, _, _ in solved])
    rows = rt.build_parameter_rows("residual", PARAMETERS, TRUTH, estimates, solved[0][1])
    residuals = np.array([residual for _, _, residual in solved]) / rt.MG
    sample_noise = rt.ACCELEROMETER_RANDOM_WALK * np.sqrt(rt.RATE_HZ) / rt.MG
    drift = _simulate_drift(settings.seed)
    findings = (
        StudyFinding("largest residual std, with second-order terms", float(residuals[:, 0].mean()), "mg", 0.3901),
        StudyFinding(
            "largest mean residual of an attitude, with second-order terms", float(residuals[:, 1].mean()), "mg"
        ),
        StudyFinding("largest mean residual of an attitude, first order only", float(residuals[:, 2].mean()), "mg"),
        StudyFinding("noise of a sample at 25 Hz by the specified random walk", float(sample_noise), "mg", 0.3901),
        StudyFinding("largest error of F", float(np.abs(estimates[0, :9] - TRUTH[:9]).max()), "1"),
        StudyFinding(
            "largest error of the bias", float(np.abs(estimates[0, 12:15] - TRUTH[12:15]).max() / rt.MG), "mg"
        ),
        StudyFinding("norm of gravity", float(np.linalg.norm(estimates[0, 9:12])), "m/s²", rt.GRAVITY_M_S2),
        *rt.find_drift_errors(drift, "mg", "mg"),
    )
    return StudyReport(table(rows), findings, partial(_draw, rows, drift), (12.0, 5.0))


def _calibrate(rng: np.random.Generator, _: int) -> tuple[Array, Array, Array]:
    """Return the parameters θ (18,), their standard deviations (18,), and three numbers in m/s².

    The three are the largest standard deviation of corrected samples, and the largest residual of an attitude's mean,
    with second-order terms and without.
    """
    attitudes = rt.draw_attitudes(REST_ATTITUDES)
    force = rt.project(attitudes, rt.ACCELEROMETER_REFERENCE_M_S2)
    model = (force + rt.ACCELEROMETER_SECOND_ORDER * force**2) @ rt.ACCELEROMETER_MATRIX.T + rt.ACCELEROMETER_BIAS_M_S2
    noise = rt.ACCELEROMETER_RESIDUAL_M_S2 * rng.normal(size=(REST_ATTITUDES, REST_SAMPLES, 3))
    samples = model[:, None] + noise
    means = samples.mean(axis=1)
    full, first = _solve(means, attitudes, second_order=True), _solve(means, attitudes, second_order=False)
    predicted = means - full.residuals
    deviation = (samples - predicted[:, None]).reshape(-1, 3) @ np.linalg.inv(full.matrix).T
    residuals = np.array([deviation.std(axis=0).max(), np.abs(full.residuals).max(), np.abs(first.residuals).max()])
    return full.theta, np.sqrt(np.diag(full.covariance)), residuals


def _solve(means: Array, attitudes: Array, *, second_order: bool) -> TriaxialSolution:
    return solve_triaxial(
        means,
        attitudes,
        np.full(means.shape, rt.ACCELEROMETER_RESIDUAL_M_S2**2 / REST_SAMPLES),
        KnownNorm(float(np.linalg.norm(rt.ACCELEROMETER_REFERENCE_M_S2)), (0.0, 0.0, -1.0)),
        second_order=second_order,
    )


def _simulate_drift(seed: int) -> list[dict[str, Any]]:
    """Return repeats as in the paper's Fig. 6: a jump after the first repeat, then almost no change."""
    sensor = rt.DriftingSensor(
        rt.ACCELEROMETER_MATRIX,
        rt.ACCELEROMETER_REFERENCE_M_S2,
        rt.ACCELEROMETER_SECOND_ORDER,
        rt.ACCELEROMETER_BIAS_M_S2,
        np.repeat([0.0, 0.3 * rt.MG, 0.03 * rt.MG], [1, 1, rt.REPEATS - 2]),
        rt.ACCELEROMETER_RANDOM_WALK,
    )
    return sensor.simulate_repeats(np.random.default_rng([seed, rt.REPEATS]), rt.MG, "mg")


def _draw(rows: list[dict[str, Any]], drift: list[dict[str, Any]], figure: "Figure") -> None:
    first, second = figure.subplots(1, 2)
    positions = np.arange(len(rows))
    first.bar(positions, [row["std_over_runs"] / row["std_by_covariance"] for row in rows], color="tab:blue", alpha=0.7)
    first.axhline(1.0, color="k", linestyle="--", label="covariance as stated")
    first.set_xticks(positions, [row["parameter"].replace("_", " ") for row in rows], rotation=75, fontsize=7)
    first.set(ylabel="σ over runs / σ by covariance", title=f"{REST_ATTITUDES} attitudes of {REST_S:.0f} s, 25 Hz")
    first.legend(loc="lower right")
    rt.draw_drift(second, drift, "mg", 0.5, "bias, mg")
    second.set_title("TRIAX Fig. 6: bias by repeat")
