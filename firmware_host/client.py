"""The host end of the link: requests to the board, and the samples it streams."""

import contextlib
from collections.abc import Callable, Collection, Iterable, Sequence
from types import TracebackType
from typing import Any, Self

from firmware_host import computer_load, protocol
from firmware_host.answers import (
    BoardIdentity,
    BoardObservation,
    BoardSolution,
    BoardStatus,
    Calibration,
    Heating,
    SampleBatch,
    SensorCounts,
    SensorInfo,
    SensorSetup,
    StoredCalibration,
    StoredPolynomials,
    reset_cause,
    sample_batches,
)
from firmware_host.errors import BoardError
from firmware_host.frames import Frame
from firmware_host.hand_answers import BoardHandSolution, HandReport
from firmware_host.link import BoardLink

__all__ = [
    "Board",
    "BoardIdentity",
    "BoardObservation",
    "BoardSolution",
    "BoardStatus",
    "Calibration",
    "Heating",
    "SampleBatch",
    "SensorCounts",
    "SensorInfo",
    "SensorSetup",
    "StoredCalibration",
    "StoredPolynomials",
]

# Erasing a flash page takes 22 ms, during which the microcontroller receives nothing: a repeated request is lost.
_FLASH_TIMEOUT_S = 4.0
_SILENCE_S = 2.0  # longest time without a frame in a stream, on a computer that is not crowded
_ABOUT_THE_BOARD = ("unknown_message", "bad_length", "busy_streaming")  # errors that do not concern a sensor


class Board:
    """The board on a serial port or `socket://host:port`; a context manager, which closes the port at its end.

    A thread reads the port and calls `on_samples`. Sensors are given by their index in `identity.sensors`. Every
    request may raise BoardError `board_link_lost`, and the board's refusal, with its name in `protocol.ERRORS`
    (`sensor_absent`, `no_calibration`, …).
    """

    def __init__(self, port: str, baud: int, on_samples: Callable[[SampleBatch], None], timeout_s: float = 4.0) -> None:
        """Open the port, identify the board, and stop a stream that an earlier program has left running.

        Raise BoardError `no_port`, `no_board`, `wrong_baud_rate`, `version_mismatch`.
        """
        self._on_samples = on_samples
        self._timeout_s = timeout_s
        self._streaming = False
        self._last_check = (-1, 0.0)  # frame count at the last check, and the other clock's time of its last change
        self._parts: tuple[str, ...] = ()
        self.heating: Heating | None = None  # the heater's last reported state
        self._link = BoardLink(port, baud, self._take, self._take_samples)
        try:
            self.identity = self._hello()
            self.stop()  # an earlier program may have left the stream running
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def configure(self, sensor: int, rate_hz: float, range_deg_s: float, range_g: float = 0.0) -> SensorSetup:
        """Set a gyroscope to the data rate nearest to `rate_hz`, and to the smallest range of at least `range_deg_s`.

        With `range_g` other than 0, accelerations are sent too, in the smallest range of at least `range_g`, unless the
        stream is calibrated.
        """
        return self._configure(sensor, rate_hz, range_deg_s=range_deg_s, range_g=range_g)

    def configure_magnetometer(self, sensor: int, rate_hz: float, range_gauss: float) -> SensorSetup:
        """Set a magnetometer to the data rate nearest to `rate_hz` and the smallest range of at least `range_gauss`."""
        return self._configure(sensor, rate_hz, range_gauss=range_gauss)

    def start(self, calibrated: Collection[int] = ()) -> None:
        """Stream every configured sensor, with sequence numbers from 0; the board calibrates those in `calibrated`."""
        self._ask("start", {"sensors": _mask(calibrated)})

    def stop(self) -> None:
        """Stop the stream; on return all samples have been passed on."""
        self._ask("stop")

    def status(self) -> BoardStatus:
        """Return the health of the board and of the link."""
        return BoardStatus.decode(self._ask("status"), self._link.frames_lost, self._link.frames_repeated)

    def keep(self, sensors: Collection[int], duration_s: float) -> None:
        """Have the board store these sensors' readings from now on, for at least `duration_s`, for `observe`."""
        self._ask("keep", {"sensors": _mask(sensors), "duration_s": duration_s})

    def observe(self, sensor: int, index: int, start_us: int, end_us: int, speed_rad_s: float) -> BoardObservation:
        """Average stored readings between two board times and add the mean to the sensor's observations.

        `index` is the number of earlier observations; with 0 the board discards these. `speed_rad_s` is the magnitude
        of the rate between the two times. Raise BoardError, among others `not_kept` and `bad_observation`.
        """
        values = {"sensor": sensor, "index": index, "start_us": start_us, "end_us": end_us, "speed_rad_s": speed_rad_s}
        return BoardObservation.decode(self._ask("observe", values))

    def recall(self, sensor: int, index: int, mean_rad_s: Sequence[float], speed_rad_s: float) -> BoardObservation:
        """Send the board an observation that it made before a reset: its `mean_rad_s`, with `index` as in `observe`."""
        values = {"sensor": sensor, "index": index, "mean_rad_s": mean_rad_s, "speed_rad_s": speed_rad_s}
        return BoardObservation.decode(self._ask("recall", values))

    def solve(self, sensor: int, method: str = "closed_form") -> BoardSolution:
        """Have the board calibrate a sensor from its observations by one of `protocol.METHODS`."""
        return BoardSolution.decode(self._ask("solve", {"sensor": sensor, "method": protocol.METHODS.index(method)}))

    def begin_by_hand(self, sensor: int, moves: int, scale_std: float) -> None:
        """Have the board calibrate a streaming sensor, set up with accelerations, while a hand turns it.

        The session ends after at least `moves` (1 to 255), once the scale's standard uncertainty is at most
        `scale_std`.
        """
        self._ask("by_hand", {"sensor": sensor, "moves": moves, "scale_std": scale_std})

    def hand_report(self) -> HandReport:
        """Return the progress of the calibration by hand."""
        return HandReport.decode(self._ask("hand_status"))

    def hand_solution(self) -> BoardHandSolution:
        """Return the present solution of the calibration by hand."""
        return BoardHandSolution.decode(self._ask("hand_solve"))

    def read_calibration(self, sensor: int) -> StoredCalibration | None:
        """Return the calibration stored on the board for a sensor; None if there is none."""
        try:
            return StoredCalibration.decode(self._ask("read_calibration", {"sensor": sensor}))
        except BoardError as error:
            if error.name == "no_calibration":
                return None
            raise

    def write_calibration(self, sensor: int, calibration: Calibration) -> None:
        """Store a calibration for a configured sensor; its configured range becomes part of the record.

        The old record remains until the new one is complete. Repeating the request is harmless.
        """
        self._ask("write_calibration", {"sensor": sensor, **calibration.values()}, _FLASH_TIMEOUT_S)

    def erase_calibration(self, sensor: int) -> None:
        """Erase a sensor's calibration on the board; without one, do nothing."""
        self._ask("erase_calibration", {"sensor": sensor}, _FLASH_TIMEOUT_S)

    def heat(self, power: float) -> Heating:
        """Set the heater's duty, 0 to 1; it switches off after two seconds without a new request."""
        return Heating.decode(self._ask("heat", {"power": _power_counts(power)}))

    def keep_heating(self, power: float) -> None:
        """Repeat the request of `heat` without waiting for the answer, which is stored in `heating`."""
        self._link.tell("heat", {"power": _power_counts(power)})

    def reboot(self) -> None:
        """Restart the board and wait until it answers again."""
        self._ask("reboot")
        self.identity = self._hello()

    def check(self, clock_s: float | None = None) -> None:
        """Raise the link's fault, if any, or BoardError `board_link_lost` if a streaming board is silent for too long.

        `clock_s` is the present time on another instrument's clock. If it is given, the silence must be too long on
        that clock as well.
        """
        if self._link.fault is not None:
            raise self._link.fault
        silent_s = self._link.silent_s
        if clock_s is not None:
            if self._link.frame_count != self._last_check[0]:
                self._last_check = self._link.frame_count, clock_s
            silent_s = min(silent_s, clock_s - self._last_check[1])
        if self._streaming and computer_load.exceeds(silent_s, min(self._timeout_s, _SILENCE_S)):
            raise BoardError(
                "board_link_lost",
                f"no readable frame from the board on {self._link.port} for {silent_s:.1f} s while it should stream",
                "Check the board's supply and cable, and whether another program has the port",
            )

    def close(self) -> None:
        """Stop the stream if the board streams, and close the port. May be called twice."""
        if self._link.closed:
            return
        if self._streaming and self._link.fault is None:
            with contextlib.suppress(BoardError):  # the link may be lost, and closing must still succeed
                self._link.tell("stop")
        self._link.close()

    def _configure(self, sensor: int, rate_hz: float, **ranges: float) -> SensorSetup:
        values = {"sensor": sensor, "rate_hz": rate_hz, "range_deg_s": 0.0, "range_g": 0.0, "range_gauss": 0.0}
        return SensorSetup.decode(self._ask("configure", values | ranges))

    def _hello(self) -> BoardIdentity:
        counts_before = self._link.byte_count, self._link.frame_count
        try:
            answer = self._ask("hello")
        except BoardError as error:
            if error.name != "board_link_lost" or self._link.fault is not None:
                raise
            raise self._why_no_hello(
                self._link.byte_count - counts_before[0], self._link.frame_count - counts_before[1]
            ) from error
        if answer.values["protocol"] != protocol.PROTOCOL_VERSION:
            raise BoardError(
                "version_mismatch",
                f"the board on {self._link.port} speaks protocol {answer.values['protocol']}, "
                f"this program {protocol.PROTOCOL_VERSION}",
                "Flash the image that comes with this program: `rig board flash`",
            )
        identity = BoardIdentity.decode(answer)
        self._parts = tuple(sensor.part for sensor in identity.sensors)
        return identity

    def _why_no_hello(self, byte_count: int, frame_count: int) -> BoardError:
        """Return why no greeting came, judged from the bytes and frames received meanwhile.

        An idle board sends an identity twice a second, so a port without bytes has no board.
        """
        if frame_count:
            return BoardError(
                "no_board",
                f"the board on {self._link.port} sends, but does not answer",
                "Check the wire to the board's RX pin",
            )
        if byte_count:
            return BoardError(
                "wrong_baud_rate",
                f"{byte_count} bytes came from {self._link.port} at {self._link.baud} Bd and none made a "
                "readable frame",
                f"Set board.baud to {protocol.BAUD_RATE}, which the shipped image uses, or flash that image",
            )
        return BoardError(
            "no_board",
            f"nothing answers on {self._link.port} within {self._timeout_s:g} s",
            "Check the board's supply, the port's name, and that the image is flashed: `rig board flash`",
        )

    def _ask(self, name: str, values: dict[str, Any] | None = None, timeout_s: float | None = None) -> Frame:
        """Return the board's answer to a request; raise its refusal as BoardError."""
        answer = self._link.ask(name, values, timeout_s or self._timeout_s)
        if answer.name == "error":
            refusal = self._refusal(answer)
            if self._streaming and refusal.name == "not_configured" and not self.status().streaming:
                # It streamed before: a request that precedes its new hello meets a restarted board.
                refusal = self._describe_restart(self._link.ask("hello", None, self._timeout_s))
                self._link.fail(refusal)
            raise refusal
        return answer

    def _take_samples(self, frames: Iterable[Frame], host_time_s: float) -> None:
        """Pass on the stream as it comes, on the reader thread; drop the end of an earlier program's stream."""
        if self._streaming:
            for batch in sample_batches(frames, host_time_s):
                self._on_samples(batch)

    def _take(self, frame: Frame, request: str | None) -> None:
        """Handle a frame outside the stream, on the reader thread."""
        if frame.name == "ack" and request in ("start", "stop", "reboot"):
            # On this thread, because samples of a started stream may already be in the next frame.
            self._streaming = request == "start"
            if request == "reboot":
                self._link.expect_restart()
        elif frame.name == "heating":
            self.heating = Heating.decode(frame)
        elif frame.name == "error" and frame.values["reply_to"] == 0:
            self._link.fail(self._refusal(frame))
        elif frame.name == "identity" and request is None and self._streaming:
            self._link.fail(self._describe_restart(frame))

    def _describe_restart(self, identity: Frame) -> BoardError:
        return BoardError(
            "board_error",
            f"the board on {self._link.port} restarted while streaming (reset by: {reset_cause(identity)})",
            "Check its supply. If the cause is fault or watchdog, the firmware has an error: keep the run folder and "
            "report it",
        )

    def _refusal(self, frame: Frame) -> BoardError:
        """Return the error of an `error` frame, with its name in `protocol.ERRORS` and the part that it concerns."""
        code, sensor = frame.values["code"], frame.values["sensor"]
        problem = protocol.ERRORS.get(code)
        if problem is None:
            return BoardError(
                "board_error",
                f"the board on {self._link.port} reports error {code}",
                "Flash the image that comes with this program: `rig board flash`",
            )
        part = self._parts[sensor] if sensor < len(self._parts) else f"sensor {sensor}"
        about = "" if problem.name in _ABOUT_THE_BOARD else f", of its {part}"
        return BoardError.from_problem(
            problem._replace(what=f"the board on {self._link.port} says{about}: {problem.what}")
        )


def _power_counts(power: float) -> int:
    """Return a power from 0 to 1 in the board's counts."""
    return round(protocol.HEATER_POWERS * min(max(power, 0.0), 1.0))


def _mask(sensors: Collection[int]) -> int:
    """Return a mask with bit i for the sensor of index i."""
    return sum(1 << sensor for sensor in set(sensors))
