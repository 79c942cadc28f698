"""A turner: a turntable on a bearing, turned by hand; only its name and the documents' words differ from `hand`.

A package brings it by an entry point, in its pyproject.toml:

    [project.entry-points."rig.turners"]
    turntable_by_hand = "turner:TURNTABLE_BY_HAND"

Then the configuration names it, `turner: {kind: turntable_by_hand, bearing: A7}`, and `rig plan CONFIG` shows the plan.
"""

from dataclasses import replace

from pydantic import Field

from rig.config.procedures.hand_sections import HandSection
from rig.motion.turner_state import TurnerIdentity
from rig.turners.hand.hand_kind import GEOMETRY, HAND


class TurntableSection(HandSection):
    """What the configuration may say of the turntable."""

    bearing: str = Field(min_length=1, max_length=40, description="which bearing it is, for the records")


def describe(section: HandSection) -> TurnerIdentity:
    """Return what recordings and documents say of the turntable."""
    assert isinstance(section, TurntableSection)
    return TurnerIdentity("turntable on a bearing", section.bearing, GEOMETRY)


TURNTABLE_BY_HAND = replace(
    HAND,
    name="turntable_by_hand",
    section=TurntableSection,
    describe_configured=describe,
    describe_connected=lambda section, report: describe(section),
    words=replace(HAND.words, name="turntable that a hand turns", short="turntable", turned="the turntable"),
)
