"""The entry of a quantity without a solution."""

from rig.data.entries.result_types import ErrorEntry
from rig.errors import Fault


def error_entry(fault: Fault) -> ErrorEntry:
    """Return the entry of a Fault that ended an attempt."""
    return ErrorEntry(error=str(fault))
