"""The answer of a history for a run, which waits a few seconds for it and no longer."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from rig.commands.history.waiting import answer_of
from rig.errors import RigError

if TYPE_CHECKING:
    from rig.history.storage.address import HistoryAddress

T = TypeVar("T")

ANSWER_S = 4.0  # docs/how-to/finished-runs/shared-history.md promises five until the verdict
# What is imported before the time begins, since on a busy computer this alone takes longer: for any question, and to
# enter a run.
TO_ASK = ("rig.history.store",)
TO_ENTER = ("rig.history.entered.index", "rig.report.kinds.registry", "rig.history.series", "scipy.special")
TO_CONNECT = {
    "file": ("sqlalchemy.dialects.sqlite.pysqlite",),
    "server": ("psycopg", "sqlalchemy.dialects.postgresql.psycopg"),
}


def history_answer(place: "HistoryAddress", work: Callable[[], T], imported: Sequence[str] = ()) -> T:
    """Return what `work` gets of the history at `place`, or raise what it raises; TimeoutError after `ANSWER_S`.

    That time is the history's alone: what the work needs is imported before, the modules named `imported` too.
    """
    for name in (*TO_ASK, *imported):
        import_module(name)
    with suppress(ImportError):  # the extra that it belongs to, the history itself names
        for name in TO_CONNECT["file" if isinstance(place.where, Path) else "server"]:
            import_module(name)
    return answer_of(work, ANSWER_S)


def why(error: Exception) -> str:
    """Say why a history was of no use, in a few words."""
    if isinstance(error, RigError):
        return f"{error.name}: {error.what}"
    if isinstance(error, TimeoutError):
        return f"it has not answered within {ANSWER_S:g} s"
    return f"{type(error).__name__}: {error}"
