"""The answer of a history to a run, awaited for a few seconds only."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import TYPE_CHECKING, TypeVar

from firmware_host.computer_load import load_factor
from rig.errors import RigError

if TYPE_CHECKING:
    from rig.history.storage.address import HistoryAddress

T = TypeVar("T")

# docs/how-to/finished-runs/shared-history.md promises the verdict within five seconds. A file uses this computer's
# processors, so on a busy computer it is given longer.
MAX_ANSWER_S = 4.0
# Modules that are imported before the time starts, because the import alone is slow on a busy computer: for any
# question, and to enter a run.
QUESTION_MODULES = ("rig.history.store",)
ENTRY_MODULES = ("rig.history.entered.index", "rig.report.kinds.kind_registry", "rig.history.series", "scipy.special")
DRIVER_MODULES = {
    "file": ("sqlalchemy.dialects.sqlite.pysqlite",),
    "server": ("psycopg", "sqlalchemy.dialects.postgresql.psycopg"),
}


def ask_history(address: "HistoryAddress", work: Callable[[], T], modules: Sequence[str] = ()) -> T:
    """Return the result of `work` on the history at `address`; raise its errors, or TimeoutError if it takes too long.

    The history's modules, and `modules`, are imported before the time limit begins.
    """
    is_file = isinstance(address.where, Path)
    for name in (*QUESTION_MODULES, *modules):
        import_module(name)
    with suppress(ImportError):  # the history itself then names the missing extra
        for name in DRIVER_MODULES["file" if is_file else "server"]:
            import_module(name)
    within_s = MAX_ANSWER_S * (load_factor() if is_file else 1.0)
    try:
        return await_answer(work, within_s)
    except TimeoutError:
        raise TimeoutError(f"it has not answered within {within_s:.2g} s") from None


def explain_failure(error: Exception) -> str:
    """Return a short reason why the history could not be used."""
    if isinstance(error, RigError):
        return f"{error.name}: {error.what}"
    if isinstance(error, TimeoutError):
        return str(error)
    return f"{type(error).__name__}: {error}"


def await_answer(work: Callable[[], T], within_s: float | None = None) -> T:
    """Return the result of `work`, from a thread of its own; pass on its exception.

    Raise TimeoutError if it takes longer than `within_s`, s. Ctrl-C takes effect immediately. A late thread is
    abandoned and ends with the process, because a library that waits for its server cannot be interrupted.
    """
    from concurrent.futures import Future  # here, as `rig --help` does not need it

    answer: Future[T] = Future()

    def carry_out() -> None:
        try:
            answer.set_result(work())
        except BaseException as error:
            answer.set_exception(error)

    Thread(target=carry_out, daemon=True).start()
    return answer.result(within_s)
