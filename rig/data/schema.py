"""The names and types in a run file that say how the rest of it is to be read: see `rig.data.layout`.

Whoever reads a file as it stands there imports nothing else of the rig, for he is a process of a moment.
"""

import numpy as np

SCHEMA = "rig.run/4"
SCHEMA_ELSEWHERE = "rig.files/1"
TABLES = ("readings", "motion")
TEXTS = {
    SCHEMA: ("config", "settings", "provenance", "turner"),
    SCHEMA_ELSEWHERE: ("config", "settings", "provenance", "elsewhere"),
    "rig.run/3": ("config", "settings", "provenance"),
    "rig.run/2": ("config", "settings", "provenance"),
    "rig.run/1": ("config", "provenance"),
}
EVENTS_DTYPE = np.dtype("u1")


def states_name(schema: str) -> str:
    """The name of the dataset of states in a file of that schema."""
    return "states" if schema == SCHEMA else "arm"
