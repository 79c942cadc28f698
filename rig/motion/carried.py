"""The load on the arm's flange, as one value."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.config.models import ArmSection

Position = tuple[float, float, float]
FLANGE_CENTRE: Position = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class FlangeLoad:
    """The payload's mass, and the positions, in the flange's frame, of its centre and of an extension's end."""

    payload_kg: float
    centre_m: Position = FLANGE_CENTRE
    extension_m: Position = FLANGE_CENTRE


def read_load(arm: "ArmSection") -> FlangeLoad:
    """Return the load on the flange that the arm's configuration states."""
    return FlangeLoad(arm.payload_kg, _metres(arm.payload_centre_mm), arm.extension_m)


def _metres(millimetres: Position) -> Position:
    x, y, z = (length / 1000 for length in millimetres)
    return x, y, z
