"""The controller's description of its arm and tool frame, from the primary interface, port 30001. Receives only.

Every UR is measured in the factory, and its controller uses the result.

Source: the maker's client interface description for PolyScope 5. A package is a big-endian size (i32), a type (u8) and
a payload. A robot state (type 16) contains sub-packages of the same form. Two are sent once, after connecting:
KinematicsInfo (type 5), the factory's measurement of this arm, and Configuration Data (type 6), the arm for which the
controller is set up. Cartesian Info (type 4) comes in every state: the tool centre point's pose in the base's frame and
in the flange's. A robot message (type 20) holds a time stamp, a source and its kind. The version message (kind 3) is
sent once, after connecting.
"""

import socket
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import isnan

from rig.errors.quoting import printable
from rig.motion.chain import DenavitHartenberg, Pose
from rig.motion.turner_state import JointLimits
from rig.turners.ur.arm_report import ArmSetup

PORT = 30001
HEADER = struct.Struct(">iB")
ROBOT_STATE, CARTESIAN_INFO, KINEMATICS_INFO, CONFIGURATION_DATA = 16, 4, 5, 6
ROBOT_MESSAGE, VERSION_MESSAGE = 20, 3
MESSAGE = struct.Struct(">QbB")  # time stamp, source, kind
VERSION = struct.Struct(">BBii")  # major, minor, bugfix, build; between the project's name and the date
KINEMATICS = struct.Struct(">6I 6d 6d 6d 6d I".replace(" ", ""))  # checksums; θ, a, d, α; quality of the calibration
CARTESIAN = struct.Struct(">6d 6d".replace(" ", ""))  # the tool centre point in the base's frame, and in the flange's
# Per joint: least and greatest angle; speed and acceleration; then defaults; a, d, α, θ; boards, type, sub-type.
CONFIGURATION = struct.Struct(">12d 12d 5d 6d 6d 6d 6d 4i".replace(" ", ""))
MAX_SIZE = 1 << 20  # a robot state has some 1500 bytes
MAX_VALUE = 1e4  # m or rad: a calibration of almost parallel axes has lengths of some hundred metres


@dataclass(frozen=True, slots=True)
class ArmDescription:
    """The arm's geometry, its tool centre point in the flange's frame, its setup, and the controller's software.

    An item that the controller has not sent is None.
    """

    kinematics: DenavitHartenberg | None = None
    tcp_offset: Pose | None = None
    setup: ArmSetup | None = None
    software: str | None = None

    @property
    def complete(self) -> bool:
        """Whether all expected items have come. The version of the software, if sent at all, comes before these."""
        return None not in (self.kinematics, self.tcp_offset, self.setup)


def read_description(host: str, timeout_s: float) -> ArmDescription:
    """Return the description that the controller at `host` sends within `timeout_s`. Raise `OSError`."""
    deadline_s, buffer, description = time.monotonic() + timeout_s, bytearray(), ArmDescription()
    with socket.create_connection((host, PORT), timeout_s) as connection:
        while not description.complete and (remaining_s := deadline_s - time.monotonic()) > 0:
            connection.settimeout(remaining_s)
            try:
                data = connection.recv(65536)
            except TimeoutError:
                break
            if not data:
                break
            buffer += data
            for kind, payload in packages(buffer):
                if kind == ROBOT_STATE:
                    description = _add_state(description, payload)
                elif kind == ROBOT_MESSAGE and (software := _software(payload)):
                    description = replace(description, software=software)
    return description


def _add_state(description: ArmDescription, state: bytes) -> ArmDescription:
    """Return the description with the valid sub-packages of a robot state added."""
    for kind, payload in packages(bytearray(state)):
        if kind == KINEMATICS_INFO and (values := _numbers(KINEMATICS, payload)[6:30]):
            kinematics = DenavitHartenberg(values[:6], values[6:12], values[12:18], values[18:])
            description = replace(description, kinematics=kinematics)
        elif kind == CARTESIAN_INFO and (values := _numbers(CARTESIAN, payload)[6:]):
            description = replace(description, tcp_offset=values)
        elif kind == CONFIGURATION_DATA and (setup := _setup(payload)):
            description = replace(description, setup=setup)
    return description


def _setup(payload: bytes) -> ArmSetup | None:
    """Decode a package of configuration data; return None if it is too short or its values are impossible."""
    if len(payload) < CONFIGURATION.size:
        return None
    values = CONFIGURATION.unpack_from(payload)
    limits, nominal, robot_type = values[:24], values[29:53], values[55]
    if any(map(isnan, limits)) or not all(abs(length) <= MAX_VALUE for length in nominal):
        return None
    least, greatest = limits[0:12:2], limits[1:12:2]
    speed, acceleration = limits[12::2], limits[13::2]
    a, d, alpha, theta = (nominal[first : first + 6] for first in (0, 6, 12, 18))
    return ArmSetup(
        robot_type, DenavitHartenberg(theta, a, d, alpha), JointLimits(least, greatest, speed, acceleration)
    )


def _software(message: bytes) -> str | None:
    """Return name, version and date of a version message in the dashboard's form; None for any other message."""
    if len(message) <= MESSAGE.size or MESSAGE.unpack_from(message)[2] != VERSION_MESSAGE:
        return None
    name_end = MESSAGE.size + 1 + message[MESSAGE.size]
    if len(message) < name_end + VERSION.size:
        return None
    name, date = message[MESSAGE.size + 1 : name_end], message[name_end + VERSION.size :]
    version = ".".join(map(str, VERSION.unpack_from(message, name_end)))
    return printable(f"{name.decode(errors='replace')} {version} ({date.decode(errors='replace').strip()})")


def _numbers(layout: struct.Struct, payload: bytes) -> tuple[float, ...]:
    """Decode the numbers of a payload; return an empty tuple if it is too short or a value is impossible."""
    values = layout.unpack_from(payload) if len(payload) >= layout.size else ()
    return values if all(isinstance(value, int) or abs(value) <= MAX_VALUE for value in values) else ()


def packages(buffer: bytearray) -> Iterator[tuple[int, bytes]]:
    """Yield type and payload of complete packages, and remove these from the start of `buffer`.

    Raise `ConnectionError` for bytes that are no package.
    """
    while len(buffer) >= HEADER.size:
        size, kind = HEADER.unpack_from(buffer)
        if not HEADER.size <= size <= MAX_SIZE:
            raise ConnectionError("this is not a primary interface")
        if len(buffer) < size:
            return
        payload = bytes(buffer[HEADER.size : size])
        del buffer[:size]
        yield kind, payload
