"""What the arm's flange carries, as one value."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.config.models import ArmSection

Place = tuple[float, float, float]
FLANGE: Place = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Carried:
    """The payload's mass and the places, x y z in the flange's frame, of its centre and of an extension's end."""

    payload_kg: float
    centre_m: Place = FLANGE
    extension_m: Place = FLANGE


def carried_by(arm: "ArmSection") -> Carried:
    """What an arm carries by its configuration."""
    return Carried(arm.payload_kg, _metres(arm.payload_centre_mm), arm.extension_m)


def _metres(millimetres: Place) -> Place:
    x, y, z = (each / 1000 for each in millimetres)
    return x, y, z
