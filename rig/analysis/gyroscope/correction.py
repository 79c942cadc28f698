"""The correction g = M (m + b) of readings m to rates g, on the board and in `calibration.h`. Pure functions.

M is a 3×3 matrix, b the bias. The correction "diagonal" is that of the paper SIX, with the diagonal matrix M = K of the
scale factors. The correction "matrix" also makes the axes orthogonal. In the vector model m = F ω − b, polar
decomposition gives F = K⁻¹ S R: R is the rotation nearest to the three axes (the result's `mounting`), and the
symmetric S contains their non-orthogonality. M = R F⁻¹ = S⁻¹ K takes a reading to the frame into which R rotates the
flange's frame. A QR decomposition would keep the direction of one axis and put the whole error on the other two; R
prefers no axis, and defines the frame in which a verification compares two sensors.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution

if TYPE_CHECKING:
    from rig.estimation.gyroscope.rotations_by_angle import TurnedSolution

CorrectionKind = Literal["matrix", "diagonal"]


@dataclass(frozen=True, slots=True)
class Correction:
    """The correction rate = `matrix` (3, 3) · (reading + bias), and its `kind`."""

    kind: CorrectionKind
    matrix: Array


def diagonal_correction(scale: Array) -> Correction:
    """Return the correction by the scale factors (3,) alone, which assumes orthogonal axes."""
    return Correction("diagonal", np.diag(scale))


def matrix_correction(solution: "VectorSolution | TurnedSolution") -> Correction:
    """Return the correction of readings to rates in the orthogonal frame nearest to the sensor's axes."""
    return Correction("matrix", solution.mounting @ np.linalg.inv(solution.matrix))
