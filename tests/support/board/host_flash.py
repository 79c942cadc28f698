"""The host library's flash, whose power can fail during an operation and leave any content that real cells may have."""

import ctypes
import random
from dataclasses import dataclass

from support.board.host_board import core

PAGES, PAGE_BYTES, DOUBLEWORD = 16, 2048, 8
_WATCH = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_uint, ctypes.c_size_t, ctypes.POINTER(ctypes.c_uint64))


@dataclass(frozen=True, slots=True)
class Operation:
    """An erase, or the programming of one doubleword (`value`) at `offset`."""

    page: int
    offset: int = 0
    value: int | None = None


class HostFlash:
    """The flash of the host library, erased. `operations` are those begun since the last power-up.

    A `worn` doubleword, (page, offset), loses its programmed value at the next operation.
    """

    def __init__(self) -> None:
        self._core = core()
        self._core.host_flash_clear()
        self._core.host_flash_bytes.restype = ctypes.POINTER(ctypes.c_uint8)
        self._watch = _WATCH(self._begin)
        self.worn: tuple[int, int] | None = None
        self.power_up()

    def power_up(self, lasts: int | None = None, rng: random.Random | None = None) -> None:
        """Power up. Power fails during the operation after `lasts` ones; never with None."""
        self.operations: list[Operation] = []
        self._lasts = lasts
        self._rng = rng or random.Random(0)
        self._core.host_flash_watch(self._watch)

    @property
    def failed(self) -> bool:
        """Whether power has failed since the last power-up."""
        return self._lasts is not None and len(self.operations) > self._lasts

    def contents(self, page: int) -> bytes:
        return ctypes.string_at(self._core.host_flash_bytes(page), PAGE_BYTES)

    def put(self, page: int, data: bytes) -> None:
        """Write to the cells without a look at their content."""
        ctypes.memmove(self._core.host_flash_bytes(page), data, len(data))

    def tear(self, page: int, offset: int) -> None:
        """Make reading this doubleword fail until the page is erased."""
        self._core.host_flash_tear(page, ctypes.c_size_t(offset))

    def _begin(self, page: int, offset: int, pointer: "ctypes._Pointer[ctypes.c_uint64]") -> bool:
        if self.failed:
            return False
        operation = Operation(page, offset, pointer[0] if pointer else None)
        self.operations.append(operation)
        if self.worn is not None and operation.value is not None:
            self.tear(*self.worn)
        if not self.failed:
            return True
        if operation.value is None:
            self._cut_erase(page)
        else:
            self._cut_program(operation, operation.value)
        return False

    def _cut_erase(self, page: int) -> None:
        """Interrupt an erase: cells as before, on their way to 1, at 1, or random; some ECCs no longer match."""
        rng, old = self._rng, int.from_bytes(self.contents(page), "little")
        noise = rng.getrandbits(8 * PAGE_BYTES)
        sparse = noise & rng.getrandbits(8 * PAGE_BYTES) & rng.getrandbits(8 * PAGE_BYTES)
        one_bit = 1 << rng.randrange(8 * 120)
        content = rng.choice([old, old | one_bit, old | sparse, old | noise, noise, 2 ** (8 * PAGE_BYTES) - 1])
        self.put(page, content.to_bytes(PAGE_BYTES, "little"))
        for offset in range(0, PAGE_BYTES, DOUBLEWORD):
            if rng.random() < rng.choice([0.0, 0.0, 0.02, 0.5]):
                self.tear(page, offset)

    def _cut_program(self, operation: Operation, value: int) -> None:
        """Interrupt programming: the doubleword stays as before, is complete, partly 0, or random; its ECC may fail."""
        rng = self._rng
        noise = rng.getrandbits(64)
        content = rng.choice([2**64 - 1, value, value | noise, value | noise & rng.getrandbits(64), noise])
        data = bytearray(self.contents(operation.page))
        data[operation.offset : operation.offset + DOUBLEWORD] = content.to_bytes(DOUBLEWORD, "little")
        self.put(operation.page, bytes(data))
        if content != value and rng.random() < 0.5:
            self.tear(operation.page, operation.offset)
