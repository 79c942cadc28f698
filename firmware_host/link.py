"""The serial link to the board: it repeats requests until they are answered, and passes on every frame."""

import threading
import time
from collections.abc import Callable, Iterable
from itertools import count, groupby
from typing import Any

from firmware_host import computer_load, protocol
from firmware_host.errors import BoardError
from firmware_host.frames import Frame, FrameReader, encode
from firmware_host.serial_port import READ_TIMEOUT_S, SerialPort, explain_closed

_MAX_ATTEMPTS = 4  # attempts of a request; each waits twice as long as the one before
_WAIT_UNITS = 2**_MAX_ATTEMPTS - 1  # their waits together, in units of the first


class _Request:
    """A pending request; the reader thread sets the answer."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.done = threading.Event()
        self.answer: Frame | None = None


class BoardLink:
    """An open serial port or `socket://host:port`, read by a thread of its own.

    The thread calls `on_frame(frame, request)` for every frame outside the stream; `request` names the request that the
    frame answers, None if it answers none. This call ends before `ask` returns. It calls `on_stream(frames,
    host_time_s)` with all frames of the stream that came together. Exceptions of both become the `fault`, as does the
    loss of the port.
    """

    def __init__(
        self,
        port: str,
        baud: int,
        on_frame: Callable[[Frame, str | None], None],
        on_stream: Callable[[Iterable[Frame], float], None],
    ) -> None:
        """Open the port. Raise BoardError `no_port`."""
        self.port = port
        self.baud = baud
        self.fault: Exception | None = None  # the first error; the link no longer works from then on
        self.frame_count = 0
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
                f"the port {port} does not open: {explain_closed(port, error)}",
                "Check board.port and the cable, and that no other program has the port",
            ) from error
        self._reader = threading.Thread(target=self._read, name=f"board {port}", daemon=True)
        self._reader.start()

    @property
    def byte_count(self) -> int:
        """The number of bytes received, readable or not."""
        return self._frames.byte_count

    @property
    def silent_s(self) -> float:
        """The time spent reading without receiving a frame. It does not grow while the reader itself is delayed."""
        return self._reads_without_frame * READ_TIMEOUT_S

    @property
    def frames_lost(self) -> int:
        """The number of frames that the board sent and that were not received, according to the sequence numbers."""
        return self._frames.lost

    @property
    def frames_repeated(self) -> int:
        """The number of frames received twice; they are passed on once."""
        return self._frames.repeated

    def expect_restart(self) -> None:
        """Accept that the board restarts the sequence of its frames."""
        self._frames.expect_restart()

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closing.is_set()

    def ask(self, name: str, values: dict[str, Any] | None, timeout_s: float) -> Frame:
        """Send a request repeatedly until its answer comes; every request must tolerate a repetition.

        Raise BoardError `board_link_lost` after `timeout_s`, and `fault`, if any. On a crowded computer, where neither
        the reader nor a simulated board may get a processor, the last attempt is repeated for longer.
        """
        with self._sending:
            self._sequence = sequence = self._sequence % 255 + 1
        request = self._requests[sequence] = _Request(name)
        waited = 0  # of _WAIT_UNITS
        try:
            for attempt in count():
                share = 2 ** min(attempt, _MAX_ATTEMPTS - 1)
                if self.fault is None:
                    self._send(name, sequence, values or {})
                    request.done.wait(timeout_s * share / _WAIT_UNITS)
                if request.answer is not None:
                    return request.answer
                if self.fault is not None:
                    raise self.fault
                waited += share
                if waited >= _WAIT_UNITS * computer_load.load_factor():
                    break
        finally:
            del self._requests[sequence]
        raise BoardError(
            "board_link_lost",
            f"the board on {self.port} did not answer {name} within {timeout_s * waited / _WAIT_UNITS:.2g} s",
            "Check the board's supply and cable",
        )

    def tell(self, name: str, values: dict[str, Any] | None = None) -> None:
        """Send a request without waiting for its answer. Raise BoardError `board_link_lost`."""
        self._send(name, 0, values or {})

    def fail(self, error: Exception) -> None:
        """Store `error` as the fault, unless there is one already."""
        self.fault = self.fault or error

    def close(self) -> None:
        """End the reader thread and close the port."""
        self._closing.set()
        self._reader.join()
        self._serial.close()

    def _send(self, name: str, sequence: int, values: dict[str, Any]) -> None:
        """Send a frame. The leading zero ends an incomplete frame that the board may have received before."""
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
        """Decode received bytes to frames until closing or the first fault, on the reader thread."""
        try:
            while not self._closing.is_set():
                data = self._receive()
                host_time_s = time.monotonic()
                self._reads_without_frame += 1
                frames = self._frames.feed(data)
                if frames:
                    self._reads_without_frame = 0
                    self.frame_count += len(frames)
                for is_stream, group in groupby(frames, lambda frame: frame.name in protocol.SAMPLES):
                    if is_stream:
                        self._on_stream(group, host_time_s)
                    else:
                        for frame in group:
                            self._take(frame)
        except Exception as error:  # a lost link or a failing consumer must reach the caller, not end in a dead thread
            self.fault = error
        for request in list(self._requests.values()):
            request.done.set()

    def _take(self, frame: Frame) -> None:
        request = self._requests.get(frame.values.get("reply_to", 0))
        if request is not None and frame.name not in (protocol.ANSWERS.get(request.name, "ack"), "error"):
            request = None  # the answer to an earlier program that used the same number
        self._on_frame(frame, request.name if request is not None else None)
        if request is not None:
            request.answer = frame
            request.done.set()
