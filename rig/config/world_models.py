"""The `world:` section: what the simulated laboratory simulates. Only the world reads the values given here."""

from pathlib import Path
from typing import Annotated

from pydantic import Field

from rig.config.models import Positive, Section, Vector3


class SimulatedArmSection(Section):
    """The simulated UR10e."""

    serial_number: Annotated[str, Field(pattern=r"^\d+$")] = "20265500123"
    polyscope: Annotated[str, Field(pattern=r"^\d+\.\d+\.\d+\.\d+$")] = "5.14.0.0"
    remote_control: bool = True
    speed_slider: Annotated[float, Field(gt=0, le=1)] = 1.0
    # A position ripple locked to the joint angle: it integrates to nothing over whole turns.
    vibration_fraction: Annotated[float, Field(ge=0, lt=0.5)] = 0.05  # RMS of the rate ripple over the rate
    vibration_cycles_per_turn: tuple[Annotated[int, Field(ge=1, le=200)], ...] = (18, 31, 50)
    encoder_step_rad: Annotated[float, Field(ge=0)] = 6.0e-6


class SimulatedBoardSection(Section):
    """The emulated board: its crystal and its moment of power-up."""

    unique_id: Annotated[str, Field(pattern=r"^[0-9a-f]{24}$")] = "0123456789abcdef01234567"
    crystal_ppm: Annotated[float, Field(ge=-25_000, le=25_000)] = 35.0  # without its crystal a board may be 2 % off
    boot_time_s: Annotated[float, Field(ge=0, le=10)] = 0.137
    flash_file: Path | None = None  # keeps the board's flash from one run to the next; fresh each time without
    pty: bool = False  # also offer the serial port as a pseudo-terminal (POSIX)


class SimulatedSensorSection(Section):
    """The truth of one simulated gyroscope, in the model g = K (m + b)."""

    scale: Vector3
    bias_rad_s: Vector3
    noise_rad_s: Annotated[float, Field(ge=0)] = 0.035  # per sample, standard deviation
    mounting_error_deg: Vector3 = (0.0, 0.0, 0.0)  # rotation vector on top of the nominal mounting
    non_orthogonality_deg: Vector3 = (0.0, 0.0, 0.0)  # xy, xz, yz
    temperature_c: Annotated[float, Field(ge=-40, le=85)] = 22.0


class WorldSection(Section):
    """The simulated laboratory."""

    seed: Annotated[int, Field(ge=0)] = 1
    time_scale: Positive = 1.0  # at most so many simulated seconds a second
    control_port: Annotated[int, Field(ge=1, le=65535)] = 7322
    arm: SimulatedArmSection = SimulatedArmSection()
    board: SimulatedBoardSection = SimulatedBoardSection()
    sensors: Annotated[dict[str, SimulatedSensorSection], Field(min_length=1)]
