"""Meanings and remedies of the checks of a verdict: the table checks.txt."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from shlex import quote

from rig.config.judging.verdict_limits import key_of
from rig.data.installed_kinds import quantities
from rig.data.quantity import RIG_QUANTITIES
from rig.data.result_file import CheckEntry
from rig.errors import Refused
from rig.errors.table_rows import read_rows

TABLE = Path(__file__).with_name("checks.txt")
LIMIT_ADVICE = ", or allow it"  # begins the advice to change the limit


@dataclass(frozen=True, slots=True)
class CheckWords:
    """A check's name without sensor and quantity, the meaning of its failure, and what to do."""

    name: str
    means: str
    remedy: str


@cache
def check_words() -> Mapping[str, CheckWords]:
    """Return the rows of checks.txt by check name. Raise ValueError for lines unlike `name | means | what to do`."""
    return {cells[0]: CheckWords(*cells) for cells in read_rows(TABLE, "name | what it means | what to do")}


def words_of(check: CheckEntry) -> CheckWords | None:
    """Return the words of a result's check; None for a check that is not in checks.txt, such as a package's."""
    return check_words().get(check.means.what or "")


def words_of_name(name: str) -> CheckWords | None:
    """Return the words of the check `name`, which may include sensor, quantity and sweep; None if it names no check.

    The name's parts are separated by points. The last part that is a check's name decides, because a sensor may have
    such a name too.
    """
    prefixes = ["", *(f"{quantity}_" for quantity in _quantities())]
    candidates = (part.removeprefix(prefix) for part in reversed(name.split(".")) for prefix in prefixes)
    return next((check_words()[candidate] for candidate in candidates if candidate in check_words()), None)


def what_failed(check: CheckEntry, folder: Path | None) -> str | None:
    """Return the meaning and remedy of a failed check; they name the run folder and the limit's configuration key.

    The advice to raise the limit is left out if no key configures it. Return None for an unknown check.
    """
    if (words := words_of(check)) is None:
        return None
    key = key_of(check.means.quantity, words.name)
    remedy = (
        words.remedy.partition(LIMIT_ADVICE)[0] if key is None else words.remedy.replace("limits.NAME", f"limits.{key}")
    )
    return f"{words.means}. {remedy}".replace("RUN", "RUN" if folder is None else quote(str(folder)))


def _quantities() -> Iterable[str]:
    try:
        return quantities()
    except Refused:  # a package that cannot be loaded must not prevent an explanation of that error
        return [quantity.name for quantity in RIG_QUANTITIES]
