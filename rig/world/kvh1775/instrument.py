"""The simulated KVH 1775: two modes, non-volatile settings, its own oscillator, bytes in and out.

Source: ICD 56-0298 Rev. B, sections 3.3 (modes), 3.4 (built-in test), 5 (messages), 8 (commands).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import cast

import numpy as np
from numpy.typing import NDArray

from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2, Accelerometer
from firmware_host.emulator.parts.gyroscope import Gyroscope
from firmware_host.emulator.parts.magnetometer import GAUSS_T, Magnetometer, MagnetometerTruth
from rig.config.world.faulty import SimulatedFaultySection
from rig.sensors.kvh1775.kvh_messages import (
    ALL_VALID,
    GOOD_TEST_BYTE,
    SEQUENCE_NUMBERS,
    Format,
    encode_one,
    encode_test,
)
from rig.world.board.sensor_truth import SensorTruth
from rig.world.faulty_gyroscope import FrozenGyroscope, Repeats
from rig.world.kvh1775.memory import KvhMemory

INTERNAL_STEP_S = 1e-3  # longest step of the integration of a delta angle
LINE_END = b"\r\n"
MAX_COMMAND_BYTES = 200
PERFECT_MAGNETOMETER = MagnetometerTruth()
NO_FAULTS = SimulatedFaultySection()


def no_field(time_s: float) -> Sequence[float]:
    """Return zero flux density, (3,) T, as in a shielded chamber."""
    return 0.0, 0.0, 0.0


@dataclass(slots=True)
class KvhFaults:
    """Faults that a test can set.

    `lose`: the number of messages still to be lost; `status`: the bits that mark axes of a message as valid; `test`:
    the first byte of a result of the built-in test.
    """

    lose: int = 0
    status: int = ALL_VALID
    test: int = GOOD_TEST_BYTE


class SimulatedKvh1775:
    """The instrument, switched on at the virtual time `time_s`, when its clock reads `uptime_s`.

    `motion_at`: its motion over time, rate in rad/s and specific force in g; `field_at`: flux density in its axes, T;
    `magnetometer`: the errors of its reading; `memory`: its settings, which commands change.
    """

    def __init__(
        self,
        truth: SensorTruth,
        motion_at: Callable[[float], Sequence[float]],
        memory: KvhMemory,
        *,
        field_at: Callable[[float], Sequence[float]] = no_field,
        magnetometer: MagnetometerTruth = PERFECT_MAGNETOMETER,
        serial_number: str,
        oscillator_ppm: float,
        uptime_s: float,
        seed: np.random.SeedSequence,
        time_s: float,
        faulty: SimulatedFaultySection = NO_FAULTS,
    ) -> None:
        """Switch the instrument on; it streams messages at once.

        `oscillator_ppm`: the error of its oscillator, positive if fast.
        """
        self.faults = KvhFaults()
        self._truth, self._motion_at, self._memory = truth, motion_at, memory
        self._serial_number = serial_number
        self._speed = 1.0 + 1e-6 * oscillator_ppm
        self._counted_from_s = time_s - uptime_s / self._speed
        self._sensed: Sequence[float] = ()
        gyroscope = Gyroscope(lambda time_s: self._sensed, truth.gyro, seed, truth.temperature_c)
        self._gyroscope, self._repeats = FrozenGyroscope(gyroscope, faulty), Repeats(faulty, seed)
        self._accelerometer = Accelerometer(motion_at, truth.accelerometer, seed, truth.temperature_c)
        self._magnetometer = Magnetometer(field_at, magnetometer, _derive_seed(seed))
        self._now_s = time_s
        self._sequence = 0
        self._command = bytearray()
        self._sent = bytearray(encode_test(bytes([GOOD_TEST_BYTE] * 6)))
        self._tests_due: list[int] = []
        self.configuring = False
        self._begin()

    @property
    def baud_rate(self) -> float:
        """The baud rate of both directions."""
        return float(self._memory["BAUD"])

    def misbehave(self, *, lose: int = 0, status: int | None = None, test: int | None = None) -> None:
        """Set the given faults; `lose` is added to the number of messages still to be lost."""
        faults = self.faults
        faults.lose += int(lose)
        faults.status = faults.status if status is None else int(status)
        faults.test = faults.test if test is None else int(test)

    def take_sent(self) -> bytes:
        """Return the bytes sent since the last call."""
        data = bytes(self._sent)
        self._sent.clear()
        return data

    def receive(self, data: bytes) -> None:
        """Receive commands, which end with CR, LF or both."""
        for byte in data:
            if byte in LINE_END:
                line, self._command = bytes(self._command), bytearray()
                if line.strip():
                    self._obey(line.decode("ascii", "replace").strip().upper())
            elif len(self._command) < MAX_COMMAND_BYTES:
                self._command.append(byte)

    def advance(self, time_s: float) -> None:
        """Simulate until the virtual time `time_s`, which lies in the laboratory's last tick."""
        while not self.configuring and self._memory["MSYNC"] == "IMU":
            at_s = self._began_s + (self._steps + 1) * self._step_s
            if at_s > time_s:
                break
            self._steps += 1
            self._integrate(at_s)
            if self._steps % self._message_steps == 0:
                self._send(at_s)
        self._now_s = time_s

    # -- normal mode ---------------------------------------------------------------------------------------------
    def _begin(self) -> None:
        """Start sending messages, the first after one interval."""
        delta = self._memory["ROTFMT"] == "DELTA"
        interval_s = 1.0 / float(self._memory["DR"])  # by its own clock
        self._message_steps = ceil(interval_s / INTERNAL_STEP_S - 1e-9) if delta else 1
        self._step_s = interval_s / self._message_steps / self._speed
        self._began_s, self._steps = self._now_s, 0
        self._before: Sequence[float] | None = None
        self._sum = [0.0] * 6

    def _integrate(self, at_s: float) -> None:
        """Add the mean of the motions at the last step and at `at_s` to the sum from which a delta angle follows."""
        now = self._motion_at(at_s - self._truth.gyro.delay_s)
        before = self._before or now
        if now is before:  # the mean of two equal numbers is exact
            self._sum = [total + value for total, value in zip(self._sum, now, strict=False)]
        else:
            self._sum = [total + 0.5 * (old + new) for total, old, new in zip(self._sum, before, now, strict=False)]
        self._before = now

    def _send(self, at_s: float) -> None:
        """Send a message with the readings at `at_s`, in the format of the settings, then test results that are due."""
        memory = self._memory
        delta = memory["ROTFMT"] == "DELTA"
        now = cast(Sequence[float], self._before)
        self._sensed = [total / self._message_steps for total in self._sum] if delta else now
        self._sum = [0.0] * 6
        rotation = np.array(self._repeats.next_rates(self._gyroscope.read(at_s)))
        if delta:
            rotation /= float(memory["DR"])
        if memory["ROTUNITS"] == "DEG":
            rotation = np.degrees(rotation)
        acceleration_g = np.array(self._accelerometer.read(at_s)) / STANDARD_GRAVITY_M_S2
        axes = memory.axes
        sequence, self._sequence = self._sequence, (self._sequence + 1) % SEQUENCE_NUMBERS
        if self.faults.lose > 0:
            self.faults.lose -= 1
            return
        temperature = self._temperature(at_s)
        self._sent += encode_one(
            cast(Format, memory["OUTPUTFMT"]),
            (axes @ rotation).tolist(),
            (axes @ acceleration_g).tolist(),
            sequence=sequence,
            status=self.faults.status,
            temperature=round(temperature),
            time_us=round((at_s - self._counted_from_s) * self._speed * 1e6) % 2**32,
            fourth=temperature if sequence % 4 == 0 else self._field_gauss(at_s)[sequence % 4 - 1],
        )
        for count in self._tests_due:
            self._sent += encode_test(bytes([self.faults.test] + [GOOD_TEST_BYTE] * (count - 1)))
        self._tests_due.clear()

    def _field_gauss(self, at_s: float) -> NDArray[np.float64]:
        """Return a new reading of the field, (3,) gauss. Format C sends one of its axes in each message."""
        if self._memory["OUTPUTFMT"] != "C":
            return np.zeros(3)
        field: NDArray[np.float64] = self._memory.axes @ np.array(self._magnetometer.read(at_s)) / GAUSS_T
        return field

    def _temperature(self, at_s: float) -> float:
        unit = self._memory["TEMPUNITS"]
        celsius = self._gyroscope.temperature_c(at_s)
        value = celsius if unit.startswith("C") else celsius * 1.8 + 32.0
        return value * 100.0 if unit.endswith("_100") else value

    # -- commands ------------------------------------------------------------------------------------------------
    def _obey(self, command: str) -> None:
        """Carry out a command of the present mode; ignore a command of the other mode."""
        if command in ("?BIT", "?BIT,2") and not self.configuring:
            self._tests_due.append(6 if command == "?BIT" else 8)
        elif command == "=CONFIG,1":
            self.configuring = True
            self._answer("CONFIG,1")
        elif not self.configuring:
            return  # binary mode accepts no other command
        elif command == "=CONFIG,0":
            self.configuring = False  # the answer is that messages resume
            self._begin()
        elif command == "?IS":
            self._answer(f"IS,{self._serial_number}")
        else:
            self._answer(self._memory.obey(command))

    def _answer(self, text: str) -> None:
        self._sent += text.encode("ascii", "replace") + LINE_END


def _derive_seed(seed: np.random.SeedSequence) -> np.random.SeedSequence:
    """Return a seed for the magnetometer's noise that does not change the noise of the other triads."""
    return np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 1775))
