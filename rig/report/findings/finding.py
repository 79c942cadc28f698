"""An entry of a result together with its sensor and quantity."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from rig.data.entries.result_types import Entry
from rig.data.quantity import Quantity

EntryT = TypeVar("EntryT", bound=Entry)


@dataclass(frozen=True, slots=True)
class Finding(Generic[EntryT]):
    """One entry of a result, its sensor, and the quantity that the sensor measures."""

    sensor: str
    quantity: Quantity
    entry: EntryT

    @property
    def is_reference(self) -> bool:
        """Whether the sensor is a reference, whose calibration was given."""
        return getattr(self.entry, "role", "calibrate") == "reference"
