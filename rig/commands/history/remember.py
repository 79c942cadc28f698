"""The entry of a finished run in the history, and its comparison with the last calibration of the same sensors.

A run never fails because of the history: it reports the problem and continues.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.history.history_answer import ENTRY_MODULES, ask_history, explain_failure
from rig.errors import RigError
from rig.station.events import LastCalibration, NotRemembered, Remembered, RunEvent

if TYPE_CHECKING:
    from rig.config.judging.judging_sections import HistorySection
    from rig.config.load import Loaded
    from rig.history.entered.finished_run import FinishedRun
    from rig.history.entered.issued_certificate import IssuedCertificate
    from rig.history.series import Change
    from rig.history.storage.address import HistoryAddress
    from rig.history.store import History, Past


@dataclass(frozen=True, slots=True)
class CalibrationComparison:
    """A calibration of this run (`now`), the sensor's previous one (`before`), and the changes between them."""

    before: "Past"
    now: "Past"
    changes: "Sequence[Change]"


def remember(folder: Path, section: "HistorySection") -> tuple[RunEvent | None, tuple[CalibrationComparison, ...]]:
    """Enter the run of `folder` into the history. Return the event to report, and comparisons with the last results."""
    from rig.history.storage.address import choose_history_address

    return _enter_run(folder, lambda: choose_history_address(section))


def remember_own(folder: Path, named: str | None) -> tuple[RunEvent | None, tuple[CalibrationComparison, ...]]:
    """Enter the run of `folder` into the user's own history, or the `named` one; return what `remember` returns."""
    from rig.history.storage.address import default_history_address

    return _enter_run(folder, lambda: default_history_address(named))


def _enter_run(
    folder: Path, choose_address: Callable[[], "HistoryAddress | None"]
) -> tuple[RunEvent | None, tuple[CalibrationComparison, ...]]:
    """Enter a finished run into the history; return the event and the comparisons. No error is raised."""
    label = "the history"
    try:
        from rig.history.entered.finished_run import read_finished_run

        address = choose_address()
        if address is None:
            return None, ()
        label = address.label
        run = read_finished_run(folder)
        numbers, comparisons = ask_history(address, lambda: _enter(address, run), ENTRY_MODULES)
    except Exception as error:  # whatever it is, the run is finished and its result is written
        return NotRemembered(folder, f"{label}: {explain_failure(error)}"), ()
    return Remembered(label, numbers, tuple(map(_since_event, comparisons)), usual=_is_usual(address)), comparisons


def _is_usual(address: "HistoryAddress") -> bool:
    """Return whether this history is the user's default, which commands use if no history is named."""
    from rig.history.storage.address import default_history_address

    try:
        return address == default_history_address(None)
    except RigError:  # the user has no home
        return False


def remember_certificate(
    folder: Path, result: str, certificate: "IssuedCertificate", history: str | None = None
) -> str | None:
    """Enter the certificate of the run in `folder`, whose result.json is `result`; return why this failed, if it did.

    The history is `history`, or if None the user's own, never one that the folder's configuration names, because the
    folder may come from anywhere.
    """
    try:
        from rig.history.entered.finished_run import content_sha256

        loaded, address = _find_own(folder, history)
        if address is None:
            return None
        noted = ask_history(address, lambda: _certify(address, content_sha256(result), certificate))
    except Exception as error:  # whatever it is, the certificate is written
        return explain_failure(error)
    if noted:
        return None
    named = None if loaded is None or history is not None else loaded.config.history.url
    hint = f", or --history {named} if that is yours" if named is not None else ""
    return f"{address.label} does not contain this run; rig history import {folder} enters it{hint}"


def _find_own(folder: Path, history: str | None) -> "tuple[Loaded | None, HistoryAddress | None]":
    """Return the configuration of the run in `folder`, and the address of `history`, by default the user's own.

    The address is None if there is no history, or if the configuration switches the history off and `history` is None.
    """
    from rig.history.entered.finished_run import read_configuration
    from rig.history.storage.address import default_history_address

    loaded = read_configuration(folder)
    is_off = history is None and loaded is not None and loaded.config.history.is_off
    return loaded, None if is_off else default_history_address(history)


def find_journal_end(folder: Path, history: str | None = None) -> tuple[int, str] | None:
    """Return number and SHA-256 of the last entry in the journal of the history that `remember_certificate` would use.

    Return None if there is no history, or if the history does not answer or is empty.
    """
    try:
        _, address = _find_own(folder, history)
        if address is None:
            return None
        return ask_history(address, lambda: _read_journal_end(address))
    except Exception:  # whatever it is, the certificate is signed; a later message says that it is in no history
        return None


def describe_changes(calibrations: Sequence[CalibrationComparison]) -> tuple[str, ...]:
    """Return sentences on how calibrations differ from earlier ones: on changed sensors, then on unchanged ones."""
    if not calibrations:  # with the history off its modules are not imported
        return ()
    from rig.history.terminal.change_words import change_in_short, select_changed

    changed = [(pair, values) for pair in calibrations if (values := select_changed(pair.changes))]
    same = [pair for pair in calibrations if not select_changed(pair.changes)]
    lines = []
    for pair, values in changed:
        quantity = "" if pair.now.quantity == "rate" else f", {pair.now.quantity}"
        whose = f"{pair.now.serial_number}{quantity} " if len(calibrations) > 1 else ""
        compare = f"`rig history compare {pair.before.id} {pair.now.id}`"
        more = f"; {len(values) - 1} more: {compare}" if len(values) > 1 else ""
        since = f"since {pair.before.started_utc[:10]} (no. {pair.before.id})"
        lines.append(f"{whose}{since}: {change_in_short(values[0])}{more}")
    if same:
        before = ", ".join(str(pair.before.id) for pair in same)
        whose = " of the other sensors" if changed else ""
        count = sum(len(pair.changes) for pair in same)
        lines.append(f"none of {count} values changed since the last calibration{whose} (no. {before})")
    return tuple(lines)


def _enter(
    address: "HistoryAddress", run: "FinishedRun"
) -> "tuple[tuple[int, ...], tuple[CalibrationComparison, ...]]":
    from rig.history.store import open_history

    with open_history(address) as history:
        run_id = history.enter(run).run_id
        return tuple(past.id for past in history.select_run(run_id)), tuple(_compare_with_earlier(history, run_id))


def _certify(address: "HistoryAddress", content_sha256: str, certificate: "IssuedCertificate") -> bool:
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history

    if not is_there(address):
        return False
    with open_history(address) as history:
        return history.certify(content_sha256, certificate)


def _read_journal_end(address: "HistoryAddress") -> tuple[int, str] | None:
    """Return number and SHA-256 of the journal's last entry; None without a history or an entry."""
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history

    if not is_there(address):
        return None
    with open_history(address) as history:
        end = history.head()
    return (end.number, end.sha256) if end.number else None


def _since_event(calibration: CalibrationComparison) -> LastCalibration:
    return LastCalibration(
        calibration.now.sensor,
        calibration.now.quantity,
        calibration.before.id,
        calibration.before.started_utc[:10],
        {change.name: (change.before.value, change.before.expanded) for change in calibration.changes},
        {change.name: change.normalised_error for change in calibration.changes},
        tuple(change.name for change in calibration.changes if change.has_changed),
    )


def _compare_with_earlier(history: "History", run_id: int) -> "list[CalibrationComparison]":
    """Return the comparison of each calibration of a run with the sensor's previous one, if any."""
    from rig.history.series import changes_in, subjects
    from rig.history.store import Selection

    pairs = []
    for now in history.select_run(run_id):
        series = subjects(history.calibrations(Selection(serial_number=now.serial_number))).get(now.subject, [])
        earlier = [past for past in series if (past.started_utc, past.id) < (now.started_utc, now.id)]
        pairs.extend([(earlier[-1], now)] if earlier else [])
    changes = changes_in([(before.parameters, now.parameters) for before, now in pairs])
    return [CalibrationComparison(before, now, changed) for (before, now), changed in zip(pairs, changes, strict=True)]
