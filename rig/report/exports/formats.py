"""The formats and their writers. A new format is a file with its writer, and a line here."""

from collections.abc import Callable, Mapping
from importlib import import_module
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:  # the command line needs only the names
    from collections.abc import Sequence
    from pathlib import Path

    from rig.report.exports.exported_corrections import ExportedCalibrations
    from rig.report.exports.exported_recording import Exported

    ReadingsWriter = Callable[[Sequence[Exported], Path], list[Path]]
    CalibrationTexts = Callable[[ExportedCalibrations], Mapping[str, str]]

# `module:function` of formats of readings: (recordings, folder) → the files written.
READING_FORMATS: Final[Mapping[str, str]] = {
    "csv": "rig.report.exports.reading_tables:write_csv",
    "parquet": "rig.report.exports.reading_tables:write_parquet",
    "mat": "rig.report.exports.reading_tables:write_mat",
    "ros2": "rig.report.exports.ros2:write_bag",
}
# Formats of calibrations: (those of a run) → texts by the name of the file.
CALIBRATION_FORMATS: Final[Mapping[str, str]] = {
    "imucal": "rig.report.exports.imucal:imucal_files",
    "px4": "rig.report.exports.autopilots:px4_files",
    "ardupilot": "rig.report.exports.autopilots:ardupilot_files",
    "kalibr": "rig.report.exports.kalibr:kalibr_files",
}
# Formats that need an optional part of the program: (library, part).
EXTRAS: Final = {"parquet": ("pyarrow", "parquet"), "ros2": ("rosbags", "ros2")}
FORMATS: Final = (*READING_FORMATS, *CALIBRATION_FORMATS)


def writer_of_readings(name: str) -> "ReadingsWriter":
    """Load and return the writer of a format of readings. Raise Refused `missing_extra`."""
    if name in EXTRAS:
        from rig.errors.extras import requiring

        library, extra = EXTRAS[name]
        with requiring(extra):
            import_module(library)
    writer: ReadingsWriter = resolve_name(READING_FORMATS[name])
    return writer


def texts_of_calibrations(name: str) -> "CalibrationTexts":
    """Load and return the function that builds the texts of a format of calibrations."""
    builder: CalibrationTexts = resolve_name(CALIBRATION_FORMATS[name])
    return builder
