"""`rig solve`: the result again, from what was recorded."""

import sys
from collections.abc import Sequence
from pathlib import Path

from rig.plans.recorded import judged, left_out, open_run
from rig.report.document import document_of
from rig.report.table import print_outcome
from rig.station.plain_text import say


def solve(
    path: Path, estimator: str, overrides: Sequence[str] = (), *, script: Path | None = None, as_json: bool = False
) -> int:
    """Recompute the result of a run folder or a run file; prints it, writes nothing. Returns as `run` does.

    `overrides` change what it is judged by, see `RunSettings.with_overrides`. `script` is the one it was recorded by,
    where that is another's.
    """
    run = open_run(path, script).judged_by(overrides)
    outcome = judged(run, estimator)
    if (said := left_out(run)) is not None:
        say(said, sys.stderr)
    print_outcome(document_of(outcome), as_json=as_json)
    return 0 if outcome.passed else 1
