"""Memory of a command that stays for a morning: threads come and go with every part, and glibc gives each an arena.

What one thread has used and let go then lies idle where the next does not look, some megabytes more with every part
(mallopt(3), M_ARENA_MAX). With one arena it is used again.
"""

import ctypes
import sys

M_ARENA_MAX = -8  # malloc.h


def keep_to_one_arena() -> None:
    """Let all threads of this process share the memory that they let go; nothing where the C library is another."""
    if sys.platform == "linux":
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt is not None:
            mallopt(M_ARENA_MAX, 1)
