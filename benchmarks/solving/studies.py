"""The processor time of each study: `python benchmarks/solving/studies.py [NAME …]`.

The second segment of every study is timed by the processor's clock and multiplied by the number of segments; the rest
of the study is timed once. `rig study` lists these durations (rig/study/study_catalogue.py).
"""

import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from rig.study.study_catalogue import STUDIES
from rig.study.study_report import Settings


class EnoughTimed(Exception):
    """Raised after the second segment, from which the time is extrapolated."""


def measure_core_s(name: str) -> float:
    """Return the processor time of the study, s."""
    remaining_s: list[float] = []

    def time_second_segment(results: Iterable[Any], total: int) -> Iterable[Any]:
        segments = iter(results)
        yield next(segments)
        began_s = time.process_time()
        if next(segments, None) is not None:
            remaining_s.append((total - 1) * (time.process_time() - began_s))
            raise EnoughTimed

    began_s = time.process_time()
    with suppress(EnoughTimed):
        STUDIES[name].run(Settings(progress=time_second_segment))
    return time.process_time() - began_s + sum(remaining_s)


if __name__ == "__main__":
    for name in sys.argv[1:] or STUDIES:
        print(f"{name:18} {measure_core_s(name):7.1f} s", flush=True)
