"""The properties of turners as data: each model of arm has a file in `models/`, with the sources of its figures."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from math import inf, pi, radians
from typing import TYPE_CHECKING, Any, Literal

from rig.config.ranges import ModelName
from rig.motion.chain import DenavitHartenberg
from rig.motion.turner_state import JointLimits, Joints

if TYPE_CHECKING:
    from rig.config.models import ArmSection

Series = Literal["e-Series", "CB3"]
CLIENT_SPEED_RAD_S = 3.14  # the highest speed that `ur_rtde` accepts, slightly below 180°/s


@dataclass(frozen=True, slots=True)
class Tube:
    """A link of the radius `radius_m`, whose middle is `offset_m` from the link's nominal line, towards wrist 1."""

    offset_m: float
    radius_m: float


@dataclass(frozen=True, slots=True, eq=False)  # each model is loaded once
class TurnerModel:
    """A model of arm: geometry, joint limits, payload, thickness. SI units.

    - `robot_type`: the number that the controller reports, which several models may have in common.
    - `sweep_room_m`, `dwell_room_m`: clearances between a link's surface and the middle of the load.
    - `home_rad`: the default home pose; `sources`: the sources of the figures.
    """

    key: str
    name: str
    maker: str
    series: Series
    robot_type: int
    joints: tuple[str, ...]
    nominal: DenavitHartenberg
    limits: JointLimits
    payload_kg: float
    forearm: Tube
    upper_arm: Tube
    sweep_room_m: float
    dwell_room_m: float
    state_rate_hz: float
    home_rad: Joints
    sources: Mapping[str, str]


@lru_cache
def load_turner_model(key: ModelName) -> TurnerModel:
    """Return the model that a configuration calls `key`. Raise FileNotFoundError for an unknown model."""
    import yaml  # imported here: the process of the arm's client must start fast and needs no model

    text = files("rig.motion").joinpath("models", f"{key}.yaml").read_text(encoding="utf-8")
    row: dict[str, Any] = yaml.safe_load(text)
    joints = tuple(row["joints"])
    greatest = tuple(inf if joint in row["endless"] else radians(row["range_deg"]) for joint in joints)
    return TurnerModel(
        key=key,
        name=row["name"],
        maker=row["maker"],
        series=row["series"],
        robot_type=row["robot_type"],
        joints=joints,
        nominal=DenavitHartenberg(
            theta_rad=(0.0,) * len(joints),
            a_m=tuple(row["a_m"]),
            d_m=tuple(row["d_m"]),
            alpha_rad=tuple(quarters * pi / 2 for quarters in row["alpha_quarters"]),
        ),
        limits=JointLimits(
            least_rad=tuple(-angle for angle in greatest),
            greatest_rad=greatest,
            speed_rad_s=tuple(min(radians(speed), CLIENT_SPEED_RAD_S) for speed in row["speed_deg_s"]),
            acceleration_rad_s2=(radians(row["acceleration_deg_s2"]),) * len(joints),
        ),
        payload_kg=row["payload_kg"],
        forearm=Tube(**row["forearm"]),
        upper_arm=Tube(**row["upper_arm"]),
        sweep_room_m=row["room_m"]["sweep"],
        dwell_room_m=row["room_m"]["dwell"],
        state_rate_hz=row["state_rate_hz"],
        home_rad=tuple(radians(angle) for angle in row["home_deg"]),
        sources=row["sources"],
    )


def model_of(arm: "ArmSection") -> TurnerModel:
    """Return the model of an arm according to its configuration."""
    return load_turner_model(arm.model)


def find_home(arm: "ArmSection") -> Joints:
    """Return the home pose (n,), rad: the configured one, else the model's."""
    return model_of(arm).home_rad if arm.home_deg is None else tuple(radians(angle) for angle in arm.home_deg)
