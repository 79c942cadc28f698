"""The signals by which somebody may end or suspend a program from outside, if it does not handle them."""

import signal
from typing import Final

# Not among them: SIGKILL and SIGSTOP, which nobody can handle; SIGSEGV, SIGABRT and the like, which say that the
# program has broken down; SIGPIPE and SIGXFSZ, which Python ignores; SIGTTIN, which waits until somebody can answer.
_BY_KEYS_AND_SYSTEM = ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")  # Windows has the first two
_BY_PROGRAMS = (
    *("SIGUSR1", "SIGUSR2", "SIGALRM", "SIGVTALRM", "SIGPROF", "SIGIO", "SIGPWR", "SIGSTKFLT", "SIGXCPU"),
    *("SIGEMT", "SIGLOST"),
)


def _numbers(names: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(int(getattr(signal, name)) for name in names if hasattr(signal, name))


def _of_real_time() -> tuple[int, ...]:
    if not hasattr(signal, "SIGRTMIN"):
        return ()
    return tuple(range(signal.SIGRTMIN, signal.SIGRTMAX + 1))


MEANT_SIGNALS: Final = _numbers(_BY_KEYS_AND_SYSTEM)  # which mean that the program should end or be suspended
OTHER_SIGNALS: Final = _numbers(_BY_PROGRAMS) + _of_real_time()  # which mean anything, and end it by default
ENDING_SIGNALS: Final = (*MEANT_SIGNALS, *OTHER_SIGNALS)


def signal_name(number: int) -> str:
    """Return what a signal is called: `SIGUSR1`; `signal 40` where it has no name."""
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
