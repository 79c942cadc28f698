"""Why a gyroscope contradicts its reference: its unit, or the end of its range."""

from dataclasses import replace

import numpy as np
import pytest

from rig.analysis.external.rate_ratios import check_rate_ratios
from rig.errors import Fault
from support.external.followed_body import World, follow, turning

FOLLOWED = follow(World(duration_s=20.0), 1)


def test_a_corrected_gyroscope_at_the_end_of_its_range_is_named() -> None:
    """Its largest readings differ by noise, so that none of them is repeated."""
    limit = 0.5 * np.abs(FOLLOWED.readings[:, 1]).max()
    clipped = FOLLOWED.readings.copy()
    clipped[:, 1] = np.clip(clipped[:, 1], -limit, limit) + np.random.default_rng(1).normal(size=len(clipped)) * 2e-3
    with pytest.raises(Fault, match=r"saturation: .* on y, .* rad/s, the attitudes turn about it 1\.\d+ times as fast"):
        check_rate_ratios(turning(replace(FOLLOWED, readings=clipped)))


def test_readings_in_degrees_are_named() -> None:
    with pytest.raises(Fault, match=r"wrong_unit: in the moves the gyroscope reads 5[5-9]"):
        check_rate_ratios(turning(replace(FOLLOWED, readings=np.degrees(FOLLOWED.readings))))


@pytest.mark.parametrize("attitudes", [FOLLOWED.attitudes, follow(World(duration_s=20.0), 2).attitudes])
def test_neither_is_named_where_the_readings_agree_or_are_those_of_another_body(attitudes: np.ndarray) -> None:
    check_rate_ratios(turning(replace(FOLLOWED, attitudes=attitudes)))
