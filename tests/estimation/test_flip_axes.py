"""The axes of gyroscope and accelerometer compared by flips: named as they are, or not at all."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.by_hand.flip_axes import check_axes
from rig.observation.by_hand.hand_segmentation import segment_session
from support.external.handled_body import SIX_TURNS, TWELVE, Recorded, handle

ABOUT_NONE = np.array([1.0, 2.0, 3.0]) / 14**0.5


@cache
def handled(seed: int = 3, rest_s: float = 1.2) -> Recorded:
    return handle(TWELVE if seed % 2 else SIX_TURNS, seed, rest_s=rest_s)


def check(recorded: Recorded) -> None:
    check_axes(segment_session(recorded.time_s, recorded.rates, recorded.acceleration))


def turned(axis: Array, angle_deg: float) -> Recorded:
    """Return a session whose gyroscope lies turned in the part."""
    rotation = Rotation.from_rotvec(np.radians(angle_deg) * axis).as_matrix()
    return replace(handled(), rates=handled().rates @ rotation.T)


@pytest.mark.parametrize(
    ("order", "signs", "name"),
    [
        ((1, 0, 2), (1, 1, -1), "swapped_axes: .* about the accelerometer's \\+y, \\+x, -z"),
        ((0, 1, 2), (1, -1, 1), "mirrored_axis: .* about the accelerometer's \\+x, -y, \\+z"),
    ],
)
def test_swapped_and_mirrored_columns_are_named(order: tuple[int, ...], signs: tuple[int, ...], name: str) -> None:
    with pytest.raises(Fault, match=name):
        check(replace(handled(), rates=handled().rates[:, order] * signs))


def test_inverted_readings_are_named_by_moves_that_were_refused_because_of_them() -> None:
    recorded = handled()
    session = segment_session(recorded.time_s, -recorded.rates, recorded.acceleration)
    refused = tuple(replace(move, left_out=True) for move in session.moves)
    with pytest.raises(Fault, match=r"mirrored_axis.*-x, -y, -z"):
        check_axes(replace(session, moves=refused))


@pytest.mark.parametrize("angle_deg", [80, 90])
def test_axes_that_no_order_explains_are_not_called_swapped(angle_deg: float) -> None:
    with pytest.raises(Fault, match=r"wrong_mounting: the gyroscope's axes lie (79|80|89|90)° off"):
        check(turned(ABOUT_NONE, angle_deg))


def test_a_gyroscope_a_little_askew_is_left_to_the_fit() -> None:
    check(turned(ABOUT_NONE, 40))


@pytest.mark.slow
@pytest.mark.one_in(9)  # each length of rests once
@pytest.mark.parametrize("rest_s", [0.45, 0.5, 0.55, 0.6])
@pytest.mark.parametrize("seed", range(1, 10))
def test_rests_too_short_to_be_found_are_no_fault_of_the_axes(seed: int, rest_s: float) -> None:
    check(handled(seed, rest_s))


@pytest.mark.parametrize(("factor", "is_named"), [(0.25, True), (0.5, True), (0.7, False), (2.0, False), (4.0, True)])
def test_the_scale_of_another_range_is_named_where_no_fit_converges(factor: float, is_named: bool) -> None:
    recorded = replace(handled(), rates=factor * handled().rates)
    if not is_named:
        check(recorded)
        return
    with pytest.raises(Fault, match=r"wrong_unit: .* on all axes, as with the scale of another range"):
        check(recorded)


def test_another_unit_is_named() -> None:
    with pytest.raises(Fault, match="wrong_unit"):
        check(replace(handled(), rates=np.radians(handled().rates)))
