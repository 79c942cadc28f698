"""The bias of every sensor repeat by repeat, of a run that goes through the same attitudes again and again: TRIAX,
sections III-A and III-B, Figs. 4 and 6. Pure.
"""

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
from rig.estimation.statistics.coverage import effective_freedom
from rig.estimation.temperature.bias_by_repeat import BiasByRepeat, bias_by_repeat
from rig.estimation.temperature.bias_over_temperature import BiasOverTemperature, bias_over_temperature
from rig.observation.finished import dwell_times_s
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.mean import by_axis

FEWEST_REPEATS = 2
SLOPE = "over_temperature"


@dataclass(frozen=True, slots=True)
class Anew:
    """The bias of one repeat with everything found anew from it: (3,), and its standard deviation (3,)."""

    bias: Array
    std: Array


@dataclass(frozen=True, slots=True)
class BiasDrift:
    """The bias of one quantity of a sensor by repeat, rad/s or m/s².

    `held`: scale, axes and reference are those of the first repeat (accelerometers), or nominal (gyroscopes). A
    gyroscope's bias has what a scale that is not nominal makes of the Earth's rate in it, and all of the Earth's rate
    where the site does not say it (`earth_rate_known`): the same in every repeat. `common_std` (3,) is what all biases
    share beside that. `anew` is each repeat for itself, by its index. `time_s` and `temperature_c` (R,) are means over
    each repeat, times since the first. `freedom` (3,) is that of `held.std`, `slope_freedom` (3,) that of the slope's
    standard deviation. `faults` say by the name SLOPE why there is no slope.
    """

    held: BiasByRepeat
    common_std: Array
    anew: Attempts[int, Anew]
    time_s: Array
    temperature_c: Array
    over_temperature: BiasOverTemperature | None
    earth_rate_known: bool
    freedom: Array
    slope_freedom: Array
    faults: Mapping[str, Fault] = field(default_factory=dict)


Drifts = Mapping[str, Mapping[Quantity, BiasDrift]]


@dataclass(frozen=True, slots=True)
class Stand:
    """What a sensor read in one dwell: means (3,), their variances, the attitude base → sensor, when, how warm.

    `freedom` (3,) is the variances'.
    """

    mean: Array
    variance: Array
    attitude: Array
    time_s: float
    temperature_c: float
    freedom: Array | float = np.inf


def bias_drifts(recordings: Sequence[ObservedRun], settings: RunSettings) -> Drifts:
    """Drift of every sensor to calibrate, over all recordings of a run; repeats that were not finished are left out.

    Raises Fault `not_all_attitudes` with fewer than two whole repeats, and as `solve_triaxial` for the first one.
    """
    site = settings.site
    repeats: defaultdict[int, dict[tuple[float, ...], int]] = defaultdict(dict)
    for planned in settings.planned_dwells:
        repeats[planned.repeat][planned.q_rad] = planned.index
    order = sorted(repeats[0])
    table = [[found[q_rad] for q_rad in order] for _, found in sorted(repeats.items()) if len(found) == len(order)]
    drifts: dict[str, dict[Quantity, BiasDrift]] = {}
    for name in settings.to_calibrate:
        sensor = recordings[0].run.sensors[name]
        drifts[name] = {RATE: rate_drift(_whole(_rates(recordings, name, sensor), table), site)}
        if sensor.measures(ACCELERATION):
            accelerations = _whole(_accelerations(recordings, name, sensor), table)
            drifts[name][ACCELERATION] = acceleration_drift(accelerations, site, second_order=settings.second_order)
    return drifts


def _whole(stands: Mapping[int, Stand], table: Sequence[Sequence[int]]) -> list[list[Stand]]:
    """The whole repeats, attitudes in the same order."""
    whole = [[stands[index] for index in repeat] for repeat in table if stands.keys() >= set(repeat)]
    if len(whole) < FEWEST_REPEATS:
        raise Fault(
            "not_all_attitudes",
            f"{len(whole)} of {len(table)} repeats were finished, and a drift needs {FEWEST_REPEATS}",
            "Go on with `rig resume RUN_DIR`, or run the procedure again",
        )
    return whole


def _accelerations(recordings: Sequence[ObservedRun], name: str, sensor: RecordedSensor) -> dict[int, Stand]:
    """What the sensor's accelerometer read in each dwell, by the dwell's index."""
    mounting = np.array(sensor.mounting)
    return {
        dwell.index: Stand(
            dwell.reading.mean,
            dwell.reading.variance,
            mounting @ nearest_rotation(dwell.attitude),
            (dwell.window.start_s + dwell.window.end_s) / 2 + recording.clock_offset_s,
            dwell.temperature_c,
            dwell.reading.freedom,
        )
        for recording in recordings
        for dwell in recording.sensors[name].dwells
    }


def _rates(recordings: Sequence[ObservedRun], name: str, sensor: RecordedSensor) -> dict[int, Stand]:
    """A dwell is a rest of the gyroscope's."""
    mounting, found = np.array(sensor.mounting), {}
    for recording in recordings:
        for index, (start_s, end_s) in dwell_times_s(recording.run).items():
            for rest in recording.sensors[name].rests:
                inside = start_s <= rest.start_s and rest.end_s <= end_s
                if inside and rest.attitude is not None:  # always where an arm made it
                    found[index] = Stand(
                        rest.mean_rad_s,
                        rest.variance_rad2_s2 - rest.drift_rad2_s2,
                        mounting @ nearest_rotation(rest.attitude),
                        (rest.start_s + rest.end_s) / 2 + recording.clock_offset_s,
                        rest.temperature_c,
                        rest.freedom,
                    )
    return found


def acceleration_drift(repeats: Sequence[Sequence[Stand]], site: Site, *, second_order: bool) -> BiasDrift:
    """Drift of an accelerometer, from repeats of the same attitudes in the same order; the first finds what is held.

    Raises Fault as `solve_triaxial` and `bias_by_repeat` do.
    """
    means, variances, attitudes = _stacked(repeats)

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
    felt = np.einsum("rnji,j->rni", attitudes, first.reference)
    if first.second_order is not None:
        felt = felt + first.second_order * felt**2
    held = bias_by_repeat(means, variances, felt @ first.matrix.T, first.bias)
    # What the first repeat's noise adds to its bias is in its own `std` already.
    common = np.maximum(np.diag(first.covariance)[BIAS] - held.std[0] ** 2, 0.0)
    return _drift(repeats, held, np.sqrt(common), solve, earth_rate_known=site.earth_rate_rad_s is not None)


def rate_drift(repeats: Sequence[Sequence[Stand]], site: Site) -> BiasDrift:
    """Drift of a gyroscope, scale and axes held at their nominal values. Raises Fault as `bias_by_repeat` does."""
    means, variances, attitudes = _stacked(repeats)
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)

    def solve(repeat: int) -> TriaxialSolution:
        if site.earth_rate_rad_s is None:
            raise Fault(
                "earth_rate_unknown",
                "a gyroscope at rest shows the Earth's rate, and the configuration does not state the site",
                "Give site.latitude_deg and site.heading_deg",
            )
        known = KnownNorm(float(np.linalg.norm(earth)), earth)
        return solve_triaxial(means[repeat], attitudes[repeat], variances[repeat], known, method="maximum_likelihood")

    held = bias_by_repeat(means, variances, np.einsum("rnji,j->rni", attitudes, earth))
    return _drift(repeats, held, np.zeros(3), solve, earth_rate_known=site.earth_rate_rad_s is not None)


def _drift(
    repeats: Sequence[Sequence[Stand]],
    held: BiasByRepeat,
    common_std: Array,
    solve: Callable[[int], TriaxialSolution],
    *,
    earth_rate_known: bool,
) -> BiasDrift:
    times = np.array([np.mean([each.time_s for each in repeat]) for repeat in repeats])
    temperatures = np.array([np.mean([each.temperature_c for each in repeat]) for repeat in repeats])
    faults = dict[str, Fault]()
    slope = attempt(faults, SLOPE, partial(bias_over_temperature, held.bias, held.std, temperatures, times))
    freedom = np.minimum(held.freedom, np.min([_noise_freedom(repeat) for repeat in repeats], axis=0))
    return BiasDrift(
        held=held,
        common_std=common_std,
        anew=attempt_each({repeat: partial(_anew, solve, repeat) for repeat in range(len(repeats))}),
        time_s=times - times[0],
        temperature_c=temperatures,
        over_temperature=slope,
        earth_rate_known=earth_rate_known,
        freedom=freedom,
        slope_freedom=freedom if slope is None else np.minimum(slope.freedom, freedom),
        faults=faults,
    )


def _noise_freedom(repeat: Sequence[Stand]) -> Array:
    """(3,) degrees of freedom of a repeat's mean over its attitudes."""
    return effective_freedom([each.variance for each in repeat], by_axis(each.freedom for each in repeat))


def _anew(solve: Callable[[int], TriaxialSolution], repeat: int) -> Anew:
    found = solve(repeat)
    return Anew(found.bias, np.sqrt(np.diag(found.covariance)[BIAS]))


def _stacked(repeats: Sequence[Sequence[Stand]]) -> tuple[Array, Array, Array]:
    """Means and variances (R, N, 3), attitudes (R, N, 3, 3) from the sensor into the base."""
    return (
        np.array([[each.mean for each in repeat] for repeat in repeats]),
        np.array([[each.variance for each in repeat] for repeat in repeats]),
        np.array([[each.attitude.T for each in repeat] for repeat in repeats]),
    )
