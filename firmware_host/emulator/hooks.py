"""The functions of `hooks.ll` as machine code, and the structures that they share with Python.

A hook in Python costs a microsecond, one of these a few nanoseconds; a second of the board's time has a quarter of a
million blocks of instructions. LLVM translates them in a few milliseconds, and no compiler need be there.
"""

import ctypes
from collections.abc import Callable
from functools import cache
from importlib import resources

import llvmlite.binding as llvm

Int = ctypes.c_int64
FIFO_PAIRS = 2
KNOWN_PAIRS = 16


class Time(ctypes.Structure):
    """`now`, and the `deadline` at which Python is asked before time goes on; ticks."""

    _fields_ = (("now", Int), ("deadline", Int))
    now: int
    deadline: int


class Meter(ctypes.Structure):
    """What blocks cost: `ticks` of the one at each halfword from `first_address` on, 0 where it has to be asked for."""

    _fields_ = (
        ("ask", ctypes.c_void_p),
        ("time", ctypes.c_void_p),
        ("first_address", Int),
        ("halfwords", Int),
        ("ticks", ctypes.c_void_p),
    )


class BlockTicks:
    """Ticks by address, of the blocks of instructions in `size_bytes` from `first_address` on; 0 is not known."""

    def __init__(self, first_address: int, size_bytes: int) -> None:
        self._first_address = first_address
        self._halfwords = size_bytes // 2
        self._ticks = (ctypes.c_uint32 * self._halfwords)()

    @property
    def place(self) -> tuple[int, int, int]:
        """The last fields of `Meter`."""
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


class Counter(ctypes.Structure):
    """A free-running counter that can be read while it is `clocked`: `counted` at the tick `since`, from where on it
    counts `counts` in `ticks`, none while it stands; it starts anew at `modulus`. `read_at`: tick of the last read;
    `polls`: reads in a row, one just after the other.
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
    """A bus master while it is `clocked`, set up to exchange while it `speaks`: it has sent everything at the tick
    `free`, two bytes take `pair_ticks`.

    `waiting` pairs of bytes are under way or not read yet: all of one is in at `ready`, and it is `answers`. `polled`:
    the status was read in vain. `control`: how it is set up, for the `setups`th time. What comes back for the next
    pairs is `known` from the index `known_from` to before `known_to`, in the setup `known_in`.
    """

    _fields_ = (
        *((name, Int) for name in ("clocked", "speaks", "free", "pair_ticks", "half_bit_ticks", "polled", "waiting")),
        ("ready", Int * FIFO_PAIRS),
        ("answers", Int * FIFO_PAIRS),
        *((name, Int) for name in ("control", "setups", "known_in", "known_from", "known_to")),
        ("known", ctypes.c_uint16 * KNOWN_PAIRS),
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
    known_in: int
    known_from: int
    known_to: int

    def foresee(self, answers: bytes) -> None:
        """What the next pairs will bring, whatever is sent."""
        ctypes.memmove(ctypes.addressof(self) + Bus.known.offset, answers, len(answers))
        self.known_from, self.known_to = 0, len(answers) // 2

    def foreseen(self) -> int:
        """The next of those."""
        self.known_from += 1
        return int(self.known[self.known_from - 1])


class Shortcuts(ctypes.Structure):
    """What accesses to the peripherals need not ask Python for: Python's `read` and `write`, its `exchange` with what
    the bus connects, and where `Time`, `Counter` and `Bus` lie.
    """

    _fields_ = tuple((name, ctypes.c_void_p) for name in ("read", "write", "exchange", "time", "counter", "bus"))


def reader(function: str, *shared: ctypes.Structure) -> Callable[[], int]:
    """A register's read in machine code, for who asks from Python; `shared` are its arguments."""
    read = ctypes.CFUNCTYPE(ctypes.c_uint64, *[ctypes.c_void_p] * len(shared))(address_of(function))
    return lambda: int(read(*map(ctypes.addressof, shared)))


@cache
def address_of(function: str) -> int:
    """Where the machine code of a function lies; it stays there."""
    return int(_translated().get_function_address(function))


@cache
def _translated() -> llvm.ExecutionEngine:
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    module = llvm.parse_assembly((resources.files(__package__) / "hooks.ll").read_text("utf-8"))
    module.verify()
    engine = llvm.create_mcjit_compiler(module, llvm.Target.from_default_triple().create_target_machine())
    engine.finalize_object()
    return engine
