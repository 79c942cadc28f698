"""The history's calibrations of a run's serial numbers, read when the run begins."""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from rig.commands.history.history_answer import ask_history, explain_failure
from rig.config.models import RigConfig
from rig.data.absent import NO_BOARD
from rig.runner.mounted_sensors import CalibratedBefore, Memory

if TYPE_CHECKING:
    from rig.history.storage.address import HistoryAddress
    from rig.history.store import Past, Selection


def recall_sensors(config: RigConfig, moved: frozenset[str]) -> Memory:
    """Return earlier calibrations of the sensors of `config`, or the reason why the history does not give any.

    `moved` are serial numbers of sensors that are declared to be on another board than before.
    """
    from rig.history.storage.address import choose_history_address

    try:
        address = choose_history_address(config.history)
        if address is None:
            return Memory(silent="the history is off", moved=moved)
        numbers = sorted({sensor.serial_number for sensor in config.all_sensors.values()})
        calibrations = ask_history(address, lambda: _load_of_sensors(address, numbers))
    except Exception as error:  # whatever it is, a run does not depend on the history
        return Memory(silent=f"the history is silent ({explain_failure(error)})", moved=moved)
    return Memory(calibrations, None, moved)


def find_other_board(
    config: RigConfig, board: str, parts: Collection[str], own_serial_numbers: Collection[str], *, simulated: bool
) -> str | None:
    """Return the serial number of the newest calibration on this `board`, with its date, if it is another sensor's.

    Only calibrations of the `parts` count, from simulated laboratories if `simulated`, else from real ones. Return None
    if there is none, if the serial number is one of `own_serial_numbers`, or if the history does not answer.
    """
    from rig.history.storage.address import choose_history_address

    try:
        address = choose_history_address(config.history)
        calibrations = () if address is None else ask_history(address, lambda: _load_of_board(address, board))
    except Exception:  # whatever it is, a run does not depend on the history; its own recall reports the failure
        return None
    similar = [before for before in calibrations if before.part in parts and before.simulated == simulated]
    if not similar or similar[0].serial_number in own_serial_numbers:
        return None
    return f"{similar[0].serial_number}, calibrated {similar[0].words}"


def _load_of_board(address: "HistoryAddress", board: str) -> tuple[CalibratedBefore, ...]:
    from rig.history.store import Selection

    return _load_calibrations(address, [Selection(board=board)])


def _load_of_sensors(address: "HistoryAddress", serial_numbers: list[str]) -> tuple[CalibratedBefore, ...]:
    from rig.history.store import Selection

    return _load_calibrations(address, [Selection(serial_number=number) for number in serial_numbers])


def _load_calibrations(address: "HistoryAddress", wanted: "Sequence[Selection]") -> tuple[CalibratedBefore, ...]:
    """Return the valid calibrations of the selections, newest first; empty if the file is missing."""
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history

    if not is_there(address):
        return ()
    with open_history(address) as history:
        pasts = [past for selection in wanted for past in history.calibrations(selection)]
    newest_first = sorted(pasts, key=lambda past: (past.started_utc, past.id), reverse=True)
    return tuple(_describe(past) for past in newest_first if past.voided is None)


def _describe(past: "Past") -> CalibratedBefore:
    return CalibratedBefore(
        part=past.part,
        serial_number=past.serial_number,
        simulated=past.simulated,
        number=past.id,
        day=past.started_utc[:10],
        verdict=past.verdict,
        board_unique_id=None if past.board_unique_id == NO_BOARD else past.board_unique_id,
    )
