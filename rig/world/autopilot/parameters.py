"""The parameters of a simulated autopilot: names and types of its firmware, and a file that stores them.

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
DEVICE_ID = 2621698  # device number of an ICM-42688 on SPI; the IMU's number is added to it


def build_factory_parameters(firmware: Firmware, imus: int) -> dict[str, tuple[int, float]]:
    """Return type and value of every parameter of an autopilot with `imus` IMUs."""
    return _build_ardupilot(imus) if firmware == "ardupilot" else _build_px4(imus)


def _build_ardupilot(imus: int) -> dict[str, tuple[int, float]]:
    parameters: dict[str, tuple[int, float]] = {
        "AHRS_ORIENTATION": (INT8, 0),
        "INS_GYR_CAL": (INT8, 1),
        "INS_GYRO_FILTER": (INT8 + 2, 20),  # AP_Int16
        "INS_ACCEL_FILTER": (INT8 + 2, 20),
        "INS_HNTCH_ENABLE": (INT8, 0),
        "INS_HNTC2_ENABLE": (INT8, 0),
        "BRD_SERIAL_NUM": (INT8 + 2, 0),
    }
    for index in range(3):  # the tables always have three rows
        nth = str(index + 1) if index else ""
        gyro = f"INS_GYR{nth}OFFS" if index else "INS_GYROFFS"
        parameters |= {f"{gyro}_{axis}": (FLOAT, 0.0) for axis in "XYZ"}
        parameters |= {f"INS_ACC{nth}OFFS_{axis}": (FLOAT, 0.0) for axis in "XYZ"}
        parameters |= {f"INS_ACC{nth}SCAL_{axis}": (FLOAT, 1.0) for axis in "XYZ"}
        parameters |= {f"INS_GYR{nth}_ID": (INT32, DEVICE_ID + index if index < imus else 0)}
        parameters |= {f"INS_TCAL{index + 1}_ENABLE": (INT8, 0), f"INS_GYR{index + 1}_CALTEMP": (FLOAT, -300.0)}
    return parameters


def _build_px4(imus: int) -> dict[str, tuple[int, float]]:
    parameters: dict[str, tuple[int, float]] = {
        "SENS_BOARD_ROT": (INT32, 0),
        **{f"SENS_BOARD_{axis}_OFF": (FLOAT, 0.0) for axis in "XYZ"},
        "TC_G_ENABLE": (INT32, 0),
        "TC_A_ENABLE": (INT32, 0),
        "IMU_GYRO_CAL_EN": (INT32, 0),
        "SENS_IMU_AUTOCAL": (INT32, 0),
        "IMU_GYRO_CUTOFF": (FLOAT, 40.0),
        "EKF2_EN": (INT32, 0),
    }
    for index in range(4):
        is_present = index < imus
        for kind in ("GYRO", "ACC"):
            parameters |= {f"CAL_{kind}{index}_ID": (INT32, DEVICE_ID + index if is_present else 0)}
            parameters |= {f"CAL_{kind}{index}_{axis}OFF": (FLOAT, 0.0) for axis in "XYZ"}
        parameters |= {f"CAL_ACC{index}_{axis}SCALE": (FLOAT, 1.0) for axis in "XYZ"}
    return parameters


class Parameters:
    """The parameters of an autopilot by name, stored in `file` if given. `settings` replace factory values.

    Raise ValueError for a parameter that the firmware does not have, and for an invalid file.
    """

    def __init__(self, firmware: Firmware, imus: int, settings: Mapping[str, float], file: Path | None = None) -> None:
        self._firmware, self._file = firmware, file
        defaults = build_factory_parameters(firmware, imus)
        if unknown := settings.keys() - defaults.keys():
            raise ValueError(f"{firmware} has no parameter {', '.join(sorted(unknown))}")
        self.types = {name: kind for name, (kind, _) in defaults.items()}
        self._values: dict[str, float] = {name: value for name, (_, value) in defaults.items()}
        for name, value in settings.items():
            self._values[name] = self._round_to_type(name, value)
        if file is not None and file.exists():
            stored = json.loads(file.read_text(encoding="utf-8"))
            self._values |= {name: struct.unpack("<f", bytes.fromhex(text))[0] if self.types[name] == FLOAT else text
                             for name, text in stored.items()}  # fmt: skip

    def __getitem__(self, name: str) -> float:
        return self._values[name]

    def __contains__(self, name: str) -> bool:
        return name in self._values

    @property
    def names(self) -> list[str]:
        """The names of all parameters in the order of their numbers."""
        return list(self._values)

    def field(self, name: str) -> bytes:
        """Return the four bytes of a value in a message: PX4 copies integers, ArduPilot converts them to floats."""
        if self.types[name] != FLOAT and self._firmware == "px4":
            return struct.pack("<i", int(self._values[name]))
        return struct.pack("<f", self._values[name])

    def set_field(self, name: str, field: bytes) -> None:
        """Set the value from the four bytes of a message."""
        if self.types[name] != FLOAT and self._firmware == "px4":
            value = float(struct.unpack("<i", field)[0])
        else:
            value = struct.unpack("<f", field)[0]
        if not isfinite(value):  # both firmwares ignore it
            return
        self._values[name] = self._round_to_type(name, value)
        if self._file is not None:
            stored = {key: struct.pack("<f", value).hex() if self.types[key] == FLOAT else value
                      for key, value in self._values.items()}  # fmt: skip
            new = self._file.with_suffix(".new")
            new.write_text(json.dumps(stored), encoding="utf-8")
            new.replace(self._file)

    def _round_to_type(self, name: str, value: float) -> float:
        if self.types[name] == FLOAT:
            single: float = struct.unpack("<f", struct.pack("<f", value))[0]
            return single
        return float(int(value))
