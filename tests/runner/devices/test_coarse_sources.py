"""Whole runs with every message of an autopilot, and with every number of digits: what they state holds.

Their steps are coarse beside the noise of a good part. Many seeds are for `make proof`; one run with each message is in
`make test`.
"""

from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from support.laboratories.hidden_results import Judged, solve
from support.laboratories.hidden_worlds import move_to_address, run_in, world_of_message, world_with_digits
from support.laboratories.worlds import fresh_host

pytestmark = pytest.mark.slow

MESSAGES = ("RAW_IMU", "SCALED_IMU", "HIGHRES_IMU")
DIGITS = (1, 2, 3)
NOISE_RAD_S = (0.0003, 0.0015, 0.005)
SEEDS = range(500, 505)
WITHIN, BEYOND = 0.93, 2.2  # at least such a share of the errors within U, and none so many U away


def judged(document: dict[str, Any], folder: Path) -> Judged:
    """A run of a laboratory, solved."""
    run_in(move_to_address(document, fresh_host()), folder)
    assert (folder / "status").read_text(encoding="utf-8") == "0\n", (folder / "said").read_text(encoding="utf-8")
    return solve(folder)


def shares(runs: list[Judged]) -> tuple[float, float]:
    """Which share of all errors is within U, and the largest of them, in U."""
    beyond = np.concatenate([np.abs(one.error) / one.expanded for run in runs for one in run.stated])
    return float(np.mean(beyond <= 1)), float(beyond.max())


@pytest.mark.thorough
@pytest.mark.timeout(900)
@pytest.mark.parametrize("message", MESSAGES)
def test_a_quiet_imu_passes_by_every_message(message: str, tmp_path: Path) -> None:
    """With and without a thermometer, on an arm that turns evenly."""
    run = judged(
        world_of_message(message, 0.0005, vibrates=False, seed=600 + MESSAGES.index(message)), tmp_path / "run"
    )
    assert not run.refused and shares([run])[1] < BEYOND


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(14_400)
@pytest.mark.parametrize("source", [*MESSAGES, *DIGITS])
def test_what_is_stated_by_every_message_and_number_of_digits_holds(source: str | int, tmp_path: Path) -> None:
    def run(draw: tuple[float, bool, int]) -> Judged:
        noise_rad_s, vibrates, seed = draw
        if isinstance(source, str):
            document = world_of_message(source, noise_rad_s, vibrates=vibrates, seed=seed)
        else:
            document = world_with_digits(source, noise_rad_s, vibrates=vibrates, seed=seed)
        return judged(document, tmp_path / f"{noise_rad_s}-{vibrates}-{seed}")

    with ThreadPoolExecutor(2) as two_at_once:  # each run is mostly one process that simulates, and waits for its arm
        runs = list(two_at_once.map(run, product(NOISE_RAD_S, (False, True), SEEDS)))
    within, largest = shares(runs)
    print(source, f"{100 * within:.1f} % within U, largest {largest:.2f} U")
    assert not [(run.folder.name, run.refused) for run in runs if run.refused]
    assert within >= WITHIN and largest < BEYOND
