"""Entries of `result.json` for readings recorded elsewhere: what attitudes of a file told."""

from typing import Any

import numpy as np

from rig.analysis.external.attitudes import InAttitudes, Result
from rig.analysis.external.elsewhere import OfSensor
from rig.analysis.external.increments import InIncrements
from rig.analysis.outcome import Outcome
from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.external import (
    AnglesEntry,
    AttitudesEntry,
    IncrementsEntry,
    OmittedIncrementsEntry,
    RateSolutionEntry,
)
from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.entries.result_types import ErrorEntry, PlacementEntry
from rig.data.quantity import ACCELERATION, FIELD, Quantity
from rig.data.recording.motion_file import Item
from rig.data.recording.settings import Site
from rig.errors import Fault
from rig.estimation.arrays import scale_of
from rig.estimation.external.known_increments import EarthSeen
from rig.estimation.reference import accelerometer, magnetometer
from rig.estimation.reference.reference_model import REFERENCE, SECOND
from rig.estimation.reference.triaxial import TriaxialSolution
from rig.report.entries.error import error_entry
from rig.report.entries.triad import OF_ACCELEROMETERS, OF_MAGNETOMETERS, attitudes_entry
from rig.report.entry import entry

ORDER = (
    *(f"f{i}{j}" for i in "xyz" for j in "xyz"),
    *(f"{name}_{axis}" for name in ("reference", "bias", "phi") for axis in "xyz"),
)


def accelerometers_elsewhere(outcome: Outcome) -> dict[str, AccelerometerEntry]:
    """The accelerometers that were calibrated in attitudes of a file."""
    return {
        name: attitudes_entry(OF_ACCELEROMETERS, result, item,
            role="calibrate",
            model=accelerometer.MODEL,
            gravity_m_s2=site.gravity_m_s2,
            second_order_s2_m=result.solution.second_order,
            second_order_std_s2_m=_second_order_std(result.solution),
            reference_m_s2=result.solution.reference,
            lever_arm_m=None, lever_arm_std_m=None, delay_s=None, delay_std_s=None, alignment=None, validation=None,
            sweeps=0,
            temperature_c=None,
            placement=_placement(result),
        )
        for name, item, site, result in _placed(outcome, ACCELERATION)
    }  # fmt: skip


def magnetometers_elsewhere(outcome: Outcome) -> dict[str, MagnetometerEntry]:
    """The magnetometers that were calibrated in attitudes of a file."""
    return {
        name: attitudes_entry(OF_MAGNETOMETERS, result, item,
            model=magnetometer.MODEL,
            arm_field_in_bias=False,
            field_t=site.magnetic_field_t,
            field_base_t=result.solution.reference,
            hard_iron_t=magnetometer.hard_iron(result.solution),
            placement=_placement(result),
        )
        for name, item, site, result in _placed(outcome, FIELD)
    }  # fmt: skip


def unsolved(outcome: Outcome) -> dict[str, dict[str, ErrorEntry]]:
    """Why quantities that were recorded have no solution, by sensor; those without any left out."""
    told: dict[str, dict[str, ErrorEntry]] = {}
    faults = [(name, *each) for name, found in outcome.elsewhere.items() for each in found.unsolved.items()]
    faults += [(kind.name, kind.quantity, kind.fault) for kind in outcome.of_kinds if kind.fault is not None]
    for name, quantity, fault in faults:
        told.setdefault(name, {})[quantity.name] = ErrorEntry(error=str(fault))
    return told


def rates_in_attitudes(sensor: OfSensor) -> AttitudesEntry | None:
    """What attitudes tell of a gyroscope beside scale and bias; None where it was swept."""
    if sensor.rates is None:
        return None
    earth = _earth_rate(sensor.rates)
    return AttitudesEntry.model_validate(
        {
            "earth_rate_rad_s": None if isinstance(earth, Fault) else earth.rate_rad_s.tolist(),
            "earth_rate_std_rad_s": None if isinstance(earth, Fault) else earth.std_rad_s.tolist(),
            "earth_rate_error": str(earth) if isinstance(earth, Fault) else None,
            "by_increments": _followed(sensor.rates) if isinstance(sensor.rates, InIncrements) else None,
            "covariance": sensor.rates.solution.covariance.tolist(),
            "covariance_order": ORDER[:15],
            "other_methods": {} if isinstance(sensor.rates, InIncrements) else _rates_beside(sensor.rates),
        }
    )


def turned(sensor: OfSensor) -> AnglesEntry | None:
    """What the turns were taken for that a gyroscope was solved by; None where means of sweeps or attitudes told it."""
    if sensor.turned is None or sensor.gyroscope is None:
        return None
    turns = sensor.turned.turns
    return AnglesEntry(
        rows=sensor.turned.rows,
        angle_std_rad=max(turn.angle_std_rad for turn in turns),
        axis_std_rad=max(turn.axis_std_rad for turn in turns),
        uncertainty_inflation=getattr(sensor.gyroscope.solution, "widened", 1.0),
    )


def _earth_rate(result: Result) -> EarthSeen | Fault:
    """The Earth's rate in the axes of the table, or the Fault for which it is not known."""
    if isinstance(result, InIncrements):
        return result.solution.earth
    if result.reference_fault is not None:
        return result.reference_fault
    return EarthSeen(result.solution.reference, result.solution.covariance[REFERENCE, REFERENCE])


def _followed(increments: InIncrements) -> IncrementsEntry:
    residuals = increments.solution.residuals_rad
    return entry(
        IncrementsEntry, increments.solution, increments,
        increments=len(residuals),
        residual_rms_rad=float(np.sqrt(np.mean(residuals**2))),
        omitted=[
            OmittedIncrementsEntry(error=cause.name, count=cause.count, first_s=cause.first_s)
            for cause in increments.left_out
        ],
    )  # fmt: skip


def _rates_beside(attitudes: InAttitudes) -> dict[str, RateSolutionEntry | ErrorEntry]:
    def solution_entry(other: TriaxialSolution) -> RateSolutionEntry:
        return entry(RateSolutionEntry, other, scale=scale_of(other.matrix), bias_rad_s=-other.bias)

    return {str(method): made for method, made in attitudes.beside.by_key(solution_entry, error_entry).items()}


def _placed(outcome: Outcome, quantity: Quantity) -> list[tuple[str, Item, Site, InAttitudes]]:
    site = outcome.settings.site
    return [
        (name, found.item, site, found.at_rest[quantity])
        for name, found in outcome.elsewhere.items()
        if quantity in found.at_rest
    ]


def _placement(attitudes: InAttitudes) -> PlacementEntry:
    solution, laid = attitudes.solution, attitudes.laid
    return PlacementEntry(
        placement_std=None if laid is None else laid.placement_std,
        placement_uncertainty=None if laid is None else laid.placement_uncertainty,
        rests_without_attitude=attitudes.elsewhere,
        rows_omitted=attitudes.moving,
        covariance=solution.covariance.tolist(),
        covariance_order=ORDER[: len(solution.covariance)],
    )


def _second_order_std(solution: TriaxialSolution) -> Any:
    return None if solution.second_order is None else np.sqrt(np.diag(solution.covariance)[SECOND])
