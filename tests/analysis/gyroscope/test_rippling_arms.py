"""Whole turns and arcs of arms that ripple and vibrate by any order of the turn: what is stated of a result holds."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from support.recordings.checked_runs import solve_inputs
from support.recordings.drawn_recording import KINDS, drawn
from support.recordings.drawn_ripple import drawn_ripple
from support.recordings.synthetic_run import Setup

pytestmark = pytest.mark.slow

SEEDS, A_FEW = 60, 2
BEYOND = 2.2  # U


@cache
def errors(kind: str, arc_deg: float | None, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(6,) of scale and bias, over u and over U."""
    rng = np.random.default_rng([seed, 47])
    speed_deg_s = float(rng.uniform(35, 120))
    arc: dict[str, Any] = {}
    if arc_deg is not None:
        arc = {"procedure": (("arc_deg", f"{arc_deg:g}"),), "angle_std_deg": 0.05}
    setup = Setup(speed_deg_s=speed_deg_s, state_rate_hz=500.0, **arc)
    ripple = drawn_ripple(rng, speed_deg_s / 360, [KINDS[kind].sensor.rate_hz])
    case = drawn(seed, KINDS[kind], setup, ripple)
    found = solve_inputs(case.run)[1]["gyro"]
    averages = [*(observation.average for observation in found.observations), *found.rests]
    inside = (case.time_s > min(average.start_s for average in averages)) & (
        case.time_s < max(average.end_s for average in averages)
    )
    assert found.uncertainty is not None
    off = np.concatenate([found.scale - case.scale, found.bias_rad_s + case.bias_rad_s[inside].mean(axis=0)])
    return off / found.uncertainty.std, np.abs(off) / found.uncertainty.expanded


@pytest.mark.thorough
@pytest.mark.proof
@pytest.mark.parametrize(("kind", "arc_deg"), [("quiet LSM9DS1", None), ("ADIS16465", None), ("quiet LSM9DS1", 180.0)])
def test_errors_are_as_large_as_is_stated(kind: str, arc_deg: float | None, thorough: bool) -> None:
    found = [errors(kind, arc_deg, seed) for seed in range(SEEDS if thorough else A_FEW)]
    over_u, over_expanded = (np.array(each) for each in zip(*found, strict=True))
    for name, axes in (("scale", slice(0, 3)), ("bias", slice(3, 6))):
        rms, within = np.sqrt(np.mean(over_u[:, axes] ** 2)), np.mean(over_expanded[:, axes] <= 1)
        print(f"{kind} {arc_deg} {name}: RMS {rms:.2f} u, {within:.1%} within U, {over_expanded[:, axes].max():.2f} U")
        # These parts hardly drift. A few rests cannot show that, so u of a quiet part's bias is larger than its errors.
        least = 0.6 if name == "bias" and kind == "ADIS16465" else 0.8
        assert not thorough or (least < rms < 1.2 and within > 0.91)
    assert over_expanded.max() < BEYOND
