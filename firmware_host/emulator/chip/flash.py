"""The flash interface (RM0394, chapter 3): wait states, and erasing and programming of the pages for calibrations.

The program runs from the same bank, so the core waits during an operation (section 3.3.5).
"""

from collections.abc import Sequence

from firmware_host.emulator.chip.bus import Register, StoredRegister, Violation, check_bits
from firmware_host.emulator.chip.flash_memory import (
    DOUBLEWORD_BYTES,
    PAGE_BYTES,
    STORE_OFFSET,
    STORE_PAGES,
    FlashMemory,
)
from firmware_host.emulator.chip.nvic import FIRST_IRQ, NMI, Nvic
from firmware_host.emulator.timeline import TICK_HZ, Timeline

_KEYS = [0x4567_0123, 0xCDEF_89AB]
_PG, _PER, _STRT, _OPTLOCK, _LOCK = 1 << 0, 1 << 1, 1 << 16, 1 << 30, 1 << 31
_PNB_SHIFT, _PNB = 3, 0xFF << 3
_PROGERR, _PGAERR, _SIZERR, _PGSERR, _BSY = 1 << 3, 1 << 5, 1 << 6, 1 << 7, 1 << 16
_ERRORS = 0xC3FA  # the error flags of SR that the firmware may clear
_ECCC, _ECCD = 1 << 30, 1 << 31
_DATA_CACHE, _INSTRUCTION_CACHE = 1 << 10, 1 << 9
_RESET_DATA_CACHE, _RESET_INSTRUCTION_CACHE = 1 << 12, 1 << 11
# Data sheet DS11451, "Flash memory characteristics", typical
_ERASE_TICKS = round(22.02e-3 * TICK_HZ)
_PROGRAM_TICKS = round(81.69e-6 * TICK_HZ)
_CORRECT = "Correct the firmware"


class Flash:
    """The interface's registers and, through `read` and `write`, the writable pages.

    Reading a torn doubleword raises the non-maskable interrupt. The flags EOP and OPERR stay clear, as their interrupts
    are not modelled (section 3.7.5).
    """

    name = "FLASH"
    base = 0x4002_2000

    def __init__(self, timeline: Timeline, memory: FlashMemory, nvic: Nvic) -> None:
        self._timeline = timeline
        self._memory = memory
        self._nvic = nvic
        self._slot = timeline.register(self._finish)
        self._access = StoredRegister("FLASH ACR", 0x1F07, initial=0x0600, after=self._check_caches)
        self.reset()

    def reset(self) -> None:
        """Reset the interface; a pending operation is cut off, and its doublewords stay torn."""
        self._access.reset()
        self._control = _LOCK | _OPTLOCK
        self._status = 0
        self._ecc = 0
        self._keys: list[int] = []
        self._first_word: tuple[int, int] | None = None  # offset and value of half a doubleword
        self._operation: tuple[int, bytes] | None = None  # pending: offset and new content
        self._cache_is_old = False  # the data cache may hold old content
        self._timeline.cancel(self._slot)
        self._nvic.set_line(NMI - FIRST_IRQ, False)

    def registers(self) -> Sequence[Register]:
        return (
            self._access.map_to(0x00),
            Register(0x08, "KEYR", None, self._write_key),
            Register(0x10, "SR", lambda: self._status | (_BSY if self.busy else 0), self._clear_status),
            Register(0x14, "CR", lambda: self._control, self._write_control),
            Register(0x18, "ECCR", lambda: 0 if self._memory.flags_lost else self._ecc, self._clear_ecc),
        )

    @property
    def wait_states(self) -> int:
        return self._access.value & 7

    @property
    def busy(self) -> bool:
        """Whether an operation is pending, during which the core waits."""
        return self._operation is not None

    # --- the pages, by offset from the first of them

    def read(self, offset: int, size: int) -> int:
        if self._cache_is_old and self._access.value & _DATA_CACHE:
            raise Violation(
                "flash_cache",
                "a page read through the data cache, which does not know that it has changed",
                "Reset the data cache after erasing and programming",
            )
        offset += STORE_OFFSET
        first, last = (byte // DOUBLEWORD_BYTES * DOUBLEWORD_BYTES for byte in (offset, offset + size - 1))
        for doubleword in (first, last):
            if doubleword in self._memory.torn and not self._ecc & _ECCD:
                self._ecc = _ECCD | doubleword
                self._nvic.set_line(NMI - FIRST_IRQ, True)
        return int.from_bytes(self._memory.data[offset : offset + size], "little")

    def write(self, offset: int, size: int, value: int) -> None:
        """Write half a doubleword (section 3.3.7)."""
        if self._control & _LOCK:
            raise Violation("flash_locked", f"write of 0x{value:X} to locked flash", "Write both keys to KEYR first")
        if self.busy:
            raise Violation("flash_busy", "write to flash while an operation is under way", "Wait until BSY is clear")
        first, self._first_word = self._first_word, None
        offset += STORE_OFFSET
        if not self._control & _PG or self._status & _ERRORS:
            self._status |= _PGSERR
        elif size != 4:
            self._status |= _SIZERR
        elif first is None and offset % DOUBLEWORD_BYTES == 0:
            self._first_word = offset, value
        elif first is None or offset != first[0] + 4:
            self._status |= _PGAERR
        else:
            self._program(first[0], first[1] | value << 32)

    # --- registers

    def _check_caches(self) -> None:
        value = self._access.value
        for cache, reset in ((_DATA_CACHE, _RESET_DATA_CACHE), (_INSTRUCTION_CACHE, _RESET_INSTRUCTION_CACHE)):
            if value & cache and value & reset:
                raise Violation(
                    "flash_cache", f"FLASH ACR = 0x{value:X} resets a cache that is on", "Switch it off first"
                )
        if value & _RESET_DATA_CACHE:
            self._cache_is_old = False

    def _write_key(self, key: int) -> None:
        self._keys.append(key)
        if self._keys != _KEYS[: len(self._keys)]:
            raise Violation(
                "flash_key", f"FLASH KEYR = 0x{key:08X}, which locks the flash until the next reset", _CORRECT
            )
        if self._keys == _KEYS:
            self._control &= ~_LOCK
            self._keys = []

    def _clear_status(self, value: int) -> None:
        check_bits("FLASH SR", value & ~_ERRORS, 1)
        self._status &= ~value

    def _clear_ecc(self, value: int) -> None:
        check_bits("FLASH ECCR", value & ~0x1F_FFFF, _ECCC | _ECCD)
        if value & _ECCD:
            self._ecc = 0
            self._nvic.set_line(NMI - FIRST_IRQ, False)

    def _write_control(self, value: int) -> None:
        check_bits("FLASH CR", value, _PG | _PER | _PNB | _STRT | _OPTLOCK | _LOCK)
        if self._control & _LOCK:
            raise Violation("flash_locked", f"FLASH CR = 0x{value:X} while locked", "Write both keys to KEYR first")
        if self.busy:
            raise Violation("flash_busy", "FLASH CR written while an operation is under way", "Wait until BSY is clear")
        self._control = value | self._control & _OPTLOCK  # opened by another key
        if value & _STRT:
            self._erase((value & _PNB) >> _PNB_SHIFT)

    # --- operations

    def _erase(self, page: int) -> None:
        if self._control & (_PER | _PG) != _PER or self._status & _ERRORS:
            self._status |= _PGSERR
            self._control &= ~_STRT
            return
        offset = page * PAGE_BYTES
        if not STORE_OFFSET <= offset < STORE_OFFSET + STORE_PAGES * PAGE_BYTES:
            raise Violation("flash_page", f"erasure of page {page}, which belongs to the program", _CORRECT)
        self._start(offset, b"\xff" * PAGE_BYTES, _ERASE_TICKS)

    def _program(self, offset: int, value: int) -> None:
        """Program a doubleword that is erased, or set any doubleword to zero."""
        if value and self._memory.data[offset : offset + DOUBLEWORD_BYTES] != b"\xff" * DOUBLEWORD_BYTES:
            self._status |= _PROGERR
            return
        self._start(offset, value.to_bytes(DOUBLEWORD_BYTES, "little"), _PROGRAM_TICKS)

    def _start(self, offset: int, content: bytes, ticks: int) -> None:
        self._memory.begin(offset, content)
        self._operation = offset, content
        self._cache_is_old = True
        self._timeline.schedule(self._slot, self._timeline.now + ticks)
        self._timeline.interrupt()

    def _finish(self) -> None:
        assert self._operation is not None
        self._memory.finish(*self._operation)
        self._operation = None
        self._control &= ~_STRT
