"""The uncertainty budgets of accelerometers and magnetometers, with the contributors that no readings show."""

from dataclasses import replace
from decimal import Decimal
from typing import Final

import numpy as np

from rig.analysis.reference.datasheet_errors import Datasheet, separate_sensor_errors
from rig.data.quantity import FIELD
from rig.data.recording.settings import Site
from rig.estimation.arrays import Array, scale_of
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.budget import NOT_GIVEN_SUFFIX, Budget, Contributor
from rig.estimation.reference.accelerometer_model import Dwells, Movement
from rig.estimation.reference.attitude_error import AttitudeError
from rig.estimation.reference.imu import ImuSolution
from rig.estimation.reference.magnetometer import FieldDrift, Uniformity
from rig.estimation.reference.reference_budget import (
    FitUncertainty,
    NormUncertainty,
    reference_budget,
    response_in_attitudes,
    scale_and_bias,
    type_b,
)
from rig.estimation.reference.triaxial import TriaxialSolution

# Half-width of gravity that is computed from latitude and height alone: anomalies by rocks and terrain, 50 mGal.
LOCAL_GRAVITY_ERROR_M_S2: Final = 0.0005
STANDARD_GRAVITIES_M_S2: Final = (STANDARD_GRAVITY_M_S2, 9.8, 9.81)
STANDARD_GRAVITY_ERROR_M_S2: Final = 0.03  # 9.780 at the equator to 9.832 at the poles, less on mountains
UNSTATED_FIELD_ERROR: Final = 0.01  # relative half-width: that of an ordinary fluxgate
UNTESTED_DRIFT_T: Final = 1e-7  # change of the field in a run: a magnetic storm, a lift some floors away
TESTED_AXES: Final = 3  # axes of one measured change of the field: the degrees of freedom of its standard deviation
SIZE_OF_FIELD: Final = "size of the field"


def accelerometer_budget(
    solution: ImuSolution,
    movement: Movement,
    site: Site,
    lag_s: float,
    *,
    noise_dof: Array,
    datasheet: Datasheet | None = None,
) -> Budget:
    """Return the budget of an accelerometer's `solution` from a `movement`.

    `lag_s` is the half-width of the unknown lag of the sensor's filter. `noise_dof` (3 N + 9 M,) are the degrees of
    freedom of the variances of the readings in N dwells, then of the harmonics of M sweeps. The sensor's own errors are
    contributors only if there is a `datasheet`.
    """
    spread = _propagate(
        solution,
        solution.response,
        movement.noise(),
        solution.attitude_error,
        (solution.chi_square, solution.dof),
        noise_dof=noise_dof,
    )
    errors = None if datasheet is None else solution.sensor_errors
    return combine_errors(
        spread, solution.theta, replace(movement, sensor_errors=errors), site, lag_s, datasheet=datasheet
    )


def combine_errors(
    spread: FitUncertainty, theta: Array, movement: Movement, site: Site, lag_s: float, *, datasheet: Datasheet | None
) -> Budget:
    """Return the budget of scale and bias from the uncertainty `spread` of a fit with the solution `theta` (22,)."""
    others = [_lag(spread, movement, lag_s)] if len(movement.sweeps.speeds_rad_s) else []
    if movement.sensor_errors is None or datasheet is None:
        return reference_budget(spread, _gravity(site), others)
    bare, by_sensor = separate_sensor_errors(spread, theta, movement, datasheet)
    return reference_budget(bare, _gravity(site), [*by_sensor, *others])


def magnetometer_budget(
    solution: TriaxialSolution,
    measured: Dwells,
    tested: tuple[Uniformity, FieldDrift | None],
    site: Site,
    *,
    field_t: float,
    noise_dof: Array,
) -> Budget:
    """Return the budget of a magnetometer's `solution`; `tested` are the tests of the field's uniformity and drift."""
    homogeneity, drift = tested
    spread = _propagate(
        solution,
        response_in_attitudes(solution, measured),
        np.diag(measured.variances_m2_s4.ravel()),
        solution.attitude_error or AttitudeError(0.0, 0.0),
        (homogeneity.chi_square, homogeneity.degrees_of_freedom),
        noise_dof=noise_dof,
    )
    return reference_budget(spread, _field(site, field_t), [_drift(spread, solution.matrix, measured.attitudes, drift)])


def _propagate(
    solution: ImuSolution | TriaxialSolution,
    response: Array,
    noise: Array,
    error: AttitudeError,
    chi_square: tuple[float, int],
    *,
    noise_dof: Array,
) -> FitUncertainty:
    """Return the uncertainty of scale and bias from that of all parameters.

    - `response` (p, n): the derivatives of p parameters with respect to n readings.
    - `noise` (n, n): the covariance of the readings; `error`: the arm's attitude error.
    - `chi_square`: the χ² of the residuals, and its degrees of freedom.
    """
    scale = scale_of(solution.matrix)
    rows = scale_and_bias(solution.matrix, scale, len(solution.covariance))
    return FitUncertainty(
        scale, rows @ solution.covariance @ rows.T, rows @ response, noise, error, *chi_square, noise_dof
    )


def _gravity(site: Site) -> NormUncertainty:
    size, source = site.gravity_m_s2, "site.gravity_uncertainty_m_s2"
    if site.gravity_expanded_m_s2 is not None:
        return NormUncertainty("gravity", site.gravity_expanded_m_s2 / size, True, size, "m/s²", source)
    return NormUncertainty(
        "gravity", gravity_error_m_s2(size) / size, False, size, "m/s²", f"{source} {NOT_GIVEN_SUFFIX}"
    )


def gravity_error_m_s2(stated_m_s2: float) -> float:
    """Return the half-width of a gravity that is stated without uncertainty.

    It is half a unit of the last digit, and at least that of a computed gravity. The standard gravity, also as 9.8 or
    9.81, says nothing about the place.
    """
    last_digit = 10.0 ** float(Decimal(repr(float(stated_m_s2))).as_tuple().exponent)
    if stated_m_s2 in STANDARD_GRAVITIES_M_S2:
        return STANDARD_GRAVITY_ERROR_M_S2
    return max(last_digit / 2, LOCAL_GRAVITY_ERROR_M_S2)


def _field(site: Site, field_t: float) -> NormUncertainty:
    size_ut, source = field_t / FIELD.bias.size, "site.magnetic_field_uncertainty_ut"
    if site.magnetic_field_expanded_t is not None:
        relative = site.magnetic_field_expanded_t / field_t
        return NormUncertainty(SIZE_OF_FIELD, relative, True, size_ut, "µT", source)
    return NormUncertainty(SIZE_OF_FIELD, UNSTATED_FIELD_ERROR, False, size_ut, "µT", f"{source} {NOT_GIVEN_SUFFIX}")


def lag_pattern(movement: Movement, lag_s: float) -> Array:
    """Return the effect (1, 3 K) of a filter lag, which reduces a sweep's wave by the fraction (speed × `lag_s`)²/2."""
    dwells, sweeps = movement.dwells, movement.sweeps
    smaller = sweeps.harmonics_m_s2 * np.square(sweeps.speeds_rad_s * lag_s)[:, None, None] / 2
    smaller[:, 0] = 0.0  # the mean is not reduced
    return np.concatenate([np.zeros(dwells.readings_m_s2.size), smaller.ravel()])[None]


def drift_patterns(matrix: Array, attitudes: Array, drift: FieldDrift | None) -> tuple[Array, float]:
    """Return the patterns (3, 3 N) of a field that changes linearly over the attitudes, and the size of the change, T.

    The patterns are those of changes along each axis of the base. If the `drift` was measured, the size is the larger
    of the measured change and its standard deviation, divided by √3; else it is `UNTESTED_DRIFT_T`.
    """
    change_t = UNTESTED_DRIFT_T
    if drift is not None:
        change_t = max(float(np.linalg.norm(field_t)) for field_t in (drift.change_t, drift.std_t)) / np.sqrt(3)
    change = np.linspace(-0.5, 0.5, len(attitudes))[:, None, None] * (matrix @ np.swapaxes(attitudes, -1, -2))
    return change_t * np.moveaxis(change, -1, 0).reshape(3, -1), change_t


def _lag(spread: FitUncertainty, movement: Movement, lag_s: float) -> Contributor:
    source = "uncertainty.acceleration_lag_ms"
    return type_b("filter's lag", 1e3 * lag_s, "ms", source, spread.covariance_of(lag_pattern(movement, lag_s)))


def _drift(spread: FitUncertainty, matrix: Array, attitudes: Array, drift: FieldDrift | None) -> Contributor:
    patterns, change_t = drift_patterns(matrix, attitudes, drift)
    if drift is None:
        source = f"procedure.field_test_s {NOT_GIVEN_SUFFIX}"
        return type_b("drift of the field", change_t / FIELD.bias.size, "µT", source, spread.covariance_of(patterns))
    tested = spread.covariance_of(patterns)
    return Contributor("drift of the field", "A", "normal", None, "", "tests at home", float(TESTED_AXES), tested)
