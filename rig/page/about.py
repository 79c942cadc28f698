"""The facts about a run that its page shows before the first event."""

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class About:
    """The facts about a run that are known before its first event.

    - `folder`, `procedure`: the run's folder and procedure. `replayed`: whether it is a recording. `simulated`: whether
      the laboratory is simulated.
    - `may_answer`: whether the page may answer the operator's questions.
    - `parts`: each sensor's part and serial number.
    - `storing`: the command that stores a calibration on the board, if possible.
    - `arm`: the arm's geometry; for a recording also its names.
    """

    folder: str
    procedure: str
    replayed: bool = False
    may_answer: bool = False
    parts: dict[str, str] = field(default_factory=dict)
    simulated: bool = False
    storing: str | None = None
    arm: dict[str, Any] = field(default_factory=dict)
