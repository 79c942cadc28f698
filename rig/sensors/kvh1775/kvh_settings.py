"""A KVH 1775's persistent settings: which of them the rig corrects, and which it refuses. Pure.

Most settings that a previous user may have made would spoil a calibration unnoticed, so all are read. Settings of the
output are corrected for the run. Settings that change the readings are refused, because only the owner knows whether
they are needed. Names and values: ICD 56-0298 Rev. B, section 8.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.kvh_messages import Format

# All settings, in the order of setting: setting the data rate resets the filters. FILTEN has its name from the document
# of the 1750.
NAMES = (
    "AXES",
    "BAUD",
    "MSYNC",
    "DR",
    "OUTPUTFMT",
    "ROTFMT",
    "ROTUNITS",
    "TEMPUNITS",
    "FILTTYPE,A",
    "FILTTYPE,G",
    "FILTEN,A",
    "FILTEN,G",
)
DEFAULT_FILTER = "CHEBY"  # as delivered; replaces the other built-in ones
NUMBER_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class Kvh1775Settings:
    """The settings that a run needs: samples a second, the messages' format, and the quantity of their rotation."""

    rate_hz: float
    message: Format
    rotation: Literal["delta", "rate"]

    @property
    def settings(self) -> Mapping[str, str]:
        """The values that the run needs, by the names of the instrument's settings."""
        return {
            "MSYNC": "IMU",
            "DR": f"{self.rate_hz:g}",
            "OUTPUTFMT": self.message,
            "ROTFMT": self.rotation.upper(),
            "ROTUNITS": "RAD",
            "TEMPUNITS": "C" if self.message == "C" else "C_100",  # in format C it is a float in either unit
            "FILTTYPE,A": DEFAULT_FILTER,
            "FILTTYPE,G": DEFAULT_FILTER,
            "FILTEN,A": "1",
            "FILTEN,G": "1",
        }


def corrections(stored: Mapping[str, str], required: Kvh1775Settings) -> dict[str, str]:
    """Return the `required` values of those settings whose `stored` value differs, by name, in the order of `NAMES`.

    `stored` must have all `NAMES`.
    """
    target = required.settings
    return {name: target[name] for name in NAMES if name in target and not same(stored[name], target[name])}


def refusals(sensor: str, stored: Mapping[str, str]) -> Iterable[SensorError]:
    """Yield `kvh_axes_not_identity` and `kvh_custom_filter` for stored settings that only the owner may change."""
    if not same(stored["AXES"], ",".join(str(value) for value in np.eye(3).ravel())):
        yield SensorError(
            "kvh_axes_not_identity",
            f"{sensor}: its memory holds axes {stored['AXES']}, by which it multiplies every reading",
            "If they are not needed, reset them in its configuration mode: =AXES,1,0,0,0,1,0,0,0,1",
        )
    for triad, name in (("gyroscope", "FILTTYPE,G"), ("accelerometer", "FILTTYPE,A")):
        if stored[name] not in ("CHEBY", "BUTTER", "AVE"):
            yield SensorError(
                "kvh_custom_filter",
                f"{sensor}: the filter of its {triad} is {stored[name]}, a custom one",
                f"If it is not needed, reset it in its configuration mode: ={name},{DEFAULT_FILTER}",
            )


def same(one: str, other: str) -> bool:
    """Return whether two values of a setting are equal, in any notation of their numbers."""
    ours, theirs = one.split(","), other.split(",")
    return len(ours) == len(theirs) and all(map(_equal_entries, ours, theirs))


def _equal_entries(one: str, other: str) -> bool:
    try:
        return abs(float(one) - float(other)) <= NUMBER_TOLERANCE
    except ValueError:
        return one == other
