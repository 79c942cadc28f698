"""Whether the board's clock follows its crystal, by its own word."""

import time

from firmware_host.client import Board

STARTS_S = 2.0  # so long after its reset a crystal of 32768 Hz may take to swing (DS11451, LSE oscillator, t_SU)
ASK_AGAIN_S = 0.1


def follows_crystal(board: Board) -> bool:
    """Asks until it does, or has had power for long enough to know that it never will.

    Raises as `Board.status` does.
    """
    while True:
        status = board.status()
        if status.clock_locked or status.uptime_s > STARTS_S:
            return status.clock_locked
        time.sleep(ASK_AGAIN_S)
