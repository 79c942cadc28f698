"""Both files in degrees declared as radians: what shows it is named, in either direction."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.data.quantity import RATE
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.observation.external.csv_import import average_sweeps
from rig.observation.external.csv_samples import Samples
from rig.observation.external.table_motion import check_rates_agree
from support.external.followed_body import World, follow

FOLLOWED = follow(World(), 1)
WAY = ("axis_x", "axis_y", "axis_z")


@pytest.mark.parametrize(
    ("factor", "name"),
    [
        (
            np.degrees(1.0),
            r"wrong_unit: the table's rates are 57\.\d times those of its attitudes: they look like",
        ),
        (
            np.radians(1.0),
            r"wrong_unit: the table's rates are 0\.017\d times those of its attitudes: they look like",
        ),
        (9.55, r"wrong_unit: the table's rates are 9\.5\d times those of its attitudes: check range"),
    ],
)
def test_rates_in_another_unit_than_attitudes_are_named(factor: float, name: str) -> None:
    with pytest.raises(Fault, match=name):
        check_rates_agree(FOLLOWED.looks_s, FOLLOWED.attitudes, factor * FOLLOWED.rates_rad_s)


@pytest.mark.parametrize("every", [1, 5, 20])
def test_rates_that_agree_pass_however_seldom_the_table_is_read(every: int) -> None:
    check_rates_agree(FOLLOWED.looks_s[::every], FOLLOWED.attitudes[::every], FOLLOWED.rates_rad_s[::every])


def test_attitudes_that_are_held_between_reports_pass() -> None:
    held = np.arange(len(FOLLOWED.looks_s)) // 4 * 4
    check_rates_agree(FOLLOWED.looks_s, FOLLOWED.attitudes[held], FOLLOWED.rates_rad_s)


def test_a_fast_steady_turn_seldom_read_passes() -> None:
    time_s = np.arange(60) / 10
    rates = np.tile([0.0, 0.0, 60.0], (60, 1))
    attitudes = Rotation.from_rotvec(rates * time_s[:, None]).as_matrix()
    check_rates_agree(time_s, attitudes, rates)


def sweeps(angle: float) -> dict[str, Array]:
    """Return a file of sweeps by angle: a rest, and a turn either way."""
    starts_s = np.array([0.0, 10.0, 20.0])
    axes = dict(zip(WAY, np.array([[0, 0, 1], [0, 0, 1], [0, 0, -1]], dtype=float).T, strict=True))
    return {"start_s": starts_s, "end_s": starts_s + 5, **axes, "angle_rad": np.array([0.0, angle, 2 * angle])}


def test_angles_that_are_whole_multiples_of_90_are_degrees() -> None:
    time_s = np.arange(3000) / 100
    samples = Samples(time_s, {RATE: np.random.default_rng(1).normal(size=(3000, 3))})
    with pytest.raises(Refused, match=r"wrong_unit: angle_rad is 180 in row 2, .* these are degrees"):
        average_sweeps(samples, sweeps(180.0))
    with pytest.raises((Refused, Fault), match=r"^(?!.*these are degrees)"):
        average_sweeps(samples, sweeps(np.pi))
