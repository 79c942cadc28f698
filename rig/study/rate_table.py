"""A simulated three-axis rate table with a KVH 1775 on it: the numbers of the paper TRIAX, and the table's motions."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import solve_triaxial
from rig.study.study_report import StudyFinding, table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

RATE_HZ = 25.0  # TRIAX, section III-A
REPEATS, ATTITUDES, AVERAGING_S = 10, 10, 360.0  # TRIAX, section III-A: ten repeats of ten attitudes, six minutes each

DEG_H = np.pi / 180 / 3600  # rad/s
EARTH_RATE_RAD_S = 7.2921159e-5
GYRO_MATRIX = np.array([[1.0004, 0.0007, 0.0007], [-0.0006, 1.0013, -0.0042], [-0.0013, 0.0044, 0.9997]])
GYRO_REFERENCE_RAD_S = np.array([-1.0755, -11.5266, -10.1612]) * DEG_H
GYRO_BIAS_RAD_S = np.array([-0.5434, 0.1925, -0.0279]) * DEG_H
GYRO_RANDOM_WALK = 0.012 * np.pi / 180 / 60  # rad/√s, from 0.012 °/√h
GYRO_RESIDUAL_RAD_S = 0.0475 * np.pi / 180

MG = 9.80665e-3  # m/s²
GRAVITY_M_S2 = 9.80061
ACCELEROMETER_MATRIX = np.array(
    [[1.000427, 0.000121, 0.001002], [-0.000196, 1.000291, -0.004034], [-0.001121, 0.004356, 1.000529]]
)
ACCELEROMETER_SECOND_ORDER = 1e-4 * np.array([0.0972, -0.9478, -0.1764])  # 1/(m/s²)
ACCELEROMETER_BIAS_M_S2 = np.array([0.9664, -0.4173, 0.8803]) * MG
ACCELEROMETER_REFERENCE_M_S2 = -np.array([0.015499, -0.004079, 9.800597])  # Eq. (11): specific force is −g
ACCELEROMETER_RANDOM_WALK = 0.070104 / 60  # m/s/√s, from 0.070104 m/s/√h
ACCELEROMETER_RESIDUAL_M_S2 = 0.3901 * MG


def draw_attitudes(count: int) -> Array:
    """Return random rotations (count, 3, 3), body to table, spread over all directions, the same at every call."""
    from scipy.spatial.transform import Rotation

    quaternions = np.random.default_rng(1775).normal(size=(count, 4))
    return np.asarray(Rotation.from_quat(quaternions).as_matrix(), dtype=np.float64)


def simulate_oscillation(duration_s: float) -> tuple[Array, Array]:
    """Return attitudes (N, 3, 3) and body rates (N, 3), rad/s, of oscillations by ±60° about all three axes.

    The paper shows its motion only in a figure, but any motion will do in which every axis turns and tilts.
    """
    from scipy.spatial.transform import Rotation

    time_s = np.arange(round(duration_s * RATE_HZ)) / RATE_HZ
    pace = 2 * np.pi / np.array([11.0, 17.0, 23.0])  # rad/s of phase, for yaw, pitch and roll
    amplitude = np.pi / 3
    yaw, pitch, roll = (amplitude * np.sin(pace[:, None] * time_s)).astype(np.float64)
    yaw_rate, pitch_rate, roll_rate = amplitude * pace[:, None] * np.cos(pace[:, None] * time_s)
    attitudes = Rotation.from_euler("ZYX", np.stack([yaw, pitch, roll], axis=1)).as_matrix()
    rates = np.stack(
        [
            roll_rate - yaw_rate * np.sin(pitch),
            pitch_rate * np.cos(roll) + yaw_rate * np.sin(roll) * np.cos(pitch),
            -pitch_rate * np.sin(roll) + yaw_rate * np.cos(roll) * np.cos(pitch),
        ],
        axis=1,
    )
    return np.asarray(attitudes, dtype=np.float64), rates


def project(attitudes: Array, reference: Array) -> Array:
    """Return a `reference` (3,) of the table in body coordinates (N, 3), in N attitudes (N, 3, 3), body to table."""
    return np.asarray(reference @ attitudes, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class DriftingSensor:
    """A sensor whose bias changes from one repeat to the next.

    `matrix` is F (3, 3), `bias` (3,) the first bias, and `bias_steps` the standard deviations of the bias' steps before
    each repeat, in the unit of the readings. `random_walk`, in this unit times √s, is the white noise of the readings.
    """

    matrix: Array
    reference: Array
    second_order: Array
    bias: Array
    bias_steps: Array
    random_walk: float

    def simulate_repeats(self, rng: np.random.Generator, unit: float, unit_name: str) -> list[dict[str, Any]]:
        """Return one row per repeat, with the bias in `unit`, as in the paper's Figs. 4 and 6.

        Columns `held_…` have the bias estimated with the matrix F and the reference of an earlier calibration. For
        columns `free_…`, all parameters are estimated from the ten attitudes, with the reference's norm given.
        """
        attitudes = draw_attitudes(ATTITUDES)
        force = project(attitudes, self.reference)
        model = (force + self.second_order * force**2) @ self.matrix.T
        variance = self.random_walk**2 / AVERAGING_S
        biases = self.bias + np.cumsum(self.bias_steps[:, None] * rng.normal(size=(REPEATS, 3)), axis=0)
        rows = []
        for repeat, bias in enumerate(biases):
            means = model + bias + np.sqrt(variance) * rng.normal(size=model.shape)
            free = solve_triaxial(
                means,
                attitudes,
                np.full(means.shape, variance),
                KnownNorm(float(np.linalg.norm(self.reference)), self.reference),
                second_order=bool(self.second_order.any()),
            )
            fixed = np.mean(means - model, axis=0)
            free_std = np.sqrt(np.diag(free.covariance)[12:15])
            row: dict[str, Any] = {"repeat": repeat + 1}
            for i, axis in enumerate("xyz"):
                row[f"true_bias_{axis}_{unit_name}"] = bias[i] / unit
                row[f"held_bias_{axis}_{unit_name}"] = fixed[i] / unit
                row[f"free_bias_{axis}_{unit_name}"] = free.bias[i] / unit
                row[f"free_bias_std_{axis}_{unit_name}"] = free_std[i] / unit
            row[f"held_bias_std_{unit_name}"] = np.sqrt(variance / ATTITUDES) / unit
            rows.append(row)
        return rows


def draw_drift(panel: "Axes", rows: list[dict[str, Any]], unit_name: str, limit: float, label: str) -> None:
    """Draw the bias by repeat: true, estimated with F fixed, and estimated with all parameters."""
    drift = table(rows)
    for axis, colour in zip("xyz", ("tab:blue", "tab:orange", "tab:green"), strict=True):
        panel.plot(drift["repeat"], drift[f"true_bias_{axis}_{unit_name}"], color=colour, label=f"{axis}, true")
        panel.plot(drift["repeat"], drift[f"held_bias_{axis}_{unit_name}"], "o", color=colour)
        panel.errorbar(
            [repeat + 0.15 for repeat in drift["repeat"]],
            drift[f"free_bias_{axis}_{unit_name}"],
            drift[f"free_bias_std_{axis}_{unit_name}"],
            fmt="x",
            color=colour,
            alpha=0.6,
        )
    for side in (-limit, limit):
        panel.axhline(side, color="grey", linestyle="--")
    panel.plot([], [], "ko", label="found, F and reference fixed")
    panel.plot([], [], "kx", label="estimated with all parameters, ±1σ")
    panel.plot([], [], color="grey", linestyle="--", label="the maker's limit")
    panel.set(xlabel="repeat (ten attitudes, 6 min each)", ylabel=label)
    panel.legend(fontsize=7, ncols=2)


def find_drift_errors(rows: list[dict[str, Any]], column_unit: str, unit: str) -> Iterator[StudyFinding]:
    """Yield two RMS errors of the bias over repeats and axes: with F and reference fixed, then with all estimated."""
    for kind, words in (("held", "F and reference fixed"), ("free", "all parameters estimated")):
        axes = [f"bias_{axis}_{column_unit}" for axis in "xyz"]
        errors = [row[f"{kind}_{axis}"] - row[f"true_{axis}"] for row in rows for axis in axes]
        rms = float(np.sqrt(np.mean(np.square(errors))))
        yield StudyFinding(f"RMS error of the drifting bias, {words}", rms, unit)


def build_parameter_rows(
    kind: str, names: Mapping[str, tuple[str, float]], truth: Array, estimates: Array, stated: Array
) -> list[dict[str, Any]]:
    """Return one row per parameter, from `estimates` (runs, p) and `stated` stds (p,) in SI units.

    `names` has for each parameter's name the unit of its row, and the size of that unit in SI.
    """
    return [
        {
            "noise": kind,
            "parameter": name,
            "unit": unit,
            "true": truth[i] / size,
            "mean_estimate": estimates[:, i].mean() / size,
            "std_over_runs": estimates[:, i].std(ddof=1) / size,
            "std_by_covariance": stated[i] / size,
        }
        for i, (name, (unit, size)) in enumerate(names.items())
    ]
