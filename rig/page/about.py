"""What the page is told of a run before anything has happened."""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class About:
    """What is known before anything has happened: the run's folder, whether it is replayed, whether the page may answer
    the operator's questions, each sensor's part and serial number; of the `arm` how it is built, of a recorded one its
    names as well; the command that stores a calibration of it on the board (`storing`), where a board keeps it.
    """

    folder: str
    procedure: str
    replayed: bool = False
    may_answer: bool = False
    parts: dict[str, str] = field(default_factory=dict)
    simulated: bool = False
    storing: str | None = None
    arm: dict[str, Any] = field(default_factory=dict)
