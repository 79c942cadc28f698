"""How long each study takes on one core: `python benchmarks/solving/studies.py [NAME …]`.

Of every study the second of its pieces is timed, by the processor's clock, and taken times their number; what a study
does beside its pieces is counted as it is. `rig study` lists these durations (rig/study/study_catalogue.py).
"""

import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from rig.study.study_catalogue import STUDIES
from rig.study.study_report import Settings


class Enough(Exception):
    """Two pieces tell how long all of them take."""


def core_s(name: str) -> float:
    """Processor time of the study, s."""
    found: list[float] = []

    def timed(results: Iterable[Any], total: int) -> Iterable[Any]:
        pieces = iter(results)
        yield next(pieces)
        began_s = time.process_time()
        if next(pieces, None) is not None:
            found.append((total - 1) * (time.process_time() - began_s))
            raise Enough

    began_s = time.process_time()
    with suppress(Enough):
        STUDIES[name].run(Settings(progress=timed))
    return time.process_time() - began_s + sum(found)


if __name__ == "__main__":
    for name in sys.argv[1:] or STUDIES:
        print(f"{name:18} {core_s(name):7.1f} s", flush=True)
