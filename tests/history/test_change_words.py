"""What has changed since the last calibration, as somebody reads it."""

import pytest

from rig.history.series import Change
from rig.history.terminal.change_words import change_in_short, name_in_words, select_changed
from rig.report.findings.history_records import Parameter


def change(name: str, before: float, now: float, u: float, unit: str = "1") -> Change:
    """Of a parameter whose u is the same in both: E_n is |now − before| / (2 √2 u)."""
    return Change(name, unit, Parameter(name, before, u, None, unit), Parameter(name, now, u, None, unit))


def said(*changes: Change) -> list[str]:
    return [change_in_short(each) for each in select_changed(changes)]


def test_a_scale_factor_changes_by_a_share_of_itself() -> None:
    large, small = change("kx", 1.0, 1.004, 0.004 / 12 / 8**0.5), change("k", 1.0, 0.99996, 4e-5 / 2.5 / 8**0.5)
    assert said(large) == ["scale factor of x changed by +0.4 %, 12 U"]
    assert said(small) == ["mean scale factor changed by −40 ppm, 2.5 U"]


def test_others_change_in_the_unit_of_a_screen() -> None:
    changes = (
        change("by", 0.01, 0.01 - 0.0017453, 1e-5, "rad/s"),
        change("nonorth_xy", 0.0, 0.0017453, 1e-4, "rad"),
        change("gxy", 0.0, 0.5, 0.1, "rad/s/(m/s²)"),
    )
    assert said(*changes) == [
        "bias of y changed by −0.1 °/s, 62 U",
        "angle between x and y changed by +0.1°, 6.2 U",
        "g-sensitivity x/y changed by +0.5 rad/s/(m/s²), 1.8 U",
    ]


def test_what_the_uncertainties_explain_is_not_told_and_the_largest_comes_first() -> None:
    changes = [change("kx", 1.0, 1.001, 1e-3), change("ky", 1.0, 1.01, 1e-3), change("kz", 1.0, 1.02, 1e-3)]
    assert [each.split(" changed")[0] for each in said(*changes)] == ["scale factor of z", "scale factor of y"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("bz", "the bias of z"),
        ("dx", "the change between repeats of the bias of x"),
        ("sy", "the slope over temperature of the bias of y"),
        ("e", "the Earth's rate"),
        ("ez", "the Earth's rate along z"),
        ("tilt", "tilt"),
    ],
)
def test_every_parameter_of_a_history_has_words(name: str, words: str) -> None:
    assert name_in_words(name) == words
