"""USART2 (RM0394, chapter 38): eight data bits, no parity, one stop bit, every byte taking its time on the wire."""

from collections import deque
from collections.abc import Callable, Sequence

from firmware_host.emulator.bus import Register, Stored, Violation
from firmware_host.emulator.clocks import Clocks
from firmware_host.emulator.dma import Channel
from firmware_host.emulator.nvic import Nvic
from firmware_host.emulator.timeline import TICK_HZ, Timeline

TDR_ADDRESS, RDR_ADDRESS = 0x4000_4428, 0x4000_4424
_IRQ = 38
_UE, _RE, _TE = 1 << 0, 1 << 2, 1 << 3
_IDLEIE, _RXNEIE, _TCIE, _TXEIE = 1 << 4, 1 << 5, 1 << 6, 1 << 7
_EIE, _DMAR, _DMAT, _OVRDIS = 1 << 0, 1 << 6, 1 << 7, 1 << 12
_ORE, _IDLE, _RXNE, _TC, _TXE = 1 << 3, 1 << 4, 1 << 5, 1 << 6, 1 << 7
_BUSY, _TEACK, _REACK = 1 << 16, 1 << 21, 1 << 22
_BITS_PER_BYTE = 10  # start, eight data, stop


class Usart2:
    """The serial port. `pins_connected()` tells whether the firmware has put TX and RX on their pins."""

    name = "USART2"
    base = 0x4000_4400

    def __init__(
        self,
        *,
        timeline: Timeline,
        clocks: Clocks,
        nvic: Nvic,
        transmit: Channel,
        receive: Channel,
        pins_connected: Callable[[], bool],
    ) -> None:
        self._timeline = timeline
        self._clocks = clocks
        self._nvic = nvic
        self._transmit_dma = transmit
        self._receive_dma = receive
        self._pins_connected = pins_connected
        transmit.on_switched = self._transmit_dma_switched
        self._arrival_slot = timeline.register(self._byte_arrives)
        self._dma_slot = timeline.register(self._last_byte_loaded)
        self._flag_slot = timeline.register(self._request_interrupt)
        self._control = Stored("USART2 CR1", 0xFD, after=self._control_changed)
        self._control2 = Stored("USART2 CR2", 0)
        self._control3 = Stored("USART2 CR3", _EIE | _DMAR | _DMAT | _OVRDIS, after=self._control_changed)
        self._divider = Stored("USART2 BRR", 0xFFFF)
        self.reset()

    def reset(self) -> None:
        for register in (self._control, self._control2, self._control3, self._divider):
            register.reset()
        self._sent: list[tuple[int, int, bytes]] = []  # tick of the first stop bit, ticks per byte, bytes
        self._line_free = 0  # tick at which the last byte's stop bit ends
        self._holding_until = 0  # tick at which the data register hands its byte to the shifter
        self._complete = True  # TC, once the line is free
        self._dma_start: int | None = None  # tick of the first start bit of the running transfer
        self._incoming: deque[int] = deque()
        self._received = 0
        self._flags = 0  # ORE, IDLE, RXNE
        for slot in (self._arrival_slot, self._dma_slot, self._flag_slot):
            self._timeline.cancel(slot)
        self._nvic.set_line(_IRQ, False)

    def registers(self) -> Sequence[Register]:
        return (
            self._control.at(0x00),
            self._control2.at(0x04),
            self._control3.at(0x08),
            self._divider.at(0x0C),
            Register(0x18, "RQR", None, self._write_request),
            Register(0x1C, "ISR", self._read_status, None),
            Register(0x20, "ICR", None, self._clear_flags),
            *(Register(0x24, "RDR", self._read_data, None, size) for size in (1, 2, 4)),
            *(Register(0x28, "TDR", None, self._write_data, size) for size in (1, 2, 4)),
        )

    @property
    def baud_rate(self) -> float | None:
        """Bits per second as set, None while the port is off."""
        if not self._control.value & _UE or not self._divider.value:
            return None
        return self._clocks.pclk1_hz / self._divider.value

    @property
    def _byte_ticks(self) -> int:
        if not self._divider.value:
            raise Violation("no_baud_rate", "USART2 is used with BRR = 0", "set BRR before TE or RE")
        return round(_BITS_PER_BYTE * self._divider.value * TICK_HZ / self._clocks.pclk1_hz)

    # --- the host's side

    def receive(self, data: bytes) -> None:
        """Bytes start arriving now, one after the other. A port that is off does not hear them."""
        if not self._listening:
            return
        if not self._incoming and data:
            self._timeline.schedule(self._arrival_slot, self._timeline.now + self._byte_ticks)
        self._incoming.extend(data)

    def transmitted(self) -> bytes:
        """The bytes whose stop bit has passed since the last call."""
        if self._dma_start is not None:
            self._load(self._timeline.now)
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
            raise Violation("tx_overrun", "USART2 TDR written before TXE", "wait for TXE")
        self._begin(bytes([value & 0xFF]), max(self._timeline.now, self._line_free))
        self._control_changed()

    def _begin(self, data: bytes, start: int) -> None:
        if not self._control.value & _UE or not self._control.value & _TE:
            raise Violation("transmitter_off", "USART2 transmits with UE or TE clear", "enable the transmitter first")
        step = self._byte_ticks
        if self._pins_connected():
            self._sent.append((start + step, step, data))
        self._line_free = start + len(data) * step
        self._holding_until = self._line_free - step
        self._complete = True

    def _transmit_dma_switched(self, on: bool) -> None:
        if not on and self._dma_start is not None:
            self._load(self._timeline.now)
            self._dma_start = None
            self._timeline.cancel(self._dma_slot)
        self._start_dma()

    def _start_dma(self) -> None:
        if self._dma_start is not None or not self._transmit_dma.enabled or not self._transmit_dma.remaining:
            return
        if not self._control3.value & _DMAT or not self._control.value & _TE:
            return
        step = self._byte_ticks
        self._dma_start = max(self._timeline.now, self._line_free)
        # The last byte leaves memory when the one before it starts on the wire
        ahead = self._transmit_dma.remaining - 2
        done = self._dma_start + ahead * step if ahead >= 0 else self._timeline.now
        self._load(self._timeline.now)
        if self._dma_start is not None:
            self._timeline.schedule(self._dma_slot, done)

    def _last_byte_loaded(self) -> None:
        self._load(self._timeline.now)

    def _load(self, now: int) -> None:
        """Move what the wire has asked for by `now` from memory to the wire."""
        if self._dma_start is None:
            return
        step = self._byte_ticks
        on_wire = max(0, (self._line_free - self._dma_start) // step)
        asked = 1 + ((now - self._dma_start) // step + 1 if now >= self._dma_start else 0)
        count = min(asked - on_wire, self._transmit_dma.remaining)
        if count > 0:
            self._begin(self._transmit_dma.fetch(count), self._dma_start + on_wire * step)
        if not self._transmit_dma.remaining:
            self._dma_start = None
            self._timeline.cancel(self._dma_slot)

    # --- receiving

    @property
    def _listening(self) -> bool:
        return self._control.value & (_UE | _RE) == _UE | _RE and self._pins_connected()

    def _byte_arrives(self) -> None:
        byte = self._incoming.popleft() if self._incoming else None
        if byte is None:  # nothing followed for a byte's time
            self._flags |= _IDLE
        elif self._listening:
            self._take(byte)
            self._timeline.schedule(self._arrival_slot, self._timeline.now + self._byte_ticks)
        self._request_interrupt()

    def _take(self, byte: int) -> None:
        if self._control3.value & _DMAR and self._receive_dma.enabled and self._receive_dma.remaining:
            self._receive_dma.deliver(byte)
        elif self._flags & _RXNE and not self._control3.value & _OVRDIS:
            self._flags |= _ORE
        else:
            self._received = byte
            self._flags |= _RXNE

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
        if now >= self._line_free and self._complete:
            status |= _TC
        if self._incoming:
            status |= _BUSY
        status |= _TEACK if control & _TE else 0
        return status | (_REACK if control & _RE else 0)

    def _clear_flags(self, value: int) -> None:
        self._flags &= ~(value & (_ORE | _IDLE))
        if value & _TC:
            self._complete = False
        self._request_interrupt()

    def _write_request(self, value: int) -> None:
        if value & 1 << 3:  # RXFRQ: drop what was received
            self._flags &= ~_RXNE
        self._request_interrupt()

    def _control_changed(self) -> None:
        self._start_dma()
        if self._control.value & _TXEIE:
            self._timeline.schedule(self._flag_slot, max(self._timeline.now, self._holding_until))
        elif self._control.value & _TCIE:
            self._timeline.schedule(self._flag_slot, max(self._timeline.now, self._line_free))
        self._request_interrupt()

    def _request_interrupt(self) -> None:
        status, control = self._read_status(), self._control.value
        wanted = (_IDLE if control & _IDLEIE else 0) | (_RXNE | _ORE if control & _RXNEIE else 0)
        wanted |= (_TC if control & _TCIE else 0) | (_TXE if control & _TXEIE else 0)
        wanted |= _ORE if self._control3.value & _EIE and self._control3.value & _DMAR else 0
        self._nvic.set_line(_IRQ, bool(status & wanted))
