"""What readings are corrected by, on the board and in `calibration.h`: g = M (m + b), M 3×3. Pure.

`diagonal` is SIX's: M = K, each axis for itself. `matrix` also brings the axes to right angles. With the vector model's
m = F ω − b, F = K⁻¹ S R: R is the rotation nearest to the three axes (the result's `mounting`) and S, symmetric, what
they lack of right angles. M = R F⁻¹ = S⁻¹ K takes a reading to the frame that R turns the flange's into. That is the
polar decomposition. QR would let one axis keep its direction and put the whole error on the others; this one favours
none, turns a reading by nothing that K would not, and is the frame in which a verification compares two sensors.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.known_turns import TurnedSolution
from rig.estimation.gyroscope.vector_model import VectorSolution

CorrectionKind = Literal["matrix", "diagonal"]


@dataclass(frozen=True, slots=True)
class Correction:
    """g = `matrix` (3, 3) · (m + b); `kind` says how it was made."""

    kind: CorrectionKind
    matrix: Array


def diagonal_correction(scale: Array) -> Correction:
    """M = K, of scale factors (3,): the axes are taken to stand at right angles."""
    return Correction("diagonal", np.diag(scale))


def matrix_correction(solution: VectorSolution | TurnedSolution) -> Correction:
    """M = R F⁻¹: the rates in the right-angled frame nearest to the sensor's axes."""
    return Correction("matrix", solution.mounting @ np.linalg.inv(solution.matrix))
