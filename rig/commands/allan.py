"""`rig allan`: random walk and bias instability of what was recorded at rest."""

import sys
from collections.abc import Mapping
from pathlib import Path

from rig.analysis.at_rest import SensorAtRest, at_rest, log_at_rest
from rig.errors import Refused, raised_as
from rig.observation.csv_samples import read_samples
from rig.plans.recorded import open_run
from rig.report.allan import draw_at_rest, print_at_rest
from rig.station.plain_text import say
from rig.study.files import missing_extra

CSV = ".csv"


def allan(recording: Path, plot: Path | None, *, as_json: bool) -> int:
    """Print the Allan deviations of a run folder, a run file or a log as CSV; draw them into the folder `plot`.

    Returns 0. Raises Refused `report_folder`, `missing_extra`, `not_at_rest`, and as `read_samples` does of a log, of a
    run `no_raw_readings`, and as `open_run` and `at_rest` do.
    """
    with raised_as(Refused):  # nothing runs here
        if recording.suffix.lower() == CSV:
            found = {recording.stem: log_at_rest(read_samples(recording))}
        else:
            found = _of_run(recording)
    print_at_rest(found, as_json=as_json)
    if plot is not None:
        _draw(found, plot)
    return 0


def _of_run(path: Path) -> dict[str, SensorAtRest]:
    recorded = open_run(path).raw
    if not recorded:
        raise Refused(
            "no_raw_readings",
            f"{path} holds only readings that the board has corrected",
            "Give the recording of a calibration, or of `bias_drift`",
        )
    return at_rest(recorded)


def _draw(found: Mapping[str, SensorAtRest], folder: Path) -> None:
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise missing_extra(error, "study") from error
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path in draw_at_rest(found, folder):
            say(f"written: {path}", file=sys.stderr)
    except OSError as error:
        raise Refused("report_folder", f"{folder} cannot be written: {error}", "Choose another with --plot") from error
