"""The settings of recordings of schema "rig.run/1", which kept none: read from the configuration's text they hold.

Frozen: this is how the configuration read, and what its defaults were, when such recordings were made (up to commit
af3b9f0). What the configuration has become since must not change how they are judged.
"""

import math
from collections.abc import Mapping
from typing import Any

from rig.data.checked import checked
from rig.data.settings import RunSettings

PROCEDURE = {
    "name": "six_observation",
    "verify": False,
    "order": ("wrist_3", "wrist_1", "wrist_2"),
    "directions": ("cw", "ccw"),
    "repeats": 1,
    "speed_deg_s": 60.0,
}
OBSERVATION = {"max_lost_fraction": 0.001, "max_speed_deviation": 0.25, "max_axis_deviation_deg": 20.0}
HOME_DEG = (0.0, -90.0, 90.0, -90.0, -90.0, 0.0)
MAX_REPEATS = 100
TURNTABLE = {"scale": (1.0, 1.0, 1.0), "bias_rad_s": (0.0, 0.0, 0.0)}


def settings_of_configuration(text: str) -> RunSettings:
    """The settings in a configuration recorded then. Raises ValueError when it cannot be one of that time."""
    import yaml

    try:
        document = yaml.safe_load(text)
        return checked(RunSettings, _settings(document), "settings")
    except (yaml.YAMLError, RecursionError, AttributeError, KeyError, TypeError, OverflowError) as error:
        raise ValueError(f"its configuration cannot be understood: {' '.join(str(error).split())}") from None


def _settings(document: Mapping[str, Any]) -> dict[str, Any]:
    procedure = PROCEDURE | document.get("procedure", {})
    sensors = document["sensors"]
    references = [name for name, sensor in sensors.items() if sensor.get("role") == "reference"]
    if not 1 <= procedure["repeats"] <= MAX_REPEATS:
        raise ValueError(f"its configuration repeats the procedure {procedure['repeats']} times")
    turns = [
        (wrist, direction)
        for _ in range(procedure["repeats"])
        for wrist in procedure["order"]
        for direction in procedure["directions"]
    ]
    return {
        "procedure": procedure["name"],
        "then_verify": procedure["verify"],
        "observation": OBSERVATION | document.get("observation", {}),
        "limits": document["limits"],
        "to_calibrate": [name for name in sensors if name not in references],
        "reference": _reference(references[0], sensors[references[0]]) if references else None,
        "home_q_rad": [math.radians(angle) for angle in document["arm"].get("home_deg", HOME_DEG)],
        "planned_sweeps": [
            {
                "index": index,
                "joint_name": wrist,
                "direction": direction,
                "speed_rad_s": math.radians(procedure["speed_deg_s"]),
            }
            for index, (wrist, direction) in enumerate(turns)
        ],
    }


def _reference(name: str, sensor: Mapping[str, Any]) -> dict[str, Any]:
    return {"name": name, **TURNTABLE, **sensor.get("turntable", {})}
