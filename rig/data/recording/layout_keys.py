"""The names and types in a run file that determine how to read the rest of it: see `rig.data.recording.layout`.

The process that extracts a file imports nothing else of the rig, because it lives only for a moment.
"""

from typing import Final

import numpy as np

SCHEMA = "rig.run/1"
SCHEMA_ELSEWHERE = "rig.files/1"
TABLES = ("readings", "motion")
TEXTS = {
    SCHEMA: ("config", "settings", "provenance", "turner"),
    SCHEMA_ELSEWHERE: ("config", "settings", "provenance", "elsewhere"),
}
NOT_STATED: Final = "not stated"  # the part or serial number of external readings
EVENTS_DTYPE = np.dtype("u1")
