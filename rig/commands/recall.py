"""The beginning of a run: what the history knows of its sensors' serial numbers."""

from typing import TYPE_CHECKING

from rig.commands.remember import ANSWER_S, why
from rig.commands.waiting import answer_of
from rig.config.models import RigConfig
from rig.data.absent import NO_BOARD
from rig.runner.mounted import CalibratedBefore, Memory

if TYPE_CHECKING:
    from rig.history.place import Place
    from rig.history.store import Past


def remembered(config: RigConfig, moved: frozenset[str]) -> Memory:
    """What is known of the sensors of `config`; a history that does not answer only says nothing.

    `moved` are serial numbers of sensors that are stated to be on another board than before.
    """
    from rig.history.place import chosen_place

    try:
        where = chosen_place(config.history)
        if where is None:
            return Memory(silent="the history is off", moved=moved)
        numbers = sorted({each.serial_number for each in config.all_sensors.values()})
        found = answer_of(lambda: _of(where, numbers), ANSWER_S)
    except Exception as error:  # whatever it is, a run does not depend on the history
        return Memory(silent=f"the history is silent ({why(error)})", moved=moved)
    return Memory(found, None, moved)


def _of(where: "Place", serial_numbers: list[str]) -> tuple[CalibratedBefore, ...]:
    from pathlib import Path

    from rig.history.store import Selection, open_history

    if isinstance(where.where, Path) and not where.where.exists():
        return ()
    with open_history(where) as history:
        found = [each for number in serial_numbers for each in history.calibrations(Selection(serial_number=number))]
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
