"""The section of one stage of a procedure: the item's mounting, and the sweeps."""

from typing import Annotated, Literal

import numpy as np
from pydantic import Field, field_validator

from rig.config.section import Section, Vector3
from rig.config.sensors.sensor_sections import MountingSection, mounting_matrix

Wrist = Literal["wrist_1", "wrist_2", "wrist_3"]
Instruction = Annotated[str, Field(min_length=1, max_length=500)]


class StageMountSection(MountingSection):
    """The flange axis along which each axis of the item points in this stage; they form a right-handed frame."""

    rotation_deg: Vector3 = Field(
        default=(0.0, 0.0, 0.0),
        description="rotation vector, in the item's own axes, of a further rotation",
    )


class StageSection(Section):
    """One stage: the operator mounts the item as stated, then its sweeps are made and recorded."""

    instruction: Instruction = Field(
        description="what the operator is to do before this stage, such as `turn the board by 90° about wrist 3`"
    )
    sweeps: tuple[Wrist, ...] | None = Field(
        default=None, min_length=1, max_length=3, description="which wrists are swept in this stage; if left out, all"
    )
    mount: StageMountSection = Field(
        default=StageMountSection(), description="how the item is mounted in this stage, nominally"
    )

    @field_validator("sweeps")
    @classmethod
    def refuse_repeated_wrists(cls, value: tuple[Wrist, ...] | None) -> tuple[Wrist, ...] | None:
        """Refuse a wrist that is listed twice."""
        if value is not None and len(set(value)) < len(value):
            raise ValueError("must name each wrist once; procedure.repeats says how often everything is done")
        return value


def mount_matrix(mount: StageMountSection) -> np.ndarray:
    """Return the rotation (3, 3) from the flange's frame to the item's: row i is the item's axis i.

    `mount` states the axes of the item, then a further rotation of the item by `rotation_deg`. Rotating the item by R
    transforms the components of a fixed vector by Rᵀ.
    """
    matrix: np.ndarray = rotation_by(np.radians(mount.rotation_deg)).T @ mounting_matrix(mount)
    return matrix


def rotation_by(vector_rad: np.ndarray) -> np.ndarray:
    """Return the matrix (3, 3) that rotates a vector by the rotation vector (3,) in rad: Rodrigues' formula."""
    angle = float(np.linalg.norm(vector_rad))
    x, y, z = vector_rad
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: np.ndarray = (
        np.eye(3) + np.sinc(angle / np.pi) * cross + np.sinc(angle / 2 / np.pi) ** 2 / 2 * cross @ cross
    )
    return turned
