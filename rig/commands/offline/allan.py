"""`rig allan`: random walk and bias instability from a recording at rest."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_columns, add_json, add_run, find_logs, read_column_map
from rig.commands.report_folder import draw_into
from rig.errors import Refused, raise_as
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.analysis.rest_noise import SensorAtRest


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig allan`."""
    what = "a run folder, its run.h5, a log of a sensor at rest (CSV, bag, .ulg, .mat), or what `rig record` wrote"
    add_run(parser, "run", what, metavar="RECORDING")
    parser.add_argument("--plot", type=Path, metavar="DIR", help="draw the curves into this folder")
    add_columns(parser)
    add_json(parser)


def run(options: Namespace) -> int:
    """Print the Allan deviations of a run folder, a run file or a log; draw them into the folder `--plot`.

    Return 0. Raise Refused `report_folder`, `missing_extra`, `not_at_rest`; for a log also as `read_samples` does; for
    a run also `bad_option`, `no_raw_readings`, and what `open_run` and `at_rest` raise.
    """
    from rig.report.figures.allan import draw_at_rest, print_at_rest

    with raise_as(Refused):  # no arm moves: wrong data is a refusal
        logs = find_logs(options.run)
        if not logs and options.columns is not None:
            raise Refused("bad_option", "--columns is for a log; a run needs no map", "Leave it out")
        sensors = _analyse_logs(logs, options.columns) if logs else _analyse_run(options.run)
    print_at_rest(sensors, as_json=options.json)
    if options.plot is not None:
        for path in draw_into(options.plot, lambda folder: draw_at_rest(sensors, folder), "--plot"):
            say(f"written: {path}", file=sys.stderr)
    return 0


def _analyse_logs(paths: Sequence[Path], columns: Path | None) -> "dict[str, SensorAtRest]":
    """Return the noise of each log at rest, by the name of its file."""
    from rig.analysis.rest_noise import log_at_rest
    from rig.observation.external.csv_samples import read_sample_table, samples_in
    from rig.observation.formats.column_selection import map_samples

    mapped = map_samples(read_column_map(columns))
    sensors = {}
    for path in paths:
        table = read_sample_table(path, (), mapped)
        if table.note:
            say(table.note, sys.stderr)
        sensors[path.stem] = log_at_rest(samples_in(table.columns, str(path)))
    return sensors


def _analyse_run(path: Path) -> "dict[str, SensorAtRest]":
    """Return the noise of every gyroscope at rest in a run. Raise Refused `no_raw_readings`."""
    from rig.analysis.rest_noise import log_at_rest, rest_noises
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
    return rest_noises(recorded)
