"""What turns is said under `arm`, or under `turner` with its kind: one of both."""

import re

import pytest
import yaml

from rig.config.load import ConfigurationRefused, parse
from rig.config.models import ArmSection, TurnerSection
from support.paths import CONFIGS

DEMO = yaml.safe_load((CONFIGS / "demo.yaml").read_text(encoding="utf-8"))
OTHERS = {key: value for key, value in DEMO.items() if key != "arm"}


class WheelSection(TurnerSection):
    """A wheel."""

    spokes: int


def text(**said: object) -> str:
    return yaml.safe_dump({**OTHERS, **said})


def problems(**said: object) -> list[str]:
    with pytest.raises(ConfigurationRefused) as refused:
        parse(text(**said), turners={"ur": ArmSection, "wheel": WheelSection})
    return list(refused.value.problems)


def test_an_arm_is_the_same_by_either_name() -> None:
    arm = parse(text(arm=DEMO["arm"])).config
    turner = parse(text(turner={"kind": "ur", **DEMO["arm"]})).config
    assert turner == arm and turner.arm == arm.turner == arm.arm


def test_another_turner_brings_its_own_keys() -> None:
    others = {key: value for key, value in OTHERS.items() if key != "world"}
    said = yaml.safe_dump({**others, "turner": {"kind": "wheel", "spokes": 32}})
    config = parse(said, turners={"ur": ArmSection, "wheel": WheelSection}).config
    assert config.turner == WheelSection(spokes=32)
    with pytest.raises(TypeError, match="no arm turns the sensors"):
        _ = config.arm
    assert parse(said).config.turner == TurnerSection(), "who only reads the rest need not have the package"


@pytest.mark.parametrize(
    ("said", "first"),
    [
        ({}, "arm: missing"),
        ({"arm": DEMO["arm"], "turner": {"kind": "ur"}}, "turner: the turner is given twice"),
        ({"turner": {"kind": "ur", "hots": "127.0.0.2"}}, "turner.host: missing"),
        ({"turner": {"kind": "ur", "payload_kg": -1, "host": "a"}}, "turner.payload_kg"),
        ({"turner": {"kind": "whel"}}, "'whel' is not allowed, did you mean wheel?; allowed: ur, hand, servo, wheel"),
        ({"turner": {}}, "None is not allowed; allowed: ur, hand, servo, wheel"),
        ({"turner": [1]}, "must be a section, with the key kind"),
        ({"turner": {"kind": "wheel", "spokes": "many"}}, "turner.spokes"),
        ({"turner": {"kind": "wheel", "spokes": 32}}, "world: simulates an arm"),
    ],
)
def test_what_is_wrong_is_told_with_its_place(said: dict[str, object], first: str) -> None:
    assert any(first in re.sub(r" \(.*?line \d+\)", "", problem) for problem in problems(**said)), problems(**said)
