"""How the board's half says no, with the same three fields as the rig's own errors."""


class BoardError(Exception):
    """Something the board or the link to it will not or cannot do.

    `name` is the error's stable name (`no_board`, `wrong_baud_rate`, …), `what` one clause saying what happened and
    where, `remedy` one clause saying what to do.
    """

    def __init__(self, name: str, what: str, remedy: str) -> None:
        super().__init__(name, what, remedy)
        self.name = name
        self.what = what
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.name}: {self.what}. {self.remedy}."
