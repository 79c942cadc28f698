"""`rig allan`: random walk and bias instability from a recording at rest."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_json, add_run
from rig.errors import Refused, raised_as
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.analysis.rest_noise import SensorAtRest

CSV = (".csv", ".csv.gz")


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig allan`."""
    what = "a run folder, its run.h5, a log of a sensor at rest as CSV, or what `rig record` wrote"
    add_run(parser, "run", what, metavar="RECORDING")
    parser.add_argument("--plot", type=Path, metavar="DIR", help="draw the curves into this folder")
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the Allan deviations of a run folder, a run file or a log as CSV; draw them into the folder `--plot`.

    Return 0. Raise Refused `report_folder`, `missing_extra`, `not_at_rest`; for a log as `read_samples`; for a run
    `no_raw_readings`, and as `open_run` and `at_rest`.
    """
    from rig.report.figures.allan import print_at_rest

    with raised_as(Refused):  # no arm moves: wrong data is a refusal
        logs = _find_logs(options.run)
        sensors = _analyse_logs(logs) if logs else _analyse_run(options.run)
    print_at_rest(sensors, as_json=options.json)
    if options.plot is not None:
        _draw(sensors, options.plot)
    return 0


def _find_logs(path: Path) -> list[Path]:
    """Return the log, or the logs in a folder that `rig record` wrote; none for a run."""
    if path.is_dir() and not any(path.glob("*.h5")):
        return sorted(file for file in path.iterdir() if _is_log(file))
    return [path] if _is_log(path) else []


def _is_log(path: Path) -> bool:
    return path.name.lower().endswith(CSV)


def _analyse_logs(paths: Sequence[Path]) -> "dict[str, SensorAtRest]":
    from rig.analysis.rest_noise import log_at_rest
    from rig.observation.external.csv_samples import read_samples

    return {path.stem: log_at_rest(read_samples(path)) for path in paths}


def _analyse_run(path: Path) -> "dict[str, SensorAtRest]":
    from rig.analysis.rest_noise import at_rest, log_at_rest
    from rig.observation.external.csv_samples import samples_in
    from rig.plans.recorded_run import open_run

    recorded = open_run(path).raw
    if not recorded:
        raise Refused(
            "no_raw_readings",
            f"{path} holds only readings that the board has corrected",
            "Give the recording of a calibration, or of `bias_drift`",
        )
    if (read := recorded[0].external) is not None:
        return {read.item.name: log_at_rest(samples_in(read.readings, str(path)))}
    return at_rest(recorded)


def _draw(sensors: "Mapping[str, SensorAtRest]", folder: Path) -> None:
    from rig.errors.extras import missing_extra
    from rig.report.figures.allan import draw_at_rest

    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise missing_extra(error, "study") from error
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in draw_at_rest(sensors, folder):
            say(f"written: {path}", file=sys.stderr)
    except OSError as error:
        raise Refused("report_folder", f"{folder} cannot be written: {error}", "Choose another with --plot") from error
