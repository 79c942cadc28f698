"""A gap in a dwell: bridged if the readings before and after are equal, else named, with row and time."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.external.placement_account import AttitudeRows
from rig.observation.external.placements import Placements, find_placements
from rig.observation.windows import Window

HZ, DWELL_S, MOVE_S = 50, 10.0, 2.0
FACES = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, -1]])
ATTITUDES = Rotation.from_euler("xyz", [(0, 0, 0), (0, 90, 0), (-90, 0, 0), (180, 0, 0)], degrees=True).as_matrix()


def laid(
    *gaps_s: tuple[float, float], turned: tuple[int, ...] = (), gyroscope: bool = False, shaken_s: float = 0.0
) -> Placements:
    """Return the placements of four dwells without the readings in the gaps; in the dwells `turned` the body is
    turned over meanwhile. From 16 s on it is shaken for `shaken_s`.
    """
    rng, time_s = np.random.default_rng(1), np.arange(round(4 * (DWELL_S + MOVE_S) * HZ)) / HZ
    dwell, since_s = np.divmod(time_s, DWELL_S + MOVE_S)
    forces = 9.81 * FACES[dwell.astype(int)] + 0.01 * rng.normal(size=(len(time_s), 3))
    rates = 1e-3 * rng.normal(size=forces.shape)
    moves = (since_s > DWELL_S) | ((time_s > 16) & (time_s < 16 + shaken_s))
    forces[moves] += 3 * rng.normal(size=(moves.sum(), 3))
    rates[moves] += rng.normal(size=(moves.sum(), 3))
    forces[np.isin(dwell, turned) & (since_s > DWELL_S / 2)] *= -1
    kept = np.all([(time_s < start_s) | (time_s >= end_s) for start_s, end_s in ((-1.0, -1.0), *gaps_s)], axis=0)
    starts_s = np.arange(4) * (DWELL_S + MOVE_S)
    windows = [Window(start_s + 0.3, start_s + DWELL_S - 0.3) for start_s in starts_s.tolist()]
    readings: dict[Quantity, Array] = {RATE: rates[kept]} if gyroscope else {}
    readings[ACCELERATION] = forces[kept]
    return find_placements(time_s[kept], readings, AttitudeRows(windows, ATTITUDES, np.arange(1, 5)))


@pytest.mark.parametrize("gyroscope", [False, True])
@pytest.mark.parametrize("lasts_s", [0.5, 1.3, 4.0])
def test_a_gap_with_equal_readings_before_and_after_costs_those_in_it(lasts_s: float, *, gyroscope: bool) -> None:
    placements = laid((16.0, 16.0 + lasts_s), gyroscope=gyroscope)
    assert len(placements.attitudes) == 4
    (missing,) = placements.omitted
    assert missing.count == round(HZ * lasts_s) and missing.reason == "lost_samples: they are missing"
    assert missing.first == "at 15.98 s, in row 2"


def test_a_body_shaken_in_a_dwell_that_lies_as_before_costs_those_readings() -> None:
    placements = laid(shaken_s=1.6)
    (moved,) = placements.omitted
    assert len(placements.attitudes) == 4 and moved.reason == "not_at_rest: the body was knocked or moved"
    assert moved.count == pytest.approx(1.6 * HZ, abs=HZ / 2)


def test_a_gap_in_the_first_dwell_is_named_like_any_other() -> None:
    (missing,) = laid((4.0, 5.0)).omitted
    assert (missing.count, missing.first) == (HZ, "at 3.98 s, in row 1")


def test_a_gap_in_which_the_body_may_move_is_called_a_gap() -> None:
    placements = laid((16.0, 18.0), turned=(1,))
    assert len(placements.attitudes) == 3
    assert str(placements.omitted[0]) == (
        "1 of 4 rows, lost_samples: readings are missing for up to 2.02 s, in which the body may move; the first row "
        "2, after 15.98 s"
    )


def test_a_recording_that_begins_late_in_a_dwell_is_no_moving_body() -> None:
    (omitted,) = laid((0.0, 6.0)).omitted
    assert str(omitted) == (
        "1 of 4 rows, lost_samples: readings are missing for up to 5.7 s, in which the body may move; the first row "
        "1, after 0.3 s"
    )


def test_gaps_in_most_dwells_are_refused_as_gaps() -> None:
    with pytest.raises(Fault, match=r"lost_samples: 3 of 4 rows, .* the first row 1, after 3\.98 s"):
        laid((4.0, 6.0), (16.0, 18.0), (28.0, 30.0), turned=(0, 1, 2))


def test_a_body_that_moves_in_a_dwell_without_a_gap_is_said_to_move() -> None:
    with pytest.raises(Fault, match="not_at_rest: more rows are left out than kept: 3 of 4 rows, not_at_rest"):
        laid(turned=(0, 1, 2))
