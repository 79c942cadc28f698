"""The sections by which a recording is judged and its result stated: thresholds, site, uncertainty."""

from datetime import date
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from rig.config.history_address import history_url
from rig.config.section import (
    RATIO,
    Positive,
    Section,
    Vector3,
    Words,
)

MIN_LEVEL = 0.1  # sine of the angle between the vertical and what a heading is given of


class ObservationSection(Section):
    """What an averaged revolution must satisfy to be used."""

    max_lost_fraction: float = Field(
        default=0.001, ge=0, lt=1, description="share of a sweep's samples that may be missing", json_schema_extra=RATIO
    )
    max_speed_deviation: float = Field(
        default=0.25,
        gt=0,
        lt=1,
        description="how far the joint's rate, smoothed over 50 ms, may lie from its mean, as a share of it",
        json_schema_extra=RATIO,
    )
    max_axis_deviation_deg: float = Field(
        default=20.0,
        gt=0,
        lt=45,
        description="how far the measured rotation may lie from the nominal axis of the sensor",
    )


class SiteSection(Section):
    """Where the arm stands. With latitude and heading the Earth's rate is taken out; the words are for certificates."""

    laboratory: Words | None = Field(default=None, description="the laboratory's name, for certificates")
    address: Words | None = Field(default=None, description="its address, in one line")
    country: Annotated[str, Field(pattern="^[A-Z]{2}$")] | None = Field(
        default=None,
        description="the country it is in, for digital certificates",
        json_schema_extra={"allowed": "two capital letters (ISO 3166-1)"},
    )
    place: Words | None = Field(
        default=None, description="where the arm stands: site, room; left out, a certificate does not state it"
    )
    time_reference: Words | None = Field(
        default=None,
        description="what disciplines this computer's clock, such as `NTP, ptbtime1.ptb.de`; without it a certificate "
        "calls no time traceable",
    )
    ambient_temperature_c: float | None = Field(default=None, ge=-50, le=100, description="of the air, as you measured")
    ambient_humidity_percent: float | None = Field(
        default=None, ge=0, le=100, description="relative, of the air", json_schema_extra={"unit": "%"}
    )
    latitude_deg: float | None = Field(
        default=None,
        ge=-90,
        le=90,
        description="north is positive; with heading_deg, or alone where the Earth's rate is found",
    )
    heading_deg: float | None = Field(
        default=None,
        ge=-360,
        le=360,
        description="where the x axis of the arm's base points: 0 north, 90 east; with latitude_deg",
    )
    gravity_m_s2: float = Field(
        default=9.80665, gt=9.7, lt=9.9, description="acceleration of free fall", json_schema_extra={"unit": "m/s²"}
    )
    gravity_uncertainty_m_s2: float | None = Field(
        default=None,
        gt=0,
        le=0.1,
        description="expanded uncertainty (k = 2) of gravity_m_s2; left out, a half-width of 0.0005 is taken, of "
        "0.03 where gravity_m_s2 is the standard value",
        json_schema_extra={"unit": "m/s²"},
    )
    magnetic_field_ut: float | None = Field(
        default=None,
        ge=1,
        le=1000,
        description="size of the magnetic field where the magnetometer stands, as a reference there measured it: its "
        "scale factors are relative to it; without it a magnetometer is recorded, not calibrated",
    )
    magnetic_field_uncertainty_ut: float | None = Field(
        default=None,
        gt=0,
        le=100,
        description="expanded uncertainty (k = 2) of magnetic_field_ut; left out, a half-width of 1 % is taken",
    )
    gravity_reference: Words | None = Field(
        default=None,
        description="where gravity_m_s2 comes from, such as a gravimeter with its certificate or a gravity map; for "
        "certificates",
    )
    magnetic_field_reference: Words | None = Field(
        default=None, description="with what magnetic_field_ut was measured; for certificates"
    )
    magnetic_field_upwards: bool = Field(
        default=False, description="whether that field rises from the ground, as it does south of the magnetic equator"
    )
    base_up: Vector3 = Field(
        default=(0.0, 0.0, 1.0),
        description="upwards in the frame of the arm's base; 0 0 −1 under a ceiling",
        json_schema_extra=RATIO,
    )

    @field_validator("base_up")
    @classmethod
    def a_direction(cls, value: Vector3) -> Vector3:
        """The direction that is up, of any length but zero."""
        if not np.linalg.norm(value) > 1e-6:
            raise ValueError("must be a direction, such as [0, 0, 1]")
        return value

    @model_validator(mode="after")
    def a_heading_has_a_latitude(self) -> Self:
        """The Earth's rate needs both where it is known."""
        if self.heading_deg is not None and self.latitude_deg is None:
            raise ValueError("needs latitude_deg and heading_deg, or neither")
        if self.heading_deg is not None and np.linalg.norm(np.cross(self.up, (1, 0, 0))) < MIN_LEVEL:
            raise ValueError("heading_deg says nothing where the x axis of the base points up or down")
        return self

    @property
    def up(self) -> Vector3:
        """Unit vector that points up, in the base's frame."""
        x, y, z = (np.array(self.base_up) / np.linalg.norm(self.base_up)).tolist()
        return x, y, z


class UncertaintySection(Section):
    """How far off may be what no recording shows. Half-widths: every value within is equally likely."""

    controller_clock_ppm: Positive = Field(
        default=50.0, description="the arm controller's clock, about which its maker says nothing"
    )
    computer_clock_ppm: Positive = Field(
        default=1.0, description="this computer's clock over a run, disciplined by a time server; 50 without one"
    )
    crystal_ppm: Positive = Field(default=20.0, description="the board's 32768 Hz crystal at room temperature")
    axis_deg: float = Field(
        default=0.06,
        ge=0,
        le=5,
        description="direction of each wrist's axis by the kinematics that are used: 1 mrad, as of calibrated arms of "
        "this size (Slamani, Nubiola and Bonev, 2012)",
    )
    repeatability_deg: float = Field(
        default=0.005,
        ge=0,
        le=5,
        description="how differently the arm stands when it comes back: 87 µrad, as of an arm of this size (Slamani, "
        "Nubiola and Bonev, 2012)",
    )
    sensor_offset_mm: float = Field(
        default=50.0,
        ge=0,
        le=1000,
        description="how far the sensor sits from the flange's centre, or from the end of `arm.extension_mm`, along "
        "each axis, either way",
    )
    acceleration_lag_ms: float = Field(
        default=5.0,
        ge=0,
        le=100,
        description="by how much an accelerometer's own filter may delay its readings: it makes the wave of a sweep "
        "smaller by half the square of what the arm turns in that time",
        json_schema_extra={"unit": "ms"},
    )
    g_sensitivity_deg_s_g: float | None = Field(
        default=None,
        ge=0,
        description="change of a reading for 1 g, where attitudes do not tell it; left out, what is known of the part",
        json_schema_extra={"unit": "°/s/g"},
    )
    nonlinearity_percent: float | None = Field(
        default=None,
        ge=0,
        description="how far a gyroscope may be off the best straight line, in per cent of full scale, by what is odd "
        "of its curve and by what is even of it, where not several speeds tell it; left out, what is known of the part",
        json_schema_extra={"unit": "%"},
    )
    asymmetry_percent: float | None = Field(
        default=None,
        ge=0,
        description="what is even of a gyroscope's curve, in per cent of full scale, that one scale factor for both "
        "ways may leave out: more of it fails `cw_against_ccw`; left out, what is known of the part",
        json_schema_extra={"unit": "%"},
    )
    bias_deg_s_k: float | None = Field(
        default=None,
        ge=0,
        description="change of a gyroscope's bias for 1 K; left out, what is known of the part",
        json_schema_extra={"unit": "°/s/K"},
    )
    scale_ppm_k: float | None = Field(
        default=None,
        ge=0,
        description="change of a gyroscope's scale factor for 1 K; left out, what is known of the part",
        json_schema_extra={"unit": "ppm/K"},
    )
    bias_instability_deg_h: float | None = Field(
        default=None,
        ge=0,
        description="the least Allan deviation of a gyroscope at rest, its in-run bias stability: by how much its bias "
        "wanders however long it is averaged; left out, what is known of the part",
        json_schema_extra={"unit": "°/h"},
    )
    non_orthogonality_deg: float | None = Field(
        default=None,
        ge=0,
        description="how far from 90° two axes of a gyroscope may stand; left out, what is known of the part",
    )
    acceleration_nonlinearity_percent: float | None = Field(
        default=None,
        ge=0,
        description="how far an accelerometer may be off the best straight line, in per cent of "
        "`acceleration_nonlinear_over_g`; left out, what is known of the part",
        json_schema_extra={"unit": "%"},
    )
    acceleration_nonlinear_over_g: float | None = Field(
        default=None,
        ge=0,
        description="over what acceleration either way that is stated, 0 for the range that is set; left out, what is "
        "known of the part",
        json_schema_extra={"unit": "g"},
    )
    acceleration_bias_mg_k: float | None = Field(
        default=None,
        ge=0,
        description="change of an accelerometer's bias for 1 K; left out, what is known of the part",
        json_schema_extra={"unit": "mg/K"},
    )
    acceleration_scale_ppm_k: float | None = Field(
        default=None,
        ge=0,
        description="change of an accelerometer's scale factor for 1 K; left out, what is known of the part",
        json_schema_extra={"unit": "ppm/K"},
    )
    acceleration_bias_instability_ug: float | None = Field(
        default=None,
        ge=0,
        description="the least Allan deviation of an accelerometer at rest; left out, what is known of the part",
        json_schema_extra={"unit": "µg"},
    )
    decision_rule: Literal["simple", "guard_band"] = Field(
        default="simple",
        description="what a limit is held against: `simple`, the value; `guard_band`, the value and its expanded "
        "uncertainty, so that at most one in forty is accepted wrongly",
    )


class CertificateSection(Section):
    """What a certificate says of the order and of who answers for it. Left out, it reads "not stated"."""

    customer: Words | None = Field(default=None, description="the customer's name")
    customer_address: Words | None = Field(default=None, description="the customer's address, in one line")
    received: date | None = Field(
        default=None, description="when the item was received", json_schema_extra={"allowed": "date, as 2026-11-20"}
    )
    condition: Words | None = Field(default=None, description="the item's condition, as received")
    authorised_by: Words | None = Field(
        default=None, description="who authorises the certificate; left out, there is a line to sign on"
    )
    replaces: Words | None = Field(
        default=None, description="the number of the certificate that this one amends and replaces"
    )
    issued: date | None = Field(
        default=None,
        description="when it is issued; left out, the day the result was computed",
        json_schema_extra={"allowed": "date, as 2026-11-20"},
    )


class HistorySection(Section):
    """Where finished runs are remembered. Left out, in a file of whoever runs the rig (`RIG_HISTORY` names another)."""

    url: str | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="an SQLite file on a disk of this computer, or `postgresql://user@host/name` of a database that "
        "several rigs share; no password, which belongs in `~/.pgpass`",
    )
    off: bool = Field(default=False, description="remember nothing")
    rig: Words | None = Field(
        default=None, description="what this rig is called there; left out, by its arm's serial number"
    )
    operator: Words | None = Field(default=None, description="who runs the rig, as the history is to have it")
    note: Words | None = Field(default=None, description="what the history is to say of this run beside its numbers")
    check_standards: tuple[Words, ...] = Field(
        default=(), max_length=100, description="serial numbers of sensors that are calibrated to watch the rig itself"
    )

    @field_validator("url")
    @classmethod
    def a_place_without_a_password(cls, value: str | None) -> str | None:
        """A recording keeps the configuration, so a password in it would go wherever recordings go."""
        if value is not None and "://" in value and history_url(value).password is not None:
            raise ValueError("holds a password, which every recording would keep; put it into ~/.pgpass")
        return value
