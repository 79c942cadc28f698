"""What the system tells of processes (proc(5))."""

from contextlib import suppress
from pathlib import Path


def resident_kb(process: int) -> int:
    """How much memory it has in use, kB."""
    status = Path(f"/proc/{process}/status").read_text(encoding="ascii")
    return int(status.split("VmRSS:")[1].split()[0])


def descendant(process: int, word: str) -> int:
    """The first of the processes that it or its own have started whose command has this word. Raises LookupError."""
    family = [process]
    for each in family:
        with suppress(OSError):  # one that has ended meanwhile
            if each != process and word.encode() in Path(f"/proc/{each}/cmdline").read_bytes():
                return each
            for thread in Path(f"/proc/{each}/task").iterdir():
                family += map(int, (thread / "children").read_text(encoding="ascii").split())
    raise LookupError(f"process {process} has started no {word}")
