"""The names and types in a run file that determine how to read its contents: see `rig.data.recording.layout`.

The short-lived process that extracts a file imports nothing else of the rig.
"""

from typing import Final

import numpy as np

SCHEMA = "rig.run/1"
EXTERNAL_SCHEMA = "rig.files/1"
TABLES = ("readings", "motion")
TEXTS = {
    SCHEMA: ("config", "settings", "provenance", "turner"),
    EXTERNAL_SCHEMA: ("config", "settings", "provenance", "elsewhere"),
}
NOT_STATED: Final = "not stated"  # the part or serial number of external readings
EVENTS_DTYPE = np.dtype("u1")
