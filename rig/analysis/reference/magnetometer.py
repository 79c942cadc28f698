"""The calibration of magnetometers on an arm, from dwells in known attitudes: Eq. (7) of the paper TRIAX.

Iron and currents that turn with the magnetometer, also in the arm, cause a field that is part of the bias, and that no
residual shows. Runs with the sensor turned over between them separate the arm's field (`rig.analysis.reversal`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.reference.accelerometer import AccelerometerResult
from rig.analysis.reference.reference_budgets import magnetometer_budget
from rig.analysis.reference.triad import COMPARED_METHODS, Triad, check_mounted, field_reference, stack_dwells
from rig.data.quantity import FIELD
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import RunSettings
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt_each
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.reference.accelerometer_model import Dwells
from rig.estimation.reference.magnetometer import FieldDrift, Uniformity, field_drift, uniformity
from rig.estimation.reference.triaxial import MAX_ATTITUDE_ERROR_RAD, Method, TriaxialSolution, solve_triaxial
from rig.observation.field_means import field_readings, field_tests, find_companion
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.mean import StaticReading, dof_by_axis

ESTIMATOR: Method = "attitude_weighted"
REMEDY = "Take iron and currents away, or measure farther from them; set the sensor farther from the arm"


@dataclass(frozen=True, slots=True)
class MagnetometerResult:
    """One magnetometer's calibration, reading m = F B + b of a field B, in the axes of its nominal mounting.

    - field_t: the size of the field.
    - extension_m (3,): the sensor's position relative to the flange, in the flange's frame.
    - uniformity: the test of whether the field is the same in all attitudes.
    - drift: the change of the field between measurements at the home pose, None if there were fewer than two.
    - triad: scale, relative to `field_t`, and axes, with the uncertainty of the solution alone.
    - budget: the uncertainty of scale and bias from all causes.
    - other_methods: the solutions by the other methods, or the Fault of a method that fails.
    - measurements: the means from which the solution is estimated, in tesla.
    """

    sensor: RecordedSensor
    field_t: float
    extension_m: tuple[float, float, float]
    solution: TriaxialSolution
    uniformity: Uniformity
    drift: FieldDrift | None
    triad: Triad
    budget: Budget
    other_methods: Attempts[Method, TriaxialSolution]
    dwells: tuple[StaticReading, ...]
    measurements: Dwells


def calibrate_magnetometers(
    recordings: Sequence[ObservedRun], settings: RunSettings, accelerometers: Mapping[str, AccelerometerResult]
) -> Attempts[str, MagnetometerResult]:
    """Return the calibration of every recorded magnetometer, or its Fault.

    The `accelerometers` show how large the error of the arm's attitudes may be. The Faults are `no_attitudes` without
    dwells, `field_strength_unknown`, `field_drifts`, `field_not_uniform`, `attitude_untrustworthy`, `swapped_axes`,
    `mirrored_axis`, `wrong_mounting`, and those of `field_readings` and `solve_triaxial`.
    """
    magnetometers = recordings[0].run.measuring(FIELD)
    return attempt_each(
        {
            name: partial(_calibrate, name, sensor, recordings, settings, accelerometers)
            for name, sensor in magnetometers.items()
        }
    )


def _calibrate(
    name: str,
    sensor: RecordedSensor,
    recordings: Sequence[ObservedRun],
    settings: RunSettings,
    accelerometers: Mapping[str, AccelerometerResult],
) -> MagnetometerResult:
    """Return one magnetometer's calibration from its dwells. Raise the Faults of `calibrate_magnetometers`."""
    site = settings.site
    if not settings.planned_dwells:
        raise Fault(
            "no_attitudes",
            "recorded only: sweeps do not calibrate a magnetometer",
            "Use the procedure static_attitudes or imu, which hold attitudes",
        )
    reference = field_reference(site, "site.magnetic_field_ut")
    dwells = tuple(
        field_reading for run in recordings for field_reading in field_readings(run, name, settings.observation)
    )
    drift = _drift(name, recordings, settings)
    measurements = stack_dwells(dwells, np.array(sensor.mounting))
    inputs = measurements.readings_m_s2, measurements.attitudes, measurements.variances_m2_s4
    solve = partial(solve_triaxial, *inputs, reference)
    solution = _solve(solve)
    check_mounted(solution.matrix)
    homogeneity = uniformity(solution, *inputs, _attitude_error_rad(name, recordings, accelerometers))
    if not homogeneity.uniform:
        raise Fault("field_not_uniform", _describe_nonuniformity(homogeneity, solution), REMEDY)
    return MagnetometerResult(
        sensor=sensor,
        field_t=reference.norm,
        extension_m=settings.extension_m,
        solution=solution,
        uniformity=homogeneity,
        drift=drift,
        triad=Triad.from_solution(solution),
        budget=magnetometer_budget(
            solution,
            measurements,
            (homogeneity, drift),
            site,
            field_t=reference.norm,
            noise_dof=dof_by_axis(dwell.reading.dof for dwell in dwells).ravel(),
        ),
        other_methods=attempt_each({method: partial(solve, method=method) for method in COMPARED_METHODS}),
        dwells=dwells,
        measurements=measurements,
    )


def _drift(name: str, recordings: Sequence[ObservedRun], settings: RunSettings) -> FieldDrift | None:
    """Return the field's change between tests at the home pose, None without two tests. Raise Fault `field_drifts`."""
    tests = [test for run in recordings for test in field_tests(run, name, settings.observation, settings.home_q_rad)]
    if len(tests) < 2:
        return None
    means, variances = [test.mean for test in tests], [test.variance for test in tests]
    drift = field_drift(means, variances, settings.stated_uncertainty.repeatability_std_rad)
    if not drift.steady:
        change_t, std_t = np.linalg.norm(drift.change_t), np.linalg.norm(drift.std_t)
        raise Fault(
            "field_drifts",
            f"at home the readings changed by {1e6 * change_t:.3f} µT between two tests, but noise explains only "
            f"{1e6 * std_t:.3f} µT: a drifting field is taken for bias and scale",
            "Find what changed (a lift, a vehicle, a current, a sensor that warms up), wait, and run again",
        )
    return drift


def _solve(solve: Callable[..., TriaxialSolution]) -> TriaxialSolution:
    """Return the solution by `solve`. Raise Fault as `solve` does.

    If the Fault is that the attitudes contradict the readings, raise Fault `field_not_uniform` instead, because the
    accelerometer has confirmed the attitudes.
    """
    try:
        return solve(method=ESTIMATOR)
    except Fault as fault:
        if fault.name != "attitude_untrustworthy":
            raise
        what = f"the accelerometer agrees with the attitudes, but the magnetometer does not ({fault.what})"
        raise Fault("field_not_uniform", what, REMEDY) from fault


def _attitude_error_rad(
    name: str, recordings: Sequence[ObservedRun], accelerometers: Mapping[str, AccelerometerResult]
) -> float:
    """Return an upper bound of the arm's attitude error: an accelerometer's estimate plus two standard deviations.

    Raise Fault `attitude_untrustworthy` if no accelerometer has a solution.
    """
    if not accelerometers:
        raise Fault(
            "attitude_untrustworthy",
            "no accelerometer has a solution, which would show how exact the arm's attitudes are",
            "Correct what prevents the accelerometer's solution, then run again",
        )
    by = next((other for run in recordings if (other := find_companion(run, name)) in accelerometers), None)
    accelerometer = accelerometers[by] if by is not None else next(iter(accelerometers.values()))
    error = accelerometer.solution.attitude_error
    return min(error.std_rad + 2 * error.uncertainty_rad, MAX_ATTITUDE_ERROR_RAD)


def _describe_nonuniformity(uniformity: Uniformity, solution: TriaxialSolution) -> str:
    residual_t = np.sqrt(np.mean(solution.residuals**2))
    return (
        f"the field is not the same in all attitudes: χ² of the residuals is {uniformity.chi_square:.4g}, but noise "
        f"and attitude errors of {1e3 * uniformity.attitude_error_rad:.2g} mrad explain {uniformity.limit:.3g} at "
        f"most; their RMS is {1e6 * residual_t:.3f} µT"
    )
