"""The simulated board's flash in a file, so that the next run meets the board this one left behind.

The file holds the 256 KB as the chip shows them, then the offset (u32, little-endian) of every doubleword whose
writing a power cut tore. Of a file only the last pages count, where the calibrations are: the program is always the
shipped one. A file that does not begin with a program is none of these and stays as it is.
"""

import struct
from pathlib import Path

from firmware_host.emulator.chip.flash_memory import FLASH_BYTES, STORE_OFFSET, FlashMemory
from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.config.files.written_file import write_new
from rig.errors import Refused
from rig.world.board.mounting import firmware

LARGEST_BYTES = 2 * FLASH_BYTES  # with an offset for every doubleword
# Where the chip has them (RM0394, section 2.2): the first two words of a program point to the end of the one, and into
# the other.
RAM, FLASH = range(0x2000_0000, 0x2001_0000), range(0x0800_0000, 0x0804_0000)


def flash_of(path: Path | None) -> FlashMemory:
    """A flash with the shipped program that `path`, if given, keeps up to date. Raises `Refused` for another file."""
    if path is None:
        return FlashMemory(firmware("bin"))
    if not path.parent.is_dir():
        raise Refused("flash_file", f"world.board.flash_file {path}: there is no such folder", "Make the folder first")
    try:
        if path.is_symlink():
            raise UnfitFile("it is a link")
        data = read_regular_file(path, LARGEST_BYTES)
        _check(data)
    except FileNotFoundError:
        data = b"\xff" * FLASH_BYTES
    except (UnfitFile, OSError) as error:
        raise Refused(
            "flash_file",
            f"world.board.flash_file {path} is no flash that a simulated board left: {error}",
            "Name another file, or delete this one",
        ) from error
    torn = frozenset(offset for (offset,) in struct.iter_unpack("<I", data[FLASH_BYTES:]))
    memory = FlashMemory(firmware("bin"), data[STORE_OFFSET:FLASH_BYTES], torn)
    memory.on_change = lambda: write_new(  # in one go: whoever reads the file meets the old flash or the new one
        path, bytes(memory.data) + b"".join(struct.pack("<I", offset) for offset in sorted(memory.torn))
    )
    return memory


def _check(data: bytes) -> None:
    """A foreign configuration may name any file, and what is named is replaced. Raises UnfitFile."""
    if len(data) < FLASH_BYTES or len(data) % 4:
        raise UnfitFile(f"it has {len(data)} bytes")
    stack, reset = struct.unpack_from("<II", data)
    if not (RAM.start <= stack <= RAM.stop and FLASH.start <= reset < FLASH.stop):
        raise UnfitFile("it does not begin as a program of this chip does")
