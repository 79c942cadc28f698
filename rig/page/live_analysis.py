"""Analyses the recordings of a running run, in a process of its own: `python -m rig.page.live_analysis FOLDER`.

The process answers each line on standard input with a line of JSON: the rows of observations and parameters so far. In
the run's process an estimator would delay the threads that take samples; this process may be slow.
"""

import json
import os
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from rig.analysis.partial_results import so_far
from rig.data.recording.run_file import read_run
from rig.data.run_folder import recordings
from rig.errors import RigError
from rig.page.rows import look_of

NICENESS = 10  # the run comes first


def look(folder: Path) -> Mapping[str, object]:
    """Return the page's rows for the recordings of raw readings in a run folder."""
    return asdict(look_of(so_far([read_run(path) for path in recordings(folder, "raw")])))


def main() -> None:
    """Analyse the run folder that the command names, again whenever a line comes on standard input, until it ends."""
    with suppress(OSError, AttributeError):
        os.nice(NICENESS)
    folder = Path(sys.argv[1])
    for _ in sys.stdin:
        try:
            answer = look(folder)
        except (RigError, OSError) as error:  # a recording that has just begun
            answer = {"nothing": str(error)}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
