"""Sections of `world:` about magnetism: the arm's iron, and the errors of a simulated magnetometer."""

from typing import Annotated, Literal

from pydantic import Field

from rig.config.section import RATIO, Section, Vector3

NO_FIELD: Vector3 = (0.0, 0.0, 0.0)


class IronSection(Section):
    """A magnetic dipole that stands for iron, a motor or a brake of the arm, under a name of your choice."""

    carried_by: Literal["base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"] = Field(
        description="the link it is fixed to and moves with, by the joint that carries that; the housing of joint "
        "wrist 3 is carried by `wrist_2`, the flange by `wrist_3`"
    )
    position_mm: Vector3 = Field(
        default=NO_FIELD, description="position in the frame of that link (Denavit and Hartenberg)"
    )
    moment_a_m2: Vector3 = Field(description="magnetic moment, in that frame")


RowLengths = Annotated[
    Vector3,
    Field(
        description="scale factor of each axis: 1 divided by the length of a row of F",
        json_schema_extra=RATIO,
    ),
]
NonOrthogonality = Annotated[
    Vector3, Field(description="deviation from 90° of the angles between its axes x y, x z, y z")
]
MountingError = Annotated[
    Vector3, Field(description="rotation of the sensor from its nominal mounting, as a rotation vector")
]


class SimulatedFieldSection(Section):
    """The truth of one simulated magnetometer: m = F B + b, with the magnetic field B at its position."""

    scale: RowLengths = (1.0, 1.0, 1.0)
    bias_ut: Vector3 = Field(
        default=NO_FIELD,
        description="bias b of each axis, part of the reading: the sensor's own, and that of iron that turns with it",
    )
    noise_ut: float = Field(default=0.3, ge=0, description="standard deviation of a sample's noise")
    non_orthogonality_deg: NonOrthogonality = NO_FIELD


class SimulatedMagnetometerSection(SimulatedFieldSection):
    """A simulated magnetometer on the board."""

    mounting_error_deg: MountingError = NO_FIELD
    offset_mm: Vector3 | None = Field(
        default=None,
        description="position of the sensor, x y z from the flange's centre in the flange's frame; if left out, the "
        "end of `arm.extension_mm`",
    )
