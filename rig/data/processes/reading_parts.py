"""The messages of a reading process: the parts of the file, and the exit status of the process."""

from enum import IntEnum
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from numpy.typing import NDArray

Part: TypeAlias = "dict[str, Any] | NDArray[Any]"


class Status(IntEnum):
    """The exit status of a reading process."""

    READ = 0
    UNREADABLE = 1
    NO_ROOM = 2
    REFUSED = 3
    NO_MEMORY = 4
    TOO_LONG = 5
