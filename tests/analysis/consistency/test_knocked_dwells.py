"""What is told of a knock in a dwell, on an arm that swings slowly in all of them."""

import numpy as np
import pytest

from rig.analysis.consistency.knocked_dwells import compare_dwell_halves
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.consistency.raw_dwells import RawDwell
from rig.observation.windows import Window

pytestmark = pytest.mark.slow

NOISE, SWING, LASTING_S, SAMPLES = 20.0, 90.0, 3.0, 300  # counts; a swing of five times what noise leaves in a half
DWELLS, RATE = 18, 1e-3


def dwells(rng: np.random.Generator, hertz: float | None, step: Array | None = None) -> list[RawDwell]:
    """Eighteen, of which the fifth has a step half-way."""
    found = []
    for index in range(DWELLS):
        time_s = LASTING_S / SAMPLES * (np.arange(SAMPLES, dtype=np.float64) + 0.5)
        readings = 1000 + NOISE * rng.normal(size=(SAMPLES, 3))
        if hertz is not None:
            phase = 2 * np.pi * hertz * time_s + rng.uniform(0, 2 * np.pi)
            readings += SWING * np.sin(phase)[:, None] * rng.uniform(-1, 1, 3)
        if step is not None and index == 4:
            readings += np.where(time_s[:, None] < LASTING_S / 2, 0.0, step)
        counts = np.round(readings).astype(np.int64)
        found.append(
            RawDwell(index, counts, np.asarray(time_s, dtype=np.float64), Window(0.0, LASTING_S), np.zeros(6), 0.0)
        )
    return found


def told(seed: int, hertz: float | None, step: Array | None = None) -> bool:
    found = compare_dwell_halves(dwells(np.random.default_rng(seed), hertz, step), 0.0, RATE, Steps(1.0))
    value, limit = found["knocked_dwell"]
    return value > limit


@pytest.mark.parametrize("hertz", [None, 0.25, 0.76])
def test_what_swings_in_all_dwells_is_no_knock(hertz: float | None) -> None:
    assert not any(told(seed, hertz) for seed in range(4))


@pytest.mark.parametrize(("hertz", "step"), [(None, 12.0), (1.0, 200.0)])
def test_a_knock_in_one_of_them_is_detected(hertz: float | None, step: float) -> None:
    assert all(told(seed, hertz, np.array([step, 0.0, -step])) for seed in range(4))
