"""Magnetometers on the simulated arm: what is found in a uniform field, what is refused, what turning over tells."""

from typing import Any

import numpy as np
import pytest

from rig.errors import Fault, Refused
from rig.estimation.reference.reference_model import BIAS, F
from rig.estimation.reference.reversal import separate
from support.motions.field_in_the_world import HOUSING, OVER, ROUND, UPRIGHT, Seen, solve_field

SEEDS, FEW = 20, 5
GRADIENT_UT_M, MOMENT_A_M2 = 5.0, 0.2


def direction(rng: np.random.Generator) -> np.ndarray:
    vector = rng.normal(size=3)
    unit: np.ndarray = vector / np.linalg.norm(vector)
    return unit


def gradient(seed: int, size: float) -> list[float]:
    """Five components of a gradient whose largest change along any direction is so many µT/m."""
    xx, xy, xz, yy, yz = np.random.default_rng(seed).normal(size=5)
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, -xx - yy]])
    scaled = size / float(np.linalg.norm(tensor, 2))
    return [scaled * float(each) for each in (xx, xy, xz, yy, yz)]


def housings(seed: int, moment_a_m2: float) -> list[dict[str, object]]:
    """Those of joints wrist 3 and wrist 2, magnetised any way."""
    rng = np.random.default_rng(seed)
    other = {"carried_by": "wrist_1", "position_mm": [0, 0, 60]}
    return [{**each, "moment_a_m2": (moment_a_m2 * direction(rng)).tolist()} for each in (HOUSING, other)]


@pytest.mark.slow
def test_in_a_uniform_field_no_estimate_is_worse_than_its_bound() -> None:
    found = [solve_field(seed) for seed in range(SEEDS)]
    errors = np.array([[*(e.solution.matrix - e.matrix).ravel(), *(e.solution.bias - e.bias_t)] for e in found])
    told = np.r_[F, BIAS]
    std = np.sqrt(np.diag(found[0].solution.covariance)[told])
    assert np.sqrt(np.mean((errors / std) ** 2)) <= 1.15
    assert all(each.uniform.uniform for each in found)


def refused(**what: Any) -> bool:
    return not solve_field(method="maximum_likelihood", **what).uniform.uniform


@pytest.mark.slow
def test_a_room_with_a_gradient_and_an_arm_of_iron_are_refused_in_every_seed() -> None:
    for seed in range(SEEDS):
        assert refused(seed=seed, site={"magnetic_gradient_ut_m": gradient(seed, GRADIENT_UT_M)})
        assert refused(seed=seed, iron=housings(seed, MOMENT_A_M2), extension_mm=100.0)


def biases(*runs: Seen) -> tuple[np.ndarray, ...]:
    return (
        np.array([run.solution.bias for run in runs]),
        np.array([run.solution.covariance[BIAS, BIAS] for run in runs]),
        np.array([run.solution.matrix for run in runs]),
        np.array([run.mounting for run in runs]),
    )


# Magnetised along the flange's axis, which is how wrist 3 turns: its field never changes in the flange's frame.
ALONG = [{**HOUSING, "moment_a_m2": [0.0, 0.0, 0.06]}]


@pytest.mark.slow
@pytest.mark.proof
def test_turning_over_recovers_the_bias_that_one_mounting_has_wrong(thorough: bool) -> None:
    for seed in range(SEEDS if thorough else FEW):
        upright, over = (solve_field(seed + 100 * i, iron=ALONG, mounting=m) for i, m in enumerate((UPRIGHT, OVER)))
        assert upright.uniform.uniform, "no residual shows it"
        off = np.abs(upright.solution.bias - upright.bias_t) / np.sqrt(np.diag(upright.solution.covariance)[BIAS])
        assert off.max() >= 5
        found = separate(*biases(upright, over))
        assert found.arm_field_in_bias == (True, False, False)
        left = np.abs(found.bias_t - upright.bias_t) / np.sqrt(np.diag(found.covariance)[:3])
        assert left[1:].max() <= 3


def test_a_second_turn_tells_the_third_axis_too() -> None:
    runs = [solve_field(seed, iron=ALONG, mounting=each) for seed, each in enumerate((UPRIGHT, OVER, ROUND))]
    found = separate(*biases(*runs))
    assert found.arm_field_in_bias == (False, False, False) and found.degrees_of_freedom == 3
    std = np.sqrt(np.diag(found.covariance))
    assert np.all(np.abs(found.bias_t - runs[0].bias_t) <= 3 * std[:3])
    field_t = 2e-7 * 0.06 / (0.11655 - 0.06 + 0.3) ** 3  # of a dipole, on its axis
    assert found.arm_field_t == pytest.approx([0, 0, field_t], abs=4 * std[3:].max())


def test_runs_that_do_not_belong_together_are_refused() -> None:
    upright, over = solve_field(1), solve_field(2, mounting=OVER)
    with pytest.raises(Refused, match="mounting_not_turned"):
        separate(*biases(upright, upright))
    moved, *others = biases(upright, over)
    moved[1] += [1e-6, 0.0, 0.0]  # on the axis that was not turned over
    with pytest.raises(Fault, match="reversal_contradicts"):
        separate(moved, *others)
