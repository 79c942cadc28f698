"""How the board's half says no."""

from firmware_host.problem import ProblemError


class BoardError(ProblemError):
    """Something the board or the link to it will not or cannot do (`no_board`, `wrong_baud_rate`, …)."""
