"""USART2 (RM0394, chapter 38): eight data bits, no parity, one stop bit, with each byte's duration on the wire."""

from collections import deque
from collections.abc import Callable, Sequence

from firmware_host.emulator.chip.bus import Register, StoredRegister, Violation
from firmware_host.emulator.chip.clocks import Clocks
from firmware_host.emulator.chip.dma import Dma1
from firmware_host.emulator.chip.nvic import Nvic
from firmware_host.emulator.timeline import TICK_HZ, Timeline

TDR_ADDRESS = 0x4000_4428
_IRQ = 38
_UE, _RE, _TE, _RXNEIE = 1 << 0, 1 << 2, 1 << 3, 1 << 5
_DMAT, _OVRDIS = 1 << 7, 1 << 12
_ORE, _RXNE, _TC, _TXE = 1 << 3, 1 << 5, 1 << 6, 1 << 7
_TEACK, _REACK = 1 << 21, 1 << 22
_BITS_PER_BYTE = 10  # start, eight data, stop


class Usart2:
    """The serial port. `pins_connected()` returns whether the firmware has put TX and RX on their pins."""

    name = "USART2"
    base = 0x4000_4400

    def __init__(
        self, *, timeline: Timeline, clocks: Clocks, nvic: Nvic, dma: Dma1, pins_connected: Callable[[], bool]
    ) -> None:
        self._timeline = timeline
        self._clocks = clocks
        self._nvic = nvic
        self._dma = dma
        self._pins_connected = pins_connected
        dma.on_switched = self._dma_switched
        self._arrival_slot = timeline.register(self._byte_arrives)
        self._dma_slot = timeline.register(self._load)
        self._control = StoredRegister("USART2 CR1", _UE | _RE | _TE | _RXNEIE, after=self._control_changed)
        self._control2 = StoredRegister("USART2 CR2", 0)
        self._control3 = StoredRegister("USART2 CR3", _DMAT | _OVRDIS, after=self._control_changed)
        self._divider = StoredRegister("USART2 BRR", 0xFFFF)
        self.reset()

    def reset(self) -> None:
        for register in (self._control, self._control2, self._control3, self._divider):
            register.reset()
        self._sent: list[tuple[int, int, bytes]] = []  # tick of the first stop bit, ticks per byte, bytes
        self._line_free = 0  # tick at which the last byte's stop bit ends
        self._holding_until = 0  # tick at which the data register hands its byte to the shifter
        self._dma_start: int | None = None  # tick of the first start bit of the running transfer
        self._incoming: deque[int] = deque()
        self._received = 0
        self._flags = 0  # ORE, RXNE
        for slot in (self._arrival_slot, self._dma_slot):
            self._timeline.cancel(slot)
        self._nvic.set_line(_IRQ, False)

    def registers(self) -> Sequence[Register]:
        return (
            self._control.map_to(0x00),
            self._control2.map_to(0x04),
            self._control3.map_to(0x08),
            self._divider.map_to(0x0C),
            Register(0x1C, "ISR", self._read_status, None),
            Register(0x20, "ICR", None, self._clear_flags),
            Register(0x24, "RDR", self._read_data, None),
            Register(0x28, "TDR", None, self._write_data),
        )

    @property
    def baud_rate(self) -> float | None:
        """The baud rate as set, None while the port is off."""
        if not self._control.value & _UE or not self._divider.value:
            return None
        return self._clocks.pclk1_hz / self._divider.value

    @property
    def _byte_ticks(self) -> int:
        if not self._divider.value:
            raise Violation("no_baud_rate", "USART2 is used with BRR = 0", "Set BRR first")
        return round(_BITS_PER_BYTE * self._divider.value * TICK_HZ / self._clocks.pclk1_hz)

    # --- the host's side

    def receive(self, data: bytes) -> None:
        """Let bytes arrive from now on, after those still in transit. A port that is off ignores them."""
        if not data or not self._listening:
            return
        if not self._incoming:
            self._timeline.schedule(self._arrival_slot, self._timeline.now + self._byte_ticks)
        self._incoming.extend(data)

    def take_sent(self) -> bytes:
        """Return the bytes whose stop bit has passed since the last call."""
        if self._dma_start is not None:
            self._load()
        out = b""
        while self._sent and self._sent[0][0] <= self._timeline.now:
            first, step, data = self._sent.pop(0)
            passed = (self._timeline.now - first) // step + 1
            out += data[:passed]
            if passed < len(data):
                self._sent.insert(0, (first + passed * step, step, data[passed:]))
                break
        return out

    # --- transmitting

    def _write_data(self, value: int) -> None:
        if self._timeline.now < self._holding_until:
            raise Violation("tx_overrun", "USART2 TDR written before TXE", "Wait for TXE")
        self._put_on_wire(bytes([value & 0xFF]), max(self._timeline.now, self._line_free))

    def _put_on_wire(self, data: bytes, start: int) -> None:
        if self._control.value & (_UE | _TE) != _UE | _TE:
            raise Violation("transmitter_off", "USART2 transmits with UE or TE clear", "Set UE and TE first")
        step = self._byte_ticks
        if self._pins_connected():
            self._sent.append((start + step, step, data))
        self._line_free = start + len(data) * step
        self._holding_until = self._line_free - step

    def _control_changed(self) -> None:
        self._start_dma()
        self._request_interrupt()

    def _dma_switched(self, on: bool) -> None:
        if on:
            self._start_dma()
        elif self._dma_start is not None:
            self._load()
            self._dma_start = None
            self._timeline.cancel(self._dma_slot)

    def _start_dma(self) -> None:
        running = self._dma_start is not None
        if running or not self._dma.enabled or not self._dma.remaining or not self._control3.value & _DMAT:
            return
        # The last byte leaves memory when the one before it starts on the wire
        start = max(self._timeline.now, self._line_free)
        before_last = max(0, self._dma.remaining - 2)
        self._dma_start = start
        self._timeline.schedule(self._dma_slot, start + before_last * self._byte_ticks)
        self._load()

    def _load(self) -> None:
        """Move bytes from memory to the wire: those whose sending has begun by now, and one for the data register."""
        if self._dma_start is None:
            return
        now, step = self._timeline.now, self._byte_ticks
        started_bytes = (now - self._dma_start) // step + 1 if now >= self._dma_start else 0
        loaded = max(0, (self._line_free - self._dma_start) // step)
        count = min(started_bytes + 1 - loaded, self._dma.remaining)
        if count > 0:
            self._put_on_wire(self._dma.fetch(count), self._dma_start + loaded * step)
        if not self._dma.remaining:
            self._dma_start = None
            self._timeline.cancel(self._dma_slot)

    # --- receiving

    @property
    def _listening(self) -> bool:
        return self._control.value & (_UE | _RE) == _UE | _RE and self._pins_connected()

    def _byte_arrives(self) -> None:
        byte = self._incoming.popleft()
        if self._incoming:
            self._timeline.schedule(self._arrival_slot, self._timeline.now + self._byte_ticks)
        if not self._listening:
            return
        if self._flags & _RXNE and not self._control3.value & _OVRDIS:
            self._flags |= _ORE  # the byte is lost
        else:
            self._received = byte
            self._flags |= _RXNE
        self._request_interrupt()

    def _read_data(self) -> int:
        self._flags &= ~_RXNE
        self._request_interrupt()
        return self._received

    # --- flags and interrupts

    def _read_status(self) -> int:
        now, control = self._timeline.now, self._control.value
        status = self._flags
        if now >= self._holding_until and self._dma_start is None:
            status |= _TXE
        if now >= self._line_free and self._dma_start is None:
            status |= _TC
        status |= _TEACK if control & _TE else 0
        return status | (_REACK if control & _RE else 0)

    def _clear_flags(self, value: int) -> None:
        if value & ~_ORE:
            raise Violation(
                "unmodelled_bits", f"USART2 ICR = 0x{value:X}: only ORECF is modelled", "Model it in usart.py"
            )
        self._flags &= ~value
        self._request_interrupt()

    def _request_interrupt(self) -> None:
        wanted = self._control.value & _RXNEIE and self._flags & (_RXNE | _ORE)
        self._nvic.set_line(_IRQ, bool(wanted))
