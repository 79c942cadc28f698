"""The check that the board's clock is locked to its crystal."""

import time

from firmware_host.client import Board

STARTS_S = 2.0  # start-up time of a 32768 Hz crystal, t_SU(LSE) in the data sheet DS11451
ASK_AGAIN_S = 0.1


def follows_crystal(board: Board) -> bool:
    """Wait, at most the start-up time, until the board's clock follows its crystal; return whether it does.

    Raise as `Board.status` does.
    """
    while True:
        status = board.status()
        if status.clock_locked or status.uptime_s > STARTS_S:
            return status.clock_locked
        time.sleep(ASK_AGAIN_S)
