"""`rig allan`: random walk and bias instability of what a run recorded at rest."""

import sys
from collections.abc import Mapping
from pathlib import Path

from rig.analysis.at_rest import SensorAtRest, at_rest
from rig.errors import Refused, raised_as
from rig.plans.recorded import open_run
from rig.report.allan import draw_at_rest, print_at_rest
from rig.station.plain_text import say
from rig.study.files import missing_extra


def allan(run: Path, plot: Path | None, *, as_json: bool) -> int:
    """Print the Allan deviations of a run folder or a run file; draw them into the folder `plot`. Returns 0.

    Raises Refused `no_raw_readings`, `report_folder`, `missing_extra`, and as `open_run` and `at_rest` do.
    """
    recorded = open_run(run).raw
    if not recorded:
        raise Refused(
            "no_raw_readings",
            f"{run} holds only readings that the board has corrected",
            "Give the recording of a calibration, or of `bias_drift`",
        )
    with raised_as(Refused):  # nothing runs here
        found = at_rest(recorded)
    print_at_rest(found, as_json=as_json)
    if plot is not None:
        _draw(found, plot)
    return 0


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
