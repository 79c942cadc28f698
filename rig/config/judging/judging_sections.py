"""Sections on the site of a measurement and on its result: site, certificate, history."""

from datetime import date
from typing import Annotated, Self

import numpy as np
from pydantic import Field, field_validator, model_validator

from rig.config.judging.history_address import history_url
from rig.config.section import RATIO, Section, Vector3, Words

# Sine of the angle between the vertical and the axis whose heading is given: equals that of
# `rig.estimation.gyroscope.earth_rate`, which the world must not import through a section.
MIN_LEVEL_SINE = 0.1


class SiteSection(Section):
    """The site of the arm. If it has latitude and heading, the Earth's rate is removed. Texts are for certificates."""

    laboratory: Words | None = Field(default=None, description="the laboratory's name, for certificates")
    address: Words | None = Field(default=None, description="the laboratory's address, in one line")
    country: Annotated[str, Field(pattern="^[A-Z]{2}$")] | None = Field(
        default=None,
        description="the laboratory's country, for digital certificates",
        json_schema_extra={"allowed": "two capital letters (ISO 3166-1)"},
    )
    location: Words | None = Field(
        alias="place",
        default=None,
        description="location of the arm: site, room; if left out, a certificate does not state it",
    )
    time_reference: Words | None = Field(
        default=None,
        description="the time server that corrects this computer's clock, such as `NTP, ptbtime1.ptb.de`; without "
        "it a certificate does not call the time traceable",
    )
    ambient_temperature_c: float | None = Field(
        default=None, ge=-50, le=100, description="temperature of the air, as you measured it"
    )
    ambient_humidity_percent: float | None = Field(
        default=None, ge=0, le=100, description="relative humidity of the air, as you measured it"
    )
    latitude_deg: float | None = Field(
        default=None,
        ge=-90,
        le=90,
        description="latitude, north is positive; give it together with heading_deg, or alone if the Earth's rate "
        "is to be found",
    )
    heading_deg: float | None = Field(
        default=None,
        ge=-360,
        le=360,
        description="direction of the x axis of the arm's base: 0 north, 90 east; give it together with latitude_deg",
    )
    gravity_m_s2: float = Field(default=9.80665, gt=9.7, lt=9.9, description="acceleration of free fall")
    gravity_uncertainty_m_s2: float | None = Field(
        default=None,
        gt=0,
        le=0.1,
        description="expanded uncertainty (k = 2) of gravity_m_s2; if left out, a half-width of 0.0005 is used, "
        "or half a unit of its last digit if that is more, or 0.03 if gravity_m_s2 is the standard value, 9.8 or 9.81",
    )
    magnetic_field_ut: float | None = Field(
        default=None,
        ge=1,
        le=1000,
        description="magnitude of the magnetic field at the magnetometer's position, measured there with a reference; "
        "the scale factors are relative to it; without it a magnetometer is recorded but not calibrated",
    )
    magnetic_field_uncertainty_ut: float | None = Field(
        default=None,
        gt=0,
        le=100,
        description="expanded uncertainty (k = 2) of magnetic_field_ut; if left out, a half-width of 1 % is used",
    )
    gravity_reference: Words | None = Field(
        default=None,
        description="source of gravity_m_s2, such as a gravimeter with its certificate or a gravity map; for "
        "certificates",
    )
    magnetic_field_reference: Words | None = Field(
        default=None, description="instrument that measured magnetic_field_ut; for certificates"
    )
    magnetic_field_upwards: bool = Field(
        default=False, description="whether this field points out of the ground, as south of the magnetic equator"
    )
    base_up: Vector3 = Field(
        default=(0.0, 0.0, 1.0),
        description="direction of up in the frame of the arm's base; 0 0 −1 if the arm hangs from a ceiling",
        json_schema_extra=RATIO,
    )

    @field_validator("base_up")
    @classmethod
    def check_direction(cls, value: Vector3) -> Vector3:
        """Refuse a vector of length zero, which has no direction."""
        if not np.linalg.norm(value) > 1e-6:
            raise ValueError("must be a direction, such as [0, 0, 1]")
        return value

    @model_validator(mode="after")
    def require_latitude_of_heading(self) -> Self:
        """Refuse a heading without a latitude (the Earth's rate needs both), and the heading of a vertical x axis."""
        if self.heading_deg is not None and self.latitude_deg is None:
            raise ValueError("needs latitude_deg and heading_deg, or neither")
        if self.heading_deg is not None and np.linalg.norm(np.cross(self.up, (1, 0, 0))) < MIN_LEVEL_SINE:
            raise ValueError("heading_deg has no meaning if the x axis of the base points up or down")
        return self

    @property
    def up(self) -> Vector3:
        """Unit vector that points up, in the base's frame."""
        x, y, z = (np.array(self.base_up) / np.linalg.norm(self.base_up)).tolist()
        return x, y, z


class CertificateSection(Section):
    """A certificate's statements on the order and the responsible person; "not stated" if left out."""

    customer: Words | None = Field(default=None, description="the customer's name")
    customer_address: Words | None = Field(default=None, description="the customer's address, in one line")
    received: date | None = Field(
        default=None,
        description="the day on which the item was received",
        json_schema_extra={"allowed": "date, as 2026-11-20"},
    )
    condition: Words | None = Field(default=None, description="the item's condition when it was received")
    authorised_by: Words | None = Field(
        default=None,
        description="who authorises the certificate; if left out, the certificate has a line for a signature",
    )
    replaces: Words | None = Field(
        default=None, description="the number of the certificate that this one amends and replaces"
    )
    issued: date | None = Field(
        default=None,
        description="the day on which the certificate is issued; if left out, the day on which the result was computed",
        json_schema_extra={"allowed": "date, as 2026-11-20"},
    )


class HistorySection(Section):
    """The history that stores finished runs. If left out: a file of the user (`RIG_HISTORY` names another)."""

    url: str | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="an SQLite file on a disk of this computer, or `postgresql://user@host/name` of a database that "
        "several rigs share; no password, which belongs in `~/.pgpass`",
    )
    is_off: bool = Field(alias="off", default=False, description="`true`: this run is not entered into the history")
    rig: Words | None = Field(
        default=None, description="name of this rig in the history; if left out, the serial number of its arm"
    )
    operator: Words | None = Field(default=None, description="name of the operator, for the history")
    note: Words | None = Field(default=None, description="a note about this run, for the history")
    check_standards: tuple[Words, ...] = Field(
        default=(),
        max_length=100,
        description="serial numbers of the check standards: sensors that are "
        "calibrated again and again in order to watch the rig itself",
    )

    @field_validator("url")
    @classmethod
    def refuse_password_in_url(cls, value: str | None) -> str | None:
        """Refuse a password, because every recording would keep it with its configuration."""
        if value is not None and "://" in value and history_url(value).password is not None:
            raise ValueError("contains a password, and every recording would keep it; put it into ~/.pgpass")
        return value
