"""The firmware's core built for this machine, with the sensors on its bus; tests play the chip."""

import ctypes
import fcntl
import functools
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from firmware_host.frames import Frame, FrameReader, encode
from firmware_host.protocol import ERRORS
from support.board.host_sensors import Part
from support.parts import REGISTERS
from support.parts.adis16465 import Adis16465Registers
from support.parts.lsm9ds1 import Lsm9ds1Registers
from support.parts.lsm9ds1_magnetometer import Lsm9ds1MagnetometerRegisters
from support.parts.mpu9250 import Mpu9250Registers
from support.paths import FIRMWARE, ROOT

PERIOD_US = 4202  # 238 Hz
SETTLING = 8  # conversions of the LSM9DS1 thrown away after a configure

_BUS = ctypes.CFUNCTYPE(None, ctypes.c_uint, ctypes.c_uint32, ctypes.POINTER(ctypes.c_uint8), ctypes.c_size_t)
_TRANSMIT = ctypes.CFUNCTYPE(None, ctypes.POINTER(ctypes.c_uint8), ctypes.c_size_t)
_RESTART = ctypes.CFUNCTYPE(None)
_LINE = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_uint)


@functools.cache
def core() -> ctypes.CDLL:
    """Return the core, built again if its sources have changed; undefined behaviour ends the process.

    With RIG_COVERAGE in the environment it is built there, and records the executed lines for `make coverage`.
    """
    out = os.environ.get("RIG_COVERAGE") or ROOT / "build" / "host"
    Path(out).mkdir(parents=True, exist_ok=True)
    with Path(out, "building").open("w") as lock:  # tests that run side by side build it once
        fcntl.flock(lock, fcntl.LOCK_EX)
        subprocess.run(["make", "-s", "-C", FIRMWARE, "host", f"OUT={out}"], check=True)
    library = ctypes.CDLL(f"{out}/rig_host.so")
    library.frame_crc.restype = ctypes.c_uint32
    library.frame_encode.restype = ctypes.c_size_t
    library.frame_decode.restype = ctypes.c_bool
    library.clock_now.restype = ctypes.c_uint64
    library.port_time_us.restype = ctypes.c_uint32
    return library


def write_coverage() -> None:
    """Write what the core has executed in this process, if it was loaded."""
    if core.cache_info().currsize:
        core().host_write_coverage()


class HostBoard:
    """The core after a reset. There is one core in a process, so one HostBoard at a time."""

    def __init__(self) -> None:
        self.core = core()
        self.parts: dict[str, Any] = {part: new() for part, new in REGISTERS.items()}
        self.gyro: Lsm9ds1Registers = self.parts["lsm9ds1"]
        self.mpu9250: Mpu9250Registers = self.parts["mpu9250"]
        self.adis16465: Adis16465Registers = self.parts["adis16465"]
        self.magnetometer: Lsm9ds1MagnetometerRegisters = self.parts["lsm9ds1_magnetometer"]
        self.sensors: list[Part] = list(self.parts.values())  # the parts present, by the board's numbers
        self.line_is_free = True  # False: the transmitter is busy until `sent()`
        self.restarts = 0
        self.wire = bytearray()
        self._callbacks = (_BUS(self._bus), _TRANSMIT(self._transmit), _RESTART(self._restart))
        self._line_callback = _LINE(self._line)
        self.core.host_connect(*self._callbacks)
        self.core.host_watch_lines(self._line_callback)
        self.core.host_flash_clear()
        self.core.host_press(False)
        self.core.host_lock_clock(False)
        self.set_time(0)
        self.core.board_reset()

    def _bus(self, device: int, max_hz: int, pointer: "ctypes._Pointer[ctypes.c_uint8]", size: int) -> None:
        assert size % 2 == 0
        answer = self.sensors[device].transfer(ctypes.string_at(pointer, size), max_hz, self.core.port_time_us())
        ctypes.memmove(pointer, answer, size)

    def _line(self, sensor: int) -> bool:
        return self.sensors[sensor].line_is_high

    def _transmit(self, pointer: "ctypes._Pointer[ctypes.c_uint8]", size: int) -> None:
        self.wire += ctypes.string_at(pointer, size)
        if self.line_is_free:
            self.core.link_sent()

    def _restart(self) -> None:
        self.restarts += 1
        self.core.board_reset()

    def set_time(self, time_us: int) -> None:
        """Set the chip's counter, which wraps at 32 bits."""
        self.core.host_set_time_us(ctypes.c_uint32(time_us & 0xFFFFFFFF))

    def wait_until(self, time_us: int) -> None:
        """Let time pass until `time_us`, unless the firmware has waited that long itself."""
        if (time_us - self.core.port_time_us()) % 2**32 < 2**31:
            self.set_time(time_us)

    def sent(self) -> None:
        """Raise the transmitter's interrupt."""
        self.core.link_sent()

    def receive(self, data: bytes) -> None:
        """Let bytes from the host arrive, then run the main loop once."""
        for byte in data:
            self.core.link_byte_received(byte)
        self.run()

    def data_ready(self, captured_us: int, sensor: int = 0) -> None:
        """Raise a sensor's data-ready interrupt."""
        self.core.acquisition_data_ready(sensor, ctypes.c_uint32(captured_us & 0xFFFFFFFF))

    def run(self, passes: int = 2) -> None:
        """Run the main loop, by default twice: the second pass sends what the first one queued for a busy line."""
        for _ in range(passes):
            self.core.board_run()

    def frames(self) -> list[Frame]:
        """Return the complete frames sent since the last call."""
        reader = FrameReader()
        frames = reader.feed(bytes(self.wire))
        assert reader.damaged == 0
        self.wire.clear()
        return frames

    def ask(self, name: str, sequence: int = 1, **values: object) -> list[Frame]:
        """Send a request; return the frames sent up to its answer."""
        self.receive(encode(name, sequence, values))
        return self.frames()


def streaming_board() -> HostBoard:
    """Return a board whose LSM9DS1 has just been started at 238 Hz, with an empty transmit buffer."""
    board = HostBoard()
    assert [
        frame.name for frame in board.ask("configure", sensor=0, rate_hz=238, range_deg_s=245, range_g=0, range_gauss=0)
    ] == ["setup"]
    assert [frame.name for frame in board.ask("start", sensors=0)] == ["ack"]
    settle(board)
    return board


def settle(board: HostBoard, time_us: int = 0) -> None:
    """Make the LSM9DS1's conversions after a configuration that are not samples yet."""
    for _ in range(SETTLING):
        convert(board, time_us, (32767, 32767, 32767), late_us=0)


def convert(
    board: HostBoard,
    time_us: int,
    counts: Sequence[int] = (1, -2, 3),
    late_us: int = 20,
    sensor: int = 0,
    *,
    acceleration: Sequence[int] = (0, 0, 0),
    temperature_counts: int = -48,
) -> None:
    """Make one conversion: the interrupt at `time_us`, the main loop `late_us` later."""
    list(board.parts.values())[sensor].convert(counts, temperature_counts, acceleration)
    board.data_ready(time_us, sensor)
    board.wait_until(time_us + late_us)
    board.run()


def error_of(frames: list[Frame]) -> str:
    """Return the name of the error in `frames`, which must be a single error frame."""
    (frame,) = frames
    assert frame.name == "error"
    return ERRORS[frame.values["code"]].name


def sample_sequences(frames: list[Frame], sensor: int = 0) -> list[int]:
    """Return the sequence numbers of a sensor's samples."""
    batches = [
        f for f in frames if f.name in ("samples", "imu_samples", "field_samples") and f.values["sensor"] == sensor
    ]
    return [batch.values["sequence"] + i for batch in batches for i in range(batch.values["count"])]


def configure(
    board: HostBoard, sensor: int, rate_hz: float = 200, range_deg_s: float = 125, range_g: float = 0
) -> dict[str, Any]:
    """Set a sensor up; return the board's answer."""
    (setup,) = board.ask(
        "configure", sensor=sensor, rate_hz=rate_hz, range_deg_s=range_deg_s, range_g=range_g, range_gauss=0
    )
    assert setup.name == "setup"
    return setup.values


def first_samples(
    board: HostBoard,
    sensor: int,
    counts: tuple[int, int, int],
    conversions: int = 40,
    acceleration: tuple[int, int, int] = (0, 0, 0),
) -> Frame:
    """Start, let the sensor convert the same reading repeatedly, and stop. Return the first batch."""
    board.ask("start", 2, sensors=0)
    for k in range(conversions):
        convert(board, 100_000 + 5000 * k, counts, sensor=sensor, acceleration=acceleration)
    return next(frame for frame in board.ask("stop", 3) if frame.name in ("samples", "imu_samples"))
