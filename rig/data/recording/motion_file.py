"""External readings, and their motion from the turner's file."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rig.config.section import SensorName
from rig.data.installed_kinds import channel_contents, quantities
from rig.data.quantity import TEMPERATURE, Quantity
from rig.data.recording.channel import Channel, sample_dtype
from rig.data.recording.layout_keys import NOT_STATED
from rig.data.recording.recorded_sensor import RecordedSensor

MotionKind = Literal["sweeps", "attitudes", "turns"]
Columns = Mapping[str, NDArray[np.float64]]

MAX_NUMBER = 1e12  # in any SI unit: a larger one is a mistake, and its square might overflow
ItemWord = Annotated[str, Field(pattern="^[ -~]{1,40}$")]  # plain ASCII, as for sensors on a board
TIME = "time_s"
QUATERNION = ("qw", "qx", "qy", "qz")


@dataclass(frozen=True, slots=True)
class Header:
    """The columns that a file may have: all `needed` ones, exactly one of `one_of`, and groups of `optional` ones.

    A file has either all columns of a group or none. `one_row`: whether the file must have exactly one row. `between`:
    for each bounded column, the number that its values must exceed, and the largest value allowed.
    """

    needed: tuple[str, ...]
    one_of: tuple[str, ...] = ()
    optional: tuple[tuple[str, ...], ...] = ()
    one_row: bool = False
    between: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """All columns that the file may have."""
        return (*self.needed, *self.one_of, *(name for group in self.optional for name in group))

    def check(self, columns: Columns) -> None:
        """Raise ValueError for columns or numbers that the file cannot have."""
        names = columns.keys()
        groups = [group for group in self.optional if names & set(group)]
        allowed = {*self.needed, *self.one_of, *(name for group in groups for name in group)}
        wanted = allowed - set(self.one_of)
        if wanted - names or names - allowed or len(names & set(self.one_of)) != min(len(self.one_of), 1):
            raise ValueError(f"its columns are {', '.join(columns)}")
        for name, column in columns.items():
            if not (np.abs(column) < MAX_NUMBER).all():
                raise ValueError(f"a value of its {name} is not a number, or cannot have been measured")
            if self.one_row and len(column) != 1:
                raise ValueError(f"it has {len(column)} rows of {name}, not one")
            above, most = self.between.get(name, (-MAX_NUMBER, MAX_NUMBER))
            if not ((column > above) & (column <= most)).all():
                raise ValueError(f"its {name} must be above {above:g} and at most {most:g}")


def samples_header(needed: Collection[Quantity] = ()) -> Header:
    """Return the header of a file of readings: of the quantities `needed` and any others."""
    columns = (TIME, *(name for quantity in needed for name in quantity.columns))
    others = (quantity.columns for quantity in quantities().values() if quantity not in needed)
    return Header(columns, (), (*others, TEMPERATURE.columns))


MOTIONS: Final[Mapping[MotionKind, Header]] = MappingProxyType(
    {
        "sweeps": Header(
            ("start_s", "end_s", "axis_x", "axis_y", "axis_z"),
            ("speed_rad_s", "angle_rad"),
            (("angle_std_rad",), ("axis_std_rad",)),
        ),
        "attitudes": Header(
            ("start_s", "end_s", *QUATERNION),
            (),
            (("rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"), ("attitude_std_rad",)),
        ),
        "turns": Header(  # from the options of a command, not from a file
            ("clock_ppm", "box_rad", "closure", "gravity_m_s2"),
            (),
            (("first_face",),),
            one_row=True,
            between={
                "clock_ppm": (0, 1e5),
                "box_rad": (0, 0.2),
                "closure": (-1, 1),
                "gravity_m_s2": (0, MAX_NUMBER),
                "first_face": (-1, 5),
            },
        ),
    }
)


@dataclass(frozen=True, slots=True)
class Item:
    """The sensor that was read, as declared by the user."""

    name: SensorName
    part: ItemWord = NOT_STATED
    serial_number: ItemWord = NOT_STATED

    @property
    def range_rad_s(self) -> None:
        """The range of the sensor, rad/s: always None, because the files do not state it."""
        return

    @property
    def mounting(self) -> NDArray[np.float64]:
        """The mounting (3, 3) on the moving body: the identity, because the file's axes count as the sensor's own."""
        return np.eye(3)


@dataclass(frozen=True, slots=True)
class ExternalReadings:
    """The `readings` (n,) of an item, and the rows (N,) of its `motion`, both by column.

    `tells` is the kind of the motion: sweeps, attitudes or "turns". Turns by hand are detected in the readings
    themselves; their `motion` is one row, in which the user declares what was done. Times are relative to `origin_s` of
    the files' clock. `other_rows` is the number of rows with readings of other sensors only. `note` states what the
    file's format does not specify about its readings, "" if nothing.
    """

    item: Item
    readings: Columns
    tells: MotionKind
    motion: Columns
    origin_s: int = 0
    other_rows: int = 0
    note: str = ""

    @property
    def sensor(self) -> RecordedSensor:
        """The item as a recorded sensor, whose samples hold readings instead of counts, on a clock of their own."""
        present = [channel for channel in channel_contents().values() if channel.columns[0] in self.readings]
        time_s = self.readings[TIME]
        span_s = float(np.ptp(time_s)) if len(time_s) else 0.0
        return RecordedSensor(
            part=self.item.part,
            serial_number=self.item.serial_number,
            rate_hz=(len(time_s) - 1) / span_s if span_s > 0 else 0.0,
            channels=tuple(Channel(channel.name, channel.name, "<f8", 1.0) for channel in present),
            clock=self.item.name,
        )

    @property
    def samples(self) -> NDArray[Any]:
        """Readings (n,) as samples of `sensor`, stamped by their file's clock."""
        time_s = self.readings[TIME]
        channels = self.sensor.channels
        samples = np.zeros(len(time_s), sample_dtype(channels))
        samples["sequence"] = np.arange(len(time_s))
        samples["board_time_us"] = np.rint(1e6 * (time_s - time_s.min(initial=0.0)))
        samples["host_time_s"] = time_s
        for channel in channels:
            columns = [self.readings[name] for name in channel.measures.columns]
            samples[channel.column] = np.column_stack(columns) if channel.measures.shape else columns[0]
        return samples


@dataclass(frozen=True, slots=True)
class ExternalHeader:
    """The fields of `ExternalReadings` that a run file holds as JSON: all but the tables of readings and motion."""

    item: Item
    tells: MotionKind
    origin_s: int = 0
    other_rows: Annotated[int, Field(ge=0)] = 0
    note: Annotated[str, Field(max_length=500)] = ""
