"""The names and types in a run file that say how the rest of it is to be read: see `rig.data.recording.layout`.

Whoever reads a file as it stands there imports nothing else of the rig, for he is a process of a moment.
"""

import numpy as np

SCHEMA = "rig.run/1"
SCHEMA_ELSEWHERE = "rig.files/1"
TABLES = ("readings", "motion")
TEXTS = {
    SCHEMA: ("config", "settings", "provenance", "turner"),
    SCHEMA_ELSEWHERE: ("config", "settings", "provenance", "elsewhere"),
}
EVENTS_DTYPE = np.dtype("u1")
