"""Readings that were recorded elsewhere, and how they were moved, as a file of whoever turned the sensor tells it."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rig.config.section import SensorName
from rig.data.installed_kinds import measured, quantities
from rig.data.quantity import TEMPERATURE, Quantity
from rig.data.recording.channel import Channel, sample_dtype
from rig.data.recording.recorded_sensor import RecordedSensor

Told = Literal["sweeps", "attitudes", "turns"]
Columns = Mapping[str, NDArray[np.float64]]

LARGEST_NUMBER = 1e12  # either sign, in any SI unit: what is beyond is a mistake, and its square might overflow
NOT_STATED: Final = "not stated"
ItemWord = Annotated[str, Field(pattern="^[ -~]{1,40}$")]  # plain ASCII, as of sensors on a board
TIME = "time_s"


@dataclass(frozen=True, slots=True)
class Header:
    """The columns of a file: those `needed`, those of which there is `one_of`, groups of others that may be there.

    `between` are numbers that some must be above, and others that they may reach, where there is `one_row`.
    """

    needed: tuple[str, ...]
    one_of: tuple[str, ...] = ()
    optional: tuple[tuple[str, ...], ...] = ()
    one_row: bool = False
    between: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def check(self, columns: Columns) -> None:
        """Raises ValueError for columns, or numbers, that are no such file's."""
        there = columns.keys()
        groups = [group for group in self.optional if there & set(group)]
        known = {*self.needed, *self.one_of, *(name for group in groups for name in group)}
        wanted = known - set(self.one_of)
        if wanted - there or there - known or len(there & set(self.one_of)) != min(len(self.one_of), 1):
            raise ValueError(f"its columns are {', '.join(columns)}")
        for name, column in columns.items():
            if not (np.abs(column) < LARGEST_NUMBER).all():
                raise ValueError(f"a value of its {name} is not a number, or cannot have been measured")
            if self.one_row and len(column) != 1:
                raise ValueError(f"it has {len(column)} rows of {name}, not one")
            above, most = self.between.get(name, (-LARGEST_NUMBER, LARGEST_NUMBER))
            if not ((column > above) & (column <= most)).all():
                raise ValueError(f"its {name} is not above {above:g} and {most:g} at most")


def samples_header(needed: Collection[Quantity] = ()) -> Header:
    """The columns of readings, of the quantities `needed` and of whatever others."""
    columns = (TIME, *(name for quantity in needed for name in quantity.columns))
    others = (each.columns for each in quantities().values() if each not in needed)
    return Header(columns, (), (*others, TEMPERATURE.columns))


MOTIONS: Final[Mapping[Told, Header]] = MappingProxyType(
    {
        "sweeps": Header(
            ("start_s", "end_s", "axis_x", "axis_y", "axis_z"),
            ("speed_rad_s", "angle_rad"),
            (("angle_std_rad",), ("axis_std_rad",)),
        ),
        "attitudes": Header(
            ("start_s", "end_s", "qw", "qx", "qy", "qz"),
            (),
            (("rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"), ("attitude_std_rad",)),
        ),
        "turns": Header(  # what is said in a command, no file
            ("clock_ppm", "box_rad", "closure", "gravity_m_s2"),
            (),
            (("first_face",),),
            one_row=True,
            between={
                "clock_ppm": (0, 1e5),
                "box_rad": (0, 0.2),
                "closure": (-1, 1),
                "gravity_m_s2": (0, LARGEST_NUMBER),
                "first_face": (-1, 5),
            },
        ),
    }
)


@dataclass(frozen=True, slots=True)
class Item:
    """The sensor that was read, as far as anybody said."""

    name: SensorName
    part: ItemWord = NOT_STATED
    serial_number: ItemWord = NOT_STATED

    @property
    def range_rad_s(self) -> None:
        """Nobody said in which range it was read."""
        return

    @property
    def mounting(self) -> NDArray[np.float64]:
        """(3, 3) how it sits on the body that is moved: what the file tells is taken for the sensor's own axes."""
        return np.eye(3)


@dataclass(frozen=True, slots=True)
class ReadElsewhere:
    """The `readings` (n,) of an item, and the rows (N,) of sweeps or of attitudes that tell its `motion`, by column.

    Of "turns" by hand the readings tell it: then there is one row, of what somebody said beside. Times count from
    `origin_s` of the files' clock. `other_rows` of the readings' file hold readings of other sensors alone.
    """

    item: Item
    readings: Columns
    tells: Told
    motion: Columns
    origin_s: int = 0
    other_rows: int = 0

    @property
    def sensor(self) -> RecordedSensor:
        """The item as a recorded sensor, whose samples hold readings and no counts, on a clock of their own."""
        given = [each for each in measured().values() if each.columns[0] in self.readings]
        time_s = self.readings[TIME]
        span_s = float(np.ptp(time_s)) if len(time_s) else 0.0
        return RecordedSensor(
            part=self.item.part,
            serial_number=self.item.serial_number,
            rate_hz=(len(time_s) - 1) / span_s if span_s > 0 else 0.0,
            channels=tuple(Channel(each.name, each.name, "<f8", 1.0) for each in given),
            clock=self.item.name,
        )

    @property
    def samples(self) -> NDArray[Any]:
        """The readings (n,) as samples of `sensor`, stamped by their file's clock."""
        time_s = self.readings[TIME]
        channels = self.sensor.channels
        samples = np.zeros(len(time_s), sample_dtype(channels))
        samples["sequence"] = np.arange(len(time_s))
        samples["board_time_us"] = np.rint(1e6 * (time_s - time_s.min(initial=0.0)))
        samples["host_time_s"] = time_s
        for each in channels:
            columns = [self.readings[name] for name in each.measures.columns]
            samples[each.column] = np.column_stack(columns) if each.measures.shape else columns[0]
        return samples


@dataclass(frozen=True, slots=True)
class ToldElsewhere:
    """What a run file says of readings from elsewhere beside their tables, as `ReadElsewhere` does."""

    item: Item
    tells: Told
    origin_s: int = 0
    other_rows: Annotated[int, Field(ge=0)] = 0
