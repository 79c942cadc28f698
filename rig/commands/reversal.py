"""`rig reversal`: a magnetometer's own bias, from runs between which it was turned over on its extension."""

from collections.abc import Sequence
from pathlib import Path

from rig.analysis.calibration import DEFAULT_ESTIMATOR
from rig.analysis.reversal import reversals
from rig.config.written_file import write_new
from rig.errors import Refused
from rig.plans.recorded import judged, open_run
from rig.report.reversal import print_reversal, reversal_document


def reversal(runs: Sequence[Path], out: Path | None, *, as_json: bool) -> int:
    """Print what the runs say together, and write it to `out`; nothing else is changed. Returns 0.

    Raises Refused `report_folder`, and Refused and Fault as `open_run`, `judged` and `reversals` do.
    """
    document = reversal_document(reversals([(str(run), judged(open_run(run), DEFAULT_ESTIMATOR)) for run in runs]))
    print_reversal(document, as_json=as_json)
    if out is not None:
        try:
            write_new(out, document.text() + "\n")
        except OSError as error:
            raise Refused("report_folder", f"{out} cannot be written: {error}", "Choose another with --out") from error
    return 0
