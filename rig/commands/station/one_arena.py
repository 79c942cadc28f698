"""The memory of a long-running command: every part starts threads, and glibc gives each thread an arena.

Freed memory remains unused in a thread's arena, some megabytes more with every part (mallopt(3), M_ARENA_MAX). With one
arena it is reused.
"""

import ctypes
import sys

M_ARENA_MAX = -8  # malloc.h


def keep_to_one_arena() -> None:
    """Make all threads of this process share freed memory, if the C library is glibc."""
    if sys.platform == "linux":
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt is not None:
            mallopt(M_ARENA_MAX, 1)
