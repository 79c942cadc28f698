"""The end of a run: it is entered in the history, and held against the last calibration of the same sensors.

A run never fails because of the history: it says so, and goes on.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.history.answer import TO_ENTER, history_answer, why
from rig.errors import RigError
from rig.station.events import NotRemembered, Remembered, RunEvent, Since

if TYPE_CHECKING:
    from rig.config.judging.judging_sections import HistorySection
    from rig.history.entered.finished import FinishedRun
    from rig.history.entered.issued import Issued
    from rig.history.series import Change
    from rig.history.storage.address import HistoryAddress
    from rig.history.store import History, Past


@dataclass(frozen=True, slots=True)
class Beside:
    """A calibration of this run, and what changed since the last of the same sensor."""

    before: "Past"
    now: "Past"
    changes: "Sequence[Change]"


def remember(folder: Path, section: "HistorySection") -> tuple[RunEvent | None, tuple[Beside, ...]]:
    """Enter the run in `folder`; what to tell of it, and its calibrations beside the ones before."""
    from rig.history.storage.address import choose_history_address

    return _remembered(folder, lambda: choose_history_address(section))


def remember_own(folder: Path, named: str | None) -> tuple[RunEvent | None, tuple[Beside, ...]]:
    """Enter the run in `folder` in the user's own history, or in the one that is `named`; returns as `remember`."""
    from rig.history.storage.address import own_history_address

    return _remembered(folder, lambda: own_history_address(named))


def _remembered(
    folder: Path, chosen: Callable[[], "HistoryAddress | None"]
) -> tuple[RunEvent | None, tuple[Beside, ...]]:
    label = "the history"
    try:
        from rig.history.entered.finished import read_finished_run

        where = chosen()
        if where is None:
            return None, ()
        label = where.label
        run = read_finished_run(folder)
        numbers, beside = history_answer(where, lambda: _entered(where, run), TO_ENTER)
    except Exception as error:  # whatever it is, the run is finished and its result is written
        return NotRemembered(folder, f"{label}: {why(error)}"), ()
    return Remembered(label, numbers, tuple(map(_since, beside)), usual=_is_usual(where)), beside


def _is_usual(where: "HistoryAddress") -> bool:
    """Whether it is the one that a command means which names none."""
    from rig.history.storage.address import own_history_address

    try:
        return where == own_history_address(None)
    except RigError:  # the user has no home
        return False


def remember_certificate(folder: Path, result: str, certificate: "Issued", history: str | None = None) -> str | None:
    """Note a certificate of the run in `folder`, whose result.json is `result`; why it is in no history, or None.

    In the user's own, `history` where that is named: to what the folder's configuration names nothing is connected, for
    the folder may have come from anywhere.
    """
    try:
        from rig.history.entered.finished import content_sha256, read_configuration
        from rig.history.storage.address import own_history_address

        loaded = read_configuration(folder)
        where = own_history_address(history)
        if where is None or (history is None and loaded is not None and loaded.config.history.off):
            return None
        known = history_answer(where, lambda: _certified(where, content_sha256(result), certificate))
    except Exception as error:  # whatever it is, the certificate is written
        return why(error)
    if known:
        return None
    named = None if loaded is None or history is not None else loaded.config.history.url
    there = f", or --history {named} if that is yours" if named is not None else ""
    return f"{where.label} does not know this run; rig history import {folder} enters it{there}"


def journal_end(folder: Path, history: str | None = None) -> tuple[int, str] | None:
    """Number and SHA-256 of the last entry in the journal of the history in which `remember_certificate` notes it.

    None where there is no history, or none that answers, or an empty one.
    """
    try:
        from rig.history.entered.finished import read_configuration
        from rig.history.storage.address import own_history_address

        loaded = read_configuration(folder)
        where = own_history_address(history)
        if where is None or (history is None and loaded is not None and loaded.config.history.off):
            return None
        return history_answer(where, lambda: _end(where))
    except Exception:  # whatever it is, the certificate is signed; that it is in no history is said afterwards
        return None


def since_lines(calibrations: Sequence[Beside]) -> tuple[str, ...]:
    """How calibrations lie beside those of before, in words: each that has changed, then the others together."""
    if not calibrations:  # as with the history off, which costs no import of it
        return ()
    from rig.history.terminal.change_words import change_in_short, select_changed

    changed = [(each, values) for each in calibrations if (values := select_changed(each.changes))]
    same = [each for each in calibrations if not select_changed(each.changes)]
    lines = []
    for each, values in changed:
        of = "" if each.now.quantity == "rate" else f", {each.now.quantity}"
        whose = f"{each.now.serial_number}{of} " if len(calibrations) > 1 else ""
        compare = f"`rig history compare {each.before.id} {each.now.id}`"
        more = f"; {len(values) - 1} more: {compare}" if len(values) > 1 else ""
        since = f"since {each.before.started_utc[:10]} (no. {each.before.id})"
        lines.append(f"{whose}{since}: {change_in_short(values[0])}{more}")
    if same:
        before = ", ".join(str(each.before.id) for each in same)
        whose = " of the other sensors" if changed else ""
        count = sum(len(each.changes) for each in same)
        lines.append(f"none of {count} values changed since the last calibration{whose} (no. {before})")
    return tuple(lines)


def _entered(where: "HistoryAddress", run: "FinishedRun") -> "tuple[tuple[int, ...], tuple[Beside, ...]]":
    from rig.history.store import open_history

    with open_history(where) as history:
        run_id = history.enter(run).run_id
        return tuple(each.id for each in history.of_run(run_id)), tuple(_beside(history, run_id))


def _certified(place: "HistoryAddress", content_sha256: str, certificate: "Issued") -> bool:
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history

    if not is_there(place):
        return False
    with open_history(place) as history:
        return history.certify(content_sha256, certificate)


def _end(place: "HistoryAddress") -> tuple[int, str] | None:
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history

    if not is_there(place):
        return None
    with open_history(place) as history:
        end = history.head()
    return (end.number, end.sha256) if end.number else None


def _since(calibration: Beside) -> Since:
    return Since(
        calibration.now.sensor,
        calibration.now.quantity,
        calibration.before.id,
        calibration.before.started_utc[:10],
        {change.name: (change.before.value, change.before.expanded) for change in calibration.changes},
        {change.name: change.normalised_error for change in calibration.changes},
        tuple(change.name for change in calibration.changes if change.has_changed),
    )


def _beside(history: "History", run_id: int) -> "list[Beside]":
    """The calibrations of a run that have one before, which are one comparison."""
    from rig.history.series import changes_in, subjects
    from rig.history.store import Selection

    pairs = []
    for now in history.of_run(run_id):
        series = subjects(history.calibrations(Selection(serial_number=now.serial_number))).get(now.subject, [])
        earlier = [each for each in series if (each.started_utc, each.id) < (now.started_utc, now.id)]
        pairs += [(earlier[-1], now)] if earlier else []
    found = changes_in([(before.parameters, now.parameters) for before, now in pairs])
    return [Beside(before, now, changed) for (before, now), changed in zip(pairs, found, strict=True)]
