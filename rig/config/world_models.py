"""The `world:` section: what the simulated laboratory simulates. Only the world uses the values given here."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from rig.config.models import RATIO, Section, SensorName, Vector3

Cycles = Annotated[int, Field(ge=1, le=200)]


class SimulatedArmSection(Section):
    """The simulated UR10e. Its ripple is locked to the joint angle: it integrates to nothing over whole turns."""

    serial_number: str = Field(
        default="20265500123",
        pattern=r"^[0-9]+$",
        max_length=24,
        description="what the controller says its number is",
        json_schema_extra={"allowed": "at most 24 digits"},
    )
    polyscope: str = Field(
        default="5.14.0.0",
        pattern=r"^[0-9]{1,5}\.[0-9]{1,5}\.[0-9]{1,5}\.[0-9]{1,5}$",
        description="version of the controller's software",
        json_schema_extra={"allowed": "four numbers with dots between them"},
    )
    remote_control: bool = Field(default=True, description="whether the pendant is switched to remote control")
    speed_slider: float = Field(
        default=1.0, gt=0, le=1, description="the pendant's speed slider, as a fraction", json_schema_extra=RATIO
    )
    vibration_fraction: float = Field(
        default=0.05, ge=0, lt=0.5, description="RMS of the rate's ripple over the rate", json_schema_extra=RATIO
    )
    vibration_cycles_per_turn: tuple[Cycles, ...] = Field(
        default=(18, 31, 50), max_length=100, description="how often each part of the ripple comes in one turn"
    )
    encoder_step_rad: float = Field(default=6.0e-6, ge=0, le=1, description="resolution of the joint angles it reports")


class SimulatedBoardSection(Section):
    """The emulated board: its crystal, its memory and its moment of power-up."""

    unique_id: str = Field(
        default="0123456789abcdef01234567",
        pattern=r"^[0-9a-f]{24}$",
        description="the microcontroller's own number",
        json_schema_extra={"allowed": "24 hexadecimal digits, small letters"},
    )
    crystal_ppm: float = Field(
        default=35.0,
        ge=-25_000,
        le=25_000,
        description="how much too fast its clock runs; without its crystal up to 2 % off",
    )
    boot_time_s: float = Field(default=0.137, ge=0, le=10, description="how long after it gets power the board starts")
    flash_file: Path | None = Field(
        default=None,
        description="file that keeps the board's flash from one run to the next; without it, it is fresh each time",
    )
    pty: bool = Field(default=False, description="also offer the serial port as a pseudo-terminal (POSIX)")


class SimulatedSensorSection(Section):
    """The truth of one simulated gyroscope, in the model g = K (m + b)."""

    scale: Vector3 = Field(description="scale factor of each axis, the diagonal of K", json_schema_extra=RATIO)
    bias_rad_s: Vector3 = Field(description="bias b of each axis")
    noise_rad_s: float = Field(default=0.035, ge=0, description="standard deviation of a sample's noise")
    mounting_error_deg: Vector3 = Field(
        default=(0.0, 0.0, 0.0), description="rotation vector by which it sits off its nominal mounting"
    )
    non_orthogonality_deg: Vector3 = Field(
        default=(0.0, 0.0, 0.0), description="by how much the angles between its axes x y, x z, y z are off 90°"
    )
    temperature_c: float = Field(default=22.0, ge=-40, le=85, description="what its thermometer says")


class WorldSection(Section):
    """The simulated laboratory."""

    seed: int = Field(
        default=1, ge=0, description="of all that is random: the same seed, the same run", json_schema_extra=RATIO
    )
    time_scale: float = Field(
        default=1.0, gt=0, description="at most so many simulated seconds in a second", json_schema_extra=RATIO
    )
    control_port: int = Field(
        default=7322, ge=1, le=65535, description="TCP port on which tests cause faults", json_schema_extra=RATIO
    )
    arm: SimulatedArmSection = SimulatedArmSection()
    board: SimulatedBoardSection = SimulatedBoardSection()
    sensors: dict[SensorName, SimulatedSensorSection] = Field(min_length=1)
