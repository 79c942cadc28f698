"""Sections of the simulated arm's joints: their motion and encoders, as measured on real arms, rough, or ideal.

docs/simulated-arm.md names the source of each figure.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal

from pydantic import Field

from rig.config.section import Ratio, Section

JointsKind = Literal["measured", "rough", "ideal"]
Cycles = Annotated[int, Field(ge=1, le=600)]
RippleRate = Annotated[float, Field(ge=0, le=0.1)]
RippleRates = tuple[RippleRate, RippleRate, RippleRate, RippleRate, RippleRate, RippleRate]
SECOND_SQUARED_UNIT: dict[str, Any] = {"unit": "s²"}


class DriveRippleSection(Section):
    """One order of the ripple of the joints' rates. Its size hardly depends on the speed."""

    cycles_per_turn: Cycles = Field(description="its number of periods in one turn of the joint")
    rms_rad_s: RippleRates = Field(
        description="its RMS in each joint, base first; below 0.1 rad/s it shrinks with the square of the speed"
    )


HARMONIC_DRIVE = (  # logs of a UR10e (dynamic_calibration, jointwise_motion), at the highest speeds in them
    DriveRippleSection(cycles_per_turn=100, rms_rad_s=(2.8e-3, 0.9e-3, 0.8e-3, 1.4e-3, 1.5e-3, 1.2e-3)),
    DriveRippleSection(cycles_per_turn=200, rms_rad_s=(1.5e-3, 2.0e-3, 2.8e-3, 2.7e-3, 2.0e-3, 1.8e-3)),
    DriveRippleSection(cycles_per_turn=400, rms_rad_s=(0.4e-3, 0.3e-3, 0.7e-3, 0.4e-3, 0.4e-3, 0.4e-3)),
)


class SimulatedDriveSection(Section):
    """The response of each joint to its target, as in public logs of real arms ([simulated arm](simulated-arm.md))."""

    ripple: tuple[DriveRippleSection, ...] = Field(default=HARMONIC_DRIVE, max_length=20)
    lag_s: float = Field(default=4.5e-4, ge=0, le=0.005, description="delay of a joint; 0.3 to 0.7 ms were measured")
    yield_s2: float = Field(
        default=1.5e-4,
        ge=0,
        le=0.01,
        description="lag of a joint per acceleration of its target. When a move ends with 1 rad/s², the joint recovers "
        "with 11 mrad/s; 10 to 13 were measured",
    )
    yield_time_s: float = Field(
        default=3.5e-3,
        gt=0,
        le=0.1,
        description="time constant of the recovery, critically damped; it was complete after 24 to 32 ms",
    )
    crosstalk: Ratio = Field(
        default=0.08,
        ge=0,
        le=1,
        description="fraction of its ripple by which a joint shakes its neighbours whose axes are parallel to its own; "
        "0.25 mrad/s RMS was measured in an elbow while wrist 1 turned, nothing in joints with other axes",
    )


# What a key of `world.arm` is if it is left out and `joints` is not `measured`.
_STIFF: dict[str, Any] = {"ripple": [], "lag_s": 0.0, "yield_s2": 0.0, "crosstalk": 0.0}
_READ_EXACTLY: dict[str, Any] = {"encoder_noise_rad": 0.0, "encoder_speed_noise_rad_s": 0.0}
KEYS_OF_KIND: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "measured": {},
        "rough": {"drive": _STIFF, **_READ_EXACTLY, "encoder_step_rad": 6.0e-6, "vibration_fraction": 0.05},
        "ideal": {"drive": _STIFF, **_READ_EXACTLY, "encoder_step_rad": 0.0},
    }
)


def fill_in_joints(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the keys of `world.arm`, with the defaults of its kind of joints filled in."""
    kind = data.get("joints", "measured")
    usual = KEYS_OF_KIND.get(kind, {}) if isinstance(kind, str) else {}
    drive = data.get("drive", {})
    if "drive" in usual and isinstance(drive, Mapping):
        return {**usual, **data, "drive": {**usual["drive"], **drive}}
    return {**usual, **data}
