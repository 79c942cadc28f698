"""Accelerometers from dwells in known attitudes and from sweeps: TRIAX, section III-B, on an arm."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType

import numpy as np

from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.reference.accelerometer_errors import mean_temperature_c, pieces_of, sheet_of, with_errors
from rig.analysis.reference.reference_budgets import accelerometer_budget
from rig.analysis.reference.triad import BESIDE, Triad, check_mounted, check_seen, known_gravity, seen_in
from rig.data.quantity import ACCELERATION
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import PlannedDwell, RunSettings, Site
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt_each
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.reference.accelerometer import specific_force
from rig.estimation.reference.accelerometer_model import LEVER, NO_SWEEPS, SECOND, Movement, Sweeps
from rig.estimation.reference.imu import ImuSolution, solve_imu
from rig.estimation.reference.reference_model import F
from rig.estimation.reference.triaxial import Method, TriaxialSolution, solve_triaxial
from rig.estimation.statistics.expected_sizes import OWN_SHARES
from rig.estimation.triads import Alignment, align_triads
from rig.observation.observed_run import ObservedRun
from rig.observation.reference.acceleration import DwellReading
from rig.observation.reference.swept_acceleration import SweptAcceleration
from rig.observation.statistics.mean import by_axis

NO_GYROSCOPES: Mapping[str, SensorResult] = MappingProxyType({})
NOT_SEEN = "Set procedure.second_order: false, which makes the bias much better known; or dwell longer"


@dataclass(frozen=True, slots=True)
class HeldOut:
    """The attitudes gone through once more after the calibration, which knows nothing of them.

    `error_m_s2` (N,): the size of each calibrated acceleration less that of gravity.
    """

    dwells: tuple[DwellReading, ...]
    error_m_s2: Array

    @property
    def rms_m_s2(self) -> float:
        """Root mean square of the attitudes' errors."""
        return float(np.sqrt(np.mean(self.error_m_s2**2)))


@dataclass(frozen=True, slots=True)
class AccelerometerResult:
    """One accelerometer's calibration, a = F (s + φ s²) + b, and what it rests on; `sweeps` counts them.

    The body of the `solution` is the sensor as it is nominally mounted: F is nearly diagonal, and φ the sensor's own.
    `alignment` is to the gyroscope beside it, None where that was not calibrated.

    The `movement` is all that the solution was found from.

    The `triad` has scale and axes by the solution alone, the `budget` all that is known of the uncertainty of scale and
    bias. Beside it stand the solutions from the attitudes alone, by method,
    or the Fault each ends in. `held_out`: when the attitudes were repeated. `temperature_c` is the mean of all
    readings.
    """

    sensor: RecordedSensor
    gravity_m_s2: float
    movement: Movement
    solution: ImuSolution
    triad: Triad
    budget: Budget
    alignment: Alignment | None
    beside: Attempts[Method, TriaxialSolution]
    dwells: tuple[DwellReading, ...]
    sweeps: int
    held_out: HeldOut | None
    temperature_c: float | None

    @property
    def correction_matrix(self) -> Array:
        """(3, 3) M of s = M (a − b).

        In the right-angled frame nearest to the gyroscope's axes, where that is known: corrected rates and
        accelerations are in one frame then. Else in that nearest to the accelerometer's own.
        """
        matrix = self.triad.correction_matrix
        return matrix if self.alignment is None else self.alignment.rotation.T @ matrix

    @property
    def bias_m_s2(self) -> Array:
        """(3,) bias b."""
        return self.solution.bias_m_s2

    @property
    def lever_arm_m(self) -> Array | None:
        """(3,) from the sweeps' axes to the sensor, in the flange's frame; None without sweeps."""
        lever = self.solution.lever_arm_m
        return None if lever is None else np.array(self.sensor.mounting).T @ lever

    @property
    def lever_arm_std_m(self) -> Array | None:
        """(3,) standard deviations of the lever arm: a nominal mounting only renames the axes."""
        if self.solution.lever_arm_m is None:
            return None
        std: Array = np.abs(np.array(self.sensor.mounting)).T @ np.sqrt(np.diag(self.solution.covariance)[LEVER])
        return std


def calibrate_accelerometers(
    recordings: Sequence[ObservedRun], settings: RunSettings, gyroscopes: Mapping[str, SensorResult] = NO_GYROSCOPES
) -> dict[str, AccelerometerResult]:
    """Every sensor to calibrate whose accelerations were recorded in dwells; beside the `gyroscopes` of the same run.

    Raises Fault as `solve_imu` and `solve_triaxial` do, and `not_all_attitudes`, `second_order_not_seen`,
    `swapped_axes`, `mirrored_axis`, `wrong_mounting`.
    """
    if not settings.planned_dwells:
        return {}
    described = recordings[0].run.sensors
    return {
        name: _calibrated(name, recordings, settings, settings.site, gyroscopes.get(name))
        for name in settings.to_calibrate
        if described[name].measures(ACCELERATION)
    }


def _calibrated(
    name: str,
    recordings: Sequence[ObservedRun],
    settings: RunSettings,
    site: Site,
    gyroscope: SensorResult | None,
) -> AccelerometerResult:
    sensor = recordings[0].run.sensors[name]
    dwells = tuple(dwell for recording in recordings for dwell in recording.sensors[name].dwells)
    used, left_out = _apart(dwells, _wanted(dwells, settings))
    mounting = np.array(sensor.mounting)
    seen, swept = seen_in(used, mounting), _swept(name, recordings)
    sweeps = sweeps_of(swept, mounting)
    solve = partial(
        solve_triaxial,
        seen.readings_m_s2,
        seen.attitudes,
        seen.variances_m2_s4,
        known_gravity(site),
        second_order=settings.second_order,
    )
    known, sheet = settings.stated_uncertainty, None
    movement = Movement(seen, sweeps, known.repeatability_std_rad)
    temperature_c = float(np.mean([dwell.temperature_c for dwell in used]))
    end_of_scale = sensor.channel(ACCELERATION).range
    if end_of_scale is not None:
        sheet = replace(sheet_of(known, name, end_of_scale), temperature_words=sensor.temperature_words)
        pieces = pieces_of(name, recordings, used)
        arm, temperature_c = recordings[0].motion.kinematics, mean_temperature_c(pieces)
        movement = with_errors(movement, pieces, sensor, sheet, arm, settings=settings)
    methods: tuple[Method, ...] = ("attitude_weighted", *BESIDE)
    beside = attempt_each({method: partial(solve, method=method) for method in methods})
    if weighted := beside.results.get("attitude_weighted"):
        check_mounted(weighted.matrix)
    elif movement.own is None:  # one attitude is off alone; what it is with a sensor that bends, `solve_imu` says
        raise beside.faults["attitude_weighted"]
    solution = solve_imu(
        seen,
        sweeps,
        gravity_m_s2=site.gravity_m_s2,
        up=site.up,
        second_order=settings.second_order,
        repeatability_rad=movement.repeatability_rad,
        own=movement.own,
        arm_turns=movement.arm_turns,
        own_shares=OWN_SHARES,
    )
    check_mounted(solution.matrix)
    if solution.second_order_s2_m is not None:
        check_seen(solution.second_order_s2_m, np.sqrt(np.diag(solution.covariance)[SECOND]), NOT_SEEN)
    return AccelerometerResult(
        sensor=sensor,
        gravity_m_s2=site.gravity_m_s2,
        movement=movement,
        solution=solution,
        triad=Triad.of(solution),
        budget=accelerometer_budget(
            solution,
            movement,
            site,
            1e-3 * known.acceleration_lag_ms,
            sheet=sheet,
            noise_freedom=_noise_freedom(used, swept),
        ),
        alignment=None if gyroscope is None else _alignment(gyroscope, solution, mounting),
        beside=beside,
        dwells=used,
        sweeps=len(sweeps.speeds_rad_s),
        held_out=_held_out(left_out, solution, site.gravity_m_s2) if left_out else None,
        temperature_c=None if np.isnan(temperature_c) else temperature_c,
    )


def _wanted(dwells: Sequence[DwellReading], settings: RunSettings) -> tuple[PlannedDwell, ...]:
    """The dwells that were planned; over temperature a run ends once its range is covered, with sets never begun."""
    if settings.reference_c is None:
        return settings.planned_dwells
    last = max((dwell.index for dwell in dwells), default=-1)
    return (
        tuple(planned_dwell for planned_dwell in settings.planned_dwells if planned_dwell.index <= last)
        or settings.planned_dwells
    )


def _apart(
    dwells: Sequence[DwellReading], planned: Sequence[PlannedDwell]
) -> tuple[tuple[DwellReading, ...], tuple[DwellReading, ...]]:
    """The dwells a calibration is made from, and the last repeat of the attitudes where there are several."""
    if missing := {each.index for each in planned} - {dwell.index for dwell in dwells}:
        raise Fault(
            "not_all_attitudes",
            f"{len(missing)} of {len(planned)} dwells were not finished",
            "Go on with `rig resume RUN_DIR`, or run the procedure again",
        )
    last = held_out(planned)
    used = tuple(dwell for dwell in dwells if dwell.index not in last)
    return used, tuple(dwell for dwell in dwells if dwell.index in last)


def held_out(planned: Sequence[PlannedDwell]) -> frozenset[int]:
    """The last repeat of the attitudes, by the dwells' indices; none where they are gone through once."""
    last = max(each.repeat for each in planned)
    return frozenset(each.index for each in planned if each.repeat == last > 0)


def sweeps_of(swept: Sequence[SweptAcceleration], mounting: Array) -> Sweeps:
    """All that was swept, in the axes of the sensor as it is nominally mounted."""
    if not swept:
        return NO_SWEEPS
    stations = list(dict.fromkeys(each.station for each in swept))
    return Sweeps(
        harmonics_m_s2=np.array([each.harmonic.harmonic_m_s2 for each in swept]),
        covariances_m2_s4=np.array([each.harmonic.covariance_m2_s4 for each in swept]),
        axes_flange=np.array([each.axis_flange for each in swept]) @ mounting.T,
        speeds_rad_s=np.array([each.harmonic.speed_rad_s for each in swept]),
        turning_rad2_s2=np.array([each.harmonic.turning_rad2_s2 for each in swept]),
        attitudes=np.array([(mounting @ each.attitude).T for each in swept]),
        arms_m=np.array([each.arm_m for each in swept]) @ mounting.T,
        stations=np.array([stations.index(each.station) for each in swept], dtype=np.intp),
    )


def _swept(name: str, recordings: Sequence[ObservedRun]) -> list[SweptAcceleration]:
    turns = [turn for recording in recordings for turn in recording.sensors[name].revolutions]
    return [turn.acceleration for turn in turns if turn.acceleration is not None]


def _noise_freedom(dwells: Sequence[DwellReading], swept: Sequence[SweptAcceleration]) -> Array:
    """(3 N + 9 M,) degrees of freedom of the readings of dwells, then of the harmonics of sweeps."""
    still = by_axis(dwell.reading.freedom for dwell in dwells).ravel()
    return np.concatenate([still, *(np.full(9, float(each.harmonic.freedom)) for each in swept)])


def _alignment(gyroscope: SensorResult, solution: ImuSolution, mounting: Array) -> Alignment | None:
    """How a gyroscope and its accelerometer are aligned, in the flange's axes; None without a vector solution."""
    vector = gyroscope.vector_model
    if vector is None:
        return None
    to_flange = np.kron(np.eye(3), mounting.T)  # of the rows of F
    return align_triads(
        vector.matrix,
        solution.matrix @ mounting,
        vector.matrix_covariance[F, F],
        to_flange @ solution.covariance[F, F] @ to_flange.T,
    )


def _held_out(dwells: tuple[DwellReading, ...], solution: ImuSolution, gravity_m_s2: float) -> HeldOut:
    means = np.array([dwell.reading.mean for dwell in dwells])
    found = specific_force(means, solution.matrix, solution.bias_m_s2, solution.second_order_s2_m)
    return HeldOut(dwells, np.linalg.norm(found, axis=1) - gravity_m_s2)
