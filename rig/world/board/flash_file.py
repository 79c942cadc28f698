"""The simulated board's flash in a file, so that the next run meets the board this one left behind.

The file holds the 256 KB as the chip shows them, then the offset (u32, little-endian) of every doubleword whose
writing a power cut tore. Of a file only the last pages count, where the calibrations are: the program is always the
shipped one.
"""

import struct
from pathlib import Path

from firmware_host.emulator.flash_memory import FLASH_BYTES, STORE_OFFSET, FlashMemory
from rig.errors import Refused
from rig.world.board.mounting import firmware


def flash_of(path: Path | None) -> FlashMemory:
    """A flash with the shipped program that `path`, if given, keeps up to date. Raises `Refused` for another file."""
    if path is None:
        return FlashMemory(firmware("bin"))
    if not path.parent.is_dir():
        raise Refused("flash_file", f"world.board.flash_file {path}: there is no such folder", "Make the folder first")
    data = path.read_bytes() if path.exists() else b"\xff" * FLASH_BYTES
    if len(data) < FLASH_BYTES or len(data) % 4:
        raise Refused(
            "flash_file",
            f"world.board.flash_file {path} has {len(data)} bytes: no flash that a simulated board left",
            "Name another file, or delete this one",
        )
    torn = frozenset(offset for (offset,) in struct.iter_unpack("<I", data[FLASH_BYTES:]))
    memory = FlashMemory(firmware("bin"), data[STORE_OFFSET:FLASH_BYTES], torn)
    memory.on_change = lambda: _save(memory, path)
    return memory


def _save(memory: FlashMemory, path: Path) -> None:
    """In one go: whoever reads the file meets the old flash or the new one."""
    fresh = path.with_name(path.name + ".new")
    fresh.write_bytes(bytes(memory.data) + b"".join(struct.pack("<I", offset) for offset in sorted(memory.torn)))
    fresh.replace(path)
