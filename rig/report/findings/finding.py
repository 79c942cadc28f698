"""An entry of a result beside what it is of."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from rig.data.entries.result_types import Entry
from rig.data.quantity import Quantity

EntryT = TypeVar("EntryT", bound=Entry)


@dataclass(frozen=True, slots=True)
class Finding(Generic[EntryT]):
    """One entry of a result, the sensor it is of, and the quantity that sensor measures."""

    sensor: str
    quantity: Quantity
    entry: EntryT

    @property
    def known(self) -> bool:
        """Whether the sensor is a reference, which nothing was found of: its calibration was known before."""
        return getattr(self.entry, "role", "calibrate") == "reference"
