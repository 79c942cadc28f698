"""The functions of `hooks.ll` as machine code, and the structures that they share with Python.

A hook in Python costs a microsecond, one of these a few nanoseconds; a second of the board's time has a quarter of a
million blocks of instructions. LLVM translates them in a few milliseconds, without a compiler.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from importlib import resources

import llvmlite.binding as llvm

Int = ctypes.c_int64
FIFO_PAIRS = 2
PREDICTED_PAIRS = 16


class Time(ctypes.Structure):
    """The present tick, `now`, and the tick `deadline`, before which time passes without a call of Python."""

    _fields_ = (("now", Int), ("deadline", Int))
    now: int
    deadline: int


class Meter(ctypes.Structure):
    """The cost of blocks: `ticks` of the block at each halfword from `first_address` on, 0 if unknown."""

    _fields_ = (
        ("ask", ctypes.c_void_p),
        ("time", ctypes.c_void_p),
        ("first_address", Int),
        ("halfwords", Int),
        ("ticks", ctypes.c_void_p),
    )


class BlockTicks:
    """Ticks by address, of the blocks of instructions in `size_bytes` from `first_address` on; 0 if unknown."""

    def __init__(self, first_address: int, size_bytes: int) -> None:
        self._first_address = first_address
        self._halfwords = size_bytes // 2
        self._ticks = (ctypes.c_uint32 * self._halfwords)()

    @property
    def fields(self) -> tuple[int, int, int]:
        """The values of the last three fields of a `Meter`."""
        return self._first_address, self._halfwords, ctypes.addressof(self._ticks)

    def __getitem__(self, address: int) -> int:
        index = address - self._first_address >> 1
        return self._ticks[index] if 0 <= index < self._halfwords else 0

    def __setitem__(self, address: int, ticks: int) -> None:
        index = address - self._first_address >> 1
        if 0 <= index < self._halfwords:
            self._ticks[index] = ticks

    def clear(self) -> None:
        ctypes.memset(self._ticks, 0, ctypes.sizeof(self._ticks))


class Watch(ctypes.Structure):
    """The watch of an instruction: `ask` is called when `register` is no multiple of four, and after `enough` runs."""

    _fields_ = (
        ("read", ctypes.c_void_p),
        ("ask", ctypes.c_void_p),
        ("register", Int),
        ("times", Int),
        ("enough", Int),
    )


class Counter(ctypes.Structure):
    """A free-running counter.

    - `clocked`: whether it can be read.
    - `since`, `counted`: the tick of its last setting, and its value then.
    - `counts`, `ticks`: it advances by `counts` in every `ticks` ticks; `counts` is 0 while it is stopped.
    - `modulus`: the value at which it wraps.
    - `read_at`, `polls`: the tick of the last read, and the number of consecutive reads.
    """

    _fields_ = tuple(
        (name, Int) for name in ("clocked", "since", "counted", "counts", "ticks", "modulus", "read_at", "polls")
    )
    clocked: int
    since: int
    counted: int
    counts: int
    ticks: int
    modulus: int
    read_at: int
    polls: int


class Bus(ctypes.Structure):
    """A bus master.

    - `clocked`, `speaks`: whether its registers are accessible, and whether it is set up to exchange.
    - `free`: the tick at which everything has been sent.
    - `pair_ticks`, `half_bit_ticks`: the duration of two bytes, and of half a bit.
    - `polled`: whether the status was read in vain.
    - `waiting`: the number of pairs of bytes that are being sent or not read yet.
    - `ready`, `answers`: the tick at which each of these pairs is complete, and the device's answer.
    - `control`, `setups`: the control register, and the number of its changes.
    - `predictions`: the answers to the next pairs, valid in the setup `predicted_in`.
    - `predicted_from`, `predicted_to`: the range of unused indices of `predictions`.
    """

    _fields_ = (
        *((name, Int) for name in ("clocked", "speaks", "free", "pair_ticks", "half_bit_ticks", "polled", "waiting")),
        ("ready", Int * FIFO_PAIRS),
        ("answers", Int * FIFO_PAIRS),
        *((name, Int) for name in ("control", "setups", "predicted_in", "predicted_from", "predicted_to")),
        ("predictions", ctypes.c_uint16 * PREDICTED_PAIRS),
    )
    clocked: int
    speaks: int
    free: int
    pair_ticks: int
    half_bit_ticks: int
    polled: int
    waiting: int
    control: int
    setups: int
    predicted_in: int
    predicted_from: int
    predicted_to: int

    def set_predictions(self, answers: bytes) -> None:
        """Set the answers to the next pairs of bytes to any bytes."""
        ctypes.memmove(ctypes.addressof(self) + Bus.predictions.offset, answers, len(answers))
        self.predicted_from, self.predicted_to = 0, len(answers) // 2

    def next_prediction(self) -> int:
        """Return the next predicted answer."""
        self.predicted_from += 1
        return int(self.predictions[self.predicted_from - 1])


class Shortcuts(ctypes.Structure):
    """The links from machine code to Python's `read`, `write`, `exchange`, and to `Time`, `Counter` and `Bus`."""

    _fields_ = tuple((name, ctypes.c_void_p) for name in ("read", "write", "exchange", "time", "counter", "bus"))


def reader(function: str, *shared: ctypes.Structure) -> Callable[[], int]:
    """Return, as a Python function, the machine code that reads a register; `shared` are its arguments."""
    read = ctypes.CFUNCTYPE(ctypes.c_uint64, *[ctypes.c_void_p] * len(shared))(address_of(function))
    return lambda: int(read(*map(ctypes.addressof, shared)))


@cache
def address_of(function: str) -> int:
    """Return the address of a function's machine code, which is permanent."""
    return int(_translate().get_function_address(function))


@cache
def _translate() -> llvm.ExecutionEngine:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    module = llvm.parse_assembly((resources.files("firmware_host.emulator") / "hooks.ll").read_text("utf-8"))
    module.verify()
    engine = llvm.create_mcjit_compiler(module, llvm.Target.from_default_triple().create_target_machine())
    engine.finalize_object()
    return engine
