"""What a configuration file may say.

Every quantity carries its unit in its key. Degrees live only here, at the edge; the rig works in SI units.
"""

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationInfo, field_validator, model_validator

from rig.config.link_budget import Stream, over_budget
from rig.config.sensor_catalogue import PARTS

Direction = Literal["cw", "ccw"]
AxisName = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Vector3 = tuple[float, float, float]
Vector6 = tuple[float, float, float, float, float, float]
Positive = Annotated[float, Field(gt=0)]
SERIAL_NUMBER_MAX = 24  # of the kind "text24" in the board's protocol


class Section(BaseModel):
    """A part of the file: unknown keys are refused, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ArmSection(Section):
    """The robot arm and what it carries."""

    host: str
    payload_kg: Annotated[float, Field(ge=0, le=12.5)]  # UR10e: 12.5 kg
    payload_centre_mm: Vector3 = (0.0, 0.0, 0.0)
    home_deg: Vector6 = (0.0, -90.0, 90.0, -90.0, -90.0, 0.0)
    transfer_speed_deg_s: Annotated[float, Field(gt=0, le=180)] = 120.0
    state_rate_hz: Annotated[float, Field(ge=125, le=500)] = 125.0


class BoardSection(Section):
    """The microcontroller board: a serial port name or `socket://host:port`."""

    port: str
    baud: Literal[115200, 230400, 460800, 921600] = 921600


def mounting_matrix(mounting: "MountingSection") -> np.ndarray:
    """(3, 3) rotation taking a flange-frame vector to the sensor's nominal frame: row i is sensor axis i."""
    axes = {"x": 0, "y": 1, "z": 2}
    rows = np.zeros((3, 3))
    for row, name in enumerate((mounting.x, mounting.y, mounting.z)):
        rows[row, axes[name[1]]] = 1.0 if name[0] == "+" else -1.0
    return rows


class MountingSection(Section):
    """Which flange axis each sensor axis points along, nominally; the solver does not need it to be exact."""

    x: AxisName = "+x"
    y: AxisName = "+y"
    z: AxisName = "+z"

    @model_validator(mode="after")
    def right_handed(self) -> Self:
        """A mirrored or doubled axis is not a mounting."""
        if not np.isclose(np.linalg.det(mounting_matrix(self)), 1.0):
            raise ValueError("must name three different axes that form a right-handed frame, for example +x, +y, +z")
        return self


class TurntableSection(Section):
    """A reference's own calibration, from a turntable: rate = scale · (reading + bias_rad_s)."""

    scale: tuple[Positive, Positive, Positive] = (1.0, 1.0, 1.0)
    bias_rad_s: Vector3 = (0.0, 0.0, 0.0)


class SensorSection(Section):
    """One gyroscope on the board. Left out, its data rate and range are the part's usual ones."""

    part: Literal["lsm9ds1", "mpu9250", "adis16465"]
    serial_number: str
    role: Literal["calibrate", "reference"] = "calibrate"
    rate_hz: float = Field(default=None, validate_default=True)
    range_deg_s: float = Field(default=None, validate_default=True)
    mounting: MountingSection = MountingSection()
    turntable: TurntableSection = TurntableSection()

    @field_validator("serial_number")
    @classmethod
    def the_board_can_keep_it(cls, value: str) -> str:
        """The board stores it beside the calibration, in a field of fixed width."""
        if not (value.isascii() and value.isprintable() and 0 < len(value) <= SERIAL_NUMBER_MAX):
            raise ValueError(f"must be 1 to {SERIAL_NUMBER_MAX} plain ASCII characters; the board keeps no others")
        return value

    @field_validator("rate_hz", "range_deg_s", mode="before")
    @classmethod
    def usual_of_the_part(cls, value: Any, info: ValidationInfo) -> Any:
        """What is left out depends on the part."""
        part = PARTS.get(info.data.get("part", ""))
        if value is not None or part is None:
            return 0.0 if value is None else value  # a part that is not known is an error of its own
        return part.default_rate_hz if info.field_name == "rate_hz" else part.default_range_deg_s

    @field_validator("rate_hz", "range_deg_s")
    @classmethod
    def the_part_has_it(cls, value: float, info: ValidationInfo) -> float:
        """Only what the part can do, and never silently something else."""
        part = PARTS.get(info.data.get("part", ""))
        if part is None:
            return value
        return part.accept_rate(value) if info.field_name == "rate_hz" else part.accept_range(value)

    @field_validator("turntable")
    @classmethod
    def only_of_a_reference(cls, value: TurntableSection, info: ValidationInfo) -> TurntableSection:
        """A sensor that is to be calibrated has no calibration yet."""
        if info.data.get("role") == "calibrate":
            raise ValueError("only a sensor with role: reference has one; a sensor to calibrate gets its own here")
        return value


class ProcedureSection(Section):
    """What every procedure's section has: its name. A procedure adds its own keys and says what else it needs."""

    name: str

    @property
    def then_verify(self) -> bool:
        """Whether a calibration that passed is stored on the board and verified by repeating the movement."""
        return False

    @property
    def needs_reference(self) -> bool:
        """Whether calibrated readings are compared with a reference's."""
        return self.then_verify

    def problems(self, config: "RigConfig") -> Iterable[str]:
        """What of the rest of the configuration does not fit this procedure, a line each."""
        return ()


class ObservationSection(Section):
    """What an averaged revolution must satisfy to be used."""

    max_lost_fraction: Annotated[float, Field(ge=0, lt=1)] = 0.001
    max_speed_deviation: Annotated[float, Field(gt=0, lt=1)] = (
        0.25  # of the joint's rate from its mean, smoothed over 50 ms
    )
    max_axis_deviation_deg: Annotated[float, Field(gt=0, lt=45)] = 20.0


class LimitsSection(Section):
    """The verdict's limits; a limit left out is a check that fails, so state all of them."""

    scale_deviation: Positive
    scale_std: Positive
    bias_rad_s: Positive
    bias_std_rad_s: Positive
    condition: Positive
    verification_rms_rad_s: Positive | None = None  # calibrated reading less the reference's, sample by sample
    verification_mean_rad_s: Positive | None = None  # the same, averaged over each revolution


class OutputSection(Section):
    """Where run folders go."""

    folder: str = "runs"


class RigConfig(Section):
    """Everything the rig reads. It has no knowledge of whether the far end is simulated."""

    arm: ArmSection
    board: BoardSection
    sensors: Annotated[dict[str, SensorSection], Field(min_length=1)]
    procedure: ProcedureSection
    observation: ObservationSection = ObservationSection()
    limits: LimitsSection
    output: OutputSection = OutputSection()

    @field_validator("sensors")
    @classmethod
    def sensors_fit_together(cls, sensors: dict[str, SensorSection]) -> dict[str, SensorSection]:
        """The board has one place for each part, and a calibration one reference at most."""
        places: dict[str, str] = {}
        for name, sensor in sensors.items():
            if sensor.part in places:
                raise ValueError(
                    f"{places[sensor.part]} and {name} are both {sensor.part}; the board has one place for each part"
                )
            places[sensor.part] = name
        references = [name for name, sensor in sensors.items() if sensor.role == "reference"]
        if len(references) > 1:
            raise ValueError(f"{' and '.join(references)} have role: reference; at most one sensor can")
        if len(references) == len(sensors):
            raise ValueError("at least one sensor must have role: calibrate")
        return sensors

    @field_validator("sensors")
    @classmethod
    def the_link_carries_them(cls, sensors: dict[str, SensorSection], info: ValidationInfo) -> dict[str, SensorSection]:
        """Rates for which the link is too slow would lose samples. Calibrated readings, the larger ones, must fit."""
        streams = {name: Stream(s.rate_hz, calibrated=s.role == "calibrate") for name, s in sensors.items()}
        problem = over_budget(streams, info.data["board"].baud) if "board" in info.data else None
        if problem is not None:
            raise ValueError(problem)
        return sensors

    @property
    def to_calibrate(self) -> Mapping[str, SensorSection]:
        """The sensors a calibration is for, by name."""
        return {name: sensor for name, sensor in self.sensors.items() if sensor.role == "calibrate"}

    @property
    def reference(self) -> tuple[str, SensorSection] | None:
        """The sensor whose calibration is known, with its name, if there is one."""
        return next(((name, s) for name, s in self.sensors.items() if s.role == "reference"), None)
