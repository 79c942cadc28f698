"""The end of a run: it is entered in the history, and held against the last calibration of the same sensors.

A run never fails because of the history: it says so, and goes on.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import RigError
from rig.station.events import NotRemembered, Remembered, RunEvent

if TYPE_CHECKING:
    from rig.config.judging_sections import HistorySection
    from rig.history.issued import Issued
    from rig.history.series import Change
    from rig.history.store import History, Past


@dataclass(frozen=True, slots=True)
class Beside:
    """A calibration of this run, and what changed since the last of the same sensor."""

    before: "Past"
    now: "Past"
    changes: "Sequence[Change]"


def remember(folder: Path, section: "HistorySection") -> tuple[RunEvent | None, tuple[Beside, ...]]:
    """Enter the run in `folder`; what to tell of it, and its calibrations beside the ones before."""
    label = "the history"
    try:
        from rig.history.finished import finished_run
        from rig.history.place import chosen_place
        from rig.history.store import open_history

        where = chosen_place(section)
        if where is None:
            return None, ()
        label = where.label
        with open_history(where) as history:
            entered = history.enter(finished_run(folder))
            beside = tuple(_beside(history, entered.run_id))
    except Exception as error:  # whatever it is, the run is finished and its result is written
        why = error.what if isinstance(error, RigError) else f"{type(error).__name__}: {error}"
        return NotRemembered(folder, f"{label}: {why}"), ()
    beyond = tuple(
        f"{b.now.serial_number} {c.name} (E_n {c.normalised_error:.1f})" for b in beside for c in b.changes if c.beyond
    )
    return Remembered(label, entered.run_id, beyond), beside


def remember_certificate(folder: Path, result: str, certificate: "Issued") -> str | None:
    """Note a certificate of the run in `folder`, whose result.json is `result`; why it is in no history, or None."""
    try:
        from rig.config.judging_sections import HistorySection
        from rig.history.finished import configured_in, content_sha256
        from rig.history.place import chosen_place
        from rig.history.store import open_history

        loaded = configured_in(folder)
        where = chosen_place(HistorySection() if loaded is None else loaded.config.history)
        if where is None:
            return None
        known = False
        if where.file is None or where.file.exists():
            with open_history(where) as history:
                known = history.certify(content_sha256(result), certificate)
    except Exception as error:  # whatever it is, the certificate is written
        return error.what if isinstance(error, RigError) else f"{type(error).__name__}: {error}"
    return None if known else f"{where.label} does not know this run; rig history import {folder} enters it"


def print_beside(found: Sequence[Beside]) -> None:
    """On stdout, for people."""
    if not found:
        return
    from rich.console import Console

    from rig.history.tables import changes_table, title_of

    console = Console(highlight=False)
    for each in found:
        day = each.before.started_utc[:10]
        title = f"{title_of(each.now.subject)}: beside the last calibration, number {each.before.id} of {day}"
        console.print(changes_table(title, each.changes))


def _beside(history: "History", run_id: int) -> "list[Beside]":
    from rig.history.series import changes, subjects
    from rig.history.store import Selection

    found = []
    for now in history.of_run(run_id):
        series = subjects(history.calibrations(Selection(serial_number=now.serial_number))).get(now.subject, [])
        earlier = [each for each in series if (each.started_utc, each.id) < (now.started_utc, now.id)]
        if earlier:
            found.append(Beside(earlier[-1], now, changes(earlier[-1], now)))
    return found
