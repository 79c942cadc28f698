"""The quantities that sensors measure: their names and units, in files and on screens, in one table.

A quantity's names in files end with its `suffix`: `bias_m_s2`, `x_m_s2`. A new quantity is a row here, or comes with an
installed kind of sensor (`rig.data.installed_kinds`).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from math import pi
from typing import Final

from rig.estimation.earth import MICRO_G_M_S2

DEG_H: Final = pi / 180 / 3600  # rad/s
ROOT_HOUR: Final = 60.0  # √(3600 s): from √s to √h


@dataclass(frozen=True, slots=True)
class DisplayUnit:
    """A unit in which numbers are shown, and its `size` in SI."""

    name: str
    size: float


@dataclass(frozen=True, slots=True)
class MistakenUnit:
    """A `unit` in which readings are often given by mistake, the remedy, and an SI value that no part reaches."""

    unit: str
    remedy: str
    most: float

    @property
    def unusual(self) -> float:
        """A value, in SI, that most parts do not reach."""
        return self.most / 10


@dataclass(frozen=True, slots=True)
class Quantity:
    """One quantity that a sensor measures along its axes.

    - sensor: the kind of sensor; unit: the SI unit; suffix: this unit in names.
    - reading: the unit of a reading on a screen; bias: the unit of a bias, and its least number of decimals; drift: the
      unit of a bias' change over hours; residuals: the units of residuals in a figure, the largest first.
    - walk: the name of its white noise; walk_suffix: the SI unit of that noise in names; walk_unit: the displayed unit.
    - steady: the largest difference, apart from noise, that the means of two adjacent seconds at rest may have. No bias
      changes as fast; a hand, or a tilt by half a degree, causes more. The magnetic field itself causes a tenth of it.
    - d_si: the unit as a digital certificate writes it. towards: the direction to which a sensor at rest is turned.
    - mistaken: the unit in which readings are given by mistake.
    - offset: the ratio of the reading at zero to the bias: −1 if the bias is a correction, m = g/k − b.
    - axes: the letters of its axes.
    """

    name: str
    sensor: str
    unit: str
    suffix: str
    reading: DisplayUnit
    bias: DisplayUnit
    decimals: int
    drift: DisplayUnit
    residuals: tuple[DisplayUnit, ...]
    walk: str
    walk_suffix: str
    walk_unit: DisplayUnit
    steady: float
    d_si: str
    towards: str = "the reference"
    mistaken: MistakenUnit | None = None
    offset: int = 1
    axes: str = "xyz"

    def __str__(self) -> str:
        return self.name

    def file_key(self, what: str) -> str:
        """Return a file's key for the value `what` in this quantity's unit, such as `bias_rad_s`."""
        return f"{what}_{self.suffix}"

    def label(self, sensor: str) -> str:
        """Return a label of a sensor's readings: the full label, or only the sensor's name for a gyroscope's rates."""
        return self.full_label(sensor) if self.prefix else sensor

    @property
    def prefix(self) -> str:
        """The prefix of the names of its checks, limits and columns, such as `acceleration_`; empty for a rate."""
        return "" if self.name == RATE.name else f"{self.name}_"

    def full_label(self, sensor: str) -> str:
        """Return the sensor's name with the kind of sensor, such as `imu, accelerometer`, to label its readings."""
        return f"{sensor}, {self.sensor}"

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of its readings in a table, one for each axis."""
        return tuple(self.file_key(axis) for axis in self.axes)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one reading."""
        return (len(self.axes),)

    @property
    def parameter_units(self) -> tuple[str, ...]:
        """The units of the scale factors, then of the biases."""
        return ("1",) * len(self.axes) + (self.unit,) * len(self.axes)

    @property
    def parameter_signs(self) -> tuple[float, ...]:
        """The signs of scale factors, then of biases: −1 for a bias that corrects readings and is not part of them."""
        return (1.0,) * len(self.axes) + (float(self.offset),) * len(self.axes)


@dataclass(frozen=True, slots=True)
class Scalar:
    """One quantity without axes, which is recorded, shown and exported, and never calibrated.

    `sensor`: the kind of sensor; `unit`: the SI unit of its values; `suffix`: this unit in names; `reading`: the unit
    on a screen.
    """

    name: str
    sensor: str
    unit: str
    suffix: str
    reading: DisplayUnit

    def file_key(self, what: str) -> str:
        """Return a file's key for the value `what` in this quantity's unit, such as `pressure_pa`."""
        return f"{what}_{self.suffix}"

    @property
    def columns(self) -> tuple[str, ...]:
        """The one column of its readings in a table."""
        return (self.file_key(self.name),)

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of one reading."""
        return ()


RATE: Final = Quantity(
    name="rate",
    sensor="gyroscope",
    unit="rad/s",
    suffix="rad_s",
    reading=DisplayUnit("°/s", pi / 180),
    bias=DisplayUnit("rad/s", 1.0),
    decimals=5,  # a MEMS gyroscope's uncertainty
    drift=DisplayUnit("°/h", DEG_H),
    residuals=(DisplayUnit("mrad/s", 1e-3), DisplayUnit("µrad/s", 1e-6)),
    walk="angle random walk",
    walk_suffix="rad_sqrt_s",
    walk_unit=DisplayUnit("°/√h", pi / 180 / ROOT_HOUR),
    steady=5e-3,
    d_si=r"\radian\second\tothe{-1}",
    mistaken=MistakenUnit("°/s", "numpy.radians(readings)", 400.0),
    offset=-1,
)
ACCELERATION: Final = Quantity(
    name="acceleration",
    sensor="accelerometer",
    unit="m/s²",
    suffix="m_s2",
    reading=DisplayUnit("m/s²", 1.0),
    bias=DisplayUnit("m/s²", 1.0),
    decimals=5,
    drift=DisplayUnit("µg", MICRO_G_M_S2),
    residuals=(DisplayUnit("m/s²", 1.0), DisplayUnit("mm/s²", 1e-3), DisplayUnit("µm/s²", 1e-6)),
    walk="velocity random walk",
    walk_suffix="m_s_sqrt_s",
    walk_unit=DisplayUnit("m/s/√h", 1 / ROOT_HOUR),
    steady=0.05,
    d_si=r"\metre\second\tothe{-2}",
    towards="up",
    mistaken=MistakenUnit("g or mg", "9.80665 * readings for readings in g", 5000.0),
)
FIELD: Final = Quantity(
    name="field",
    sensor="magnetometer",
    unit="T",
    suffix="t",
    reading=DisplayUnit("µT", 1e-6),
    bias=DisplayUnit("µT", 1e-6),
    decimals=3,
    drift=DisplayUnit("nT", 1e-9),
    residuals=(DisplayUnit("µT", 1e-6), DisplayUnit("nT", 1e-9)),
    walk="white noise",
    walk_suffix="t_sqrt_s",
    walk_unit=DisplayUnit("nT √s", 1e-9),
    steady=2e-6,
    d_si=r"\tesla",
    towards="the field",
    mistaken=MistakenUnit("µT or gauss", "1e-6 * readings for readings in µT, 1e-4 for gauss", 0.1),
)
RIG_QUANTITIES: Final = (RATE, ACCELERATION, FIELD)
TEMPERATURE: Final = Scalar("temperature", "thermometer", "°C", "c", DisplayUnit("°C", 1.0))
PRESSURE: Final = Scalar("pressure", "barometer", "Pa", "pa", DisplayUnit("hPa", 100.0))
MIN_TEMPERATURE_C, MAX_TEMPERATURE_C = -273.15, 200.0  # that a part survives; kelvins and counts are beyond
SCALARS: Final = (TEMPERATURE, PRESSURE)


def select_displayed(quantities: Iterable[str]) -> list[str]:
    """Return the names of a sensor's displayed quantities: the temperature only if it measures nothing else."""
    names = list(quantities)
    return [name for name in names if name != TEMPERATURE.name] or names
