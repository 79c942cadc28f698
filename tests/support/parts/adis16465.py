"""The ADIS16465, by Analog Devices' data sheet."""

from collections.abc import Callable, Sequence

from firmware_host.emulator.parts.accelerometer import AccelerometerTruth
from firmware_host.emulator.parts.adis16465 import Adis16465
from firmware_host.emulator.parts.gyroscope import GyroTruth
from support.board.data_sheet import DataSheet
from support.board.spi_master import NO_ERRORS, Master, Rate, integers, still


class Adis16465Driver(Master):
    """A driver by the Analog Devices data sheet ADIS16465."""

    def __init__(
        self,
        rate_at: Rate = still,
        truth: GyroTruth = NO_ERRORS,
        *,
        acceleration: AccelerometerTruth | None = None,
        range_deg_s: float = 500.0,
        temperature_c: float = 25.0,
        seed: int = 1,
        ppm: float = 0.0,
    ) -> None:
        part = Adis16465(
            rate_at,
            truth,
            acceleration=acceleration,
            temperature_c=temperature_c,
            seed=seed,
            oscillator_ppm=ppm,
            range_deg_s=int(range_deg_s),
        )
        super().__init__(part)

    def get(self, address: int) -> int:
        self.exchange(bytes([address, 0]))
        return int.from_bytes(self.exchange(bytes(2)), "big")

    def set(self, address: int, value: int) -> None:
        self.exchange(bytes([0x80 | address, value & 0xFF]))
        self.exchange(bytes([0x80 | address + 1, value >> 8]))

    def burst(self) -> bytes:
        """Return the 20 bytes after the burst command."""
        return self.exchange(bytes([0x68]) + bytes(21))[2:]

    def identity(self) -> int:
        return self.get(0x72)

    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None:
        assert range_g == 8.0, "the part has one range"
        self.set(0x64, round(2000 / rate_hz) - 1)
        self.await_data()  # of the old rate
        self.read()

    def read(self) -> tuple[list[int], int]:
        _status, *rates_and_rest = integers(self.burst()[:16], ">")
        return rates_and_rest[:3], rates_and_rest[6]

    def accelerations(self) -> list[int]:
        return integers(self.burst()[8:14], ">")


SHEET = DataSheet(
    name="ADIS16465",
    new=Adis16465Driver,
    identity=0x4051,
    other_identity=0x4056,
    rates_hz=(1.0, 100.0, 200.0, 500.0, 2000.0),
    per_count_deg_s={125.0: 1 / 160, 500.0: 1 / 40, 2000.0: 1 / 10},
    per_count_g={8.0: 1 / 4000},
    temperature_counts=lambda temperature_c: 10 * temperature_c,
    forbidden=(
        ("unmodelled_register", b"\x24\x00"),  # delta angle
        ("unmodelled_register", b"\xf6\x01"),  # user scratch
        ("unmodelled_bits", b"\xe0\x04"),  # external sync
        ("unmodelled_bits", b"\xe8\x04"),  # self-test
    ),
)


class Adis16465Registers:
    """Registers of 16 bits, high byte first; an answer comes one frame later, a setting acts later than its writing."""

    def __init__(self) -> None:
        self.words = {
            0x00: 0,
            0x02: 0,
            **dict.fromkeys(range(0x04, 0x1C, 2), 0),
            **dict.fromkeys(range(0x40, 0x58, 2), 0),
        }
        self.words |= {0x5C: 0, 0x5E: 0x0007, 0x60: 0x00C1, 0x64: 0, 0x68: 0, 0x72: 0x4051}
        self.writes: list[tuple[int, int]] = []
        self.stuck: set[int] = set()  # registers that ignore writes
        self.transfers: list[int] = []
        self.status = 0
        self.counter = 0
        self.taking_us = 150
        self.cured_by_reset = False  # whether the next reset clears DIAG_STAT
        self.before_burst: Callable[[], None] | None = None  # called once, just before the registers are read
        self.after_burst: Callable[[], None] | None = None  # or just after
        self.damage = 0  # added to the next bursts' last data byte
        self._data = [0] * 7
        self._answer = 0
        self._pending: dict[int, tuple[int, int]] = {}  # register → when its new value can be read, the value
        self._idle_since_us = -100

    line_is_high = False  # its line is down only while the registers change

    def answer_as(self, who_am_i: int) -> None:
        """Answer with another identity."""
        self.words[0x72] = who_am_i

    def transfer(self, data: bytes, max_hz: int, time_us: int) -> bytes:
        """Make one access, from chip select to chip select; return the received bytes."""
        assert max_hz <= (2e6 if len(data) == 2 else 1e6), "a burst is slow"
        assert (time_us - self._idle_since_us) % 2**32 >= 16, "the part needs 16 µs between frames"
        self._idle_since_us = time_us
        self.transfers.append(len(data))
        if data == b"\x68" + bytes(21):
            before, self.before_burst = self.before_burst, None
            if before is not None:
                before()
            burst = self._answer.to_bytes(2, "big") + self._burst()
            after, self.after_burst = self.after_burst, None
            if after is not None:
                after()
            return burst
        assert len(data) == 2
        answer, address = self._answer, data[0] & 0x7E
        if data[0] & 0x80:
            self._write(data[0] & 0x7F, data[1], time_us)
        else:
            due_us, value = self._pending.get(address, (0, 0))
            if address in self._pending and time_us >= due_us:
                self.words[address] = value
            self._answer = self.words[address]
        return answer.to_bytes(2, "big")

    def _write(self, address: int, byte: int, time_us: int) -> None:
        self.writes.append((address, byte))
        word = address & 0x7E
        if (word, byte) == (0x68, 0x80) and self.cured_by_reset:
            self.words[0x02] = 0
        if word not in self.stuck:
            _, value = self._pending.get(word, (0, self.words[word]))
            value = value & 0x00FF | byte << 8 if address & 1 else value & 0xFF00 | byte
            self._pending[word] = (time_us + self.taking_us, value)

    def _burst(self) -> bytes:
        words = [self.status, *self._data, self.counter]
        body = bytearray(b"".join((word & 0xFFFF).to_bytes(2, "big") for word in words))
        total = sum(body)
        body[-1] = (body[-1] + self.damage) & 0xFF
        return bytes(body) + total.to_bytes(2, "big")

    def convert(
        self,
        counts: Sequence[int],
        temperature: int,
        acceleration: Sequence[int] = (0x0111, -0x0222, 0x0333),
        low_words: Sequence[int] = (0, 0, 0, 0, 0, 0),
    ) -> None:
        """Put a new conversion into the output registers: upper words, and the lower words of all six."""
        self._data = [*counts, *acceleration, temperature]
        self.counter = (self.counter + 1) & 0xFFFF
        for output, (low, upper) in enumerate(zip(low_words, self._data[:6], strict=True)):
            self.words[0x04 + 4 * output] = low
            self.words[0x06 + 4 * output] = upper & 0xFFFF
        self.words[0x22] = self.counter
