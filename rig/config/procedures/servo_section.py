"""The `turner:` section of a servo: one shaft, on a serial line."""

from collections.abc import Mapping
from typing import Literal
from urllib.parse import urlsplit

from pydantic import Field

from rig.config.models import TurnerSection
from rig.config.ranges import PAYLOAD_RANGE_KG
from rig.config.section import JointAngle, Offset, Port, WholeNumber

ServoName = Literal["xl430_w250", "xm430_w350", "xm430_w210"]
MAX_SPEED_DEG_S = 460.0  # of the fastest servo without load


class ServoSection(TurnerSection):
    """The Dynamixel X servo on whose shaft the item turns."""

    port: Port = Field(
        min_length=1,
        max_length=255,
        description="serial port of the servo's adapter, such as `/dev/ttyUSB0` or `COM4`, or `socket://host:port`",
    )
    id: WholeNumber = Field(default=1, ge=0, le=252, description="the servo's ID on its bus")
    model: ServoName = Field(description="model of the servo; the servo must report the same")
    baud: Literal[57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000] = Field(
        default=1_000_000, description="speed of its serial line, as set in the servo"
    )
    payload_kg: float = Field(
        ge=0, le=PAYLOAD_RANGE_KG, description="mass of all that the shaft carries: adapter, board, cable"
    )
    payload_centre_mm: tuple[Offset, Offset, Offset] = Field(
        default=(0.0, 0.0, 0.0),
        description="centre of mass of all this: x and y from the shaft's axis, z along the shaft from its horn",
    )
    home_deg: JointAngle = Field(
        default=180.0, description="angle of the shaft, by the servo's encoder, around which the sweeps turn"
    )
    transfer_speed_deg_s: float = Field(
        default=60.0, ge=1, le=MAX_SPEED_DEG_S, description="speed of the movements between sweeps"
    )
    state_rate_hz: float = Field(
        default=125.0, ge=100, le=250, description="how many times a second the shaft's angle is read"
    )
    watchdog_s: float = Field(
        default=0.3, ge=0.1, le=2.0, description="the servo stops by itself if it receives nothing for this long"
    )

    @property
    def address(self) -> str:
        """The servo's port."""
        return self.port

    @property
    def address_key(self) -> str:
        """The key in this section whose value is the address."""
        return "port"

    @property
    def simulated_at(self) -> str | None:
        """The host of its port; None for a serial port, which cannot be simulated."""
        return urlsplit(self.port).hostname if self.port.startswith("socket://") else None

    def override_host(self, host: str) -> Mapping[str, str]:
        """Return the key of the servo's port with a new value: the same port number at another `host`."""
        return {"port": f"socket://{host}:{urlsplit(self.port).port}"}
