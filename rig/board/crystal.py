"""The check that the board's clock is locked to its crystal."""

import time

from firmware_host.client import Board

STARTUP_S = 2.0  # of a 32768 Hz crystal, t_SU(LSE) in the data sheet DS11451
POLL_S = 0.1


def follows_crystal(board: Board) -> bool:
    """Wait, at most the start-up time, until the board's clock follows its crystal; return whether it does.

    Raise as `Board.status` does.
    """
    while True:
        status = board.status()
        if status.clock_locked or status.uptime_s > STARTUP_S:
            return status.clock_locked
        time.sleep(POLL_S)
