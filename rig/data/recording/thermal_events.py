"""The events of a calibration over temperature in its recording, other than those of sweeps and dwells."""

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from rig.data.validation import Finite

Index = Annotated[int, Field(ge=0)]
Celsius = dict[str, Finite]


@dataclass(frozen=True, slots=True)
class TemperatureWanted:
    """A request to warm or cool the sensors, now at `now_c`, until the first of them is at `next_c`.

    The operator changes the temperature; if `heated`, the board's heater does.
    """

    warming: bool
    now_c: Finite
    next_c: Finite
    heated: bool


@dataclass(frozen=True, slots=True)
class SetMeasured:
    """All sweeps and dwells of one temperature step are recorded.

    Their indices are from `first` up to, not including, `end`. `warming`: whether the sensors became warmer or, if
    false, colder during them. `temperatures_c` are the mean temperatures of the sensors' own thermometers, by name.
    """

    first: Index
    end: Index
    warming: bool
    temperatures_c: Celsius


OfTheTemperature = TemperatureWanted | SetMeasured
