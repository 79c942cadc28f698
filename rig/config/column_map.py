"""The columns of external files and their units: the file that `--columns` names."""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from rig.config.section import Positive, Section
from rig.config.units import ACCELERATION, ANGLE, FIELD, NUMBER, PRESSURE, RATE, TEMPERATURE, TIME, UNITS

# Files tell no pressure, and a column of theirs is multiplied by its unit alone.
ALLOWED = tuple(name for name, unit in UNITS.items() if unit.quantity != PRESSURE and not unit.zero)
SUFFIXES = (
    ("_rad_s", RATE),
    ("_m_s2", ACCELERATION),
    ("_rad", ANGLE),
    ("_s", TIME),
    ("_t", FIELD),
    ("_c", TEMPERATURE),
)
AxisDirection = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


class ColumnSection(Section):
    """One column of the file."""

    column: Annotated[str, Field(min_length=1, max_length=200)] = Field(description="its name in the file's heading")
    unit: str = Field(description="the unit of its numbers")

    @field_validator("unit")
    @classmethod
    def unit_exists(cls, value: str) -> str:
        """Refuse a unit that is not in the table, as nothing can be converted from it."""
        if value not in ALLOWED:
            raise ValueError(f"this unit is not known; allowed: {', '.join(ALLOWED)}")
        return value

    @property
    def factor(self) -> float:
        """The factor that converts its numbers to SI units."""
        return UNITS[self.unit].size


class AxisSection(Section):
    """One axis of the table, with the log's columns of its angle and rate."""

    along: AxisDirection = Field(
        description="the axis of the item it lies along where all angles are zero, by the right hand"
    )
    angle: ColumnSection
    rate: ColumnSection | None = None

    @model_validator(mode="after")
    def units_fit(self) -> Self:
        """Refuse units of another quantity than angle and rate."""
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
    def rates_of_all_axes_or_none(self) -> Self:
        """Refuse rates of some axes only: the item's rate needs those of all."""
        _fit("time", self.time, TIME)
        if len({axis.rate is None for axis in self.axes}) > 1:
            raise ValueError("give the rate of every axis, or of none")
        return self


class ColumnMap(Section):
    """The columns of files: `samples` of the readings; `motion` of sweeps or attitudes, or the log of a `table`.

    The keys of `samples` and `motion` are the rig's own names of columns. A column that already has such a name need
    not be named; columns that are not named are left out. `…_skip_lines` precede the heading.
    """

    samples: dict[str, ColumnSection] = Field(default_factory=dict)
    motion: dict[str, ColumnSection] = Field(default_factory=dict)
    table: TableSection | None = None
    samples_skip_lines: int = Field(default=0, ge=0, le=1000)
    motion_skip_lines: int = Field(default=0, ge=0, le=1000)

    @model_validator(mode="after")
    def fits_together(self) -> Self:
        """Refuse a column if its unit and the unit in its name are of different quantities."""
        for section in (self.samples, self.motion):
            for name, column in section.items():
                _fit(name, column, next((what for suffix, what in SUFFIXES if name.endswith(suffix)), NUMBER))
        if self.table is not None and self.motion:
            raise ValueError("give motion or table: a file tells attitudes, or the angles of axes")
        return self


def _fit(name: str, column: ColumnSection, wanted: str) -> None:
    quantity = UNITS[column.unit].quantity
    if quantity != wanted:
        raise ValueError(f"{name} is {_one(wanted)}, and {column.unit} is the unit of {_one(quantity)}")


def _one(name: str) -> str:
    return f"an {name}" if name[0] in "aeiou" else f"a {name}"
