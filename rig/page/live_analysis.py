"""Looks at the recordings of a run that goes on, as a process of its own: `python -m rig.page.live_analysis FOLDER`.

For each line on its standard input it answers with one of JSON: the rows of observations and parameters so far. The
arithmetic of an estimator would hold up the threads that take samples, and this process can be as slow as it likes.
"""

import json
import os
import sys
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path

from rig.analysis.partial_results import so_far
from rig.data.recording.run_file import read_run
from rig.data.run_folder import recordings
from rig.errors import RigError
from rig.page.rows import look_of

NICENESS = 10  # the run comes first


def look(folder: Path) -> dict[str, object]:
    """What the recordings of raw readings in a run folder amount to."""
    return asdict(look_of(so_far([read_run(path) for path in recordings(folder, "raw")])))


def main() -> None:
    """Look at the folder at every line that comes, until standard input ends."""
    with suppress(OSError, AttributeError):
        os.nice(NICENESS)
    folder = Path(sys.argv[1])
    for _ in sys.stdin:
        try:
            answer = look(folder)
        except (RigError, OSError) as error:  # a recording that is only just begun
            answer = {"nothing": str(error)}
        print(json.dumps(answer), flush=True)


if __name__ == "__main__":
    main()
