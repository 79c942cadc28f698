"""The entry of what has no solution."""

from rig.data.entries.result_types import ErrorEntry
from rig.errors import Fault


def error_entry(fault: Fault) -> ErrorEntry:
    """Return the entry of the Fault that an attempt ended in."""
    return ErrorEntry(error=str(fault))
