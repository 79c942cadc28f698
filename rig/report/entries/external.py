"""Entries of `result.json` for external readings, whose motion a file gives as attitudes or angles."""

from typing import Any

import numpy as np

from rig.analysis.external.attitudes import AttitudeCalibration, Result
from rig.analysis.external.external_recordings import ExternalResult
from rig.analysis.external.increment_calibration import IncrementCalibration
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
from rig.estimation.external.increment_solution import EarthRateEstimate
from rig.estimation.reference import accelerometer, magnetometer
from rig.estimation.reference.reference_model import REFERENCE, SECOND
from rig.estimation.reference.triaxial import TriaxialSolution
from rig.report.entries.triad import ACCELEROMETER_MODELS, MAGNETOMETER_MODELS, attitudes_entry
from rig.report.entry import entry, error_entry

ORDER = (
    *(f"f{i}{j}" for i in "xyz" for j in "xyz"),
    *(f"{name}_{axis}" for name in ("reference", "bias", "phi") for axis in "xyz"),
)


def list_external_accelerometers(outcome: Outcome) -> dict[str, AccelerometerEntry]:
    """Return the entries, by name, of the accelerometers that were calibrated in attitudes stated by a file."""
    return {
        name: attitudes_entry(ACCELEROMETER_MODELS, result, item,
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
        for name, item, site, result in _attitude_results(outcome, ACCELERATION)
    }  # fmt: skip


def list_external_magnetometers(outcome: Outcome) -> dict[str, MagnetometerEntry]:
    """Return the entries, by name, of the magnetometers that were calibrated in attitudes stated by a file."""
    return {
        name: attitudes_entry(MAGNETOMETER_MODELS, result, item,
            model=magnetometer.MODEL,
            arm_field_in_bias=False,
            field_t=site.magnetic_field_t,
            field_base_t=result.solution.reference,
            hard_iron_t=magnetometer.hard_iron(result.solution),
            placement=_placement(result),
        )
        for name, item, site, result in _attitude_results(outcome, FIELD)
    }  # fmt: skip


def rates_in_attitudes(sensor: ExternalResult) -> AttitudesEntry | None:
    """Return a gyroscope's results from attitudes, other than scale and bias; None if it was calibrated by sweeps."""
    if sensor.rates is None:
        return None
    earth = _earth_rate(sensor.rates)
    return AttitudesEntry.model_validate(
        {
            "earth_rate_rad_s": None if isinstance(earth, Fault) else earth.rate_rad_s.tolist(),
            "earth_rate_std_rad_s": None if isinstance(earth, Fault) else earth.std_rad_s.tolist(),
            "earth_rate_error": str(earth) if isinstance(earth, Fault) else None,
            "by_increments": _increments_entry(sensor.rates)
            if isinstance(sensor.rates, IncrementCalibration)
            else None,
            "covariance": sensor.rates.solution.covariance.tolist(),
            "covariance_order": ORDER[:15],
            "other_methods": {} if isinstance(sensor.rates, IncrementCalibration) else _other_rates(sensor.rates),
        }
    )


def angles_entry(sensor: ExternalResult) -> AnglesEntry | None:
    """Return the entry of the turning angles' stated accuracy; None for a gyroscope calibrated from mean rates."""
    if sensor.turned is None or sensor.gyroscope is None:
        return None
    turns = sensor.turned.turns
    return AnglesEntry(
        rows=sensor.turned.rows,
        angle_std_rad=max(turn.angle_std_rad for turn in turns),
        axis_std_rad=max(turn.axis_std_rad for turn in turns),
        uncertainty_inflation=getattr(sensor.gyroscope.solution, "inflation", 1.0),
    )


def _earth_rate(result: Result) -> EarthRateEstimate | Fault:
    """Return the Earth's rate in the axes of the rate table, or the Fault that explains its absence."""
    if isinstance(result, IncrementCalibration):
        return result.solution.earth
    if result.reference_fault is not None:
        return result.reference_fault
    return EarthRateEstimate(result.solution.reference, result.solution.covariance[REFERENCE, REFERENCE])


def _increments_entry(increments: IncrementCalibration) -> IncrementsEntry:
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


def _other_rates(attitudes: AttitudeCalibration) -> dict[str, RateSolutionEntry | ErrorEntry]:
    def solution_entry(other: TriaxialSolution) -> RateSolutionEntry:
        return entry(RateSolutionEntry, other, scale=scale_of(other.matrix), bias_rad_s=-other.bias)

    return {
        str(method): other
        for method, other in attitudes.other_methods.results_by_key(solution_entry, error_entry).items()
    }


def _attitude_results(outcome: Outcome, quantity: Quantity) -> list[tuple[str, Item, Site, AttitudeCalibration]]:
    site = outcome.settings.site
    return [
        (name, sensor.item, site, sensor.at_rest[quantity])
        for name, sensor in outcome.external.items()
        if quantity in sensor.at_rest
    ]


def _placement(attitudes: AttitudeCalibration) -> PlacementEntry:
    solution, laid = attitudes.solution, attitudes.laid
    return PlacementEntry(
        placement_std=None if laid is None else laid.placement_std,
        placement_uncertainty=None if laid is None else laid.placement_uncertainty,
        rests_without_attitude=attitudes.unplaced_rests,
        rows_omitted=attitudes.moving,
        covariance=solution.covariance.tolist(),
        covariance_order=ORDER[: len(solution.covariance)],
    )


def _second_order_std(solution: TriaxialSolution) -> Any:
    return None if solution.second_order is None else np.sqrt(np.diag(solution.covariance)[SECOND])
