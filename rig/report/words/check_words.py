"""What the checks of a verdict mean, and what to do when one failed: the table checks.txt."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from shlex import quote

from rig.config.judging.limits import key_of
from rig.data.installed_kinds import quantities
from rig.data.quantity import OF_THE_RIG
from rig.data.result_file import CheckEntry
from rig.errors import Refused

TABLE = Path(__file__).with_name("checks.txt")
ALLOWING = ", or allow it"  # from here on a row says how to set another limit


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
    """What a check of a result means; None of what only an installed kind of sensor knows."""
    return check_words().get(check.means.what or "")


def words_of_name(name: str) -> CheckWords | None:
    """What a check means that somebody calls so, with its sensor, quantity and sweep or without them.

    A sensor may be called as a check is, so the last part that is one counts.
    """
    of = [f"{quantity}_" for quantity in _quantities()]
    told = (part.removeprefix(each) for part in reversed(name.split(".")) for each in ("", *of))
    return next((check_words()[what] for what in told if what in check_words()), None)


def what_failed(check: CheckEntry, folder: Path | None) -> str | None:
    """What it means that a check failed, and what to do, with the run's folder and the limit's key in the commands.

    Nobody is told to allow more by a limit that no configuration has.
    """
    if (words := words_of(check)) is None:
        return None
    key = key_of(check.means.quantity, words.name)
    remedy = (
        words.remedy.partition(ALLOWING)[0] if key is None else words.remedy.replace("limits.NAME", f"limits.{key}")
    )
    return f"{words.means}. {remedy}".replace("RUN", "RUN" if folder is None else quote(str(folder)))


def _quantities() -> Iterable[str]:
    try:
        return quantities()
    except Refused:  # a package that cannot be loaded must not keep anybody from asking what that means
        return [each.name for each in OF_THE_RIG]
