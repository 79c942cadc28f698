"""The rig measures what it says: seeds of the whole chain against the simulated truth.

One seed is in `make test` as well: tests/installation/test_wheel.py.
"""

import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from support.demo_runs import normalised_errors
from support.paths import DEMO

SEEDS = range(1, 21)


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(900)
def test_errors_are_as_large_as_reported(tmp_path: Path) -> None:
    def errors_of(seed: int) -> np.ndarray:
        return normalised_errors([sys.executable, "-m", "rig"], DEMO, seed, tmp_path / str(seed))

    with ThreadPoolExecutor(2) as two_at_once:  # each run is mostly one process that simulates, and waits for its arm
        errors = np.array(list(two_at_once.map(errors_of, SEEDS)))
    rms = float(np.sqrt(np.mean(errors**2)))
    print(f"largest error {np.abs(errors).max():.2f} σ, RMS {rms:.3f} σ over {errors.size} errors")
    assert np.abs(errors).max() < 4
    # Three standard deviations of the RMS of so many independent errors, a little more than 0.2.
    assert abs(rms - 1) < 3 / np.sqrt(2 * errors.size)
