"""A simulated KVH 1775 on a pseudo-terminal, without a laboratory around it, with a given motion."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from rig.config.sensors.sensor_sections import SensorSection
from rig.config.world.laboratory import SimulatedKvhSection, SimulatedSensorSection
from rig.world.board.sensor_truth import SensorTruth
from rig.world.kvh1775.instrument import SimulatedKvh1775, no_field
from rig.world.kvh1775.memory import KvhMemory
from support.wires.device_on_a_wire import DeviceOnAWire

SERIAL_NUMBER = "1775-7"
TICK_S = 0.002
STILL = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def section(port: str, **changes: object) -> SensorSection:
    """Return the section of a sensor at `port`; `changes` may also contain keys of its serial section."""
    of_the_line: dict[str, object] = {
        key: changes.pop(key) for key in ("baud", "message", "rotation") if key in changes
    }
    serial: dict[str, object] = {"port": port, **of_the_line}
    sensor: dict[str, object] = {"part": "kvh1775", "serial_number": SERIAL_NUMBER, "serial": serial, **changes}
    return SensorSection.model_validate(sensor)


class KvhOnAWire:
    """The instrument, at most `pace` times as fast as real time.

    `motion_at`: its motion at a time, rad/s and g; `field_at`: the magnetic field in its axes, T.
    """

    def __init__(
        self,
        stored_settings: Mapping[str, str],
        motion_at: Callable[[float], Sequence[float]] = lambda time_s: STILL,
        pace: float = 1.0,
        uptime_s: float = 3.0,
        field_at: Callable[[float], Sequence[float]] = no_field,
        *,
        dead: bool = False,
    ) -> None:
        self.memory = KvhMemory(stored_settings)
        self._field_at = field_at
        self._motion_at, self._on_for_s = motion_at, uptime_s
        self.kvh: SimulatedKvh1775 | None = None
        self.wire = DeviceOnAWire(lambda: self.kvh, TICK_S, pace, dead=dead)
        self.line, self.port = self.wire.line, self.wire.port
        self.switch_on()
        self.wire.live(self._advance)

    def switch_on(self) -> None:
        sensor = section("/dev/ttyUSB0", acceleration={"range_g": 10})
        truth = SensorTruth(sensor, SimulatedSensorSection(scale=(1, 1, 1), bias_rad_s=(0, 0, 0), noise_rad_s=1e-5))
        self.kvh = SimulatedKvh1775(
            truth,
            self._motion_at,
            self.memory,
            field_at=self._field_at,
            serial_number=SERIAL_NUMBER,
            oscillator_ppm=SimulatedKvhSection().oscillator_ppm,
            uptime_s=self._on_for_s,
            seed=np.random.SeedSequence(1),
            time_s=self.wire.time_s,
        )

    def order(self, what: Callable[[SimulatedKvh1775], None]) -> None:
        """Let the instrument's own thread call `what`, and wait until it is done."""

        def carry_out() -> None:
            assert self.kvh is not None
            what(self.kvh)

        self.wire.order(carry_out)

    def close(self) -> None:
        self.wire.close()

    def _advance(self, time_s: float) -> None:
        if self.kvh is not None:
            self.kvh.advance(time_s)


@contextmanager
def kvh_on_a_wire(
    stored_settings: Mapping[str, str] | None = None,
    motion_at: Callable[[float], Sequence[float]] = lambda time_s: STILL,
    *,
    pace: float = 1.0,
    uptime_s: float = 3.0,
    field_at: Callable[[float], Sequence[float]] = no_field,
    dead: bool = False,
) -> Iterator[KvhOnAWire]:
    """Run the instrument during the `with` block; a `dead` line carries no bytes."""
    wire = KvhOnAWire(stored_settings or {}, motion_at, pace, uptime_s, field_at, dead=dead)
    try:
        yield wire
    finally:
        wire.close()
