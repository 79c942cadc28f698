"""The change of a gyroscope over the rows of a file of sweeps: refused if it is abrupt and large, else a part of U."""

from dataclasses import replace

import numpy as np

from rig.analysis.external.changes import check_steady
from rig.data.quantity import RATE
from rig.estimation.arrays import Array
from rig.estimation.external.abrupt_change import AbruptChange
from rig.estimation.external.row_changes import MIN_EITHER_SIDE, MIN_EVIDENCE
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.gyroscope.rotations_by_angle import BIAS, TurnedSolution
from rig.estimation.sensor_axes import parameter_jacobian
from rig.observation.arm_rests import estimate_bias_drift
from rig.observation.external.csv_import import ExternalData, stack_rows

MIN_STEP_RATIO = 0.01  # to the sweeps' rate: without rests, a smaller step may be one of the rate itself


def check_sweeps_steady(data: ExternalData) -> None:
    """Raise Fault `bias_jumped` or `scale_changed` if the gyroscope certainly changed between two rows of the file."""
    change = data.change
    if change is None or data.at_reference:  # then polynomials contain the change
        return
    if change.what == "scale":
        check_steady(change, RATE)
    elif _is_certain(data, change):
        check_steady(change, RATE, MIN_EVIDENCE)


def estimate_changes(data: ExternalData, matrix: Array) -> Array:
    """Return the covariance (12, 12) of matrix and bias due to changes of the sensor that the rows show.

    It is for the elements of `matrix` (3, 3), row by row, then the bias. The changes are an abrupt one, and those of
    the bias from rest to rest; if the rows show neither, the covariance is zero.
    """
    change = data.change
    abrupt = change.find_covariance(matrix) if change is not None and _must_include(change) else np.zeros((12, 12))
    drift = np.diag([*np.zeros(9), *estimate_bias_drift(data.all_rests)])
    return abrupt + np.maximum(drift - np.diag(np.diag(abrupt)), 0.0)  # a step scatters the rests too


def widen_by_changes(solution: TurnedSolution, data: ExternalData) -> TurnedSolution:
    """Return the solution with the gyroscope's changes over the rows added to its covariances and budget."""
    changes = estimate_changes(data, solution.matrix)
    to_parameters = parameter_jacobian(solution.matrix, solution.scale)
    more = to_parameters @ changes @ to_parameters.T
    lines = solution.budget.contributors
    return replace(
        solution,
        covariance=solution.covariance + more,
        matrix_covariance=solution.matrix_covariance + changes,
        budget=Budget(
            tuple(replace(line, covariance=line.covariance + more) if line.name == BIAS else line for line in lines)
        ),
    )


def _must_include(change: AbruptChange) -> bool:
    """Return whether U must include a change: if it is likely, or if it is a large change of the bias."""
    is_large = change.what == "bias" and float(np.abs(change.sizes).max()) > RATE.steady
    return is_large or change.evidence >= MIN_EVIDENCE


def _is_certain(data: ExternalData, change: AbruptChange) -> bool:
    """Return whether a step of the bias is certain, and cannot be an error of the stated motion.

    If there are rests before and after the step, they must show more than half of it; otherwise the step must exceed
    the effect of plausible errors of all stated rates. A step with too few rows on either side is never certain,
    because these rows may be wrong.
    """
    axis = int(np.argmax(np.abs(change.sizes)))
    size_rad_s = float(change.sizes[axis])
    averages, rates_rad_s = stack_rows(data.sweeps, data.all_rests)
    is_later = np.array([average.start_s >= change.from_s for average in averages])
    if min(is_later.sum(), (~is_later).sum()) < MIN_EITHER_SIDE:
        return False
    before = [rest.mean_rad_s[axis] for rest in data.all_rests if rest.start_s < change.from_s]
    after = [rest.mean_rad_s[axis] for rest in data.all_rests if rest.start_s >= change.from_s]
    if before and after:
        return bool((np.median(after) - np.median(before)) / size_rad_s > 1 / 2)
    readings_rad_s = np.array([average.mean_rad_s[axis] for average in averages])
    median_rad_s = float(np.median([sweep.speed_rad_s for sweep in data.sweeps]))
    usual_rad_s = max(median_rad_s, np.sqrt(2) * _find_leverage(rates_rad_s, readings_rad_s, is_later))
    return abs(size_rad_s) > MIN_STEP_RATIO * usual_rad_s


def _find_leverage(rates_rad_s: Array, readings_rad_s: Array, is_later: Array) -> float:
    """Return the std, rad/s, of an axis' apparent bias step, per unit of relative error of the stated rates.

    The rates `rates_rad_s` (N, 3) of N rows err independently; `readings_rad_s` (N,) are those of the axis, and
    `is_later` (N,) is true for rows after the step.
    """
    design = np.column_stack([rates_rad_s, np.ones(len(rates_rad_s))])
    inverse = np.linalg.pinv(design)
    rotation_rad_s = design[:, :3] @ (inverse @ readings_rad_s)[:3]
    unexplained = is_later - design @ (inverse @ is_later)
    return float(np.linalg.norm(unexplained * rotation_rad_s) / (unexplained @ unexplained))
