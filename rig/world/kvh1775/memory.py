"""The non-volatile settings of a KVH 1775, and the commands that read and change them (ICD, section 8)."""

from collections.abc import Mapping
from functools import lru_cache
from math import isfinite

import numpy as np
from numpy.typing import NDArray

IDENTITY = "1,0,0,0,1,0,0,0,1"
FILTERS = ("CHEBY", "BUTTER", "AVE", "CUSTOM")
FACTORY_SETTINGS: Mapping[str, str] = {
    "AXES": IDENTITY,
    "BAUD": "921600",
    "DR": "1000",
    "FILTEN,A": "1",
    "FILTEN,G": "1",
    "FILTTYPE,A": "CHEBY",
    "FILTTYPE,G": "CHEBY",
    "MSYNC": "IMU",
    "OUTPUTFMT": "A",
    "ROTFMT": "DELTA",
    "ROTUNITS": "RAD",
    "TEMPUNITS": "C",
}
CHOICES: Mapping[str, tuple[str, ...]] = {
    "BAUD": ("9600", "19200", "38400", "57600", "115200", "460800", "576000", "921600", "4147200"),
    "DR": ("1", "5", "10", "25", "50", "100", "250", "500", "750", "1000", "3600", "5000"),
    "FILTEN,A": ("0", "1"),
    "FILTEN,G": ("0", "1"),
    "FILTTYPE,A": FILTERS,
    "FILTTYPE,G": FILTERS,
    "MSYNC": ("IMU", "EXT"),
    "OUTPUTFMT": ("A", "B", "C"),
    "ROTFMT": ("DELTA", "RATE"),
    "ROTUNITS": ("RAD", "DEG"),
    "TEMPUNITS": ("C", "F", "C_100", "F_100"),
}


class KvhMemory:
    """The instrument's memory: `settings` replace the factory's. Raise ValueError for an unknown setting or value."""

    def __init__(self, settings: Mapping[str, str]) -> None:
        self._settings = dict(FACTORY_SETTINGS)
        for name, value in settings.items():
            if not self._set(name.upper(), value.upper()):
                raise ValueError(f"a KVH 1775 cannot be set to {name},{value}")

    def __getitem__(self, name: str) -> str:
        return self._settings[name]

    @property
    def axes(self) -> NDArray[np.float64]:
        """Matrix (3, 3) that multiplies rates and accelerations. It need not be a rotation."""
        return _matrix(self["AXES"])

    def obey(self, command: str) -> str:
        """Execute a command, given in capitals, and return the answer."""
        sign, name = command[:1], command[1:]
        if sign == "?" and name in self._settings:
            return self._report(name)
        if command == "=RSTCFG":
            self._settings.update({**FACTORY_SETTINGS, "BAUD": self["BAUD"]})
            return "RSTCFG"
        if sign == "=":
            for setting in self._settings:
                if name.startswith(f"{setting},") and self._set(setting, name[len(setting) + 1 :]):
                    return self._report(setting)
        return f"INVALID,{command}"

    def _report(self, name: str) -> str:
        if name == "AXES":
            return "AXES," + ",".join(f"{value:+.6E}" for value in self.axes.ravel().tolist())
        return f"{name},{self[name]}"

    def _set(self, name: str, value: str) -> bool:
        """Set a setting if the value is allowed; return whether it is."""
        if name == "AXES":
            if not _is_matrix(value):
                return False
        elif value not in CHOICES.get(name, ()):
            return False
        self._settings[name] = value
        if (name, value) == ("MSYNC", "EXT"):
            self._settings.update({"FILTTYPE,A": "AVE", "FILTTYPE,G": "AVE"})  # also after MSYNC is reset
        return True


@lru_cache(maxsize=4)  # needed at every message
def _matrix(text: str) -> NDArray[np.float64]:
    return np.array([float(value) for value in text.split(",")]).reshape(3, 3)


def _is_matrix(text: str) -> bool:
    try:
        values = [float(value) for value in text.split(",")]
    except ValueError:
        return False
    return len(values) == 9 and all(map(isfinite, values))
