"""The error for missing samples, with remedies that depend on the samples' way from the sensor to the recording."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Fault

BOARD_REMEDY = "Check the cable to the board and the load of this computer"
# Keyed by the part of a sensor that has a port of its own.
PORT_REMEDIES: Mapping[str, str] = MappingProxyType(
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
    """Return the Fault `lost_samples` for samples (n,) of a sensor.

    `where` names the part of the recording, `what` says what is missing in it, and `then` is the last part of the
    remedy. If only every k-th sample is present, the message says so.
    """
    steps = np.diff(samples["sequence"].astype(np.int64))
    stride = int(np.median(steps)) if len(steps) else 1
    evenly = f": one of {stride} comes, about {sensor.rate_hz / stride:.4g} a second" if stride > 1 else ""
    look_at = BOARD_REMEDY if sensor.on_board else PORT_REMEDIES.get(sensor.part, BOARD_REMEDY)
    return Fault("lost_samples", f"in {where} {what}{evenly}", f"{look_at}; then {then}")
