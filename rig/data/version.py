"""The version of the rig, which results and certificates state."""

from typing import Final

VERSION: Final = "0.1.0"
