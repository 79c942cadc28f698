"""The section `lines` of a sensor: the columns of the lines that a device sends, one sample in each."""

import re
from collections import Counter
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from rig.config.section import Positive, Section
from rig.config.sensors.stated_temperature import StatedTemperatureSection, WithinK
from rig.errors.quoting import quote

GYROSCOPE, ACCELEROMETER, MAGNETOMETER = ("gx", "gy", "gz"), ("ax", "ay", "az"), ("mx", "my", "mz")
COLUMNS = ("time", "sequence", *GYROSCOPE, *ACCELEROMETER, *MAGNETOMETER, "temperature", "-")
SEPARATORS = {"comma": b",", "semicolon": b";", "tab": b"\t", "space": b" "}
UNDETERMINED = "?"  # what `rig lines` writes for values that the readings do not determine
MAX_GAP_S = 2.0  # a device that is silent for longer is lost
PRINTABLE = r"^[ -~]*$"
USUALLY_NONE: dict[str, Any] = {"usual": "none"}

Scale = Annotated[
    float,
    Field(
        gt=0,
        description="value of a printed 1 in the unit; 1 if the device prints the unit itself, the sensitivity if "
        "it prints counts",
        json_schema_extra={"unit": "1"},
    ),
]
Decimals = Annotated[
    int | None,
    Field(
        ge=0,
        le=9,
        description="digits after the point that the device prints, which set the resolution; if left out, it counts "
        "as fine enough",
        json_schema_extra={"unit": "1"},
    ),
]


def _refuse_gap(value: str) -> str:
    """Return the value. Raise ValueError for `?`, which `rig lines` writes if readings do not determine a value."""
    if value == UNDETERMINED:
        raise ValueError("the readings did not determine it: look it up in the device's program, and write it here")
    return value


class LineTimeSection(Section):
    """The column `time`: the time of the sample by the device's own clock."""

    unit: Literal["ns", "us", "ms", "s", "?"] = Field(description="unit in which the device prints it")
    wrap: Annotated[float, Field(ge=0)] = Field(
        default=2.0**32,
        description="printed time at which it starts again at zero: `4294967296` of an Arduino's `micros()` and "
        "`millis()`, `1073741824` of MicroPython's `ticks_us()`; `0`: never",
        json_schema_extra={"unit": "as printed"},
    )

    unit_is_given = field_validator("unit")(_refuse_gap)


class LineRateSection(Section):
    """The columns `gx gy gz`: the gyroscope's readings."""

    unit: Literal["deg/s", "rad/s", "mdeg/s", "mrad/s", "?"] = Field(description="unit of the rates")
    scale: Scale = 1.0
    decimals: Decimals = None

    unit_is_given = field_validator("unit")(_refuse_gap)


class LineAccelerationSection(Section):
    """The columns `ax ay az`: the accelerometer's readings; at rest, 1 g upwards."""

    unit: Literal["m/s2", "g", "mg", "?"] = Field(description="unit of the accelerations")
    scale: Scale = 1.0
    decimals: Decimals = None

    unit_is_given = field_validator("unit")(_refuse_gap)


class LineFieldSection(Section):
    """The columns `mx my mz`: the magnetometer's readings."""

    unit: Literal["uT", "nT", "T", "gauss", "mgauss", "?"] = Field(description="unit of the magnetic field")
    scale: Scale = 1.0
    decimals: Decimals = None

    unit_is_given = field_validator("unit")(_refuse_gap)


class LineTemperatureSection(Section):
    """The column `temperature`: printed value × scale + offset is in °C. Without the column, `stated_c` applies."""

    scale: Scale = 1.0
    offset_c: float = Field(default=0.0, description="temperature at a printed 0")
    decimals: Decimals = None
    stated_c: float | None = Field(
        default=None,
        ge=-40,
        le=85,
        description="temperature of the sensor, stated if the device prints none; without it U allows for a change "
        "of 20 K",
    )
    stated_within_k: WithinK = 5.0

    @property
    def stated(self) -> StatedTemperatureSection | None:
        """The stated temperature, None if it is not stated."""
        if self.stated_c is None:
            return None
        return StatedTemperatureSection(stated_c=self.stated_c, stated_within_k=self.stated_within_k)


class LineScalarSection(Section):
    """A column of a quantity without axes, such as air pressure; it is recorded as the sensor `<sensor>_<name>`."""

    unit: Literal["Pa", "hPa", "kPa", "degC", "K"] = Field(description="unit in which it is printed")
    scale: Scale = 1.0


ScalarName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=20)]


class LinesSection(Section):
    """The lines that a device prints, one per sample. See [a sensor that prints lines](how-to/at-the-rig/lines.md)."""

    columns: tuple[str, ...] = Field(
        min_length=3,
        max_length=40,
        description="the contents of a line, from left to right; `-` is a number or a text that is not read",
        json_schema_extra={
            "allowed": "`time`, `sequence`, `gx gy gz`, `ax ay az`, `mx my mz`, `temperature`, names in `scalars`, `-`"
        },
    )
    separator: Literal["comma", "semicolon", "tab", "space"] = Field(
        default="comma", description="the separator between the numbers; spaces around it do not matter"
    )
    prefix: str = Field(
        default="",
        max_length=40,
        pattern=PRINTABLE,
        description="text at the start of every sample's line, such as `$IMU,`; other lines are skipped; `*` in it "
        "stands for any digits, as in `I (*) imu: `",
        json_schema_extra={"allowed": "at most 40 plain characters"} | USUALLY_NONE,
    )
    keys: tuple[Annotated[str, Field(min_length=1, max_length=40, pattern=PRINTABLE)], ...] = Field(
        default=(),
        max_length=40,
        description='text before each number, if the device prints names: `["gx:", "gy:", "gz:"]`; brackets and '
        "separators between them do not matter",
        json_schema_extra={"allowed": "as many as `columns`"} | USUALLY_NONE,
    )
    comment: str = Field(
        default="#",
        max_length=4,
        pattern=PRINTABLE,
        description="beginning of lines that are not samples",
        json_schema_extra={"allowed": "at most 4 plain characters"},
    )
    checksum: Literal["none", "nmea"] = Field(
        default="none",
        description="`nmea`: the line ends with `*` and two hexadecimal digits, the XOR of all characters before it "
        "except a `$` or `!` at the start; one damaged line in 256 passes this test, whereas without it a damaged "
        "digit always passes",
    )
    clock: Literal["device", "counted", "arrival"] = Field(
        default="device",
        description="clock of the samples: `device`, the column `time`; `counted`, the column `sequence`, of a "
        "device that samples by a timer; `arrival`, the computer's clock when a line arrives, which has a line of "
        "its own in the budget",
    )
    time: LineTimeSection | None = Field(default=None, description="the column `time`")
    sequence_wrap: int = Field(
        default=0,
        ge=0,
        le=2**53,
        description="number at which the column `sequence` starts again at zero; `0`: never",
        json_schema_extra={"unit": "1"},
    )
    jitter_ms: Positive = Field(
        default=20.0,
        le=1000,
        description="with `clock: arrival`, how much later than usual a line may arrive: half of the width",
    )
    rate: LineRateSection = Field(description="the gyroscope's columns")
    acceleration: LineAccelerationSection | None = Field(default=None, description="the accelerometer's columns")
    field: LineFieldSection | None = Field(
        default=None, description="the magnetometer's columns; recorded as the magnetometer `<sensor>_field`"
    )
    temperature: LineTemperatureSection = Field(
        default=LineTemperatureSection(), description="the thermometer's column, or the temperature stated in its place"
    )
    scalars: dict[ScalarName, LineScalarSection] = Field(
        default=dict[ScalarName, LineScalarSection](),
        max_length=16,
        description="columns of quantities without axes, by their names",
    )

    @field_validator("columns")
    @classmethod
    def require_complete_columns(cls, columns: tuple[str, ...]) -> tuple[str, ...]:
        """Refuse repeated columns, incomplete triads, and lines without a gyroscope."""
        twice = [name for name, count in Counter(columns).items() if count > 1 and name != "-"]
        if twice:
            raise ValueError(f"{', '.join(twice)} is listed twice")
        for axes in (GYROSCOPE, ACCELEROMETER, MAGNETOMETER):
            present = [axis for axis in axes if axis in columns]
            if present != [] and len(present) < 3:
                raise ValueError(f"of {' '.join(axes)} it has {' '.join(present)} only; name all three")
        if "gx" not in columns:
            raise ValueError("gx gy gz must be among them: the time of every rotation is found from the gyroscope")
        return columns

    @model_validator(mode="after")
    def match_columns_and_sections(self) -> Self:
        """Refuse unknown columns, reserved names, and columns, sections or keys without their counterparts."""
        if self.keys and len(self.keys) != len(self.columns):
            raise ValueError(f"there are {len(self.keys)} keys for {len(self.columns)} columns; give one for each")
        if reserved := sorted(self.scalars.keys() & {*COLUMNS, "field"}):
            raise ValueError(f"{', '.join(reserved)}: cannot name a scalar, because it means something else here")
        if unknown := [name for name in self.columns if name not in COLUMNS and name not in self.scalars]:
            raise ValueError(
                f"no such column: {', '.join(map(quote, unknown))}; it may be {', '.join(COLUMNS)} or a name in scalars"
            )
        if missing := [name for name in self.scalars if name not in self.columns]:
            raise ValueError(f"there is a section scalars.{missing[0]}, but no column {missing[0]}")
        described = {"time": self.time, "mx": self.field}
        for column, section in described.items():
            if (column in self.columns) != (section is not None):
                key = "field" if column == "mx" else column
                raise ValueError(f"give the column {column} and the section {key} both, or neither")
        if self.acceleration is not None and "ax" not in self.columns:
            raise ValueError("there is a section acceleration, but no columns ax ay az")
        return self

    @model_validator(mode="after")
    def require_clock_column(self) -> Self:
        """Refuse a clock whose column is missing, and a checksum if the prefix contains changing digits."""
        if self.clock == "device" and self.time is None:
            raise ValueError(
                "the clock is the device's, but there is no column time: write clock: counted if the device samples by "
                "a timer and prints a column sequence, else clock: arrival"
            )
        if "*" in self.prefix and self.checksum != "none":
            raise ValueError("digits that change, * in prefix, cannot be left out of a checksum: give one of the two")
        if self.clock == "counted" and "sequence" not in self.columns:
            raise ValueError("the clock is counted, but there is no column sequence")
        return self

    @property
    def prefix_pattern(self) -> re.Pattern[bytes] | None:
        """The pattern of a prefix with changing digits; None for any other prefix."""
        if "*" not in self.prefix:
            return None
        return re.compile(b"^" + rb"\d+".join(map(re.escape, self.prefix.encode().split(b"*"))), re.MULTILINE)

    @property
    def least_bytes(self) -> int:
        """The length of the shortest line: a digit and a separator for each column, and the fixed text."""
        return 2 * len(self.columns) + len(self.prefix) + sum(map(len, self.keys)) + 3 * (self.checksum == "nmea")
