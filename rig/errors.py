"""How the rig says no: every error has a name, says what and where, and says what to do."""


class RigError(Exception):
    """Something the rig will not or cannot do.

    `name` is the error's stable name (`lost_samples`, `arm_link_lost`, …), `what` one clause saying what happened and
    where, `remedy` one clause saying what to do. `exit_status` is what the command line returns for it.
    """

    exit_status = 3

    def __init__(self, name: str, what: str, remedy: str) -> None:
        super().__init__(name, what, remedy)
        self.name = name
        self.what = what
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.name}: {self.what}. {self.remedy}."


class Refused(RigError):
    """The configuration or the pre-flight check says no; nothing has moved (exit status 2)."""

    exit_status = 2


class Fault(RigError):
    """Something failed during the run; the arm is stopped and the data kept (exit status 3)."""
