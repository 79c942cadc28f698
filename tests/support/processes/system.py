"""Information of the system on processes (proc(5))."""

from contextlib import suppress
from pathlib import Path


def resident_kb(process: int) -> int:
    """Return a process' resident memory, kB."""
    status = Path(f"/proc/{process}/status").read_text(encoding="ascii")
    return int(status.split("VmRSS:")[1].split()[0])


def descendant(process: int, word: str) -> int:
    """Return the first descendant of a process whose command contains this word. Raise LookupError if there is none."""
    family = [process]
    for relative in family:
        with suppress(OSError):  # one that has ended meanwhile
            if relative != process and word.encode() in Path(f"/proc/{relative}/cmdline").read_bytes():
                return relative
            for thread in Path(f"/proc/{relative}/task").iterdir():
                family += map(int, (thread / "children").read_text(encoding="ascii").split())
    raise LookupError(f"process {process} has started no {word}")


def grown(memory_kb: list[int]) -> float:
    """Return the fraction by which memory has grown over consecutive parts.

    The largest of a few parts is compared, because connections made in advance vary, and a part with repeated sweeps
    needs more.
    """
    return max(memory_kb[-4:]) / max(memory_kb[1:5]) - 1.0
