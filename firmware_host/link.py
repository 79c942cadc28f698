"""The serial link to the board: sends requests until they are answered, hands on every frame that arrives."""

import threading
import time
from collections.abc import Callable, Iterable
from itertools import groupby
from typing import Any

from firmware_host import protocol
from firmware_host.errors import BoardError
from firmware_host.frames import Frame, FrameReader, encode
from firmware_host.serial_port import READ_TIMEOUT_S, SerialPort, why_closed

_ATTEMPTS = 4  # times a request is sent before the board counts as gone; each waits twice as long as the one before


class _Request:
    """A question under way; the reader thread puts the answer in."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.answered = threading.Event()
        self.answer: Frame | None = None


class BoardLink:
    """An open serial port or `socket://host:port`, read by a thread of its own.

    `on_frame(frame, request)` gets every frame but those of the stream on that thread, with the name of the request it
    answers or None; it has returned before `ask` does. `on_stream(frames, host_time_s)` gets those of the stream, as
    many at once as came together. What they raise becomes `fault`, as a lost port does.
    """

    def __init__(
        self,
        port: str,
        baud: int,
        on_frame: Callable[[Frame, str | None], None],
        on_stream: Callable[[Iterable[Frame], float], None],
    ) -> None:
        """Opens the port. Raises BoardError `no_port`."""
        self.port = port
        self.baud = baud
        self.fault: Exception | None = None  # the first thing that went wrong; nothing works from then on
        self.frames_seen = 0
        self._reads_without_frame = 0
        self._on_frame = on_frame
        self._on_stream = on_stream
        self._frames = FrameReader()
        self._requests: dict[int, _Request] = {}
        self._sequence = 0
        self._sending = threading.Lock()
        self._closing = threading.Event()
        try:
            self._serial = SerialPort(port, baud)
        except OSError as error:
            raise BoardError(
                "no_port",
                f"the port {port} does not open: {why_closed(port, error)}",
                "Check board.port and the cable, and that no other program has the port",
            ) from error
        self._reader = threading.Thread(target=self._read, name=f"board {port}", daemon=True)
        self._reader.start()

    @property
    def bytes_seen(self) -> int:
        """Bytes that ever came, readable or not."""
        return self._frames.bytes_seen

    @property
    def silent_s(self) -> float:
        """How long no frame has come, in time spent reading: when the reader was held up, nobody was silent."""
        return self._reads_without_frame * READ_TIMEOUT_S

    @property
    def frames_lost(self) -> int:
        """Frames the board sent and that did not come, by their sequence."""
        return self._frames.lost

    @property
    def frames_repeated(self) -> int:
        """Frames that came twice; they are handed on once."""
        return self._frames.repeated

    def expect_restart(self) -> None:
        """The board is about to count its frames anew."""
        self._frames.expect_restart()

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closing.is_set()

    def ask(self, name: str, values: dict[str, Any] | None, timeout_s: float) -> Frame:
        """Sends a request until its answer comes, so every request must be one that may arrive twice.

        Raises BoardError `board_link_lost` after `timeout_s`, and `fault` if there is one.
        """
        with self._sending:
            self._sequence = sequence = self._sequence % 255 + 1
        request = self._requests[sequence] = _Request(name)
        try:
            for attempt in range(_ATTEMPTS):
                if self.fault is None:
                    self._send(name, sequence, values or {})
                    request.answered.wait(timeout_s * 2**attempt / (2**_ATTEMPTS - 1))
                if request.answer is not None:
                    return request.answer
                if self.fault is not None:
                    raise self.fault
        finally:
            del self._requests[sequence]
        raise BoardError(
            "board_link_lost",
            f"the board on {self.port} did not answer {name} within {timeout_s:g} s",
            "Check the board's supply and cable",
        )

    def tell(self, name: str, values: dict[str, Any] | None = None) -> None:
        """Sends a request without waiting for its answer. Raises BoardError `board_link_lost`."""
        self._send(name, 0, values or {})

    def fail(self, error: Exception) -> None:
        """Makes `error` the fault, unless there is one already."""
        self.fault = self.fault or error

    def close(self) -> None:
        """Ends the reader thread and closes the port."""
        self._closing.set()
        self._reader.join()
        self._serial.close()

    def _send(self, name: str, sequence: int, values: dict[str, Any]) -> None:
        """The leading zero ends whatever half a frame the board may have heard before."""
        try:
            with self._sending:
                self._serial.write(b"\0" + encode(name, sequence, values))
        except OSError as error:
            raise self._port_closed(error) from error

    def _port_closed(self, error: Exception) -> BoardError:
        return BoardError(
            "board_link_lost",
            f"the port {self.port} closed: {error}",
            "Check the cable, the board's supply, and whether another program has the port",
        )

    def _receive(self) -> bytes:
        try:
            return self._serial.read()
        except OSError as error:
            raise self._port_closed(error) from error

    def _read(self) -> None:
        """The reader thread: bytes to frames until closing or the first fault."""
        try:
            while not self._closing.is_set():
                data = self._receive()
                host_time_s = time.monotonic()
                self._reads_without_frame += 1
                frames = self._frames.feed(data)
                if frames:
                    self._reads_without_frame = 0
                    self.frames_seen += len(frames)
                for streamed, together in groupby(frames, lambda frame: frame.name in protocol.SAMPLES):
                    if streamed:
                        self._on_stream(together, host_time_s)
                    else:
                        for frame in together:
                            self._take(frame)
        except Exception as error:  # a lost link or a failing consumer must reach the caller, not end in a dead thread
            self.fault = error
        for request in list(self._requests.values()):
            request.answered.set()

    def _take(self, frame: Frame) -> None:
        request = self._requests.get(frame.values.get("reply_to", 0))
        if request is not None and frame.name not in (protocol.ANSWERS.get(request.name, "ack"), "error"):
            request = None  # to a program that was here before, and whose numbers were the same
        self._on_frame(frame, request.name if request is not None else None)
        if request is not None:
            request.answer = frame
            request.answered.set()
