"""`rig export`: a run in the formats of other programs."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_columns, add_run, find_logs, read_column_map
from rig.commands.report_folder import refuse_unwritable
from rig.config.files.safe_writing import replace_together, write_new
from rig.errors import Refused
from rig.report.exports.formats import FORMATS, READING_FORMATS, texts_of_calibrations, writer_of_readings
from rig.station.plain_text import say, say_on_terminal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rig.data.recording.run_data import RunData
    from rig.report.exports.exported_corrections import ExportedCalibrations


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig export`."""
    add_run(parser, "run", "a run folder; for the formats of readings also a log of another program")
    parser.add_argument("--format", choices=FORMATS, required=True, help="the format")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder of the files (default: export/FORMAT in the run folder)"
    )
    add_columns(parser)
    parser.add_argument(
        "--at-temperature",
        nargs=2,
        metavar=("CELSIUS", "DRIFT_RUN"),
        help="give biases at this temperature, by the slopes that a run of bias_drift measured",
    )


def run(options: Namespace) -> int:
    """Write the files as `export_files` does; return 0."""
    export_files(options)
    return 0


def export_files(options: Namespace) -> list[Path]:
    """Write readings and motion of a run's first movement, or a passed run's calibrations, into `--out`.

    `--at-temperature` has a temperature, °C, and a run of `bias_drift`, by whose slopes the biases are converted to
    this temperature. Return the files. Raise Refused `report_folder`, `bad_option`, `missing_extra`, and what
    `refuse_links` raises; for readings also what `open_run`, `read_log` and `export_recordings` raise; for calibrations
    what `read_passed_result`, `move_to_temperature` and the format raise.
    """
    from rig.report.exports.exported_recording import export_recordings

    run, name, out = options.run, options.format, options.out
    moved: tuple[str, str] | None = options.at_temperature
    if moved is not None and name in READING_FORMATS:
        raise Refused("bad_option", f"--at-temperature is for calibrations, but {name} holds readings", "Leave it out")
    if options.columns is not None and name not in READING_FORMATS:
        raise Refused("bad_option", f"--columns is for readings, but {name} holds calibrations", "Leave it out")
    if name not in READING_FORMATS and run.is_file() and find_logs(run):
        remedy = (
            "Solve it into a run folder by the command that rig look names, with --out RUN; then: "
            f"rig export RUN --format {name}"
        )
        raise Refused("bad_option", f"{name} holds calibrations, but {run} holds readings alone", remedy)
    folder: Path = out or (run if run.is_dir() else run.parent) / "export" / name
    with refuse_unwritable(folder):
        if name in READING_FORMATS:
            write = writer_of_readings(name)
            say_on_terminal("reading the recordings")
            recordings = export_recordings(_read_recordings(run, options.columns))
            _make_folder(folder, named_by_user=out is not None)
            with replace_together():
                written = write(recordings, folder)
        else:
            texts = texts_of_calibrations(name)(_read_calibrations(run, moved))
            _make_folder(folder, named_by_user=out is not None)
            written = [folder / file for file in texts]
            with replace_together():
                for path, text in zip(written, texts.values(), strict=True):
                    write_new(path, text)
    for path in written:
        say(str(path))
    return written


def _read_recordings(run: Path, columns: Path | None) -> "Sequence[RunData]":
    """Return the recordings of a run, or of a log of another program.

    A folder of `rig record` counts as logs, not as a run. Raise Refused `bad_option`, and the errors of the readers of
    runs and of logs.
    """
    from rig.observation.external.from_files import read_log
    from rig.observation.formats.sample_files import is_in_format
    from rig.plans.recorded_run import open_run

    logs = list[Path]() if run.is_dir() and not is_in_format(run) else find_logs(run)
    if not logs:
        if columns is not None:
            raise Refused("bad_option", "--columns is for a log; a run needs no map", "Leave it out")
        return open_run(run).movement
    recording = read_log(logs[0], read_column_map(columns))
    if recording.external is not None and recording.external.note:
        say(recording.external.note, sys.stderr)
    return [recording]


def _make_folder(folder: Path, *, named_by_user: bool) -> None:
    """Make the folder, and raise Refused if it contains a link.

    The folder itself may be a link only if the user named it. Raise OSError too.
    """
    from rig.data.run_folder import refuse_links

    refuse_links(*(() if named_by_user else (folder.parent, folder)))
    folder.mkdir(parents=True, exist_ok=True)
    refuse_links(*folder.rglob("*"))


def _read_calibrations(run: Path, moved: tuple[str, str] | None) -> "ExportedCalibrations":
    """Return a passed run's calibrations: if given, at the temperature `moved[0]`, by slopes of the run `moved[1]`."""
    from rig.data.result_file import read_passed_result, read_result
    from rig.report.exports.exported_corrections import calibrations
    from rig.report.exports.temperature import move_to_temperature

    run_calibrations = calibrations(read_passed_result(run))
    if moved is None:
        return run_calibrations
    temperature, drift = moved
    try:
        temperature_c = float(temperature)
    except ValueError as error:
        remedy = "Give it like this: --at-temperature 31.5 DRIFT_RUN"
        raise Refused("bad_option", f"--at-temperature {temperature} is not a temperature", remedy) from error
    return move_to_temperature(run_calibrations, read_result(Path(drift)), temperature_c)
