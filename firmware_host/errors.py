"""The error of the board and its link."""

from firmware_host.problem import ProblemError


class BoardError(ProblemError):
    """A failure of the board or of the link to it (`no_board`, `wrong_baud_rate`, …)."""
