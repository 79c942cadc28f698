"""Magnetometers from dwells in known attitudes: TRIAX, Eq. (7), on an arm.

As they are mounted: iron and currents that turn with a magnetometer are part of what is found of it, the arm's own
among them, which no residual shows. Runs with the sensor turned over tell them apart: `rig.analysis.reversal`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.reference.acceleration import AccelerometerResult
from rig.analysis.reference.reference_budgets import magnetometer_budget
from rig.analysis.reference.triad import BESIDE, Triad, check_mounted, known_field, seen_in
from rig.data.quantity import FIELD
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import RunSettings
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt_each
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.reference.accelerometer_model import Dwells
from rig.estimation.reference.magnetometer import FieldDrift, Uniformity, field_drift, uniformity
from rig.estimation.reference.triaxial import UNTRUSTWORTHY_RAD, Method, TriaxialSolution, solve_triaxial
from rig.observation.field import field_readings, field_tests, find_companion
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.mean import StaticReading, by_axis

ESTIMATOR: Method = "attitude_weighted"
ELSEWHERE = "Take iron and currents away, or measure farther from them; set the sensor farther from the arm"


@dataclass(frozen=True, slots=True)
class MagnetometerResult:
    """One magnetometer's calibration m = F B + b in the axes of its nominal mounting, and what it rests on.

    The `triad` has scale, relative to the field's size `field_t`, and axes by the solution alone, the `budget` all that
    is known of the uncertainty of scale and bias.
    `extension_m` (3,) is where it sits on the flange, `drift` how the field changed between tests at home, None where
    there were fewer than two. `seen` is what it was found from, in tesla. `beside` are the other methods' solutions, or
    the Fault each ends in.
    """

    sensor: RecordedSensor
    field_t: float
    extension_m: tuple[float, float, float]
    solution: TriaxialSolution
    uniformity: Uniformity
    drift: FieldDrift | None
    triad: Triad
    budget: Budget
    beside: Attempts[Method, TriaxialSolution]
    dwells: tuple[StaticReading, ...]
    seen: Dwells


def calibrate_magnetometers(
    recordings: Sequence[ObservedRun], settings: RunSettings, accelerometers: Mapping[str, AccelerometerResult]
) -> Attempts[str, MagnetometerResult]:
    """Every magnetometer that was recorded, or the Fault for which it is not calibrated.

    `accelerometers` say how far the arm's attitudes are off. The Fault is `no_attitudes` where none were held,
    `field_strength_unknown`, `field_drifts`, `field_not_uniform`, one of those of `field_readings` and of
    `solve_triaxial`, `swapped_axes`, `mirrored_axis`, `wrong_mounting`.
    """
    magnetometers = recordings[0].run.measuring(FIELD)
    return attempt_each(
        {
            name: partial(_calibrated, name, sensor, recordings, settings, accelerometers)
            for name, sensor in magnetometers.items()
        }
    )


def _calibrated(
    name: str,
    sensor: RecordedSensor,
    recordings: Sequence[ObservedRun],
    settings: RunSettings,
    accelerometers: Mapping[str, AccelerometerResult],
) -> MagnetometerResult:
    site = settings.site
    if not settings.planned_dwells:
        raise Fault(
            "no_attitudes",
            "recorded only: sweeps do not calibrate a magnetometer",
            "Use the procedure static_attitudes or imu, which hold attitudes",
        )
    known = known_field(site, "site.magnetic_field_ut")
    dwells = tuple(
        field_reading for run in recordings for field_reading in field_readings(run, name, settings.observation)
    )
    drift = _drift(name, recordings, settings)
    seen = seen_in(dwells, np.array(sensor.mounting))
    read = seen.readings_m_s2, seen.attitudes, seen.variances_m2_s4
    solve = partial(solve_triaxial, *read, known)
    solution = _solved(solve)
    check_mounted(solution.matrix)
    alike = uniformity(solution, *read, _attitude_error_rad(name, recordings, accelerometers))
    if not alike.uniform:
        raise Fault("field_not_uniform", _not_alike(alike, solution), ELSEWHERE)
    return MagnetometerResult(
        sensor=sensor,
        field_t=known.norm,
        extension_m=settings.extension_m,
        solution=solution,
        uniformity=alike,
        drift=drift,
        triad=Triad.of(solution),
        budget=magnetometer_budget(
            solution,
            seen,
            (alike, drift),
            site,
            field_t=known.norm,
            noise_freedom=by_axis(dwell.reading.freedom for dwell in dwells).ravel(),
        ),
        beside=attempt_each({method: partial(solve, method=method) for method in BESIDE}),
        dwells=dwells,
        seen=seen,
    )


def _drift(name: str, recordings: Sequence[ObservedRun], settings: RunSettings) -> FieldDrift | None:
    """Drift by the tests at home of all recordings; None where there is no second one. Raises Fault `field_drifts`."""
    tests = [test for run in recordings for test in field_tests(run, name, settings.observation, settings.home_q_rad)]
    if len(tests) < 2:
        return None
    means, variances = [test.mean for test in tests], [test.variance for test in tests]
    found = field_drift(means, variances, settings.stated_uncertainty.repeatability_std_rad)
    if not found.steady:
        change_t, std_t = np.linalg.norm(found.change_t), np.linalg.norm(found.std_t)
        raise Fault(
            "field_drifts",
            f"at home the readings changed by {1e6 * change_t:.3f} µT between two tests, and noise explains "
            f"{1e6 * std_t:.3f}: a field that drifts reads as bias and scale",
            "Find what changed (a lift, a vehicle, a current, a sensor that warms up), wait, and run again",
        )
    return found


def _solved(solve: Callable[..., TriaxialSolution]) -> TriaxialSolution:
    """Raises Fault `field_not_uniform`: the accelerometer has found the same attitudes good."""
    try:
        return solve(method=ESTIMATOR)
    except Fault as fault:
        if fault.name != "attitude_untrustworthy":
            raise
        what = f"the accelerometer agrees with the attitudes, the magnetometer does not ({fault.what})"
        raise Fault("field_not_uniform", what, ELSEWHERE) from fault


def _attitude_error_rad(
    name: str, recordings: Sequence[ObservedRun], accelerometers: Mapping[str, AccelerometerResult]
) -> float:
    """How far off the arm's attitudes may be, with 2σ, by the accelerometer that stood in them on the same clock."""
    by = next((other for run in recordings if (other := find_companion(run, name)) in accelerometers), None)
    found = accelerometers[by] if by is not None else next(iter(accelerometers.values()))
    error = found.solution.attitude_error
    return min(error.std_rad + 2 * error.uncertainty_rad, UNTRUSTWORTHY_RAD)


def _not_alike(uniformity: Uniformity, solution: TriaxialSolution) -> str:
    left_t = np.sqrt(np.mean(solution.residuals**2))
    return (
        f"the field is not the same in all attitudes: χ² of what the model leaves is {uniformity.chi_square:.4g}, "
        f"{uniformity.limit:.3g} at most by noise and by attitudes off by "
        f"{1e3 * uniformity.attitude_error_rad:.2g} mrad; "
        f"{1e6 * left_t:.3f} µT are left in the mean"
    )
