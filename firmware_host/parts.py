"""The parts with drivers on the board: one table for Python and, through `parts_header.py`, for C.

A new part is one entry here, of at most eight: the messages select sensors by a mask of eight bits. The errors of its
data sheet are in the rig's catalogue (`rig/config/sensors/sensor_catalogue.py`), its behaviour at its registers in the
model that the entry names.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firmware_host.emulator.chip.spi_device import SpiDevice


@dataclass(frozen=True, slots=True)
class BoardPart:
    """A part and its wiring.

    - `name`: its spelling in the board's message `identity`.
    - `driver`: its `struct sensor_driver` in `firmware/core`.
    - `who_am_i`: the value of its identity register.
    - `select`, `data_ready`: the chip's pins.
    - `model`: module and class of its register model in `emulator/`.
    - `identities`: the values of that register in other parts, and those parts' names.
    - `model_options`: the names of that model's further arguments: `range_deg_s`, `ready_s`, or none.
    """

    name: str
    driver: str
    who_am_i: int
    select: str
    data_ready: str
    model: str
    identities: Mapping[int, str] = field(default_factory=dict)
    model_options: tuple[str, ...] = ()

    @property
    def register_model(self) -> "Callable[..., SpiDevice]":
        """The class that simulates the part at its registers."""
        module, name = self.model.split(":")
        model_class: Callable[..., Any] = getattr(import_module(f"firmware_host.emulator.parts.{module}"), name)
        return model_class

    def describe_other(self, who_am_i: int) -> str:
        """Return the description of a different part that answers, identified by its identity register."""
        other = self.identities.get(who_am_i, "an unknown part")
        return f"{other}, identity 0x{who_am_i:02x} instead of 0x{self.who_am_i:02x}"


# Sources of the other parts' identities: the identities in Linux' drivers st_gyro_core.c and st_lsm6dsx_core.c
# (0x0F), inv_mpu_iio.h and inv_icm42600.h (0x75) and adis16475.c, whose parts hold their own number (0x72).
GYROSCOPES: Mapping[str, BoardPart] = MappingProxyType(
    {
        "lsm9ds1": BoardPart(
            name="LSM9DS1",
            driver="lsm9ds1_gyro",
            who_am_i=0x68,
            select="PA11",
            data_ready="PA8",
            model="lsm9ds1:Lsm9ds1",
            identities={
                0x69: "an LSM6DS3",
                0x6A: "an LSM6DSL or its like",
                0x6C: "an LSM6DSO or its like",
                0xD4: "an L3GD20 or LSM9DS0",
                0xD7: "an L3GD20H",
            },
        ),
        "mpu9250": BoardPart(
            name="MPU-9250",
            driver="mpu9250_gyro",
            who_am_i=0x71,
            select="PB0",
            data_ready="PA12",
            model="mpu9250:Mpu9250",
            identities={
                0x68: "an MPU-6050, MPU-6000 or MPU-9150",
                0x70: "an MPU-6500",
                0x73: "an MPU-9255",
                0x74: "an MPU-6515",
                0xAF: "an ICM-20608",
            },
        ),
        "adis16465": BoardPart(
            name="ADIS16465",
            driver="adis16465_gyro",
            who_am_i=0x4051,  # 16465
            select="PA4",
            data_ready="PA1",
            model="adis16465:Adis16465",
            identities={number: f"an ADIS{number}" for number in range(16001, 17000) if number != 16465},
            model_options=("range_deg_s", "ready_s"),  # three variants, one for each range, and a slow start
        ),
        "icm42688p": BoardPart(
            name="ICM-42688-P",
            driver="icm42688p_gyro",
            who_am_i=0x47,
            select="PA10",
            data_ready="PA9",
            model="icm42688p:Icm42688P",
            identities={
                0x12: "an ICM-20602",
                0x3B: "an ICM-40609-D",
                0x40: "an ICM-42600",
                0x41: "an ICM-42602",
                0x42: "an ICM-42605",
                0x46: "an ICM-42622",
                0x5C: "an ICM-42631",
                0x70: "an MPU-6500",
                0x71: "an MPU-9250",
            },
        ),
        "lsm6dsv16x": BoardPart(
            name="LSM6DSV16X",
            driver="lsm6dsv16x_gyro",
            who_am_i=0x70,
            select="PA7",
            data_ready="PB7",
            model="lsm6dsv16x:Lsm6dsv16x",
            identities={
                0x68: "an LSM9DS1",
                0x69: "an LSM6DS3",
                0x6A: "an LSM6DSL or its like",
                0x6B: "an LSM6DSR or its like",
                0x6C: "an LSM6DSO or its like",
                0x71: "an LSM6DSV16B",
            },
        ),
    }
)

MAGNETOMETERS: Mapping[str, BoardPart] = MappingProxyType(
    {
        "lsm9ds1_magnetometer": BoardPart(
            name="LSM9DS1-M",
            driver="lsm9ds1_magnetometer",
            who_am_i=0x3D,
            select="PB1",
            data_ready="PA3",
            model="lsm9ds1_magnetometer:Lsm9ds1Magnetometer",
        )
    }
)

BOARD_PARTS: Mapping[str, BoardPart] = MappingProxyType({**GYROSCOPES, **MAGNETOMETERS})  # in the board's order
