"""What the checks of a verdict mean, and what to do when one failed: the table checks.txt."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from shlex import quote

from rig.config.limits import LIMITS
from rig.data.result_file import CheckEntry

TABLE = Path(__file__).with_name("checks.txt")
PREFIXES = {"": "rate", "acceleration_": "acceleration", "field_": "field"}  # of a check's name: the quantity


@dataclass(frozen=True, slots=True)
class CheckWords:
    """A check's name without sensor and quantity, what it means that it failed, and what to do."""

    name: str
    means: str
    remedy: str


@cache
def check_words() -> Mapping[str, CheckWords]:
    """The table, by name. Raises ValueError for a line of another form than `name | means | what to do`."""
    found = {}
    for number, line in enumerate(TABLE.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("#"):
            continue
        cells = line.split(" | ")
        if len(cells) != 3:
            raise ValueError(f"{TABLE.name}, line {number}: not `name | what it means | what to do`")
        found[cells[0]] = CheckWords(*cells)
    return found


def words_of(check: CheckEntry) -> CheckWords | None:
    """What a check of a result means; None of one that only an installed kind of sensor knows."""
    return words_of_name(check.name)


def words_of_name(name: str) -> CheckWords | None:
    """What a check means that is called so, with its sensor, quantity and sweep or without them."""
    found = _of_quantity(name)
    return None if found is None else found[1]


def what_failed(check: CheckEntry, folder: Path | None) -> str | None:
    """What it means that a check failed, and what to do, with the run's folder and the limit's key in the commands."""
    if (found := _of_quantity(check.name)) is None:
        return None
    quantity, words = found
    run = "RUN" if folder is None else quote(str(folder))
    keys = [key for key, row in LIMITS.items() if (row.quantity, row.what) == (quantity, words.name)]
    remedy = words.remedy.replace("RUN", run).replace("limits.NAME", f"limits.{keys[0] if keys else 'NAME'}")
    return f"{words.means}. {remedy}"


def _of_quantity(name: str) -> tuple[str, CheckWords] | None:
    """The quantity's name, and the words: a sensor may be called as a check is, so the last part that is one counts."""
    for part in reversed(name.split(".")):
        for prefix, quantity in PREFIXES.items():
            if part.startswith(prefix) and (found := check_words().get(part.removeprefix(prefix))) is not None:
                return quantity, found
    return None
