"""What checks mean in results that say nothing of it but their names: as it was read out of these then."""

import pytest

from rig.data.meaning import Meaning, meaning_by_name
from rig.data.result_file import CheckEntry


@pytest.mark.parametrize(
    ("name", "means"),
    [
        ("gyro.scale_deviation", Meaning("conformity", "gyro", "rate", "scale")),
        ("gyro.bias", Meaning("conformity", "gyro", "rate", "bias")),
        ("the old-one 2.acceleration_bias", Meaning("conformity", "the old-one 2", "acceleration", "bias")),
        ("gyro.acceleration_bias_drift", Meaning("conformity", "gyro", "acceleration", "bias_drift")),
        ("gyro.acceleration_verification", Meaning("conformity", "gyro", "acceleration")),
        ("gyro.verification_mean", Meaning("conformity", "gyro", "rate")),
        ("gyro.disturbed_sweep.13", Meaning("fitness", "gyro", "rate", sweep=13)),
        ("gyro.acceleration_disturbed_sweep.13", Meaning("fitness")),
        *(
            (f"gyro.{what}", Meaning("fitness"))
            for what in ("scale_std", "verification_reference", "board_bias", "disturbed_sweep", "bias_jumped")
        ),
        ("clocks_agree.controller_and_computer", Meaning("fitness")),
        ("gyro.disturbed_sweep." + 5000 * "1", Meaning("fitness")),
        ("", Meaning("fitness")),
    ],
    ids=lambda each: each[:40] if isinstance(each, str) else "",
)
def test_a_check_that_says_nothing_means_what_its_name_did(name: str, means: Meaning) -> None:
    assert CheckEntry(name=name, value=1.0, limit=2.0, unit="1", passed=True).means == means == meaning_by_name(name)


def test_what_a_check_says_counts_and_not_what_it_is_called() -> None:
    check = CheckEntry(name="gyro.bias", value=1.0, limit=2.0, unit="1", passed=True, kind="fitness", sensor="gyro")
    assert check.means == Meaning("fitness", "gyro")
