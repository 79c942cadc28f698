"""Which of a KVH 1775's persistent settings the rig corrects, and which it refuses. Pure.

Whoever had the instrument before may have left anything in its memory, and most of it would spoil a calibration without
a sign. So every setting is read. What says how it talks is set as the run needs it; what changes the readings
themselves is somebody's purpose, and refused. Names and values: ICD 56-0298 Rev. B, section 8.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.messages import Format

# Every one there is, in the order in which they are set: the data rate computes the filters anew. FILTEN has the name
# that the document of the 1750 gives it.
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
USUAL_FILTER = "CHEBY"  # as delivered; the other built-in ones are set back to it
SAME_NUMBER = 1e-6


@dataclass(frozen=True, slots=True)
class Wanted:
    """What a run needs: samples a second, the format of the messages, what their rotation is."""

    rate_hz: float
    message: Format
    rotation: Literal["delta", "rate"]

    @property
    def settings(self) -> Mapping[str, str]:
        """The settings that are corrected, by name."""
        return {
            "MSYNC": "IMU",
            "DR": f"{self.rate_hz:g}",
            "OUTPUTFMT": self.message,
            "ROTFMT": self.rotation.upper(),
            "ROTUNITS": "RAD",
            "TEMPUNITS": "C" if self.message == "C" else "C_100",  # format C's is a float anyway
            "FILTTYPE,A": USUAL_FILTER,
            "FILTTYPE,G": USUAL_FILTER,
            "FILTEN,A": "1",
            "FILTEN,G": "1",
        }


def corrections(stored: Mapping[str, str], wanted: Wanted) -> dict[str, str]:
    """What has to be set, by name, in order; `stored` holds all `NAMES`."""
    target = wanted.settings
    return {name: target[name] for name in NAMES if name in target and not same(stored[name], target[name])}


def refusals(sensor: str, stored: Mapping[str, str]) -> Iterable[SensorError]:
    """What of the settings found only somebody who knows their purpose may change.

    `kvh_axes_not_identity`, `kvh_custom_filter`.
    """
    if not same(stored["AXES"], ",".join(str(value) for value in np.eye(3).ravel())):
        yield SensorError(
            "kvh_axes_not_identity",
            f"{sensor}: its memory holds axes {stored['AXES']}, by which it multiplies every reading",
            "If nobody needs them, set them back in its configuration mode: =AXES,1,0,0,0,1,0,0,0,1",
        )
    for triad, name in (("gyroscope", "FILTTYPE,G"), ("accelerometer", "FILTTYPE,A")):
        if stored[name] not in ("CHEBY", "BUTTER", "AVE"):
            yield SensorError(
                "kvh_custom_filter",
                f"{sensor}: the filter of its {triad} is {stored[name]}, somebody's own",
                f"If nobody needs it, set it back in its configuration mode: ={name},{USUAL_FILTER}",
            )


def same(one: str, other: str) -> bool:
    """Whether two values of a setting mean the same, however their numbers are written."""
    ours, theirs = one.split(","), other.split(",")
    return len(ours) == len(theirs) and all(map(_same, ours, theirs))


def _same(one: str, other: str) -> bool:
    try:
        return abs(float(one) - float(other)) <= SAME_NUMBER
    except ValueError:
        return one == other
