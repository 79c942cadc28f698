"""The error for samples that are missing: which way they go from a sensor to the recording says what to look at."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Fault

ON_THE_BOARD = "Check the cable to the board and the load of this computer"
# By the part of a sensor with a port of its own.
BESIDE_THE_BOARD: Mapping[str, str] = MappingProxyType(
    {
        "mavlink": "See that no ground station has changed how often the autopilot sends this message, and that no "
        "other program reads the same port; check its line and the load of this computer",
        "lines": "See that no other program reads the same port, and that the device prints as fast as rate_hz says; "
        "check its cable and the load of this computer",
        "kvh1775": "See that no other program reads the same port; check the instrument's cable and the load of this "
        "computer",
    }
)


def lost_samples(sensor: RecordedSensor, samples: NDArray[Any], where: str, what: str, then: str) -> Fault:
    """Return the Fault `lost_samples` for samples (n,) of a sensor: `where` and `what` is missing, what to do `then`.

    If every so many of them is there alone, the source has sent fewer, and nothing was lost on the way.
    """
    steps = np.diff(samples["sequence"].astype(np.int64))
    each = int(np.median(steps)) if len(steps) else 1
    evenly = f": one of {each} comes, about {sensor.rate_hz / each:.4g} a second" if each > 1 else ""
    look_at = ON_THE_BOARD if sensor.on_board else BESIDE_THE_BOARD.get(sensor.part, ON_THE_BOARD)
    return Fault("lost_samples", f"in {where} {what}{evenly}", f"{look_at}; then {then}")
