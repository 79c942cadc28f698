"""The events of a calibration over temperature, in addition to its sweeps and dwells, as its recording keeps them."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from rig.data.validation import Finite

Index = Annotated[int, Field(ge=0)]
Celsius = dict[str, Finite]


@dataclass(frozen=True, slots=True)
class TemperatureWanted:
    """A request to warm or cool the sensors until the first of them is at `next_c`.

    They are `now_c`. The operator does it, or the board's heater, if `heated`.
    """

    warming: bool
    now_c: Finite
    next_c: Finite
    heated: bool


@dataclass(frozen=True, slots=True)
class SetMeasured:
    """The sweeps and dwells with the indices from `first` up to, not including, `end` are finished, on the way up or
    down.

    `temperatures_c` are the means of the sensors' own thermometers meanwhile, by the sensor's name.
    """

    first: Index
    end: Index
    warming: bool
    temperatures_c: Celsius


OfTheTemperature = TemperatureWanted | SetMeasured
