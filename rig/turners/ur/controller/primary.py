"""What the controller says of its arm and of its tool's frame: primary interface, port 30001. Receives only.

Every UR is measured in the factory, and its controller reckons with what was found. (Client interface description of
the maker for PolyScope 5: packages of a big-endian size, i32, a type, u8, and a payload; a robot state, type 16, holds
sub-packages of the same form. Of these KinematicsInfo, type 5, and Configuration Data, type 6, are sent once after
connecting: how the factory measured this arm, and for which arm the controller is set up; Cartesian Info, type 4, in
every state: the tool centre point's pose, and where it stands in the flange's frame. A robot message, type 20, holds a
time stamp, a source and its kind; the version message, kind 3, is sent once after connecting.)
"""

import socket
import struct
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import isnan

from rig.errors.quoting import printable
from rig.motion.geometry import DenavitHartenberg, Pose
from rig.motion.state import JointLimits
from rig.turners.ur.report import ArmSetup

PORT = 30001
HEADER = struct.Struct(">iB")
ROBOT_STATE, CARTESIAN_INFO, KINEMATICS_INFO, CONFIGURATION_DATA = 16, 4, 5, 6
ROBOT_MESSAGE, VERSION_MESSAGE = 20, 3
MESSAGE = struct.Struct(">QbB")  # time stamp, source, kind
VERSION = struct.Struct(">BBii")  # major, minor, bugfix, build; the project's name comes before, the date after
KINEMATICS = struct.Struct(">6I 6d 6d 6d 6d I".replace(" ", ""))  # checksums; θ, a, d, α; how well it was calibrated
CARTESIAN = struct.Struct(">6d 6d".replace(" ", ""))  # the tool centre point in the base's frame, and in the flange's
# Of each joint least and greatest angle; of each speed and acceleration; defaults; a, d, α, θ; boards, type, sub-type.
CONFIGURATION = struct.Struct(">12d 12d 5d 6d 6d 6d 6d 4i".replace(" ", ""))
SIZE_MAX = 1 << 20  # a robot state has some 1500 bytes
VALUE_MAX = 1e4  # m or rad: axes that are almost parallel meet some hundred metres away, which stands in a calibration


@dataclass(frozen=True, slots=True)
class Account:
    """The arm's geometry, where its tool centre point stands in the flange's frame, and which arm it is.

    `software` is the controller's, in its own words. None where it is not told.
    """

    kinematics: DenavitHartenberg | None = None
    tcp_offset: Pose | None = None
    setup: ArmSetup | None = None
    software: str | None = None

    @property
    def complete(self) -> bool:
        """Whether all is told that a look waits for; the software is told before it, or never."""
        return None not in (self.kinematics, self.tcp_offset, self.setup)


def read_account(host: str, timeout_s: float) -> Account:
    """What the controller at `host` tells within `timeout_s`. Raises `OSError`."""
    deadline_s, buffer, account = time.monotonic() + timeout_s, bytearray(), Account()
    with socket.create_connection((host, PORT), timeout_s) as connection:
        while not account.complete and (left_s := deadline_s - time.monotonic()) > 0:
            connection.settimeout(left_s)
            try:
                data = connection.recv(65536)
            except TimeoutError:
                break
            if not data:
                break
            buffer += data
            for kind, payload in packages(buffer):
                if kind == ROBOT_STATE:
                    account = _completed(account, payload)
                elif kind == ROBOT_MESSAGE and (software := _software(payload)):
                    account = replace(account, software=software)
    return account


def _completed(account: Account, state: bytes) -> Account:
    """The account with what a robot state says, as far as it can be so."""
    for kind, payload in packages(bytearray(state)):
        if kind == KINEMATICS_INFO and (values := _numbers(KINEMATICS, payload)[6:30]):
            told = DenavitHartenberg(values[:6], values[6:12], values[12:18], values[18:])
            account = replace(account, kinematics=told)
        elif kind == CARTESIAN_INFO and (values := _numbers(CARTESIAN, payload)[6:]):
            account = replace(account, tcp_offset=values)
        elif kind == CONFIGURATION_DATA and (setup := _setup(payload)):
            account = replace(account, setup=setup)
    return account


def _setup(payload: bytes) -> ArmSetup | None:
    """The setup in a package of configuration data; None where it is too short, or no arm is made so."""
    if len(payload) < CONFIGURATION.size:
        return None
    values = CONFIGURATION.unpack_from(payload)
    limits, drawing, robot_type = values[:24], values[29:53], values[55]
    if any(map(isnan, limits)) or not all(abs(each) <= VALUE_MAX for each in drawing):
        return None
    least, greatest = limits[0:12:2], limits[1:12:2]
    speed, acceleration = limits[12::2], limits[13::2]
    a, d, alpha, theta = (drawing[first : first + 6] for first in (0, 6, 12, 18))
    return ArmSetup(
        robot_type, DenavitHartenberg(theta, a, d, alpha), JointLimits(least, greatest, speed, acceleration)
    )


def _software(message: bytes) -> str | None:
    """Name, version and date in a version message, as a dashboard says them; None for any other message."""
    if len(message) <= MESSAGE.size or MESSAGE.unpack_from(message)[2] != VERSION_MESSAGE:
        return None
    name_end = MESSAGE.size + 1 + message[MESSAGE.size]
    if len(message) < name_end + VERSION.size:
        return None
    name, date = message[MESSAGE.size + 1 : name_end], message[name_end + VERSION.size :]
    version = ".".join(map(str, VERSION.unpack_from(message, name_end)))
    return printable(f"{name.decode(errors='replace')} {version} ({date.decode(errors='replace').strip()})")


def _numbers(layout: struct.Struct, payload: bytes) -> tuple[float, ...]:
    """The numbers of a payload, whole ones first; none when it is too short for them, or no arm is made so."""
    values = layout.unpack_from(payload) if len(payload) >= layout.size else ()
    return values if all(isinstance(each, int) or abs(each) <= VALUE_MAX for each in values) else ()


def packages(buffer: bytearray) -> Iterator[tuple[int, bytes]]:
    """The whole packages at the beginning of the bytes, taken from them. Raises `ConnectionError` for other bytes."""
    while len(buffer) >= HEADER.size:
        size, kind = HEADER.unpack_from(buffer)
        if not HEADER.size <= size <= SIZE_MAX:
            raise ConnectionError("this is no primary interface")
        if len(buffer) < size:
            return
        payload = bytes(buffer[HEADER.size : size])
        del buffer[:size]
        yield kind, payload
