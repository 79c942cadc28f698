"""What a model leaves of each mean reading, and what it was expected to leave: for pages and notebooks. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.data.entries.drift import DriftEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.data.result_file import AverageEntry, GyroscopeEntry, ObservationEntry
from rig.estimation.arrays import Array
from rig.report.findings.finding import Finding

EXPECTED = "what noise, a wandering bias and the ends of turns are expected to leave"
EXPECTED_IN_ATTITUDES = {
    ACCELERATION: "what noise, the arm's attitudes and a sensor within its data sheet are expected to leave",
    FIELD: "what noise and the arm's attitudes are expected to leave",
}
EXPECTED_OF_FILES = "what noise and the file's attitudes are expected to leave"
OF_SAMPLES = "the samples' scatter over the root of their number, which holds vibration that a mean leaves out"
OF_REPEATS = "what differs between repeats"
FROM_MEAN = "less its mean"


@dataclass(frozen=True, slots=True)
class Unexplained:
    """What is left of N means, by their `labels`: `values` (N, 3), of each one standard deviation `stds` (N, 3), in SI.

    `shown` is what the values are, `of` what the deviations are of; rests begin at `split`.
    """

    quantity: Quantity
    labels: Sequence[str]
    values: Array
    stds: Array
    of: str
    shown: str = "mean reading less model"
    split: int | None = None


def of_sweeps_and_rests(finding: Finding[GyroscopeEntry]) -> Unexplained | None:
    """A gyroscope's sweeps and rests; None where the vector model left nothing, or that of other sweeps and rests."""
    sensor, vector = finding.entry, finding.entry.vector_model
    averages: list[ObservationEntry | AverageEntry] = [*sensor.observations, *sensor.rests]
    if isinstance(vector, ErrorEntry) or len(vector.residuals_rad_s) != len(averages) or not averages:
        return None
    labels = [f"{turn.joint} {turn.direction}" for turn in sensor.observations] + ["rest"] * len(sensor.rests)
    split = len(sensor.observations) if sensor.rests else None
    left = np.array(vector.residuals_rad_s)
    if vector.residuals_std_rad_s is not None:
        return Unexplained(RATE, labels, left, np.array(vector.residuals_std_rad_s), EXPECTED, split=split)
    # Not the average's own standard deviation, which counts as drift of the bias what gravity does to the rests.
    std = np.array([each.noise_rad_s for each in averages]) / np.sqrt([[each.samples] for each in averages])
    return Unexplained(RATE, labels, left, std, OF_SAMPLES, split=split)


def of_attitudes(finding: Finding[Any]) -> Unexplained:
    """The attitudes of an accelerometer or a magnetometer."""
    entry, quantity, dwells = finding.entry, finding.quantity, finding.entry.dwells

    def of(dwell: object, what: str) -> Any:
        return getattr(dwell, quantity.named(what))

    left, stds = (np.array([of(dwell, name) for dwell in dwells]) for name in ("residual", "residual_std"))
    what = EXPECTED_OF_FILES if entry.placement is not None else EXPECTED_IN_ATTITUDES[quantity]
    return Unexplained(quantity, [each.name for each in dwells], left, stds, what)


def of_repeats(finding: Finding[DriftEntry]) -> Unexplained:
    """The biases by repeat, less their mean over the repeats."""
    repeats = finding.entry.repeats
    bias = np.array([each.scale_fixed.bias for each in repeats])
    std = np.array([each.scale_fixed.std for each in repeats])
    labels = [f"repeat {number}" for number in range(1, len(repeats) + 1)]
    return Unexplained(finding.quantity, labels, bias - bias.mean(axis=0), std, OF_REPEATS, shown=FROM_MEAN)
