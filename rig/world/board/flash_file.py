"""The simulated board's flash in a file, so that the next run finds the board as this run left it.

The file contains the 256 KB as the chip reads them, then the offset (u32, little-endian) of every doubleword that a
power cut interrupted while it was written. Only the last pages of a file are used, which hold the calibrations, because
the program is always the shipped one. A file that does not begin with a program is refused and not changed.
"""

import struct
from pathlib import Path

from firmware_host.emulator.chip.flash_memory import FLASH_BYTES, STORE_OFFSET, FlashMemory
from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.config.files.safe_writing import write_new
from rig.errors import Refused
from rig.world.board.mounted_board import read_firmware

MAX_BYTES = 2 * FLASH_BYTES  # with an offset for every doubleword
# The chip's memories (RM0394, section 2.2). A program's first word points to the end of the RAM, its second into the
# flash.
RAM, FLASH = range(0x2000_0000, 0x2001_0000), range(0x0800_0000, 0x0804_0000)


def open_flash(path: Path | None) -> FlashMemory:
    """Return a flash with the shipped program.

    If a `path` is given, the other stored data are read from this file, and every change is written to it. Raise
    Refused `flash_file`.
    """
    if path is None:
        return FlashMemory(read_firmware("bin"))
    if not path.parent.is_dir():
        raise Refused("flash_file", f"world.board.flash_file {path}: there is no such folder", "Make the folder first")
    try:
        if path.is_symlink():
            raise UnfitFile("it is a link")
        data = read_regular_file(path, MAX_BYTES)
        _check(data)
    except FileNotFoundError:
        data = b"\xff" * FLASH_BYTES
    except (UnfitFile, OSError) as error:
        raise Refused(
            "flash_file",
            f"world.board.flash_file {path} is not the flash of a simulated board: {error}",
            "Name another file, or delete this one",
        ) from error
    torn = frozenset(offset for (offset,) in struct.iter_unpack("<I", data[FLASH_BYTES:]))
    memory = FlashMemory(read_firmware("bin"), data[STORE_OFFSET:FLASH_BYTES], torn)
    memory.on_change = lambda: write_new(  # atomic: a reader sees the old flash or the new one
        path, bytes(memory.data) + b"".join(struct.pack("<I", offset) for offset in sorted(memory.torn))
    )
    return memory


def _check(data: bytes) -> None:
    """Raise UnfitFile unless `data` is the content of a flash.

    The named file will be replaced, so this protects another file that is named by mistake.
    """
    if len(data) < FLASH_BYTES or len(data) % 4:
        raise UnfitFile(f"it has {len(data)} bytes")
    stack, reset = struct.unpack_from("<II", data)
    if not (RAM.start <= stack <= RAM.stop and FLASH.start <= reset < FLASH.stop):
        raise UnfitFile("it does not begin as a program of this chip does")
