"""The board's serial line: bytes between the USART and the host, spoilt when the baud rates differ."""

from rig.world.laboratory import Laboratory

TOLERANCE = 0.03  # of the baud rate; a receiver still reads ten bits right


def misread(data: bytes, sent_baud: float, read_baud: float) -> bytes:
    """What a receiver at `read_baud` makes of `data` sent back to back at `sent_baud` (8 data bits, 1 stop bit)."""
    if abs(sent_baud / read_baud - 1.0) < TOLERANCE:
        return data
    line = [bit for byte in data for bit in (0, *(byte >> i & 1 for i in range(8)), 1)]
    bit_length = sent_baud / read_baud  # of the receiver's bits, in the sender's

    def level(time: float) -> int:
        return line[int(time)] if time < len(line) else 1  # an idle line is high

    seen = bytearray()
    time = 0.0
    while time < len(line):
        if level(time):
            time = float(int(time) + 1)  # the next place where the line may fall
            continue
        if level(time + 0.5 * bit_length) == 0:  # else a glitch shorter than half a bit
            seen.append(sum(level(time + (1.5 + i) * bit_length) << i for i in range(8)))
            time += 9.5 * bit_length
        else:
            time = float(int(time) + 1)
    return bytes(seen)


class SerialLine:
    """Between the laboratory's board and the host's end.

    `host_baud` is the host's baud rate where the transport does not tell (None: the same as the board's); a `silent`
    line loses everything both ways.
    """

    def __init__(self, laboratory: Laboratory) -> None:
        self._laboratory = laboratory
        self.host_baud: float | None = None
        self.silent = False
        self.fresh = b""  # what the board has sent in the last tick, as the line carries it

    @property
    def baud(self) -> float | None:
        """The board's baud rate; None while its USART is off or it has no power."""
        return self._laboratory.board.baud_rate if self._laboratory.board is not None else None

    def tick(self) -> None:
        board = self._laboratory.board
        self.fresh = board.transmitted() if board is not None else b""

    def to_host(self, host_baud: float | None) -> bytes:
        """What a host at `host_baud` reads in this tick."""
        if self.silent or not self.fresh:
            return b""
        wanted, baud = host_baud or self.host_baud, self.baud
        return misread(self.fresh, baud, wanted) if wanted and baud else self.fresh

    def to_board(self, data: bytes, host_baud: float | None) -> None:
        """A host at `host_baud` sends."""
        board, baud = self._laboratory.board, self.baud
        if self.silent or board is None or not baud:
            return
        wanted = host_baud or self.host_baud
        board.receive(misread(data, wanted, baud) if wanted else data)


class SerialSession:
    """The line over TCP, which carries no baud rate."""

    closing = False
    dialogue = False

    def __init__(self, line: SerialLine) -> None:
        self._line = line

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        self._line.to_board(data, None)
        return b""

    def tick(self) -> bytes:
        return self._line.to_host(None)

    def closed(self) -> None:
        pass
