"""The calibration as a C header, for firmware that corrects its own readings."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.outcome import Outcome
from rig.config.files.written_file import write_new
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.report.findings.kind import said
from rig.report.kinds.registry import kinds
from rig.station.events import DocumentWritten, RunEvent

NOTHING: Mapping[str, Array] = MappingProxyType({})


def write_header(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """`calibration.h`, unless the calibration failed its limits: nobody should compile it in then."""
    found = {name: g_sensitivity(result) for name, result in outcome.results.items()}
    sensed = {name: matrix for name, matrix in found.items() if matrix is not None}
    if not outcome.passed or not any(_calibrations(document, sensed)):
        return ()
    path = folder / "calibration.h"
    write_new(path, calibration_header(document, sensed))
    return (DocumentWritten(path),)


def g_sensitivity(result: SensorResult) -> Array | None:
    """(3, 3) what gravity in the frame of the corrected rates adds to a reading, rad/s per m/s²; None if not found.

    The vector model has it with gravity in the flange frame, which its `mounting` R turns into the sensor's: G Rᵀ.
    """
    vector = result.vector_model
    if not isinstance(vector, VectorSolution) or vector.g_sensitivity is None:
        return None
    matrix: Array = vector.g_sensitivity @ vector.mounting.T
    return matrix


def calibration_header(document: ResultDocument, g_sensitivity: Mapping[str, Array] = NOTHING) -> str:
    """C source text for the sensors of a result.

    For each calibrated sensor its scale factors (no unit), its biases in rad/s, the matrix M of g = M (m + b) by which
    the board corrects it, and the function that does the same; where `g_sensitivity` (3, 3), rad/s per m/s², is known,
    that too and a function that takes it out first. Of each calibrated accelerometer and magnetometer bias, matrix and
    function. Names are those of the sensors, with everything that C does not allow written as `_`.
    """
    lines = [
        "/* Calibrations. Of gyroscopes g = M (m + b): rate_rad_s = matrix * (reading_rad_s + bias_rad_s), where",
        " * M is diag(scale), or the whole matrix, which also brings the axes to right angles. Of others M (m - b).",
        f" * Verdict: {document.verdict}. Solved {document.provenance.solved_utc}. */",
        "#ifndef CALIBRATION_H",
        "#define CALIBRATION_H",
        *_calibrations(document, g_sensitivity),
    ]
    return "\n".join([*lines, "", "#endif", ""])


def _calibrations(document: ResultDocument, sensed: Mapping[str, Array]) -> Iterator[str]:
    for kind in kinds():
        for found in kind.found(document):
            yield from said(kind.header, found, sensed)
