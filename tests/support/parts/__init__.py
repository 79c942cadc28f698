"""The parts of the board by their data sheets: one file per part, with three definitions.

`SHEET`: the requirements on its register model; `<Part>Registers`: the part as the firmware's driver sees it; a driver
in Python for the model. The magnetometers have only the second.
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from firmware_host.parts import BOARD_PARTS, GYROSCOPES
from support.board.data_sheet import DataSheet

_OF = {part: import_module(f"support.parts.{part}") for part in BOARD_PARTS}
SHEETS: dict[str, DataSheet] = {part: _OF[part].SHEET for part in GYROSCOPES}
REGISTERS: dict[str, Callable[[], Any]] = {
    part: getattr(_OF[part], f"{on_board.model.split(':')[1]}Registers") for part, on_board in BOARD_PARTS.items()
}
NUMBER = {part: number for number, part in enumerate(BOARD_PARTS)}  # that the board gives a part
