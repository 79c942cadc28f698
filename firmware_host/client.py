"""The host end of the link: asks the board, and passes on the samples it streams."""

import contextlib
import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

import serial

from firmware_host import protocol
from firmware_host.answers import (
    BoardIdentity,
    BoardStatus,
    SampleBatch,
    SensorCounts,
    SensorInfo,
    SensorSetup,
    reset_cause,
)
from firmware_host.errors import BoardError
from firmware_host.protocol import Frame

__all__ = ["Board", "BoardIdentity", "BoardStatus", "SampleBatch", "SensorCounts", "SensorInfo", "SensorSetup"]

_READ_TIMEOUT_S = 0.005  # pyserial waits for all bytes asked for or this long, so it is the delay of every read
_READ_SIZE = 65536
_ATTEMPTS = 4  # times a request is sent before the board counts as gone


class _Request:
    """A question under way; the reader thread puts the answer in."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.answered = threading.Event()
        self.answer: Frame | None = None


class Board:
    """The board on a serial port or `socket://host:port`; a context manager. `on_samples` runs on the reader thread."""

    def __init__(self, port: str, baud: int, on_samples: Callable[[SampleBatch], None], timeout_s: float = 1.0) -> None:
        """Opens the port and says hello. Raises BoardError: no_port, no_board, wrong_baud_rate, version_mismatch."""
        self._name = port
        self._baud = baud
        self._on_samples = on_samples
        self._timeout_s = timeout_s
        self._frames = protocol.FrameReader()
        self._frames_seen = 0
        self._last_frame_s = time.monotonic()
        self._streaming = False
        self._fault: Exception | None = None
        self._requests: dict[int, _Request] = {}
        self._sequence = 0
        self._sending = threading.Lock()
        self._closing = threading.Event()
        try:
            self._port = serial.serial_for_url(port, baudrate=baud, timeout=_READ_TIMEOUT_S, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            raise BoardError(
                "no_port",
                f"the port {port} does not open: {error}",
                "Check board.port and the cable, and that no other program has the port",
            ) from error
        self._reader = threading.Thread(target=self._read, name=f"board {port}", daemon=True)
        self._reader.start()
        try:
            self.identity = self._hello()
            self.stop()  # whoever was here before may have left the stream running
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def configure(self, sensor: int, rate_hz: float, range_deg_s: float) -> SensorSetup:
        """Sets a sensor to the nearest data rate and the next range up. Raises BoardError."""
        values = {"sensor": sensor, "rate_hz": rate_hz, "range_deg_s": range_deg_s}
        return SensorSetup.of(self._ask("configure", values))

    def start(self) -> None:
        """Streams every configured sensor, sequences from 0. Raises BoardError."""
        self._ask("start", {"sensors": 0})

    def stop(self) -> None:
        """Stops the stream; when it returns, every sample that was sent has been passed on. Raises BoardError."""
        self._ask("stop")

    def status(self) -> BoardStatus:
        """The board's health. Raises BoardError."""
        return BoardStatus.of(self._ask("status"))

    def reboot(self) -> None:
        """Starts the board afresh and waits until it answers again. Raises BoardError."""
        self._ask("reboot")
        self._streaming = False
        self.identity = self._hello()

    def check(self) -> None:
        """Raises what went wrong meanwhile: board_link_lost (closed, or silent while streaming) or board_error."""
        if self._fault is not None:
            raise self._fault
        silent_s = time.monotonic() - self._last_frame_s
        if self._streaming and silent_s > self._timeout_s:
            raise BoardError(
                "board_link_lost",
                f"no readable frame from the board on {self._name} for {silent_s:.1f} s while it should stream",
                "Check the board's supply and cable, and whether another program has the port",
            )

    def close(self) -> None:
        """Tells the board to stop if it streams, and closes the port. May be called twice."""
        if self._closing.is_set():
            return
        if self._streaming and self._fault is None:
            with contextlib.suppress(BoardError):  # the link may be gone, and closing is what was asked for
                self._send("stop", 0, {})
        self._closing.set()
        self._reader.join()
        sock = getattr(self._port, "_socket", None)
        self._port.close()
        if sock is not None:
            sock.close()  # pyserial leaves it open when the far end closed it first

    def _hello(self) -> BoardIdentity:
        before = self._frames.bytes_seen, self._frames_seen
        try:
            answer = self._ask("hello")
        except BoardError as error:
            if error.name != "board_link_lost" or self._fault is not None:
                raise
            raise self._why_no_hello(self._frames.bytes_seen - before[0], self._frames_seen - before[1]) from error
        if answer.values["protocol"] != protocol.PROTOCOL_VERSION:
            raise BoardError(
                "version_mismatch",
                f"the board on {self._name} speaks protocol {answer.values['protocol']}, "
                f"this program {protocol.PROTOCOL_VERSION}",
                "Flash the image that comes with this program",
            )
        return BoardIdentity.of(answer)

    def _why_no_hello(self, bytes_seen: int, frames_seen: int) -> BoardError:
        """An idle board speaks twice a second, so what was heard tells what is wrong."""
        if frames_seen:
            return BoardError(
                "no_board",
                f"the board on {self._name} sends, but does not answer",
                "Check the wire to the board's RX pin",
            )
        if bytes_seen:
            return BoardError(
                "wrong_baud_rate",
                f"{bytes_seen} bytes came from {self._name} at {self._baud} Bd and none made a readable frame",
                f"Set board.baud to {protocol.BAUD_RATE}, which the shipped image uses",
            )
        return BoardError(
            "no_board",
            f"nothing answers on {self._name} within {self._timeout_s:g} s",
            "Check the board's supply, the port's name, and that the image is flashed",
        )

    def _ask(self, name: str, values: dict[str, Any] | None = None) -> Frame:
        """Sends a request until its answer comes; every request may safely arrive twice."""
        with self._sending:
            self._sequence = sequence = self._sequence % 255 + 1
        request = self._requests[sequence] = _Request(name)
        try:
            for _ in range(_ATTEMPTS):
                if self._fault is None:
                    self._send(name, sequence, values or {})
                    request.answered.wait(self._timeout_s / _ATTEMPTS)
                if request.answer is not None:
                    return _accepted(request.answer)
                if self._fault is not None:
                    raise self._fault
        finally:
            del self._requests[sequence]
        raise BoardError(
            "board_link_lost",
            f"the board on {self._name} did not answer {name} within {self._timeout_s:g} s",
            "Check the board's supply and cable",
        )

    def _send(self, name: str, sequence: int, values: dict[str, Any]) -> None:
        """The leading zero ends whatever half a frame the board may have heard before."""
        try:
            with self._sending:
                self._port.write(b"\0" + protocol.encode(name, sequence, values))
        except (serial.SerialException, OSError) as error:
            raise self._link_closed(error) from error

    def _link_closed(self, error: Exception) -> BoardError:
        return BoardError(
            "board_link_lost",
            f"the port {self._name} closed: {error}",
            "Check the cable, the board's supply, and whether another program has the port",
        )

    def _receive(self) -> bytes:
        try:
            return bytes(self._port.read(_READ_SIZE))
        except (serial.SerialException, OSError) as error:
            raise self._link_closed(error) from error

    def _read(self) -> None:
        """The reader thread: bytes to frames until closing or the first fault."""
        try:
            while not self._closing.is_set():
                data = self._receive()
                host_time_s = time.monotonic()
                for frame in self._frames.feed(data):
                    self._last_frame_s = host_time_s
                    self._frames_seen += 1
                    self._take(frame)
        except Exception as error:  # a lost link or a failing consumer must reach check(), not end in a dead thread
            self._fault = error
        for request in list(self._requests.values()):
            request.answered.set()

    def _take(self, frame: Frame) -> None:
        if frame.name == "samples":
            if self._streaming:
                self._on_samples(SampleBatch.of(frame, self._last_frame_s))
            return
        request = self._requests.get(frame.values.get("reply_to", 0))
        if request is not None:
            if frame.name == "ack" and request.name in ("start", "stop"):
                self._streaming = request.name == "start"
                # Here and not in the caller's thread: the samples of a started stream may already be in the next frame.
            request.answer = frame
            request.answered.set()
        elif frame.name == "error" and frame.values["reply_to"] == 0:
            self._fault = self._fault or _board_error(frame)
        elif frame.name == "identity" and self._streaming:
            self._fault = self._fault or BoardError(
                "board_error",
                f"the board on {self._name} restarted while streaming (reset by: {reset_cause(frame)})",
                "Check its supply; a fault or watchdog is an error in the firmware: keep the run folder and report it",
            )


def _accepted(answer: Frame) -> Frame:
    if answer.name == "error":
        raise _board_error(answer)
    return answer


def _board_error(frame: Frame) -> BoardError:
    code, sensor = frame.values["code"], frame.values["sensor"]
    kind = protocol.ERROR_BY_CODE.get(code)
    if kind is None:
        return BoardError(
            "board_error", f"the board reports error {code}", "Flash the image that comes with this program"
        )
    return BoardError("board_error", f"the board says, of sensor {sensor}, {kind.name}: {kind.what}", kind.remedy)
