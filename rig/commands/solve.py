"""`rig solve`: the result again, from what was recorded."""

from collections.abc import Sequence
from pathlib import Path

from rig.plans.recorded import judged, open_run
from rig.report.document import document_of
from rig.report.table import print_outcome


def solve(path: Path, estimator: str, overrides: Sequence[str] = (), *, as_json: bool = False) -> int:
    """Recompute the result of a run folder or a run file; prints it, writes nothing. Returns as `run` does.

    `overrides` change what it is judged by, see `RunSettings.with_overrides`.
    """
    outcome = judged(open_run(path).judged_by(overrides), estimator)
    print_outcome(document_of(outcome), as_json=as_json)
    return 0 if outcome.passed else 1
