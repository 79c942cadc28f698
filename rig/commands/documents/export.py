"""`rig export`: a run in the files of other programs."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_run
from rig.config.files.written_file import replace_together, write_new
from rig.errors import Refused
from rig.report.exports.formats import FORMATS, OF_READINGS, texts_of_calibrations, writer_of_readings
from rig.station.plain_text import say, say_on_terminal

if TYPE_CHECKING:
    from rig.report.exports.calibrations import ExportedCalibrations


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig export`."""
    add_run(parser, "run", "a run folder")
    parser.add_argument(
        "--format",
        choices=FORMATS,
        required=True,
        help="whose; docs/how-to/finished-runs/export.md says what each holds",
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to (default: export/FORMAT in the run folder)")
    parser.add_argument(
        "--at-temperature",
        nargs=2,
        metavar=("CELSIUS", "DRIFT_RUN"),
        help="biases as they are at that temperature, by the slopes a run of bias_drift has found",
    )


def run(options: Namespace) -> int:
    """Write the files as `files` does; returns 0."""
    files(options)
    return 0


def files(options: Namespace) -> list[Path]:
    """Readings of the first movement with what turned it, or the calibrations of a run that passed, into `--out`.

    `--at-temperature`: a temperature in °C, and the run of `bias_drift` that tells how to get there.
    Returns the files. Raises Refused `report_folder`, `bad_option`, `missing_extra`, as `refuse_links` does, of
    readings as `open_run` and `exported`, of calibrations as `read_passed_result`, `at_temperature` and the format do.
    """
    from rig.plans.recorded import open_run
    from rig.report.exports.recorded import exported

    run, name, out = options.run, options.format, options.out
    moved: tuple[str, str] | None = options.at_temperature
    if moved is not None and name in OF_READINGS:
        raise Refused("bad_option", f"--at-temperature is for calibrations, and {name} holds readings", "Leave it out")
    folder: Path = out or (run if run.is_dir() else run.parent) / "export" / name
    try:
        if name in OF_READINGS:
            write = writer_of_readings(name)
            say_on_terminal("reading the recordings")
            recordings = exported(open_run(run).movement)
            _made(folder, own=out is not None)
            with replace_together():
                written = write(recordings, folder)
        else:
            texts = texts_of_calibrations(name)(_calibrations(run, moved))
            _made(folder, own=out is not None)
            written = [folder / file for file in texts]
            with replace_together():
                for path, text in zip(written, texts.values(), strict=True):
                    write_new(path, text)
    except OSError as error:
        raise Refused("report_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error
    for path in written:
        say(str(path))
    return written


def _made(folder: Path, *, own: bool) -> None:
    """Make the folder, unless a link leads elsewhere, from what lies in it or, if it is not named by the user as their
    `own`, from itself. Raises Refused and OSError.
    """
    from rig.data.run_folder import refuse_links

    refuse_links(*(() if own else (folder.parent, folder)))
    folder.mkdir(parents=True, exist_ok=True)
    refuse_links(*folder.rglob("*"))


def _calibrations(run: Path, moved: tuple[str, str] | None) -> "ExportedCalibrations":
    from rig.data.result_file import read_passed_result, read_result
    from rig.report.exports.calibrations import calibrations
    from rig.report.exports.temperature import at_temperature

    found = calibrations(read_passed_result(run))
    if moved is None:
        return found
    temperature, drift = moved
    try:
        temperature_c = float(temperature)
    except ValueError as error:
        remedy = "Give it as in --at-temperature 31.5 DRIFT_RUN"
        raise Refused("bad_option", f"--at-temperature {temperature} is no temperature", remedy) from error
    return at_temperature(found, read_result(Path(drift)), temperature_c)
