"""A thin layer over Unicorn's C interface: memory, registers in batches, hooks without the binding's wrappers.

The Python binding that ships with Unicorn wraps every callback and every register in objects of its own. Direct calls
of the same shared library halve the price of a register access by the firmware (0.2 µs instead of 0.5 µs) and cut a
batch of eleven core registers from 16 µs to 0.7 µs; these two numbers set the emulator's pace. More frequent events
bypass Python: see `hooks.py`.
"""

import ctypes
import mmap
import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from unicorn import (
    UC_ARCH_ARM,
    UC_CTL_CPU_MODEL,
    UC_CTL_TB_REMOVE_CACHE,
    UC_ERR_OK,
    UC_HOOK_BLOCK,
    UC_HOOK_CODE,
    UC_HOOK_INTR,
    UC_HOOK_MEM_INVALID,
    UC_MEM_FETCH_PROT,
    UC_MEM_FETCH_UNMAPPED,
    UC_MEM_READ_UNMAPPED,
    UC_MEM_WRITE_PROT,
    UC_MEM_WRITE_UNMAPPED,
    UC_MODE_MCLASS,
    UC_MODE_THUMB,
    UC_PROT_ALL,
    UC_PROT_EXEC,
    UC_PROT_READ,
)
from unicorn.arm_const import UC_ARM_REG_LR, UC_ARM_REG_PC, UC_CPU_ARM_CORTEX_M4
from unicorn.unicorn_py3.unicorn import uclib

from firmware_host.emulator.hooks import BlockTicks, Bus, Counter, Meter, Shortcuts, Watch, address_of
from firmware_host.emulator.timeline import Timeline

_SET_CPU_MODEL = (1 << 30) | (1 << 26) | UC_CTL_CPU_MODEL  # uc_ctl: write, one argument
_TRANSLATE_ANEW = (1 << 30) | (2 << 26) | UC_CTL_TB_REMOVE_CACHE  # write, two arguments
# The calls that set the pace, without the overhead of the binding: no other thread may run while the core runs, so
# that the interpreter's lock need not be released at each call and callback; and few arguments are converted
_quick = ctypes.PyDLL(uclib._name, handle=uclib._handle)
_start = _quick.uc_emu_start
_start.argtypes = uclib.uc_emu_start.argtypes
_read_registers, _write_registers = _quick.uc_reg_read_batch, _quick.uc_reg_write_batch
_NO_END = 0xFFFF_FFFF  # an address the core never executes: only stop(), WFI and faults end a run

# Unicorn passes one more argument to all of these, the user's data: unused arguments need no conversion
_READ = ctypes.CFUNCTYPE(ctypes.c_uint64, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint)
_WRITE = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint, ctypes.c_uint64)
_EXCHANGE = ctypes.CFUNCTYPE(ctypes.c_uint64, ctypes.c_uint64)
_BLOCK = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint64, ctypes.c_uint32)
_INVALID = ctypes.CFUNCTYPE(
    ctypes.c_bool, ctypes.c_void_p, ctypes.c_int, ctypes.c_uint64, ctypes.c_int, ctypes.c_int64, ctypes.c_void_p
)
_INTERRUPT = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_void_p)

_ATTEMPTS = {
    UC_MEM_READ_UNMAPPED: "read from",
    UC_MEM_WRITE_UNMAPPED: "write to",
    UC_MEM_FETCH_UNMAPPED: "execution at",
    UC_MEM_WRITE_PROT: "write to read-only",
    UC_MEM_FETCH_PROT: "execution at",
}


class EngineFault(Exception):
    """A failure of the core, or an access to missing memory; the message is Unicorn's."""


@dataclass(frozen=True, slots=True)
class QuickAccess:
    """Registers with access in machine code, see `hooks.ll`: those of `counter` and `bus`.

    `exchange(pair)` puts the two bytes of a 16-bit number on the bus, the low byte first, and returns their answers.
    """

    timeline: Timeline
    counter: Counter
    bus: Bus
    exchange: Callable[[int], int]


class Registers:
    """A fixed set of core registers, read and written in one call each.

    `ids` are Unicorn's register numbers; all of them must be 32 bits wide.
    """

    __slots__ = ("_count", "_handle", "_ids", "_pointers", "_values")

    def __init__(self, handle: ctypes.c_void_p, ids: Sequence[int]) -> None:
        self._handle = handle
        self._count = len(ids)
        self._ids = (ctypes.c_int * self._count)(*ids)
        self._values = (ctypes.c_uint32 * self._count)()
        base = ctypes.addressof(self._values)
        self._pointers = (ctypes.c_void_p * self._count)(*(base + 4 * i for i in range(self._count)))

    def read(self) -> list[int]:
        _read_registers(self._handle, self._ids, self._pointers, self._count)
        return self._values[:]

    def write(self, values: Sequence[int]) -> None:
        self._values[:] = values  # any sequence will do
        _write_registers(self._handle, self._ids, self._pointers, self._count)


class Engine:
    """One Cortex-M4F core with its memories. It runs code, without peripherals and interrupts."""

    def __init__(self) -> None:
        self._handle = ctypes.c_void_p()
        _check(uclib.uc_open(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS, ctypes.byref(self._handle)))
        _check(uclib.uc_ctl(self._handle, _SET_CPU_MODEL, ctypes.c_int(UC_CPU_ARM_CORTEX_M4)))
        weakref.finalize(self, uclib.uc_close, self._handle)
        self._callbacks: list[Any] = []  # ctypes callbacks live as long as the engine
        self._memories: list[tuple[int, int, mmap.mmap]] = []  # first address, the one after the last, contents
        self._raised: BaseException | None = None
        self._fault_registers: list[int] | None = None
        self._pc_and_link = self.registers([UC_ARM_REG_PC, UC_ARM_REG_LR])
        self.paused = False  # whether the last run ended before a block: at the deadline, or to measure it

    def map_ram(self, address: int, size: int) -> None:
        self._map(address, size, UC_PROT_ALL)

    def map_rom(self, address: int, size: int) -> None:
        self._map(address, size, UC_PROT_READ | UC_PROT_EXEC)

    def map_io(
        self,
        address: int,
        size: int,
        read: Callable[[int, int], int],
        write: Callable[[int, int, int], None],
        quick: QuickAccess | None = None,
    ) -> None:
        """Route a range to `read(offset, size)` and `write(offset, size, value)`; their exceptions end `run`.

        `quick`: registers of the range with access in machine code.
        """

        def call_read(_handle: int, offset: int, width: int) -> int:
            try:
                return read(offset, width)
            except BaseException as error:
                self._fail(error)
                return 0

        def call_write(_handle: int, offset: int, width: int, value: int) -> None:
            try:
                write(offset, width, value)
            except BaseException as error:
                self._fail(error)

        read_callback, write_callback = _READ(call_read), _WRITE(call_write)
        self._callbacks += [read_callback, write_callback]
        reader, writer = _pointer(read_callback), _pointer(write_callback)
        user = None
        if quick is not None:

            def call_exchange(pair: int) -> int:
                try:
                    return quick.exchange(pair)
                except BaseException as error:
                    self._fail(error)
                    return 0

            exchange = _EXCHANGE(call_exchange)
            shared = map(ctypes.addressof, (quick.timeline, quick.counter, quick.bus))
            shortcuts = Shortcuts(reader, writer, _pointer(exchange), *shared)
            self._callbacks += [exchange, quick, shortcuts]
            reader, writer = ctypes.c_void_p(address_of("read")), ctypes.c_void_p(address_of("write"))
            user = ctypes.byref(shortcuts)
        _check(uclib.uc_mmio_map(self._handle, address, size, reader, user, writer, user))

    def meter(self, timeline: Timeline, ticks: BlockTicks, measure: Callable[[int, int], int | None]) -> None:
        """Let time pass with the instructions: before each block add `ticks[address]`, or stop at the deadline.

        A block without `ticks` is passed to `measure(address, size_bytes)`, which returns its ticks, or None to stop.
        """

        def call_block(_handle: int, address: int, size: int) -> None:
            try:
                may_run = timeline.now < timeline.deadline or timeline.go_on()
                block_ticks = (ticks[address] or measure(address, size)) if may_run else None
                if block_ticks is None:
                    self.paused = True
                    self.stop()
                else:
                    timeline.now += block_ticks
            except BaseException as error:
                self._fail(error)

        callback = _BLOCK(call_block)
        meter = Meter(_pointer(callback), ctypes.addressof(timeline), *ticks.fields)
        self._callbacks += [callback, meter, timeline, ticks]
        self._add(UC_HOOK_BLOCK, ctypes.c_void_p(address_of("block")), ctypes.byref(meter))

    def watch_instruction(
        self, address: int, register: int, enough: int, ask: Callable[[int], None]
    ) -> Callable[[], None]:
        """Call `ask(address)` before the instruction at `address` if a core register there is no multiple of four.

        `register` is Unicorn's number of the register. `ask` is also called once after `enough` executions with a
        multiple of four. Return a function that ends the watch. Use both only between two runs of the core.
        """

        def call_ask(_handle: int, address: int, _size: int) -> None:
            try:
                ask(address)
            except BaseException as error:
                self._fail(error)

        callback = _BLOCK(call_ask)
        watch = Watch(ctypes.cast(uclib.uc_reg_read, ctypes.c_void_p), _pointer(callback), register, 0, enough)
        self._callbacks += [callback, watch]
        function = ctypes.c_void_p(address_of("watch"))
        hook_handle = self._add(UC_HOOK_CODE, function, ctypes.byref(watch), address, address)
        addresses = ctypes.c_uint64(address), ctypes.c_uint64(address + 2)
        _check(
            uclib.uc_ctl(self._handle, _TRANSLATE_ANEW, *addresses)
        )  # the block may have been translated without the hook
        return lambda: _check(uclib.uc_hook_del(self._handle, hook_handle))

    def hook_interrupt(self, hook: Callable[[int], None]) -> None:
        """Call `hook(number)` when the core raises one of its own exceptions (supervisor call, exception return, …)."""

        def call_hook(_handle: int, number: int, _user: int) -> None:
            try:
                hook(number)
            except BaseException as error:
                self._fail(error)

        self._hook(UC_HOOK_INTR, _INTERRUPT(call_hook))

    def hook_invalid(self, hook: Callable[[str, int], None]) -> None:
        """Call `hook(attempt, address)` for an access to inaccessible memory; `attempt` is "read from", for example."""

        def call_hook(_handle: int, kind: int, address: int, _size: int, _value: int, _user: int) -> bool:
            try:
                hook(_ATTEMPTS[kind], address)
            except BaseException as error:
                self._fail(error)
            return False

        self._hook(UC_HOOK_MEM_INVALID, _INVALID(call_hook))

    def registers(self, ids: Sequence[int]) -> Registers:
        return Registers(self._handle, ids)

    def register(self, number: int) -> Callable[[], int]:
        """Return a function that reads one core register of 32 bits, by Unicorn's number."""
        read, handle, value = uclib.uc_reg_read, self._handle, ctypes.c_uint32()
        pointer = ctypes.byref(value)

        def read_register() -> int:
            read(handle, number, pointer)
            return value.value

        return read_register

    def read(self, address: int, size: int) -> bytes:
        """Read memory. Raise EngineFault if there is no memory at the address."""
        for first, end, memory in self._memories:
            if first <= address and address + size <= end:
                return memory[address - first : address - first + size]
        raise EngineFault(f"memory read of {size} bytes at 0x{address:08X}, where there is none")

    def write(self, address: int, data: bytes) -> None:
        """Write memory, read-only or not, in which no code has run yet. Raise EngineFault if none is mapped there."""
        for first, end, memory in self._memories:
            if first <= address and address + len(data) <= end:
                memory[address - first : address - first + len(data)] = data
                return
        raise EngineFault(f"memory write of {len(data)} bytes at 0x{address:08X}, where there is none")

    def run(self, address: int) -> None:
        """Run from `address` until `stop`, WFI or a fault. Raise EngineFault, or the exception of a callback."""
        status = _start(self._handle, address | 1, _NO_END, 0, 0)
        if self._raised is not None:
            raised, self._raised = self._raised, None
            raise raised
        _check(status)

    def fault_registers(self) -> list[int]:
        """Return program counter and link register at the first exception of a callback, or now if there was none."""
        return self._pc_and_link.read() if self._fault_registers is None else self._fault_registers

    def stop(self) -> None:
        """Stop before the next block; inside a block hook, before the block of the hook."""
        uclib.uc_emu_stop(self._handle)

    def _map(self, address: int, size: int, protection: int) -> None:
        """Map memory that the engine and Python share."""
        memory = mmap.mmap(-1, size)
        pointer = ctypes.addressof(ctypes.c_char.from_buffer(memory))
        _check(uclib.uc_mem_map_ptr(self._handle, address, size, protection, pointer))
        self._memories.append((address, address + size, memory))

    def _fail(self, error: BaseException) -> None:
        if self._raised is None:
            self._raised = error
            self._fault_registers = self._pc_and_link.read()
        self.stop()

    def _hook(self, kind: int, callback: Any, begin: int = 1, end: int = 0) -> ctypes.c_size_t:
        """Add a hook for addresses from `begin` to `end`; by default all addresses, as Unicorn encodes them."""
        self._callbacks.append(callback)
        return self._add(kind, _pointer(callback), None, begin, end)

    def _add(self, kind: int, function: ctypes.c_void_p, user: Any, begin: int = 1, end: int = 0) -> ctypes.c_size_t:
        handle = ctypes.c_size_t()
        _check(uclib.uc_hook_add(self._handle, ctypes.byref(handle), kind, function, user, begin, end))
        return handle


def _pointer(callback: Any) -> ctypes.c_void_p:
    return ctypes.cast(callback, ctypes.c_void_p)


def _check(status: int) -> None:
    if status != UC_ERR_OK:
        raise EngineFault(uclib.uc_strerror(status).decode())
