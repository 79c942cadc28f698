"""What checks mean in results that say nothing of it but their names: as it was read out of these then."""

import pytest

from rig.data.meaning import Meaning, meaning_by_name
from rig.data.result_file import CheckEntry


@pytest.mark.parametrize(
    ("name", "means"),
    [
        ("gyro.scale_deviation", Meaning("conformity", "gyro", "rate", "scale", what="scale_deviation")),
        ("gyro.bias", Meaning("conformity", "gyro", "rate", "bias", what="bias")),
        (
            "the old-one 2.acceleration_bias",
            Meaning("conformity", "the old-one 2", "acceleration", "bias", what="bias"),
        ),
        (
            "gyro.acceleration_bias_drift",
            Meaning("conformity", "gyro", "acceleration", "bias_drift", what="bias_drift"),
        ),
        ("gyro.acceleration_verification", Meaning("conformity", "gyro", "acceleration", what="verification")),
        ("gyro.verification_mean", Meaning("conformity", "gyro", "rate", what="verification_mean")),
        ("bias.scale_std.residuals", Meaning("fitness", what="residuals")),
        ("gyro.disturbed_sweep.13", Meaning("fitness", "gyro", "rate", sweep=13, what="disturbed_sweep")),
        (
            "gyro.acceleration_disturbed_sweep.13",
            Meaning("fitness", "gyro", "acceleration", None, 13, "disturbed_sweep"),
        ),
        ("compass.field_disturbed_dwell.13", Meaning("fitness", what="disturbed_dwell")),
        *(
            (f"gyro.{what}", Meaning("fitness", what=what))
            for what in ("scale_std", "verification_reference", "board_bias", "disturbed_sweep", "bias_jumped")
        ),
        ("clocks_agree.controller_and_computer", Meaning("fitness", what="clocks_agree")),
        ("gyro.disturbed_sweep." + 5000 * "1", Meaning("fitness", what="disturbed_sweep")),
        ("gyro.offset", Meaning("fitness")),
        ("", Meaning("fitness")),
    ],
    ids=lambda each: each[:40] if isinstance(each, str) else "",
)
def test_a_check_that_says_nothing_means_what_its_name_did(name: str, means: Meaning) -> None:
    assert CheckEntry(name=name, value=1.0, limit=2.0, unit="1", passed=True).means == means == meaning_by_name(name)


def test_what_a_check_says_counts_and_not_what_it_is_called() -> None:
    check = CheckEntry(name="gyro.bias", value=1.0, limit=2.0, unit="1", passed=True, kind="fitness", sensor="gyro")
    assert check.means == Meaning("fitness", "gyro", what="bias")
    said = check.model_copy(update={"criterion": "residuals", "quantity": "inclination"})
    assert said.means == Meaning("fitness", "gyro", "inclination", what="residuals")


def test_a_sweep_that_an_accelerometer_named_before_it_said_so_is_repeated_too() -> None:
    named = {"name": "gyro.acceleration_disturbed_sweep.4", "kind": "fitness", "sensor": "gyro"}
    check = CheckEntry(value=500.0, limit=45.0, unit="1", passed=False, quantity="acceleration", **named)
    assert check.means.sweep == 4
