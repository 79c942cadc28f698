"""The columns of external files and their units, as stated in the file that `--columns` names."""

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from rig.config.section import Positive, Section
from rig.config.units import ACCELERATION, ANGLE, FIELD, NUMBER, PRESSURE, RATE, TEMPERATURE, TIME, UNITS

# Files contain no pressure, and their columns are only multiplied: units with an offset, such as °F, are excluded.
ALLOWED_UNITS = tuple(name for name, unit in UNITS.items() if unit.quantity != PRESSURE and not unit.zero)
TIMES = ("time_s", "start_s", "end_s")
SUFFIXES = (
    ("_rad_s", RATE),
    ("_m_s2", ACCELERATION),
    ("_rad", ANGLE),
    ("_s", TIME),
    ("_t", FIELD),
    ("_c", TEMPERATURE),
)
MIN_FACTOR = 1e-15
AxisDirection = Literal["+x", "-x", "+y", "-y", "+z", "-z"]


class ColumnSection(Section):
    """One column of the file.

    The column's numbers × `factor`, or ÷ `lsb_per_unit`, are in `unit`. A mirrored axis has a negative factor.
    """

    column: Annotated[str, Field(min_length=1, max_length=200)] = Field(
        description="its name in the file's heading, or its number, from 1"
    )
    unit: str | None = Field(default=None, description="the unit of its numbers; by default that of the key")
    factor: float | None = Field(default=None, description="units in one step of its numbers; -1 mirrors an axis")
    lsb_per_unit: float | None = Field(default=None, description="steps of its numbers in one unit")
    wraps_at: Positive | None = Field(
        default=None, description="the number at which a counter of time begins at 0 again, for example 4294967296"
    )

    @field_validator("column", mode="before")
    @classmethod
    def convert_number_to_text(cls, value: object) -> object:
        """Convert a column that is given by an integer to text, because the headings of a file are texts."""
        return str(value) if isinstance(value, int) and not isinstance(value, bool) else value

    @field_validator("unit")
    @classmethod
    def refuse_unknown_unit(cls, value: str | None) -> str | None:
        """Refuse a unit that is not in `ALLOWED_UNITS`."""
        if value is not None and value not in ALLOWED_UNITS:
            raise ValueError(f"this unit is not known; allowed: {', '.join(ALLOWED_UNITS)}")
        return value

    @field_validator("factor", "lsb_per_unit")
    @classmethod
    def refuse_zero(cls, value: float | None) -> float | None:
        """Refuse zero, and numbers too small or too large for the size of a sensor's unit."""
        if value is not None and not MIN_FACTOR < abs(value) < 1 / MIN_FACTOR:
            raise ValueError(f"must be between {MIN_FACTOR:g} and {1 / MIN_FACTOR:g}, of either sign")
        return value

    @model_validator(mode="after")
    def require_one_factor(self) -> Self:
        """Refuse `factor` together with `lsb_per_unit`."""
        if self.factor is not None and self.lsb_per_unit is not None:
            raise ValueError("give factor or lsb_per_unit, not both")
        return self

    @property
    def to_si(self) -> float:
        """The factor that converts the column's numbers to SI units."""
        step = 1 / self.lsb_per_unit if self.lsb_per_unit is not None else 1.0 if self.factor is None else self.factor
        return step * (1.0 if self.unit is None else UNITS[self.unit].size)


class AxisSection(Section):
    """One axis of a rate table, with the log's columns of its angle and rate."""

    direction: AxisDirection = Field(
        alias="along",
        description="the axis of the item that it is parallel to when all angles are zero, by the right-hand rule",
    )
    angle: ColumnSection
    rate: ColumnSection | None = None

    @model_validator(mode="after")
    def match_units(self) -> Self:
        """Refuse units of quantities other than angle and rate."""
        _fit("angle", self.angle, ANGLE)
        if self.rate is not None:
            _fit("rate", self.rate, RATE)
        return self


class TableSection(Section):
    """The log of a rate table: its time, and the angle of each axis, the outermost first."""

    time: ColumnSection
    axes: tuple[AxisSection, ...] = Field(min_length=1, max_length=3)
    attitude_std_deg: Positive | None = Field(
        default=None, description="standard deviation of the attitude about each axis"
    )

    @model_validator(mode="after")
    def require_rates_of_all_axes(self) -> Self:
        """Refuse columns without a unit, and rates of only some axes, because the item's rate needs all axes."""
        _fit("time", self.time, TIME)
        if any(column.unit is None for axis in self.axes for column in (self.time, axis.angle, axis.rate) if column):
            raise ValueError("state the unit of every column of a table")
        if len({axis.rate is None for axis in self.axes}) > 1:
            raise ValueError("give the rate of every axis, or of none")
        return self


class ColumnMap(Section):
    """The columns of files: `samples` of readings; `motion` of sweeps or attitudes, or the log of a `table`.

    The keys of `samples` and `motion` are the rig's names of columns. Columns with these names need no key; other
    columns without a key are left out.

    - …_skip_lines: lines before the heading.
    - …_rate_hz: rows per second of a file without a column of time.
    - …_missing: texts that mean a missing value, as an empty cell does.
    - motion_inverse: whether the quaternions take table to body coordinates.
    """

    samples: dict[str, ColumnSection] = Field(default_factory=dict)
    motion: dict[str, ColumnSection] = Field(default_factory=dict)
    table: TableSection | None = None
    samples_skip_lines: int = Field(default=0, ge=0, le=1000)
    motion_skip_lines: int = Field(default=0, ge=0, le=1000)
    samples_rate_hz: Positive | None = None
    motion_rate_hz: Positive | None = None
    samples_missing: tuple[str, ...] = ()
    motion_missing: tuple[str, ...] = ()
    motion_inverse: bool = False

    @model_validator(mode="after")
    def check_combination(self) -> Self:
        """Refuse a unit that contradicts a column's name, a rate together with times, and motion with a table."""
        for section, rate_hz in ((self.samples, self.samples_rate_hz), (self.motion, self.motion_rate_hz)):
            for name, column in section.items():
                _fit(name, column, next((what for suffix, what in SUFFIXES if name.endswith(suffix)), NUMBER))
            if rate_hz is not None and (timed := [name for name in section if name in TIMES]):
                raise ValueError(f"give the column of {timed[0]} or a rate, not both")
        if self.table is not None and self.motion:
            raise ValueError("give motion or table: a file contains attitudes, or the angles of axes")
        return self


STANDARD_NAMES = ColumnMap()  # every column has the rig's name
MAP_REMEDY = "Give a map of the columns; rig look LOG --write FILE writes one"


def _fit(name: str, column: ColumnSection, wanted: str) -> None:
    if column.wraps_at is not None and wanted != TIME:
        raise ValueError(f"{name} is {_add_article(wanted)}, but only a counter of time has wraps_at")
    quantity = wanted if column.unit is None else UNITS[column.unit].quantity
    if quantity != wanted:
        raise ValueError(f"{name} is {_add_article(wanted)}, but {column.unit} is the unit of {_add_article(quantity)}")


def _add_article(name: str) -> str:
    return f"an {name}" if name[0] in "aeiou" else f"a {name}"
