"""The calibration of accelerometers on an arm, from dwells in known attitudes (the paper TRIAX, III-B) and sweeps."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType

import numpy as np

from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.reference.datasheet_errors import add_errors, list_windows, mean_temperature_c, read_datasheet
from rig.analysis.reference.reference_budgets import accelerometer_budget
from rig.analysis.reference.triad import (
    COMPARED_METHODS,
    Triad,
    check_identifiable,
    check_mounted,
    gravity_reference,
    stack_dwells,
)
from rig.data.quantity import ACCELERATION
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import PlannedDwell, RunSettings, Site
from rig.errors import Fault, name_sensor
from rig.errors.attempts import Attempts, attempt_each
from rig.errors.remedies_by_method import remedies_by_method
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.reference.accelerometer import specific_force
from rig.estimation.reference.accelerometer_model import LEVER, NO_SWEEPS, SECOND, Movement, Sweeps
from rig.estimation.reference.imu import ImuSolution, solve_imu
from rig.estimation.reference.reference_model import F
from rig.estimation.reference.triaxial import Method, TriaxialSolution, solve_triaxial
from rig.estimation.statistics.expected_variances import INDEPENDENT_FRACTIONS
from rig.estimation.triads import Alignment, align_triads
from rig.observation.observed_run import ObservedRun
from rig.observation.reference.dwell_acceleration import DwellReading
from rig.observation.reference.swept_acceleration import SweptAcceleration
from rig.observation.statistics.mean import dof_by_axis

NO_GYROSCOPES: Mapping[str, SensorResult] = MappingProxyType({})
ORDER_REMEDY = "Set procedure.second_order: false, which makes the bias much better known; or dwell longer"


@dataclass(frozen=True, slots=True)
class ValidationRepeat:
    """The N dwells of the last repeat of the attitudes, which are held out of the solution to validate it.

    `error_m_s2` (N,): the norm of the calibrated acceleration in each dwell, minus gravity.
    """

    dwells: tuple[DwellReading, ...]
    error_m_s2: Array

    @property
    def rms_m_s2(self) -> float:
        """The root mean square of `error_m_s2`."""
        return float(np.sqrt(np.mean(self.error_m_s2**2)))


@dataclass(frozen=True, slots=True)
class AccelerometerResult:
    """One accelerometer's calibration, reading a = F (s + φ s²) + b of a force s, in the axes of its nominal mounting.

    - movement: the readings from which the solution is estimated.
    - triad: scale and axes, with the uncertainty of the solution alone.
    - budget: the uncertainty of scale and bias from all causes.
    - alignment: rotation from the gyroscope of the same sensor, None if the gyroscope was not calibrated.
    - other_methods: the solutions from the attitudes alone, by method, or the Fault of a method that fails.
    - dwells: the dwells used in the solution.
    - sweeps: the number of sweeps used in the solution.
    - validation: the errors in the last repeat of the attitudes, None if the attitudes were not repeated.
    - temperature_c: the mean temperature of the readings, None without a thermometer.
    """

    sensor: RecordedSensor
    gravity_m_s2: float
    movement: Movement
    solution: ImuSolution
    triad: Triad
    budget: Budget
    alignment: Alignment | None
    other_methods: Attempts[Method, TriaxialSolution]
    dwells: tuple[DwellReading, ...]
    sweeps: int
    validation: ValidationRepeat | None
    temperature_c: float | None

    @property
    def correction_matrix(self) -> Array:
        """The matrix M (3, 3) of the correction s = M (a − b), without the quadratic terms.

        M takes readings to the orthogonal frame nearest to the gyroscope's axes, so that corrected rates and
        accelerations share a frame. Without an alignment it is the frame nearest to the accelerometer's own axes.
        """
        matrix = self.triad.correction_matrix
        return matrix if self.alignment is None else self.alignment.rotation.T @ matrix

    @property
    def bias_m_s2(self) -> Array:
        """The bias b (3,) of the readings."""
        return self.solution.bias_m_s2

    @property
    def lever_arm_m(self) -> Array | None:
        """The lever arm (3,) from the sweeps' axes to the sensor, in the flange's frame; None without sweeps."""
        lever = self.solution.lever_arm_m
        return None if lever is None else np.array(self.sensor.mounting).T @ lever

    @property
    def lever_arm_std_m(self) -> Array | None:
        """The standard deviations (3,) of the lever arm along the flange's axes; None without sweeps."""
        if self.solution.lever_arm_m is None:
            return None
        std: Array = np.abs(np.array(self.sensor.mounting)).T @ np.sqrt(np.diag(self.solution.covariance)[LEVER])
        return std


def calibrate_accelerometers(
    recordings: Sequence[ObservedRun], settings: RunSettings, gyroscopes: Mapping[str, SensorResult] = NO_GYROSCOPES
) -> Attempts[str, AccelerometerResult]:
    """Return the calibration of each sensor's accelerometer, with its alignment to the gyroscope, by sensor name.

    It is empty if no dwells are planned. The Faults are `not_all_attitudes`, `second_order_not_seen`, `swapped_axes`,
    `mirrored_axis`, `wrong_mounting`, and what `solve_imu` and `solve_triaxial` raise.
    """
    if not settings.planned_dwells:
        return Attempts()
    described = recordings[0].run.sensors

    def solve(name: str) -> AccelerometerResult:
        with name_sensor(name, described), _advise_on_arm():
            return _calibrate(name, recordings, settings, settings.site, gyroscopes.get(name))

    names = [name for name in settings.to_calibrate if described[name].measures(ACCELERATION)]
    return attempt_each({name: partial(solve, name) for name in names})


@contextmanager
def _advise_on_arm() -> Iterator[None]:
    """Raise a Fault `attitude_untrustworthy` with the remedy for an arm, whose attitudes no file states."""
    try:
        yield
    except Fault as fault:
        if fault.name != "attitude_untrustworthy":
            raise
        raise Fault(fault.name, fault.what, remedies_by_method(fault.name)["arm"]) from fault


def _calibrate(
    name: str, recordings: Sequence[ObservedRun], settings: RunSettings, site: Site, gyroscope: SensorResult | None
) -> AccelerometerResult:
    """Return one accelerometer's calibration by maximum likelihood, from dwells and sweeps, and by other methods."""
    sensor = recordings[0].run.sensors[name]
    dwells = tuple(dwell for recording in recordings for dwell in recording.sensors[name].dwells)
    used, left_out = _split_dwells(dwells, _select_planned(dwells, settings))
    mounting = np.array(sensor.mounting)
    measured, swept = stack_dwells(used, mounting), _list_swept(name, recordings)
    sweeps = stack_sweeps(swept, mounting)
    solve = partial(
        solve_triaxial,
        measured.readings_m_s2,
        measured.attitudes,
        measured.variances_m2_s4,
        gravity_reference(site),
        second_order=settings.second_order,
    )
    uncertainty, datasheet = settings.stated_uncertainty, None
    movement = Movement(measured, sweeps, uncertainty.repeatability_std_rad)
    temperature_c = float(np.mean([dwell.temperature_c for dwell in used]))
    end_of_scale = sensor.channel(ACCELERATION).range
    if end_of_scale is not None:
        datasheet = replace(read_datasheet(uncertainty, name, end_of_scale), temperature_words=sensor.temperature_words)
        windows = list_windows(name, recordings, used)
        arm, temperature_c = recordings[0].motion.kinematics, mean_temperature_c(windows)
        movement = add_errors(movement, windows, sensor, datasheet, arm, settings=settings)
    methods: tuple[Method, ...] = ("attitude_weighted", *COMPARED_METHODS)
    other_methods = attempt_each({method: partial(solve, method=method) for method in methods})
    if weighted := other_methods.results.get("attitude_weighted"):
        check_mounted(weighted.matrix)
    elif movement.sensor_errors is None:  # if there is nonlinearity, `solve_imu` decides
        raise other_methods.faults["attitude_weighted"]
    solution = solve_imu(
        measured,
        sweeps,
        gravity_m_s2=site.gravity_m_s2,
        up=site.up,
        second_order=settings.second_order,
        repeatability_rad=movement.repeatability_rad,
        sensor_errors=movement.sensor_errors,
        arm_turns=movement.arm_turns,
        independent_fractions=INDEPENDENT_FRACTIONS,
    )
    check_mounted(solution.matrix)
    if solution.second_order_s2_m is not None:
        check_identifiable(solution.second_order_s2_m, np.sqrt(np.diag(solution.covariance)[SECOND]), ORDER_REMEDY)
    return AccelerometerResult(
        sensor=sensor,
        gravity_m_s2=site.gravity_m_s2,
        movement=movement,
        solution=solution,
        triad=Triad.from_solution(solution),
        budget=accelerometer_budget(
            solution,
            movement,
            site,
            1e-3 * uncertainty.acceleration_lag_ms,
            datasheet=datasheet,
            noise_dof=_readings_dof(used, swept),
        ),
        alignment=None if gyroscope is None else _align_to_gyroscope(gyroscope, solution, mounting),
        other_methods=other_methods,
        dwells=used,
        sweeps=len(sweeps.speeds_rad_s),
        validation=_validate(left_out, solution, site.gravity_m_s2) if left_out else None,
        temperature_c=None if np.isnan(temperature_c) else temperature_c,
    )


def _select_planned(dwells: Sequence[DwellReading], settings: RunSettings) -> tuple[PlannedDwell, ...]:
    """Return the planned dwells; in a calibration over temperature only those up to the last dwell that was read."""
    if settings.reference_c is None:
        return settings.planned_dwells
    last = max((dwell.index for dwell in dwells), default=-1)
    return (
        tuple(planned_dwell for planned_dwell in settings.planned_dwells if planned_dwell.index <= last)
        or settings.planned_dwells
    )


def _split_dwells(
    dwells: Sequence[DwellReading], planned: Sequence[PlannedDwell]
) -> tuple[tuple[DwellReading, ...], tuple[DwellReading, ...]]:
    """Return the dwells to use in the solution, and those of the last repeat, which are left out to validate it.

    If each attitude is visited once, nothing is left out. Raise Fault `not_all_attitudes`.
    """
    if missing := {dwell.index for dwell in planned} - {dwell.index for dwell in dwells}:
        raise Fault(
            "not_all_attitudes",
            f"{len(missing)} of {len(planned)} dwells were not finished",
            "Go on with `rig resume RUN_DIR`, or run the procedure again",
        )
    last = select_validation(planned)
    used = tuple(dwell for dwell in dwells if dwell.index not in last)
    return used, tuple(dwell for dwell in dwells if dwell.index in last)


def select_validation(planned: Sequence[PlannedDwell]) -> frozenset[int]:
    """Return the indices of the last repeat's dwells; empty if each attitude is visited once."""
    last = max(dwell.repeat for dwell in planned)
    return frozenset(dwell.index for dwell in planned if dwell.repeat == last > 0)


def stack_sweeps(swept: Sequence[SweptAcceleration], mounting: Array) -> Sweeps:
    """Return the accelerations in all sweeps, as arrays in the axes of the sensor as it is nominally mounted."""
    if not swept:
        return NO_SWEEPS
    stations = list(dict.fromkeys(sweep.station for sweep in swept))
    return Sweeps(
        harmonics_m_s2=np.array([sweep.harmonic.harmonic_m_s2 for sweep in swept]),
        swayed_m_s2=np.array([sweep.harmonic.swayed_m_s2 for sweep in swept]),
        covariances_m2_s4=np.array([sweep.harmonic.covariance_m2_s4 for sweep in swept]),
        axes_flange=np.array([sweep.axis_flange for sweep in swept]) @ mounting.T,
        speeds_rad_s=np.array([sweep.harmonic.speed_rad_s for sweep in swept]),
        turning_rad2_s2=np.array([sweep.harmonic.turning_rad2_s2 for sweep in swept]),
        attitudes=np.array([(mounting @ sweep.attitude).T for sweep in swept]),
        arms_m=np.array([sweep.arm_m for sweep in swept]) @ mounting.T,
        stations=np.array([stations.index(sweep.station) for sweep in swept], dtype=np.intp),
    )


def _list_swept(name: str, recordings: Sequence[ObservedRun]) -> list[SweptAcceleration]:
    turns = [turn for recording in recordings for turn in recording.sensors[name].revolutions]
    return [turn.acceleration for turn in turns if turn.acceleration is not None]


def _readings_dof(dwells: Sequence[DwellReading], swept: Sequence[SweptAcceleration]) -> Array:
    """Return the degrees of freedom (3 N + 9 M,) of the variances of N dwells, then of the harmonics of M sweeps."""
    still = dof_by_axis(dwell.reading.dof for dwell in dwells).ravel()
    return np.concatenate([still, *(np.full(9, float(sweep.harmonic.dof)) for sweep in swept)])


def _align_to_gyroscope(gyroscope: SensorResult, solution: ImuSolution, mounting: Array) -> Alignment | None:
    """Return the rotation from gyroscope to accelerometer in the flange's axes; None without a vector solution."""
    vector = gyroscope.vector_model
    if vector is None:
        return None
    to_flange = np.kron(np.eye(3), mounting.T)  # acts on the rows of F
    return align_triads(
        vector.matrix,
        solution.matrix @ mounting,
        vector.matrix_covariance[F, F],
        to_flange @ solution.covariance[F, F] @ to_flange.T,
    )


def _validate(dwells: tuple[DwellReading, ...], solution: ImuSolution, gravity_m_s2: float) -> ValidationRepeat:
    means = np.array([dwell.reading.mean for dwell in dwells])
    accelerations = specific_force(means, solution.matrix, solution.bias_m_s2, solution.second_order_s2_m)
    return ValidationRepeat(dwells, np.linalg.norm(accelerations, axis=1) - gravity_m_s2)
