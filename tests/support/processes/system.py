"""What the system tells of processes (proc(5))."""

from contextlib import suppress
from pathlib import Path


def resident_kb(process: int) -> int:
    """Return the memory that it uses, kB."""
    status = Path(f"/proc/{process}/status").read_text(encoding="ascii")
    return int(status.split("VmRSS:")[1].split()[0])


def descendant(process: int, word: str) -> int:
    """The first of the processes that it or its own have started whose command has this word. Raises LookupError."""
    family = [process]
    for relative in family:
        with suppress(OSError):  # one that has ended meanwhile
            if relative != process and word.encode() in Path(f"/proc/{relative}/cmdline").read_bytes():
                return relative
            for thread in Path(f"/proc/{relative}/task").iterdir():
                family += map(int, (thread / "children").read_text(encoding="ascii").split())
    raise LookupError(f"process {process} has started no {word}")


def grown(memory_kb: list[int]) -> float:
    """By which part memory has grown over parts in a row.

    Of a few parts the most counts: what is connected ahead comes and goes, and a part with repeated sweeps needs more.
    """
    return max(memory_kb[-4:]) / max(memory_kb[1:5]) - 1.0
