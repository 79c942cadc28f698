"""Residuals of mean readings and their expected standard deviations, for pages and notebooks. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.data.entries.bias_drift import DriftEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.result_file import AverageEntry, GyroscopeEntry, ObservationEntry
from rig.estimation.arrays import Array
from rig.report.findings.finding import Finding

EXPECTED = "the residuals expected from noise, bias drift and the ends of turns"
EXPECTED_IN_ATTITUDES = {
    ACCELERATION: "the residuals expected from noise, the arm's attitudes and a sensor within its data sheet",
    FIELD: "the residuals expected from noise and the arm's attitudes",
}
EXPECTED_OF_FILES = "the residuals expected from noise and the file's attitudes"
SAMPLE_SCATTER = "the samples' scatter over the root of their number, which includes vibration that a mean averages out"
REPEAT_DIFFERENCES = "the differences between repeats"
MINUS_MEAN = "minus its mean"


@dataclass(frozen=True, slots=True)
class Unexplained:
    """Residuals `values` (N, 3) of N mean readings, and their standard deviations `stds` (N, 3), in SI units.

    `labels` name the means. `shown` and `expectation` are texts on the values and on the standard deviations. The rests
    of a gyroscope begin at index `split`.
    """

    quantity: Quantity
    labels: Sequence[str]
    values: Array
    stds: Array
    expectation: str
    shown: str = "mean reading minus model"
    split: int | None = None


def find_sweep_residuals(finding: Finding[GyroscopeEntry]) -> Unexplained | None:
    """Return the residuals of a gyroscope's sweeps and rests; None without a solution of the vector model."""
    sensor, vector = finding.entry, finding.entry.vector_model
    averages: list[ObservationEntry | AverageEntry] = [*sensor.observations, *sensor.rests]
    if isinstance(vector, ErrorEntry) or len(vector.residuals_rad_s) != len(averages) or not averages:
        return None
    labels = [f"{turn.joint} {turn.direction}" for turn in sensor.observations] + ["rest"] * len(sensor.rests)
    split = len(sensor.observations) if sensor.rests else None
    residuals = np.array(vector.residuals_rad_s)
    if vector.residuals_std_rad_s is not None:
        return Unexplained(RATE, labels, residuals, np.array(vector.residuals_std_rad_s), EXPECTED, split=split)
    # Not the average's own standard deviation, which includes the effect of gravity on the rests as drift of the bias.
    std = np.array([average.noise_rad_s for average in averages]) / np.sqrt([[average.samples] for average in averages])
    return Unexplained(RATE, labels, residuals, std, SAMPLE_SCATTER, split=split)


def find_attitude_residuals(finding: Finding[Any]) -> Unexplained:
    """Return the residuals of an accelerometer's or magnetometer's attitudes."""
    entry, quantity, dwells = finding.entry, finding.quantity, finding.entry.dwells

    def read(dwell: object, name: str) -> Any:
        return getattr(dwell, quantity.file_key(name))

    residuals, stds = (np.array([read(dwell, name) for dwell in dwells]) for name in ("residual", "residual_std"))
    expectation = EXPECTED_OF_FILES if entry.placement is not None else EXPECTED_IN_ATTITUDES[quantity]
    return Unexplained(quantity, [dwell.name for dwell in dwells], residuals, stds, expectation)


def find_repeat_residuals(finding: Finding[DriftEntry]) -> Unexplained:
    """Return the bias in each repeat of the attitudes, minus the mean over all repeats."""
    repeats = finding.entry.repeats
    bias = np.array([repeat.scale_fixed.bias for repeat in repeats])
    std = np.array([repeat.scale_fixed.std for repeat in repeats])
    labels = [f"repeat {number}" for number in range(1, len(repeats) + 1)]
    return Unexplained(finding.quantity, labels, bias - bias.mean(axis=0), std, REPEAT_DIFFERENCES, shown=MINUS_MEAN)
