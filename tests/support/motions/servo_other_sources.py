"""A drawn servo, read by a device that prints lines or by an autopilot; their bytes pass through the rig's drivers."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from firmware_host.emulator.parts.magnetometer import MagnetometerTruth
from rig.config.world.laboratory import SimulatedSensorSection
from rig.config.world.printing_device import SimulatedLinesSection
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array
from rig.sensors.lines.lines_source import lines
from rig.sensors.mavlink.autopilot_source import mavlink
from rig.sensors.sample_source import SampleSource
from rig.world.board.sensor_truth import SensorTruth
from rig.world.lines.printer import Printer
from rig.world.servo.servo import SimulatedServo
from support.motions.drawn_servo import BEGINS_S, Until
from support.processes.waiting import PATIENCE_S
from support.wires.autopilot_on_a_wire import autopilot_on_a_wire, section
from support.wires.printed_lines import pty_printing, sensor_section

STILL_S = BEGINS_S - 0.9  # it stands from then on, before the first turn
RATE_HZ = 200.0
CHUNK_S = 0.05
PACE = 8.0
DRAINED_S = 1.0  # after so long nothing is on its way any more
Model = tuple[Array, Array]


def sample_lines(
    servo: SimulatedServo, rows: Array, model: Model, until: Until, rng: np.random.Generator
) -> tuple[RecordedSensor, np.ndarray]:
    """Sample a device that prints its time and three rates in steps of 0.001 °/s."""
    end_s, drift, _ = until
    listening = threading.Event()
    ended = threading.Event()
    wanted = sensor_section(
        "/dev/ttyUSB0", rate_hz=RATE_HZ, columns=("time", "gx", "gy", "gz"), acceleration=None,
        rate={"unit": "deg/s", "decimals": 3},
    )  # fmt: skip
    assert wanted.lines is not None and wanted.serial is not None
    printer = Printer(
        SensorTruth(wanted, _errors(model, until)),
        _make_motion(servo, rows),
        SimulatedLinesSection(oscillator_ppm=-1e6 * drift),
        wanted.lines,
        field_at=lambda time_s: (0.0, 0.0, 0.0),
        magnetometer=MagnetometerTruth(),
        rate_hz=RATE_HZ,
        baud_rate=921600.0,
        seed=np.random.SeedSequence(int(rng.integers(1 << 31))),
        time_s=STILL_S - 10.0,
    )

    def printed() -> Iterator[bytes]:
        time_s = STILL_S - 10.0
        while time_s < end_s:
            if time_s > STILL_S:
                listening.wait(PATIENCE_S)
            time_s += CHUNK_S
            printer.advance(time_s)
            yield printer.take_sent()
        ended.set()

    collected = _SampleSink()
    with pty_printing(printed(), 0.001) as (port, _):
        at_port = wanted.model_copy(update={"serial": wanted.serial.model_copy(update={"port": port})})
        with lines("gyro", at_port, collected) as source:
            source.start()
            listening.set()
            return source.sensors["gyro"], collected.all_of(
                source, lambda: ended.is_set() and collected.quiet_s > DRAINED_S
            )


def sample_autopilot(
    servo: SimulatedServo, rows: Array, model: Model, until: Until, rng: np.random.Generator
) -> tuple[RecordedSensor, np.ndarray]:
    """Sample ArduPilot's first IMU behind its low-pass filter, with offsets to be undone."""
    end_s, drift, _ = until
    begun_s: list[float] = []
    motion = _make_motion(servo, rows)

    def motion_at(time_s: float) -> Sequence[float]:
        return motion(STILL_S + (max(time_s - begun_s[0], 0.0) if begun_s else 0.0))

    offsets = {f"INS_GYROFFS_{axis}": float(rng.uniform(-0.05, 0.05)) for axis in "XYZ"}
    collected = _SampleSink()
    with autopilot_on_a_wire(
        "ardupilot", offsets, motion_at, pace=PACE, simulated=_errors(model, until), clock_ppm=-1e6 * drift
    ) as wire:
        sections = {"gyro": section(wire.port, acceleration=None)}
        with mavlink(sections, collected) as source:
            source.start()
            begun_s.append(wire.time_s + 1.0)
            return source.sensors["gyro"], collected.all_of(
                source, lambda: wire.time_s > begun_s[0] + end_s - STILL_S + DRAINED_S * PACE
            )


class _SampleSink:
    """The samples that a source passed on."""

    def __init__(self) -> None:
        self._parts: list[np.ndarray] = []
        self._last_s = time.monotonic()

    def __call__(self, sensor: str, samples: np.ndarray) -> None:
        self._parts.append(samples)
        self._last_s = time.monotonic()

    @property
    def quiet_s(self) -> float:
        """The time without new samples, s."""
        return time.monotonic() - self._last_s

    def all_of(self, source: SampleSource, ended: Callable[[], bool]) -> np.ndarray:
        """Return all samples once the source has ended."""
        while not ended():
            source.check()
            time.sleep(0.01)
        return np.concatenate(self._parts)


def _make_motion(servo: SimulatedServo, rows: Array) -> Callable[[float], Sequence[float]]:
    """Return a function of time: rate in rad/s and specific force in g on a vertical shaft."""
    axis = rows[:, 2]

    def motion_at(time_s: float) -> Sequence[float]:
        return [*(servo.rate_at(max(time_s, STILL_S)) * axis).tolist(), *axis.tolist()]

    return motion_at


def _errors(model: Model, until: Until) -> SimulatedSensorSection:
    scale, bias = (tuple(values.tolist()) for values in model)
    return SimulatedSensorSection(scale=scale, bias_rad_s=bias, noise_rad_s=until[2])
