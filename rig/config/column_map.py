"""Which columns of somebody else's files hold what, and in which units: the file that `--columns` names."""

from collections.abc import Mapping
from math import pi, radians
from types import MappingProxyType
from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from rig.config.section import Positive, Section
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

TIME, ANGLE, RATE, ACCELERATION, FIELD, TEMPERATURE, NUMBER = (
    "a time", "an angle", "a rate", "an acceleration", "a field", "a temperature", "a plain number",
)  # fmt: skip
UNITS: Mapping[str, tuple[str, float]] = MappingProxyType(
    {
        **dict.fromkeys(("s", "sec"), (TIME, 1.0)), "ms": (TIME, 1e-3), **dict.fromkeys(("us", "µs"), (TIME, 1e-6)),
        "ns": (TIME, 1e-9), "min": (TIME, 60.0), "h": (TIME, 3600.0),
        "rad": (ANGLE, 1.0), "mrad": (ANGLE, 1e-3), **dict.fromkeys(("deg", "°"), (ANGLE, radians(1))),
        "arcsec": (ANGLE, radians(1 / 3600)), **dict.fromkeys(("turn", "rev"), (ANGLE, 2 * pi)),
        "rad/s": (RATE, 1.0), "mrad/s": (RATE, 1e-3), **dict.fromkeys(("deg/s", "°/s", "dps"), (RATE, radians(1))),
        **dict.fromkeys(("deg/h", "°/h"), (RATE, radians(1 / 3600))), "rpm": (RATE, 2 * pi / 60),
        **dict.fromkeys(("m/s2", "m/s²"), (ACCELERATION, 1.0)), "g": (ACCELERATION, STANDARD_GRAVITY_M_S2),
        "mg": (ACCELERATION, 1e-3 * STANDARD_GRAVITY_M_S2),
        "T": (FIELD, 1.0), **dict.fromkeys(("uT", "µT"), (FIELD, 1e-6)), "nT": (FIELD, 1e-9), "G": (FIELD, 1e-4),
        "mG": (FIELD, 1e-7), **dict.fromkeys(("C", "°C"), (TEMPERATURE, 1.0)), "1": (NUMBER, 1.0),
    }
)  # fmt: skip
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
        if value not in UNITS:
            raise ValueError(f"no unit that is known here; allowed: {', '.join(UNITS)}")
        return value

    @property
    def factor(self) -> float:
        """What takes its numbers to SI units."""
        return UNITS[self.unit][1]


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
    found = UNITS[column.unit][0]
    if found != wanted:
        raise ValueError(f"{name} is {wanted}, and {column.unit} is the unit of {found}")
