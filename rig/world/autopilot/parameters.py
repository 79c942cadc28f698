"""The parameters of a simulated autopilot: names and types of its firmware, and a file that keeps them.

Sources: ArduPilot, libraries/AP_InertialSensor (AP_InertialSensor_Params), GCS_Param.cpp; PX4, src/lib/parameters,
src/modules/mavlink/mavlink_parameters.cpp.
"""

import json
import struct
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Literal

FLOAT, INT8, INT32 = 9, 2, 6  # MAV_PARAM_TYPE
Firmware = Literal["ardupilot", "px4"]
DEVICE_ID = 2621698  # of an ICM-42688 on SPI; a further one has its number added


def factory(firmware: Firmware, imus: int) -> dict[str, tuple[int, float]]:
    """Type and value of each parameter, of an autopilot with so many IMUs."""
    return _ardupilot(imus) if firmware == "ardupilot" else _px4(imus)


def _ardupilot(imus: int) -> dict[str, tuple[int, float]]:
    found: dict[str, tuple[int, float]] = {
        "AHRS_ORIENTATION": (INT8, 0),
        "INS_GYR_CAL": (INT8, 1),
        "INS_GYRO_FILTER": (INT8 + 2, 20),  # AP_Int16
        "INS_ACCEL_FILTER": (INT8 + 2, 20),
        "INS_HNTCH_ENABLE": (INT8, 0),
        "INS_HNTC2_ENABLE": (INT8, 0),
        "BRD_SERIAL_NUM": (INT8 + 2, 0),
    }
    for place in range(3):  # the tables have room for three, whatever there is
        nth = str(place + 1) if place else ""
        gyro = f"INS_GYR{nth}OFFS" if place else "INS_GYROFFS"
        found |= {f"{gyro}_{axis}": (FLOAT, 0.0) for axis in "XYZ"}
        found |= {f"INS_ACC{nth}OFFS_{axis}": (FLOAT, 0.0) for axis in "XYZ"}
        found |= {f"INS_ACC{nth}SCAL_{axis}": (FLOAT, 1.0) for axis in "XYZ"}
        found |= {f"INS_GYR{nth}_ID": (INT32, DEVICE_ID + place if place < imus else 0)}
        found |= {f"INS_TCAL{place + 1}_ENABLE": (INT8, 0), f"INS_GYR{place + 1}_CALTEMP": (FLOAT, -300.0)}
    return found


def _px4(imus: int) -> dict[str, tuple[int, float]]:
    found: dict[str, tuple[int, float]] = {
        "SENS_BOARD_ROT": (INT32, 0),
        **{f"SENS_BOARD_{axis}_OFF": (FLOAT, 0.0) for axis in "XYZ"},
        "TC_G_ENABLE": (INT32, 0),
        "TC_A_ENABLE": (INT32, 0),
        "IMU_GYRO_CAL_EN": (INT32, 0),
        "SENS_IMU_AUTOCAL": (INT32, 0),
        "IMU_GYRO_CUTOFF": (FLOAT, 40.0),
        "EKF2_EN": (INT32, 0),
    }
    for place in range(4):
        there = place < imus
        for kind in ("GYRO", "ACC"):
            found |= {f"CAL_{kind}{place}_ID": (INT32, DEVICE_ID + place if there else 0)}
            found |= {f"CAL_{kind}{place}_{axis}OFF": (FLOAT, 0.0) for axis in "XYZ"}
        found |= {f"CAL_ACC{place}_{axis}SCALE": (FLOAT, 1.0) for axis in "XYZ"}
    return found


class Parameters:
    """What an autopilot has set, by name; kept in a file where there is one, as its own memory keeps it.

    Raises ValueError for a parameter that the firmware does not have, and for a file that is none of these.
    """

    def __init__(self, firmware: Firmware, imus: int, left: Mapping[str, float], file: Path | None = None) -> None:
        self._firmware, self._file = firmware, file
        made = factory(firmware, imus)
        if unknown := left.keys() - made.keys():
            raise ValueError(f"{firmware} has no parameter {', '.join(sorted(unknown))}")
        self.types = {name: kind for name, (kind, _) in made.items()}
        self._values: dict[str, float] = {name: value for name, (_, value) in made.items()}
        for name, value in left.items():
            self._values[name] = self._as_kept(name, value)
        if file is not None and file.exists():
            kept = json.loads(file.read_text(encoding="utf-8"))
            self._values |= {name: struct.unpack("<f", bytes.fromhex(each))[0] if self.types[name] == FLOAT else each
                             for name, each in kept.items()}  # fmt: skip

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._values

    @property
    def names(self) -> list[str]:
        """The names of all parameters, in the order in which they are numbered."""
        return list(self._values)

    def field(self, name: str) -> bytes:
        """The four bytes that stand for it in a message: PX4 copies whole numbers, ArduPilot casts them."""
        if self.types[name] != FLOAT and self._firmware == "px4":
            return struct.pack("<i", int(self._values[name]))
        return struct.pack("<f", self._values[name])

    def set_field(self, name: str, field: bytes) -> None:
        """Set it to what four bytes of a message mean."""
        if self.types[name] != FLOAT and self._firmware == "px4":
            value = float(struct.unpack("<i", field)[0])
        else:
            value = struct.unpack("<f", field)[0]
        if not isfinite(value):  # neither takes what is no number
            return
        self._values[name] = self._as_kept(name, value)
        if self._file is not None:
            kept = {each: struct.pack("<f", value).hex() if self.types[each] == FLOAT else value
                    for each, value in self._values.items()}  # fmt: skip
            new = self._file.with_suffix(".new")
            new.write_text(json.dumps(kept), encoding="utf-8")
            new.replace(self._file)

    def _as_kept(self, name: str, value: float) -> float:
        if self.types[name] == FLOAT:
            single: float = struct.unpack("<f", struct.pack("<f", value))[0]
            return single
        return float(int(value))
