"""The simulated autopilot: heartbeat, parameter protocol, message intervals, bytes in and out.

Sources: the services of mavlink.io; ArduPilot, libraries/GCS_MAVLink/GCS_Common.cpp and GCS_Param.cpp; PX4,
src/modules/mavlink.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from random import Random
from typing import Any

import numpy as np

from rig.errors.extras import requiring
from rig.world.autopilot.autopilot_imu import RATE_HZ, SimulatedImu
from rig.world.autopilot.parameters import Parameters

STANDARD_GRAVITY_M_S2 = 9.80665
HEARTBEAT_S, ATTITUDE_S = 1.0, 0.1
QUADROTOR, ACTIVE, STANDBY = 2, 4, 3
AUTOPILOTS = {"ardupilot": 3, "px4": 12}
VERSIONS = {"ardupilot": 0x04050700, "px4": 0x010E03FF}
SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 511, 512  # commands
ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3
SCALED = {26: 0, 116: 1, 129: 2}  # index of the IMU in SCALED_IMU, SCALED_IMU2, SCALED_IMU3
RAW_IMU, HIGHRES_IMU, AUTOPILOT_VERSION = 27, 105, 148
IMU_INDEX = {**SCALED, RAW_IMU: 0, HIGHRES_IMU: 0}
MIN_INTERVAL_S = 1.0 / RATE_HZ
HEAD_BYTES = 6  # header of a message in MAVLink 1
BAROMETER_S = 0.05  # interval of PX4's barometer readings
# HIGHRES_IMU_UPDATED_FLAGS: x y z of the accelerometer and of the gyroscope; temperature.
SENSORS_UPDATED, TEMPERATURE_UPDATED = 0x3F, 0x1000


@dataclass(slots=True)
class AutopilotFaults:
    """Faults that a test can set.

    `lost` and `doubled` are fractions of the sent messages, `slowest` is the sent message rate as a fraction of the
    requested one. A `deaf` autopilot ignores all messages; a `camera` reports that it is no autopilot.
    """

    lost: float = 0.0
    doubled: float = 0.0
    slowest: float = 1.0
    deaf: bool = False
    camera: bool = False  # it reports that it is neither of the two autopilots


class SimulatedAutopilot:
    """The simulated autopilot, switched on at the virtual time `time_s`, when its clock reads `uptime_s`."""

    def __init__(
        self,
        firmware: str,
        imus: Sequence[SimulatedImu],
        parameters: Parameters,
        *,
        baud: float,
        uid: str,
        clock_ppm: float,
        uptime_s: float,
        armed: bool,
        provides_temperature: bool = True,
        mavlink_version: int = 2,
        seed: int,
        time_s: float,
    ) -> None:
        """Switch the autopilot on with its `imus` and `parameters`.

        `clock_ppm`: the error of its clock, positive if fast. `uid`: its unique number, hexadecimal.
        """
        with requiring("autopilot"):
            from pymavlink.dialects.v10 import ardupilotmega as first_version
            from pymavlink.dialects.v20 import ardupilotmega
        self._mavlink: Any = ardupilotmega
        self._sizes: Any = first_version.mavlink_map
        self._out = ardupilotmega.MAVLink(None, srcSystem=1, srcComponent=1)
        self._in = ardupilotmega.MAVLink(None)
        self._in.robust_parsing = True
        self._firmware, self._imus, self.parameters = firmware, imus, parameters
        self._baud, self._first_version = baud, mavlink_version == 1
        self._provides_temperature, self._next_pressure_s = provides_temperature, 0.0
        self._uid, self.armed = bytes.fromhex(uid), armed
        self.faults = AutopilotFaults()
        self._speed, self._began_s, self._on_for_s = 1.0 + 1e-6 * clock_ppm, time_s, uptime_s
        self._random = Random(f"autopilot {seed}")
        self._sent = bytearray()
        self._steps = 0
        self._due_s = {"heartbeat": 0.0, "attitude": 0.0}  # due times, by its own clock since power-up
        self._intervals_s: dict[int, float] = {}
        self._next_s: dict[int, float] = {}

    @property
    def baud_rate(self) -> float:
        """The baud rate of its port."""
        return self._baud

    def misbehave(self, *, armed: bool | None = None, **faults: float) -> None:
        """Set the simulated faults, and whether the autopilot is `armed`. Raise AttributeError for an unknown fault."""
        self.armed = self.armed if armed is None else bool(armed)
        for name, value in faults.items():
            setattr(self.faults, name, value)

    def take_sent(self) -> bytes:
        """Return the bytes sent since the last call."""
        data = bytes(self._sent)
        self._sent.clear()
        return data

    def receive(self, data: bytes) -> None:
        """Process bytes sent to the autopilot, in fragments of any size."""
        for message in self._in.parse_buffer(data) or []:
            if not self.faults.deaf and message.get_type() != "BAD_DATA":
                self._obey(message)

    def advance(self, time_s: float) -> None:
        """Simulate until the virtual time `time_s`, which lies in the laboratory's last tick."""
        while (at_s := self._began_s + (self._steps + 1) / RATE_HZ / self._speed) <= time_s:
            self._steps += 1
            own_s = self._steps / RATE_HZ
            now_us = round((self._on_for_s + own_s) * 1e6)
            for imu in self._imus:
                imu.step(at_s, now_us)
            self._send_due(own_s, now_us)

    # -- sending -----------------------------------------------------------------------------------------------------
    def _send_due(self, own_s: float, now_us: int) -> None:
        """Send heartbeat, attitude and IMU messages that are due; `own_s` and `now_us` count from power-up."""
        if own_s >= self._due_s["heartbeat"]:
            self._due_s["heartbeat"] += HEARTBEAT_S
            mode, state = (128, ACTIVE) if self.armed else (0, STANDBY)
            kind = 0 if self.faults.camera else AUTOPILOTS[self._firmware]
            self._send(self._mavlink.MAVLink_heartbeat_message(QUADROTOR, kind, mode | 1, 0, state, 3))
        if own_s >= self._due_s["attitude"]:
            self._due_s["attitude"] += ATTITUDE_S
            self._send(self._mavlink.MAVLink_attitude_message(now_us // 1000 % 2**32, 0, 0, 0, 0, 0, 0))
        for number, interval_s in self._intervals_s.items():
            if own_s >= self._next_s[number] - 1e-9:
                late = own_s - self._next_s[number] > interval_s
                self._next_s[number] = (own_s if late else self._next_s[number]) + interval_s / self.faults.slowest
                self._send_imu(number, now_us)

    def _send_imu(self, number: int, now_us: int) -> None:
        """Send an IMU's readings in the requested message: floats, or truncated integers."""
        imu = self._imus[IMU_INDEX[number]]
        rate = imu.rate_to_send()
        px4 = self._firmware == "px4"
        time_us = imu.time_us if px4 else now_us
        if number == HIGHRES_IMU:
            celsius, flags = self._read_barometer(imu.temperature_c + 3.0)
            values = (*imu.force.tolist(), *rate, 0, 0, 0, 1013.0, 0, 0, celsius, flags, 0)
            self._send(self._mavlink.MAVLink_highres_imu_message(time_us, *values))
            return
        # A float converted to an integer is truncated toward zero.
        forces = [_int16(1000 * component / STANDARD_GRAVITY_M_S2) for component in imu.force]
        rates = [_int16(1000 * component) for component in rate]
        centi = (_int16(100 * imu.temperature_c) or 1) if self._provides_temperature else 0
        if number == RAW_IMU:
            message = self._mavlink.MAVLink_raw_imu_message(time_us, *forces, *rates, 0, 0, 0, 0, centi)
        else:
            kind = self._mavlink.mavlink_map[number]
            message = kind(time_us // 1000 % 2**32, *forces, *rates, 0, 0, 0, centi)
        self._send(message)

    def _read_barometer(self, celsius: float) -> tuple[float, int]:
        """Return the temperature, °C, and the flags of updated fields.

        PX4 flags the temperature as updated only after a reading of the barometer, ArduPilot in every message.
        """
        if not self._provides_temperature:
            return 0.0, SENSORS_UPDATED
        own_s = self._steps / RATE_HZ
        new = self._firmware == "ardupilot" or own_s >= self._next_pressure_s
        if new:
            self._next_pressure_s = own_s + BAROMETER_S
        return celsius, SENSORS_UPDATED | TEMPERATURE_UPDATED * new

    def _send(self, message: Any) -> None:
        data = self._pack_first_version(message) if self._first_version else message.pack(self._out)
        self._out.seq = (self._out.seq + 1) % 256
        if self.faults.lost and self._random.random() < self.faults.lost:
            return
        self._sent += data
        if self.faults.doubled and self._random.random() < self.faults.doubled:
            self._sent += data

    def _pack_first_version(self, message: Any) -> bytes:
        """Return a message in MAVLink 1, whose payload ends before the fields that version 2 added."""
        size = self._sizes[message.get_msgId()].unpacker.size
        begin, length, *rest = message.pack(self._out, force_mavlink1=True)[: HEAD_BYTES + size]
        checked = bytes([min(length, size), *rest])
        crc = self._mavlink.x25crc(checked)
        crc.accumulate(bytes([message.crc_extra]))
        return bytes([begin]) + checked + int(crc.crc).to_bytes(2, "little")

    # -- receiving ---------------------------------------------------------------------------------------------------
    def _obey(self, message: Any) -> None:
        """Carry out a message from the client: read or set parameters, or a command."""
        match message.get_type():
            case "PARAM_REQUEST_READ" if message.param_index < 0:
                self._send_parameter(message.param_id)
            case "PARAM_REQUEST_LIST":
                for name in self.parameters.names:
                    self._send_parameter(name)
            case "PARAM_SET" if message.param_id in self.parameters:
                field = _read_field(message)
                self.parameters.set_field(message.param_id, field)
                self._send_parameter(message.param_id)
            case "COMMAND_LONG":
                result = self._command(message)
                self._send(self._mavlink.MAVLink_command_ack_message(message.command, result))

    def _send_parameter(self, name: str) -> None:
        """Send a parameter. Both firmwares ignore requests for an unknown one."""
        if name not in self.parameters:
            return
        names = self.parameters.names
        number = np.frombuffer(self.parameters.field(name), "<f4")[0]
        kind, index = self.parameters.types[name], names.index(name)
        message = self._mavlink.MAVLink_param_value_message(name.encode(), float(number), kind, len(names), index)
        self._send(message)

    def _command(self, message: Any) -> int:
        """Carry out a command that asks for the version or one message, or sets an interval; return its result code."""
        if message.command == REQUEST_MESSAGE and int(message.param1) == AUTOPILOT_VERSION:
            uid = list(self._uid.ljust(18, b"\0"))
            version, zeros = VERSIONS[self._firmware], [0] * 8
            self._send(
                self._mavlink.MAVLink_autopilot_version_message(0, version, 0, 0, 0, zeros, zeros, zeros, 0, 0, 0, uid)
            )
            return ACCEPTED
        if message.command not in (SET_MESSAGE_INTERVAL, REQUEST_MESSAGE):
            return UNSUPPORTED
        number, interval_us = int(message.param1), message.param2
        if number not in IMU_INDEX or IMU_INDEX[number] >= len(self._imus) or isnan(interval_us):
            return DENIED
        if number == RAW_IMU and self._firmware == "px4":
            return DENIED
        if message.command == REQUEST_MESSAGE:
            self._send_imu(number, round((self._on_for_s + self._steps / RATE_HZ) * 1e6))
        elif interval_us <= 0:  # a disabled message, or the default, which is also disabled
            self._intervals_s.pop(number, None)
        else:
            self._intervals_s[number] = max(1e-6 * interval_us, MIN_INTERVAL_S)
            self._next_s[number] = self._steps / RATE_HZ
        return ACCEPTED


def _int16(value: float) -> int:
    return int(np.clip(value, -32768, 32767))


def _read_field(message: Any) -> bytes:
    """Return the four bytes of the value in a PARAM_SET."""
    frame = bytes(message.get_msgbuf())
    begin = 10 if frame[0] == 0xFD else 6
    return frame[begin : begin + 4]
