"""What happens in a calibration over temperature beside its sweeps and dwells, as its recording keeps it."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from rig.data.checked import Finite

Index = Annotated[int, Field(ge=0)]
Celsius = dict[str, Finite]


@dataclass(frozen=True, slots=True)
class TemperatureWanted:
    """The sensors are to become warmer, or else colder, until the first of them is at `next_c`.

    They are `now_c`. The operator sees to it unless the board's heater does, which is `heated`.
    """

    warming: bool
    now_c: Finite
    next_c: Finite
    heated: bool


@dataclass(frozen=True, slots=True)
class SetMeasured:
    """The sweeps and dwells with the indices from `first` up to, not including, `end` are made, on the way up or down.

    `temperatures_c` are the means of the sensors' own thermometers meanwhile, by the sensor's name.
    """

    first: Index
    end: Index
    warming: bool
    temperatures_c: Celsius


OfTheTemperature = TemperatureWanted | SetMeasured
