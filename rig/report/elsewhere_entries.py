"""Entries of `result.json` for readings recorded elsewhere: what attitudes of a file told."""

from typing import Any

import numpy as np

from rig.analysis.attitudes import InAttitudes, Result
from rig.analysis.elsewhere import OfSensor
from rig.analysis.increments import InIncrements
from rig.analysis.outcome import Outcome
from rig.data.accelerometer_entries import AccelerometerEntry, DwellEntry, InAttitudesEntry
from rig.data.attitude_entries import BesideEntry, FollowedEntry, InAttitudesRatesEntry, LeftOutEntry, TurnedEntry
from rig.data.magnetometer_entries import FieldDwellEntry, FieldSolutionEntry, MagnetometerEntry
from rig.data.motion_file import Item
from rig.data.quantity import ACCELERATION, FIELD, Quantity
from rig.data.result_types import ErrorEntry, LaidDownEntry
from rig.data.settings import Site
from rig.errors import Fault
from rig.estimation import accelerometer, magnetometer
from rig.estimation.arrays import scale_of
from rig.estimation.attitude_error import AttitudeError
from rig.estimation.known_increments import EarthSeen
from rig.estimation.reference_budget import scale_and_bias_covariance
from rig.estimation.reference_model import REFERENCE, SECOND, F
from rig.estimation.residuals import attitude_residual_std
from rig.estimation.sensor_axes import SensorAxes
from rig.estimation.six_observation import PARAMETERS
from rig.estimation.triaxial import TriaxialSolution
from rig.report.axes import beside_entries, dwell_entry
from rig.report.budget_entry import budget_entry
from rig.report.entry import entry

ORDER = (
    *(f"f{i}{j}" for i in "xyz" for j in "xyz"),
    *(f"{name}_{axis}" for name in ("reference", "bias", "phi") for axis in "xyz"),
)


def accelerometers_elsewhere(outcome: Outcome) -> dict[str, AccelerometerEntry]:
    """The accelerometers that were calibrated in attitudes of a file."""
    return {
        name: _at_rest(AccelerometerEntry, ACCELERATION, item, result,
            role="calibrate",
            model=accelerometer.MODEL,
            gravity_m_s2=site.gravity_m_s2,
            second_order_s2_m=result.solution.second_order,
            second_order_std_s2_m=_second_order_std(result.solution),
            reference_m_s2=result.solution.reference,
            lever_arm_m=None, lever_arm_std_m=None, delay_s=None, delay_std_s=None, alignment=None, held_out=None,
            sweeps=0,
            temperature_c=None,
            dwells=_dwells(DwellEntry, ACCELERATION, result),
            beside=beside_entries(InAttitudesEntry, ACCELERATION, result.beside),
        )
        for name, item, site, result in _placed(outcome, ACCELERATION)
    }  # fmt: skip


def magnetometers_elsewhere(outcome: Outcome) -> dict[str, MagnetometerEntry]:
    """The magnetometers that were calibrated in attitudes of a file."""
    return {
        name: _at_rest(MagnetometerEntry, FIELD, item, result,
            model=magnetometer.MODEL,
            arm_field_in_bias=False,
            field_t=site.magnetic_field_t,
            field_base_t=result.solution.reference,
            hard_iron_t=magnetometer.hard_iron(result.solution),
            dwells=_dwells(FieldDwellEntry, FIELD, result),
            beside=beside_entries(FieldSolutionEntry, FIELD, result.beside),
        )
        for name, item, site, result in _placed(outcome, FIELD)
    }  # fmt: skip


def unsolved(outcome: Outcome) -> dict[str, dict[str, ErrorEntry]]:
    """Why quantities that were recorded have no solution, by sensor; those without any left out."""
    told: dict[str, dict[str, ErrorEntry]] = {}
    faults = [(name, *each) for name, found in outcome.elsewhere.items() for each in found.unsolved.items()]
    faults += [(each.name, each.quantity, each.found) for each in outcome.of_kinds if isinstance(each.found, Fault)]
    for name, quantity, fault in faults:
        told.setdefault(name, {})[quantity.name] = ErrorEntry(error=str(fault))
    return told


def rates_in_attitudes(sensor: OfSensor) -> InAttitudesRatesEntry | None:
    """What attitudes tell of a gyroscope beside scale and bias; None where it was swept."""
    if sensor.rates is None:
        return None
    earth = _earth_rate(sensor.rates)
    return InAttitudesRatesEntry.model_validate(
        {
            "earth_rate_rad_s": None if isinstance(earth, Fault) else earth.rate_rad_s.tolist(),
            "earth_rate_std_rad_s": None if isinstance(earth, Fault) else earth.std_rad_s.tolist(),
            "earth_rate_error": str(earth) if isinstance(earth, Fault) else None,
            "followed": _followed(sensor.rates) if isinstance(sensor.rates, InIncrements) else None,
            "covariance": sensor.rates.solution.covariance.tolist(),
            "covariance_order": ORDER[:15],
            "beside": {} if isinstance(sensor.rates, InIncrements) else _rates_beside(sensor.rates),
        }
    )


def turned(sensor: OfSensor) -> TurnedEntry | None:
    """What the turns were taken for that a gyroscope was solved by; None where means of sweeps or attitudes told it."""
    if sensor.turned is None or sensor.gyroscope is None:
        return None
    turns = sensor.turned.turns
    return TurnedEntry(
        rows=sensor.turned.rows,
        angle_std_rad=max(turn.angle_std_rad for turn in turns),
        axis_std_rad=max(turn.axis_std_rad for turn in turns),
        widened=getattr(sensor.gyroscope.solution, "widened", 1.0),
    )


def _earth_rate(result: Result) -> EarthSeen | Fault:
    """The Earth's rate in the axes of the table, or the Fault for which it is not known."""
    if isinstance(result, InIncrements):
        return result.solution.earth
    if result.reference_fault is not None:
        return result.reference_fault
    return EarthSeen(result.solution.reference, result.solution.covariance[REFERENCE, REFERENCE])


def _followed(increments: InIncrements) -> FollowedEntry:
    residuals = increments.solution.residuals_rad
    return entry(
        FollowedEntry, increments.solution, increments,
        increments=len(residuals),
        residual_rms_rad=float(np.sqrt(np.mean(residuals**2))),
        left_out=[
            LeftOutEntry(error=each.name, count=each.count, first_s=each.first_s) for each in increments.left_out
        ],
    )  # fmt: skip


def _rates_beside(attitudes: InAttitudes) -> dict[str, BesideEntry | ErrorEntry]:
    return {
        method: ErrorEntry(error=str(other))
        if isinstance(other, Fault)
        else entry(BesideEntry, other, scale=scale_of(other.matrix), bias_rad_s=-other.bias)
        for method, other in attitudes.beside.items()
    }


def _placed(outcome: Outcome, quantity: Quantity) -> list[tuple[str, Item, Site, InAttitudes]]:
    site = outcome.settings.site
    return [
        (name, found.item, site, found.at_rest[quantity])
        for name, found in outcome.elsewhere.items()
        if site is not None and quantity in found.at_rest
    ]


def _at_rest(kind: Any, quantity: Quantity, item: Item, attitudes: InAttitudes, **own: Any) -> Any:
    """What the entries of accelerometers and magnetometers share, each in the unit of its quantity."""
    solution, error, laid = attitudes.solution, attitudes.solution.attitude_error, attitudes.laid
    axes = SensorAxes.of(solution.matrix)
    return entry(
        kind, solution,
        part=item.part,
        serial_number=item.serial_number,
        estimator=solution.method,
        scale=axes.scale,
        covariance=scale_and_bias_covariance(solution.matrix, axes.scale, solution.covariance),
        covariance_order=PARAMETERS,
        covariance_units=quantity.parameter_units,
        covariance_combined=attitudes.budget.covariance,
        budget=budget_entry(attitudes.budget),
        non_orthogonality_rad=axes.non_orthogonality_rad,
        non_orthogonality_std_rad=axes.non_orthogonality_std_rad(solution.covariance[F, F]),
        **attitude_error(error),
        correction_matrix=axes.correction_matrix,
        laid_down=LaidDownEntry(
            placement_std=None if laid is None else laid.placement_std,
            placement_uncertainty=None if laid is None else laid.placement_uncertainty,
            rests_elsewhere=attitudes.elsewhere,
            rows_left_out=attitudes.moving,
            covariance=solution.covariance.tolist(),
            covariance_order=ORDER[: len(solution.covariance)],
        ),
        **{quantity.named("bias"): solution.bias},
        **own,
    )  # fmt: skip


def attitude_error(error: AttitudeError | None) -> dict[str, float | None]:
    """How far the attitudes are off about each axis, and how well that is known; none by a method that holds them."""
    if error is None:
        return {"attitude_error_rad": None, "attitude_error_std_rad": None}
    known = error.uncertainty_rad if np.isfinite(error.uncertainty_rad) else None
    return {"attitude_error_rad": error.std_rad, "attitude_error_std_rad": known}


def _dwells(kind: Any, quantity: Quantity, attitudes: InAttitudes) -> list[Any]:
    if attitudes.seen is None:  # of rows there are no placements
        return []
    expected = attitude_residual_std(attitudes.solution, attitudes.seen)
    rows = zip(attitudes.dwells, attitudes.solution.residuals, expected, strict=True)
    return [dwell_entry(kind, quantity, *each) for each in rows]


def _second_order_std(solution: TriaxialSolution) -> Any:
    return None if solution.second_order is None else np.sqrt(np.diag(solution.covariance)[SECOND])
