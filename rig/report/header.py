"""The calibration as a C header, for firmware that corrects its own readings."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.outcome import Outcome
from rig.config.files.safe_writing import write_new
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.report.findings.result_kind import outlet_items
from rig.report.kinds.kind_registry import kinds
from rig.station.events import DocumentWritten, RunEvent

NO_PARAMETERS: Mapping[str, Array] = MappingProxyType({})


def write_header(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Write `calibration.h`, and return the event of the file.

    Nothing is written for a calibration that failed its limits and must not be used, or without a calibration.
    """
    by_sensor = {name: g_sensitivity(result) for name, result in outcome.results.items()}
    sensitivities = {name: matrix for name, matrix in by_sensor.items() if matrix is not None}
    if not outcome.passed or not any(_calibrations(document, sensitivities)):
        return ()
    path = folder / "calibration.h"
    write_new(path, calibration_header(document, sensitivities))
    return (DocumentWritten(path),)


def g_sensitivity(result: SensorResult) -> Array | None:
    """Return the g-sensitivity (3, 3) in the frame of the corrected rates, rad/s per m/s²; None if unknown.

    The vector model's g-sensitivity G refers to gravity in the flange frame. With the model's `mounting` R, which
    rotates from the flange to the sensor, G Rᵀ refers to gravity in the sensor's frame.
    """
    vector = result.vector_model
    if not isinstance(vector, VectorSolution) or vector.g_sensitivity is None:
        return None
    matrix: Array = vector.g_sensitivity @ vector.mounting.T
    return matrix


def calibration_header(document: ResultDocument, g_sensitivity: Mapping[str, Array] = NO_PARAMETERS) -> str:
    """Return C source text for the sensors of a result.

    A calibrated gyroscope gets its scale factors, its biases (rad/s), the matrix M of the board's correction g = M (m +
    b), and a function for this correction. If `g_sensitivity` (3, 3), rad/s per m/s², is known, it is included, with a
    function that first subtracts its effect. An accelerometer and a magnetometer get bias, matrix and function. C names
    are the sensors' names with `_` for every character that C does not allow.
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


def _calibrations(document: ResultDocument, sensitivities: Mapping[str, Array]) -> Iterator[str]:
    for kind in kinds():
        for finding in kind.find(document):
            yield from outlet_items(kind.header, finding, sensitivities)
