"""Write the calibrations of a finished run in a format of one's own: a TOML file, a table for each sensor.

python examples/own_export.py RUN

As a format of `rig export` the function belongs in rig/report/exports/, and its line in formats.py.
"""

import sys
from collections.abc import Mapping
from pathlib import Path

import rig
from rig.report.exports.exported_corrections import ExportedCalibrations, calibrations


def toml_files(solved: ExportedCalibrations) -> Mapping[str, str]:
    """Return the texts by name of the file; a file says its convention, and what it cannot hold."""
    lines = ["# corrected = matrix @ (reading - offset), SI units. Lost: uncertainties, second order, g-sensitivity."]
    for sensor in solved.sensors:
        lines += ["", f'["{sensor.name}"]', *(f"# {line}" for line in solved.origin(sensor))]
        lines += [f"matrix = {sensor.matrix.tolist()}", f"offset = {sensor.offset.tolist()}"]
    return {"calibration.toml": "\n".join(lines) + "\n"}


if __name__ == "__main__":
    for name, text in toml_files(calibrations(rig.load_result(sys.argv[1]).document)).items():
        (Path(sys.argv[1]) / name).write_text(text, encoding="utf-8")
        print(f"{name} is in {sys.argv[1]}")
