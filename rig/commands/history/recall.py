"""The beginning of a run: what the history knows of its sensors' serial numbers."""

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from rig.commands.history.answer import history_answer, why
from rig.config.models import RigConfig
from rig.data.absent import NO_BOARD
from rig.runner.mounted import CalibratedBefore, Memory

if TYPE_CHECKING:
    from rig.history.storage.address import HistoryAddress
    from rig.history.store import Past, Selection


def remembered(config: RigConfig, moved: frozenset[str]) -> Memory:
    """What is known of the sensors of `config`; a history that does not answer only says nothing.

    `moved` are serial numbers of sensors that are stated to be on another board than before.
    """
    from rig.history.storage.address import choose_history_address

    try:
        where = choose_history_address(config.history)
        if where is None:
            return Memory(silent="the history is off", moved=moved)
        numbers = sorted({each.serial_number for each in config.all_sensors.values()})
        found = history_answer(where, lambda: _of(where, numbers))
    except Exception as error:  # whatever it is, a run does not depend on the history
        return Memory(silent=f"the history is silent ({why(error)})", moved=moved)
    return Memory(found, None, moved)


def known_board(
    config: RigConfig, board: str, parts: Collection[str], own: Collection[str], *, simulated: bool
) -> str | None:
    """The serial number, in words, that the history has of one of these `parts` on that board, if it is not of `own`.

    The newest calibration decides. A history that does not answer knows none.
    """
    from rig.history.storage.address import choose_history_address

    try:
        where = choose_history_address(config.history)
        found = () if where is None else history_answer(where, lambda: _on(where, board))
    except Exception:  # whatever it is, a run does not depend on the history, and says that it is silent
        return None
    same = [each for each in found if each.part in parts and each.simulated == simulated]
    if not same or same[0].serial_number in own:
        return None
    return f"{same[0].serial_number}, calibrated {same[0].words}"


def _on(where: "HistoryAddress", board: str) -> tuple[CalibratedBefore, ...]:
    from rig.history.store import Selection

    return _found(where, [Selection(board=board)])


def _of(where: "HistoryAddress", serial_numbers: list[str]) -> tuple[CalibratedBefore, ...]:
    from rig.history.store import Selection

    return _found(where, [Selection(serial_number=number) for number in serial_numbers])


def _found(where: "HistoryAddress", wanted: "Sequence[Selection]") -> tuple[CalibratedBefore, ...]:
    """What a history has of that, the newest first; a file that is not there has nothing."""
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history

    if not is_there(where):
        return ()
    with open_history(where) as history:
        found = [each for selection in wanted for each in history.calibrations(selection)]
    newest_first = sorted(found, key=lambda each: (each.started_utc, each.id), reverse=True)
    return tuple(_before(each) for each in newest_first if each.voided is None)


def _before(past: "Past") -> CalibratedBefore:
    return CalibratedBefore(
        part=past.part,
        serial_number=past.serial_number,
        simulated=past.simulated,
        number=past.id,
        day=past.started_utc[:10],
        verdict=past.verdict,
        board_unique_id=None if past.board_unique_id == NO_BOARD else past.board_unique_id,
    )
