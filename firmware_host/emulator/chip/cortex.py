"""Parts of the Cortex-M4F that Unicorn lacks: exception entry and return, with and without the floating-point frame.

ARMv7-M Architecture Reference Manual, B1.5.6 to B1.5.8. The floating-point registers are stacked at once, although the
chip may do so lazily: the frame is the same, only the time differs.
"""

import struct
from enum import Enum, auto

from unicorn import arm_const as arm

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.nvic import FIRST_IRQ, NMI, Nvic
from firmware_host.emulator.engine import Engine

_CALLER_SAVED = [arm.UC_ARM_REG_R0, arm.UC_ARM_REG_R1, arm.UC_ARM_REG_R2, arm.UC_ARM_REG_R3]
_CALLER_SAVED += [arm.UC_ARM_REG_R12, arm.UC_ARM_REG_LR]
_STATE = [arm.UC_ARM_REG_CONTROL, arm.UC_ARM_REG_XPSR, arm.UC_ARM_REG_SP]  # in the order they have to be written
_MASKS = [arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_FAULTMASK, arm.UC_ARM_REG_BASEPRI]
_FLOATS = [*range(arm.UC_ARM_REG_S0, arm.UC_ARM_REG_S0 + 16), arm.UC_ARM_REG_FPSCR]

_BASIC_FRAME = struct.Struct("<8I")
_FLOAT_FRAME = struct.Struct("<17I4x")
_THUMB = 1 << 24
_FLOAT_ACTIVE = 1 << 2  # CONTROL.FPCA
_PROCESS_STACK = 1 << 1  # CONTROL.SPSEL
_UNPRIVILEGED = 1 << 0  # CONTROL.nPRIV
_REALIGNED = 1 << 9  # stacked xPSR: the frame was moved by 4 to align it
_RETURNS = {0xFFFF_FFF1, 0xFFFF_FFF9, 0xFFFF_FFE1, 0xFFFF_FFE9}  # handler or thread, main stack, basic or float
_TO_HANDLER = 0xFFFF_FFF1
_TO_THREAD = 0xFFFF_FFF9
_WITH_FLOAT = 1 << 4  # in EXC_RETURN, cleared when the frame holds floating-point registers


class Entry(Enum):
    """The fate of the exception that would preempt the running code."""

    NONE = auto()  # no exception
    MASKED = auto()  # blocked by PRIMASK, FAULTMASK or BASEPRI
    ENTERED = auto()


class Cortex:
    """The core's exception model on top of the engine. `pc` is the address at which the next run starts."""

    def __init__(self, engine: Engine, nvic: Nvic) -> None:
        self._engine = engine
        self._nvic = nvic
        self._return_state = engine.registers([arm.UC_ARM_REG_PC, arm.UC_ARM_REG_SP])
        self._floats = engine.registers(_FLOATS)
        self._masks = engine.registers(_MASKS)
        self._everything = engine.registers([*_CALLER_SAVED, *_STATE, *_MASKS])
        self._restored = engine.registers([*_STATE, *_CALLER_SAVED, arm.UC_ARM_REG_PC])
        self._link = engine.registers([*_STATE, arm.UC_ARM_REG_LR])
        self._program_counter = engine.registers([arm.UC_ARM_REG_PC])
        self.pc = 0

    def reset(self, vectors: int) -> None:
        """Start as after a chip reset: stack pointer and first instruction from the table at `vectors`."""
        stack, entry = struct.unpack("<2I", self._engine.read(vectors, 8))
        self._masks.write([0, 0, 0])
        self._link.write([0, _THUMB, stack, 0xFFFF_FFFF])
        self._jump(entry, "the reset vector")

    def note_pause(self) -> None:
        """Record the program counter after the engine has stopped between two instructions."""
        self.pc = self._program_counter.read()[0]

    def enter_pending(self, vectors: int) -> Entry:
        """Enter the handler of the preempting exception, if any. `vectors`: address of the vector table."""
        number = self._nvic.candidate()
        if number is None:
            return Entry.NONE
        *scratch, control, xpsr, stack, primask, faultmask, basepri = self._everything.read()
        if self._is_masked(number, primask, faultmask, basepri):
            return Entry.MASKED
        if control & (_PROCESS_STACK | _UNPRIVILEGED):
            raise Violation(
                "unmodelled_mode", "the firmware uses the process stack or unprivileged mode", "Model it in cortex.py"
            )
        frame = _BASIC_FRAME.size
        return_code = _TO_HANDLER if self._nvic.running else _TO_THREAD
        if control & _FLOAT_ACTIVE:
            frame += _FLOAT_FRAME.size
            return_code &= ~_WITH_FLOAT
        base = (stack - frame) & ~7
        if base != stack - frame:
            xpsr |= _REALIGNED
        data = _BASIC_FRAME.pack(*scratch, self.pc, xpsr)
        if control & _FLOAT_ACTIVE:
            data += _FLOAT_FRAME.pack(*self._floats.read())
        self._engine.write(base, data)
        self._link.write([0, _THUMB | number, base, return_code])
        self._nvic.enter(number)
        (entry,) = struct.unpack("<I", self._engine.read(vectors + 4 * number, 4))
        self._jump(entry, f"the vector of exception {number} (interrupt {number - FIRST_IRQ})")
        return Entry.ENTERED

    def masks_pending(self) -> bool:
        """Return whether a pending exception is still masked."""
        number = self._nvic.candidate()
        return number is not None and self._is_masked(number, *self._masks.read())

    def _is_masked(self, number: int, primask: int, faultmask: int, basepri: int) -> bool:
        is_blocked = primask or faultmask or (basepri and self._nvic.priority(number) >= basepri)
        return bool(is_blocked) and number != NMI

    def return_from_exception(self) -> None:
        """Undo `enter_pending` inside a hook, after the core branched to a return code (EXC_RETURN).

        The run continues at the return address, without the cost of a stop and a start.
        """
        address, base = self._return_state.read()
        return_code = address | 1
        if return_code not in _RETURNS:
            raise Violation("bad_return", f"exception return to 0x{return_code:08X}", "Correct the firmware")
        self._nvic.leave()
        *scratch, pc, xpsr = _BASIC_FRAME.unpack(self._engine.read(base, _BASIC_FRAME.size))
        stack = base + _BASIC_FRAME.size
        control = 0
        if not return_code & _WITH_FLOAT:
            control = _FLOAT_ACTIVE
            self._floats.write(_FLOAT_FRAME.unpack(self._engine.read(stack, _FLOAT_FRAME.size)))
            stack += _FLOAT_FRAME.size
        if xpsr & _REALIGNED:
            stack += 4
        if xpsr & 0x1FF != self._nvic.running:
            raise Violation(
                "bad_return",
                f"the stack frame returns to exception {xpsr & 0x1FF}, not to the one that was left",
                "Look for a stack overflow in the firmware",
            )
        self._restored.write([control, xpsr & ~_REALIGNED, stack, *scratch, pc | 1])
        self.pc = pc

    def _jump(self, entry: int, source: str) -> None:
        if not entry & 1:
            raise Violation("bad_vector", f"{source} is 0x{entry:08X}, not Thumb code", "Correct the vector table")
        self.pc = entry & ~1
