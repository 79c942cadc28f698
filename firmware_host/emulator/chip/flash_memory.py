"""The content of the chip's flash, which survives a reset, a power cut and, in a file, the simulation."""

from collections.abc import Callable

from firmware_host.errors import BoardError

FLASH_BYTES = 256 * 1024
PAGE_BYTES = 2048
DOUBLEWORD_BYTES = 8
STORE_PAGES = 16  # at the end, for the calibrations; the others for the program
STORE_OFFSET = FLASH_BYTES - STORE_PAGES * PAGE_BYTES


class PowerLost(Exception):
    """A failure of the supply, as requested by `FlashMemory.fail_power`."""


class FlashMemory:
    """The content and state of the flash.

    - `image`: the program, from the start.
    - `store`: the last pages, erased if omitted.
    - `torn`: offsets of doublewords with an interrupted erasure or programming. The chip detects a read of such a
      doubleword. With `flags_lost` it does not report which one, as in the chip's errata on a power loss during an
      operation.
    - `on_change`: called after every change.

    Raise BoardError if the image does not fit.
    """

    def __init__(self, image: bytes, store: bytes = b"", torn: frozenset[int] = frozenset()) -> None:
        if len(image) > STORE_OFFSET:
            raise BoardError("image_too_big", f"the image has {len(image)} bytes", f"Flash holds {STORE_OFFSET}")
        self.data = bytearray(image.ljust(STORE_OFFSET, b"\xff") + store.ljust(FLASH_BYTES - STORE_OFFSET, b"\xff"))
        self.torn = set(torn)
        self.flags_lost = False
        self.operations = 0  # number of erasures and programmings begun
        self.on_change: Callable[[], None] = lambda: None
        self._fails_at: int | None = None
        self._fails_torn = False

    def fail_power(self, operation: int, torn: bool) -> None:
        """Let the power fail at the operation of this number, counted from 1.

        With `torn`, the power fails during the operation; else before the operation begins.
        """
        self._fails_at, self._fails_torn = operation, torn

    def begin(self, offset: int, content: bytes) -> None:
        """Begin to write `content` at `offset`; until `finish` it is incomplete.

        Raise PowerLost if the power is to fail.
        """
        self.operations += 1
        fails = self.operations == self._fails_at
        if not fails or self._fails_torn:
            span = range(offset, offset + len(content))
            self.torn.update(span[::DOUBLEWORD_BYTES])
            self.data[span.start : span.stop] = bytes(byte ^ 0x5A for byte in content)  # torn content is arbitrary
            self.on_change()
        if fails:
            raise PowerLost

    def finish(self, offset: int, content: bytes) -> None:
        """Complete the operation that `begin` started."""
        self.data[offset : offset + len(content)] = content
        self.torn.difference_update(range(offset, offset + len(content), DOUBLEWORD_BYTES))
        self.on_change()
