"""The section of a sensor that is an autopilot's IMU: the autopilot's port, and the IMU's number."""

from collections.abc import Mapping
from typing import Literal

from pydantic import Field, field_validator

from rig.config.section import Section, check_port
from rig.config.sensors.link_budget import BITS_PER_BYTE, HEADROOM, capacity_bytes_per_s
from rig.config.sensors.stated_temperature import StatedTemperatureSection

ImuMessage = Literal["HIGHRES_IMU", "RAW_IMU", "SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3"]
# Payload of the longest form in MAVLink 2 and the 12 bytes around it (mavlink.io, message definitions of `common`).
MESSAGE_BYTES: Mapping[str, int] = {
    "HIGHRES_IMU": 75,
    "RAW_IMU": 41,
    "SCALED_IMU": 36,
    "SCALED_IMU2": 36,
    "SCALED_IMU3": 36,
}
OTHER_BYTES_PER_S = 100  # heartbeats and answers
NETWORKS = ("udp", "tcp")


class MavlinkSection(Section):
    """An IMU of an autopilot (ArduPilot or PX4), which speaks MAVLink. Several at one port are read at once."""

    port: str = Field(
        min_length=1,
        max_length=255,
        description="where the autopilot answers: serial port, such as `/dev/ttyACM0` or `COM5`, or `tcp:host:port`, "
        "or `udp:host:port`, an address of this computer to which the autopilot sends",
    )
    baud: Literal[57600, 115200, 230400, 460800, 921600, 1500000] = Field(
        default=115200, description="speed of the line, as set in the autopilot; over USB any value works"
    )
    imu: ImuMessage = Field(
        default="HIGHRES_IMU",
        description="the message that holds the readings: `SCALED_IMU`, `SCALED_IMU2`, `SCALED_IMU3` of the first, "
        "second and third IMU, `RAW_IMU` of the first, all in steps of 1 mrad/s and 1 mg; `HIGHRES_IMU` without "
        "rounding, of the IMU that the autopilot has chosen, which must be its only one or its first",
    )
    uid: str | None = Field(
        default=None,
        pattern=r"^[0-9a-f]{8,36}$",
        description="the autopilot's own number, as `rig check` shows it; another autopilot is refused",
        json_schema_extra={"allowed": "8 to 36 hexadecimal digits, small letters"},
    )
    temperature: StatedTemperatureSection | None = Field(
        default=None, description="temperature of the IMU, stated if the autopilot provides none"
    )

    @field_validator("port")
    @classmethod
    def check_host_and_port(cls, value: str) -> str:
        """Refuse an invalid port; `udp:` and `tcp:` need an address."""
        kind, _, rest = value.partition(":")
        if kind in NETWORKS:
            check_port(f"socket://{rest}")
            return value
        return check_port(value)

    @property
    def instance(self) -> int:
        """The index of the IMU in the autopilot, from 0."""
        return {"SCALED_IMU2": 1, "SCALED_IMU3": 2}.get(self.imu, 0)

    @property
    def wired(self) -> bool:
        """Whether the port is a serial one, over which transfer takes time."""
        return not self.port.startswith(("udp:", "tcp:", "socket://"))


def autopilots_over_budget(sensors: Mapping[str, tuple[MavlinkSection | None, float]]) -> str | None:
    """Return the fault of a line with too much load, or of IMUs at one port with different speeds; else None."""
    imus_at: dict[str, list[tuple[str, MavlinkSection, float]]] = {}
    for name, (section, rate_hz) in sensors.items():
        if section is not None:
            imus_at.setdefault(section.port, []).append((name, section, rate_hz))
    for port, imus in imus_at.items():
        first = imus[0][1]
        if any((imu.baud, imu.uid) != (first.baud, first.uid) for _, imu, _ in imus):
            return f"the IMUs at {port} are in one autopilot: give the same baud and uid for all of them"
        needed = OTHER_BYTES_PER_S + sum(MESSAGE_BYTES[imu.imu] * rate_hz for _, imu, rate_hz in imus)
        if first.wired and needed > capacity_bytes_per_s(first.baud):
            terms = " + ".join(f"{name} {rate:g} Hz × {MESSAGE_BYTES[imu.imu]} bytes" for name, imu, rate in imus)
            return (
                f"the line to {port} cannot carry these rates: {terms} and {OTHER_BYTES_PER_S} for the rest = "
                f"{needed:g} bytes/s, but {first.baud} / {BITS_PER_BYTE} bits a byte less {HEADROOM:.0%} kept free = "
                f"{capacity_bytes_per_s(first.baud):.0f} bytes/s; lower rate_hz or raise mavlink.baud"
            )
    return None
