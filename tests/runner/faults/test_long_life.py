"""Calibrations in a row in one laboratory, across a wrap of the counter; 200: benchmarks/laboratory/long_life.py."""

from pathlib import Path

import pytest

from support.laboratories.long_life import Life, complaints, live

pytestmark = [pytest.mark.slow, pytest.mark.thorough, pytest.mark.proof]
RUNS, WARM_UP = 16, 13  # the station loads and caches during its first dozen
SIGMA = 5.0  # that few runs tell little of a drift, and nothing may fail by chance


def test_nothing_grows_drifts_or_stays_open_from_run_to_run(tmp_path: Path) -> None:
    *runs, life = live(tmp_path, RUNS)
    assert isinstance(life, Life) and len(runs) == RUNS
    assert complaints(life, WARM_UP, SIGMA) == []
    assert life.wraps >= 1 and life.runs[2].wraps == 1, "the counter wraps in the middle of the third run"
