"""Biases by repeat, in a run that visits attitudes several times (the paper TRIAX, III-A, III-B, Figs. 4, 6)."""

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rig.analysis.reference.triad import gravity_reference
from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.settings import RunSettings, Site
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt, attempt_each
from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import BIAS, KnownNorm
from rig.estimation.reference.triaxial import TriaxialSolution, solve_triaxial
from rig.estimation.sensor_axes import nearest_rotation
from rig.estimation.statistics.coverage import effective_dof
from rig.estimation.temperature.bias_by_repeat import BiasByRepeat, bias_by_repeat
from rig.estimation.temperature.bias_over_temperature import BiasOverTemperature, bias_over_temperature
from rig.observation.finished_steps import dwell_times_s
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.mean import dof_by_axis

MIN_REPEATS = 2
SLOPE = "over_temperature"


@dataclass(frozen=True, slots=True)
class ScaleFreeBias:
    """The bias (3,) and its std (3,) from a solution of one repeat alone, which estimates scale and axes too."""

    bias: Array
    std: Array


@dataclass(frozen=True, slots=True)
class BiasDrift:
    """The bias of one quantity of a sensor by repeat, rad/s or m/s².

    - scale_fixed: biases with scale and axes fixed: those of the first repeat (accelerometer), or nominal (gyroscope).
    - common_std (3,): the standard deviation of an error that all biases share, in addition to their own.
    - scale_free: the bias by a separate solution of every repeat, or its Fault, by the repeat's index.
    - time_s, temperature_c (R,): mean time, since the first of R repeats, and mean temperature of each repeat.
    - over_temperature: the slope of the bias over temperature, None without one.
    - earth_rate_known: whether the site states the Earth's rate. If not, a gyroscope's bias contains the whole Earth's
      rate, otherwise only its product with the scale error; either part is the same in every repeat.
    - dof, slope_dof (3,): degrees of freedom of `scale_fixed.std` and of the slope's standard deviation.
    - faults: under the name SLOPE, why there is no slope.
    """

    scale_fixed: BiasByRepeat
    common_std: Array
    scale_free: Attempts[int, ScaleFreeBias]
    time_s: Array
    temperature_c: Array
    over_temperature: BiasOverTemperature | None
    earth_rate_known: bool
    dof: Array
    slope_dof: Array
    faults: Mapping[str, Fault] = field(default_factory=dict)


Drifts = Mapping[str, Mapping[Quantity, BiasDrift]]


@dataclass(frozen=True, slots=True)
class DwellMean:
    """A sensor's mean reading (3,) in one dwell, at the middle time `time_s` and a mean temperature.

    - `variance`, `dof` (3,): the variance of the mean, and the degrees of freedom of this variance.
    - `attitude` (3, 3): takes vectors from the base's frame into the sensor's.
    """

    mean: Array
    variance: Array
    attitude: Array
    time_s: float
    temperature_c: float
    dof: Array | float = np.inf


def estimate_bias_drifts(recordings: Sequence[ObservedRun], settings: RunSettings) -> Drifts:
    """Return the bias drift of every sensor to calibrate, from the finished repeats in all recordings of a run.

    Raise Fault `not_all_attitudes` if fewer than two repeats were finished, and as `fit_acceleration_drift` does.
    """
    site = settings.site
    repeats: defaultdict[int, dict[tuple[float, ...], int]] = defaultdict(dict)
    for planned in settings.planned_dwells:
        repeats[planned.repeat][planned.q_rad] = planned.index
    order = sorted(repeats[0])
    table = [[dwells[q_rad] for q_rad in order] for _, dwells in sorted(repeats.items()) if len(dwells) == len(order)]
    drifts: dict[str, dict[Quantity, BiasDrift]] = {}
    for name in settings.to_calibrate:
        sensor = recordings[0].run.sensors[name]
        drifts[name] = {RATE: fit_rate_drift(_select_complete(_rates(recordings, name, sensor), table), site)}
        if sensor.measures(ACCELERATION):
            accelerations = _select_complete(_accelerations(recordings, name, sensor), table)
            drifts[name][ACCELERATION] = fit_acceleration_drift(accelerations, site, second_order=settings.second_order)
    return drifts


def _select_complete(means: Mapping[int, DwellMean], table: Sequence[Sequence[int]]) -> list[list[DwellMean]]:
    """Return the dwells of each complete repeat; rows of `table` list repeats. Raise Fault `not_all_attitudes`."""
    complete = [[means[index] for index in repeat] for repeat in table if means.keys() >= set(repeat)]
    if len(complete) < MIN_REPEATS:
        raise Fault(
            "not_all_attitudes",
            f"{len(complete)} of {len(table)} repeats were finished, but a drift needs {MIN_REPEATS}",
            "Go on with `rig resume RUN_DIR`, or run the procedure again",
        )
    return complete


def _accelerations(recordings: Sequence[ObservedRun], name: str, sensor: RecordedSensor) -> dict[int, DwellMean]:
    """Return the means of the sensor's accelerometer in every dwell, by the dwell's index."""
    mounting = np.array(sensor.mounting)
    return {
        dwell.index: DwellMean(
            dwell.reading.mean,
            dwell.reading.variance,
            mounting @ nearest_rotation(dwell.attitude),
            (dwell.window.start_s + dwell.window.end_s) / 2 + recording.clock_offset_s,
            dwell.temperature_c,
            dwell.reading.dof,
        )
        for recording in recordings
        for dwell in recording.sensors[name].dwells
    }


def _rates(recordings: Sequence[ObservedRun], name: str, sensor: RecordedSensor) -> dict[int, DwellMean]:
    """Return the gyroscope's mean reading while the arm stands still in every dwell, by the dwell's index."""
    mounting = np.array(sensor.mounting)
    means = {}
    for recording in recordings:
        for index, (start_s, end_s) in dwell_times_s(recording.run).items():
            for rest in recording.sensors[name].rests:
                inside = start_s <= rest.start_s and rest.end_s <= end_s
                if inside and rest.attitude is not None:  # always where an arm made it
                    means[index] = DwellMean(
                        rest.mean_rad_s,
                        rest.variance_rad2_s2 - rest.drift_rad2_s2,
                        mounting @ nearest_rotation(rest.attitude),
                        (rest.start_s + rest.end_s) / 2 + recording.clock_offset_s,
                        rest.temperature_c,
                        rest.dof,
                    )
    return means


def fit_acceleration_drift(repeats: Sequence[Sequence[DwellMean]], site: Site, *, second_order: bool) -> BiasDrift:
    """Return the bias drift of an accelerometer, from repeats of the same attitudes in the same order.

    Scale and axes are those of the first repeat. Raise Fault as `solve_triaxial` and `bias_by_repeat` do.
    """
    means, variances, attitudes = _stack(repeats)

    def solve(repeat: int) -> TriaxialSolution:
        return solve_triaxial(
            means[repeat],
            attitudes[repeat],
            variances[repeat],
            gravity_reference(site),
            second_order=second_order,
            method="attitude_weighted",
        )

    first = solve(0)
    sensed = np.einsum("rnji,j->rni", attitudes, first.reference)
    if first.second_order is not None:
        sensed = sensed + first.second_order * sensed**2
    by_repeat = bias_by_repeat(means, variances, sensed @ first.matrix.T, first.bias)
    # What the first repeat's noise adds to its bias is in its own `std` already.
    common = np.maximum(np.diag(first.covariance)[BIAS] - by_repeat.std[0] ** 2, 0.0)
    return _combine(repeats, by_repeat, np.sqrt(common), solve, earth_rate_known=site.earth_rate_rad_s is not None)


def fit_rate_drift(repeats: Sequence[Sequence[DwellMean]], site: Site) -> BiasDrift:
    """Return a gyroscope's bias drift, computed with nominal scale and axes. Raise Fault as `bias_by_repeat` does."""
    means, variances, attitudes = _stack(repeats)
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)

    def solve(repeat: int) -> TriaxialSolution:
        if site.earth_rate_rad_s is None:
            raise Fault(
                "earth_rate_unknown",
                "a gyroscope at rest shows the Earth's rate, but the configuration does not state the site",
                "Give site.latitude_deg and site.heading_deg",
            )
        field = KnownNorm(float(np.linalg.norm(earth)), earth)
        return solve_triaxial(means[repeat], attitudes[repeat], variances[repeat], field, method="maximum_likelihood")

    by_repeat = bias_by_repeat(means, variances, np.einsum("rnji,j->rni", attitudes, earth))
    return _combine(repeats, by_repeat, np.zeros(3), solve, earth_rate_known=site.earth_rate_rad_s is not None)


def _combine(
    repeats: Sequence[Sequence[DwellMean]],
    by_repeat: BiasByRepeat,
    common_std: Array,
    solve: Callable[[int], TriaxialSolution],
    *,
    earth_rate_known: bool,
) -> BiasDrift:
    """Return the drift from `by_repeat`, the biases with a fixed scale, and from a separate solution of each repeat.

    `solve` returns the latter. The slope over temperature is that of the biases with a fixed scale.
    """
    times = np.array([np.mean([mean.time_s for mean in repeat]) for repeat in repeats], dtype=np.float64)
    temperatures = np.array([np.mean([mean.temperature_c for mean in repeat]) for repeat in repeats], dtype=np.float64)
    faults = dict[str, Fault]()
    slope = attempt(faults, SLOPE, partial(bias_over_temperature, by_repeat.bias, by_repeat.std, temperatures, times))
    dof = np.minimum(by_repeat.dof, np.min([_repeat_dof(repeat) for repeat in repeats], axis=0))
    return BiasDrift(
        scale_fixed=by_repeat,
        common_std=common_std,
        scale_free=attempt_each({repeat: partial(_solve_repeat, solve, repeat) for repeat in range(len(repeats))}),
        time_s=times - times[0],
        temperature_c=temperatures,
        over_temperature=slope,
        earth_rate_known=earth_rate_known,
        dof=dof,
        slope_dof=dof if slope is None else np.minimum(slope.dof, dof),
        faults=faults,
    )


def _repeat_dof(repeat: Sequence[DwellMean]) -> Array:
    """Return the degrees of freedom (3,) of the variance of a repeat's mean over all its dwells."""
    return effective_dof([mean.variance for mean in repeat], dof_by_axis(mean.dof for mean in repeat))


def _solve_repeat(solve: Callable[[int], TriaxialSolution], repeat: int) -> ScaleFreeBias:
    solution = solve(repeat)
    return ScaleFreeBias(solution.bias, np.sqrt(np.diag(solution.covariance)[BIAS]))


def _stack(repeats: Sequence[Sequence[DwellMean]]) -> tuple[Array, Array, Array]:
    """Return means and variances (R, N, 3), and attitudes (R, N, 3, 3) from the sensor into the base."""
    return (
        np.array([[dwell.mean for dwell in repeat] for repeat in repeats]),
        np.array([[dwell.variance for dwell in repeat] for repeat in repeats]),
        np.array([[dwell.attitude.T for dwell in repeat] for repeat in repeats]),
    )
