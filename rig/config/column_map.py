"""Which columns of somebody else's files hold what, and in which units: the file that `--columns` names."""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from rig.config.section import Positive, Section
from rig.config.units import ACCELERATION, ANGLE, FIELD, NUMBER, PRESSURE, RATE, TEMPERATURE, TIME, UNITS

# Files tell no pressure, and a column of theirs is multiplied by its unit alone.
ALLOWED = tuple(name for name, unit in UNITS.items() if unit.of != PRESSURE and not unit.zero)
SUFFIXES = (
    ("_rad_s", RATE),
    ("_m_s2", ACCELERATION),
    ("_rad", ANGLE),
    ("_s", TIME),
    ("_t", FIELD),
    ("_c", TEMPERATURE),
)
Along = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


class ColumnSection(Section):
    """One column of the file."""

    column: Annotated[str, Field(min_length=1, max_length=200)] = Field(description="its name in the file's heading")
    unit: str = Field(description="the unit of its numbers")

    @field_validator("unit")
    @classmethod
    def known(cls, value: str) -> str:
        """A unit that is not known is no unit to convert from."""
        if value not in ALLOWED:
            raise ValueError(f"no unit that is known here; allowed: {', '.join(ALLOWED)}")
        return value

    @property
    def factor(self) -> float:
        """What takes its numbers to SI units."""
        return UNITS[self.unit].size


class AxisSection(Section):
    """One axis of the table, of the log's columns that tell it."""

    along: Along = Field(description="the axis of the item it lies along where all angles are zero, by the right hand")
    angle: ColumnSection
    rate: ColumnSection | None = None

    @model_validator(mode="after")
    def units_fit(self) -> Self:
        """An angle is no rate."""
        _fit("angle", self.angle, ANGLE)
        if self.rate is not None:
            _fit("rate", self.rate, RATE)
        return self


class TableSection(Section):
    """The log of a rate table: its time, and the angle of each axis, the outermost first."""

    time: ColumnSection
    axes: tuple[AxisSection, ...] = Field(min_length=1, max_length=3)
    attitude_std_deg: Positive | None = Field(
        default=None, description="how well the attitude is known about each axis, one standard deviation"
    )

    @model_validator(mode="after")
    def told_alike(self) -> Self:
        """The item's rate is known where every axis tells its own."""
        _fit("time", self.time, TIME)
        if len({axis.rate is None for axis in self.axes}) > 1:
            raise ValueError("give the rate of every axis, or of none")
        return self


class ColumnMap(Section):
    """What stands where: `samples` of the readings' file; `motion` of the sweeps' or attitudes', or a `table`'s log.

    The keys of `samples` and `motion` are the rig's own names of columns. A column that already has such a name need
    not be named; columns that nobody names are left out. `…_skip_lines` stand before the heading.
    """

    samples: dict[str, ColumnSection] = Field(default_factory=dict)
    motion: dict[str, ColumnSection] = Field(default_factory=dict)
    table: TableSection | None = None
    samples_skip_lines: int = Field(default=0, ge=0, le=1000)
    motion_skip_lines: int = Field(default=0, ge=0, le=1000)

    @model_validator(mode="after")
    def fits_together(self) -> Self:
        """The unit that a name carries is what the column is converted to."""
        for section in (self.samples, self.motion):
            for name, column in section.items():
                _fit(name, column, next((what for suffix, what in SUFFIXES if name.endswith(suffix)), NUMBER))
        if self.table is not None and self.motion:
            raise ValueError("give motion or table: a file tells attitudes, or the angles of axes")
        return self


def _fit(name: str, column: ColumnSection, wanted: str) -> None:
    found = UNITS[column.unit].of
    if found != wanted:
        raise ValueError(f"{name} is {_one(wanted)}, and {column.unit} is the unit of {_one(found)}")


def _one(name: str) -> str:
    return f"an {name}" if name[0] in "aeiou" else f"a {name}"
