"""What belongs into the uncertainty of accelerometers and magnetometers beside what their readings tell."""

from dataclasses import replace
from typing import Final

import numpy as np

from rig.analysis.reference.accelerometer_errors import Sheet, of_its_own
from rig.data.quantity import FIELD
from rig.data.recording.settings import Site
from rig.estimation.arrays import Array, scale_of
from rig.estimation.earth import STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.budget import NOT_GIVEN, Budget, Contributor
from rig.estimation.reference.accelerometer_model import Dwells, Movement
from rig.estimation.reference.attitude_error import AttitudeError
from rig.estimation.reference.imu import ImuSolution
from rig.estimation.reference.magnetometer import FieldDrift, Uniformity
from rig.estimation.reference.reference_budget import (
    KnownSize,
    Spread,
    assumed,
    reference_budget,
    response_in_attitudes,
    scale_and_bias,
)
from rig.estimation.reference.triaxial import TriaxialSolution

# What gravity by latitude and height alone may be off by: the anomalies of rocks and terrain, 50 mGal.
LOCAL_GRAVITY_M_S2: Final = 0.0005
# What a place may differ by from the standard value: 9.780 at the equator to 9.832 at the poles, less in the mountains.
ANY_GRAVITY_M_S2: Final = 0.03
UNSTATED_FIELD: Final = 0.01  # of the field: an ordinary fluxgate
UNTESTED_DRIFT_T: Final = 1e-7  # in a run: a magnetic storm, a lift some floors away
TESTED_AXES: Final = 3  # of one change of the field, by which its standard deviation is known
SIZE_OF_FIELD: Final = "size of the field"


def accelerometer_budget(
    solution: ImuSolution,
    movement: Movement,
    site: Site,
    lag_s: float,
    *,
    noise_freedom: Array,
    sheet: Sheet | None = None,
) -> Budget:
    """The budget of the solution found from the `movement`; `lag_s` is how late the sensor's own filter may be.

    `noise_freedom` (3 N + 9 M,) as in `Spread`: of the dwells' readings, then of the sweeps' harmonics. `sheet`
    is that by which the solution's `own` errors are known.
    """
    spread = _spread(
        solution,
        solution.response,
        movement.noise(),
        solution.attitude_error,
        (solution.chi_square, solution.freedom),
        noise_freedom=noise_freedom,
    )
    own = None if sheet is None else solution.own
    return accelerometer_lines(spread, solution.theta, replace(movement, own=own), site, lag_s, sheet=sheet)


def accelerometer_lines(
    spread: Spread, theta: Array, movement: Movement, site: Site, lag_s: float, *, sheet: Sheet | None
) -> Budget:
    """The budget of scale and bias that spread so, where θ (22,) is found from the `movement` with its `own` errors."""
    others = [_lagging(spread, movement, lag_s)] if len(movement.sweeps.speeds_rad_s) else []
    if movement.own is None or sheet is None:
        return reference_budget(spread, _gravity(site), others)
    bare, own = of_its_own(spread, theta, movement, sheet)
    return reference_budget(bare, _gravity(site), [*own, *others])


def magnetometer_budget(
    solution: TriaxialSolution,
    seen: Dwells,
    tested: tuple[Uniformity, FieldDrift | None],
    site: Site,
    *,
    field_t: float,
    noise_freedom: Array,
) -> Budget:
    """The budget of a solution found from what was `seen`, in tesla."""
    alike, drift = tested
    spread = _spread(
        solution,
        response_in_attitudes(solution, seen),
        np.diag(seen.variances_m2_s4.ravel()),
        solution.attitude_error or AttitudeError(0.0, 0.0),
        (alike.chi_square, alike.degrees_of_freedom),
        noise_freedom=noise_freedom,
    )
    return reference_budget(spread, _field(site, field_t), [_drifting(spread, solution.matrix, seen.attitudes, drift)])


def _spread(
    solution: ImuSolution | TriaxialSolution,
    response: Array,
    noise: Array,
    error: AttitudeError,
    left: tuple[float, int],
    *,
    noise_freedom: Array,
) -> Spread:
    """Spread of scale and bias, from the `response` (p, n) of all found; `left`: residuals' χ², its freedom."""
    scale = scale_of(solution.matrix)
    told = scale_and_bias(solution.matrix, scale, len(solution.covariance))
    return Spread(scale, told @ solution.covariance @ told.T, told @ response, noise, error, *left, noise_freedom)


def _gravity(site: Site) -> KnownSize:
    size, said = site.gravity_m_s2, "site.gravity_uncertainty_m_s2"
    if site.gravity_expanded_m_s2 is not None:
        return KnownSize("gravity", site.gravity_expanded_m_s2 / size, True, size, "m/s²", said)
    half_width = ANY_GRAVITY_M_S2 if size == STANDARD_GRAVITY_M_S2 else LOCAL_GRAVITY_M_S2
    return KnownSize("gravity", half_width / size, False, size, "m/s²", f"{said} {NOT_GIVEN}")


def _field(site: Site, field_t: float) -> KnownSize:
    size_ut, said = field_t / FIELD.bias.size, "site.magnetic_field_uncertainty_ut"
    if site.magnetic_field_expanded_t is not None:
        relative = site.magnetic_field_expanded_t / field_t
        return KnownSize(SIZE_OF_FIELD, relative, True, size_ut, "µT", said)
    return KnownSize(SIZE_OF_FIELD, UNSTATED_FIELD, False, size_ut, "µT", f"{said} {NOT_GIVEN}")


def lag_pattern(movement: Movement, lag_s: float) -> Array:
    """(1, 3 K) what the sensor's own filter takes of a turn's wave: (ω τ)²/2, which the model leaves out."""
    dwells, sweeps = movement.dwells, movement.sweeps
    smaller = sweeps.harmonics_m_s2 * np.square(sweeps.speeds_rad_s * lag_s)[:, None, None] / 2
    smaller[:, 0] = 0.0  # the mean passes whole
    return np.concatenate([np.zeros(dwells.readings_m_s2.size), smaller.ravel()])[None]


def drift_patterns(matrix: Array, attitudes: Array, drift: FieldDrift | None) -> tuple[Array, float]:
    """(3, 3 N) patterns of a field that changes evenly from the first attitude to the last, along the base's axes.

    By one standard uncertainty where its `drift` was tested, else by half of all that is possible; and how much, T.
    """
    change_t = UNTESTED_DRIFT_T
    if drift is not None:
        change_t = max(float(np.linalg.norm(each)) for each in (drift.change_t, drift.std_t)) / np.sqrt(3)
    along = np.linspace(-0.5, 0.5, len(attitudes))[:, None, None] * (matrix @ np.swapaxes(attitudes, -1, -2))
    return change_t * np.moveaxis(along, -1, 0).reshape(3, -1), change_t


def _lagging(spread: Spread, movement: Movement, lag_s: float) -> Contributor:
    said = "uncertainty.acceleration_lag_ms"
    return assumed("filter's lag", 1e3 * lag_s, "ms", said, spread.of(lag_pattern(movement, lag_s)))


def _drifting(spread: Spread, matrix: Array, attitudes: Array, drift: FieldDrift | None) -> Contributor:
    patterns, change_t = drift_patterns(matrix, attitudes, drift)
    if drift is None:
        said = f"procedure.field_test_s {NOT_GIVEN}"
        return assumed("drift of the field", change_t / FIELD.bias.size, "µT", said, spread.of(patterns))
    tested = spread.of(patterns)
    return Contributor("drift of the field", "A", "normal", None, "", "tests at home", float(TESTED_AXES), tested)
