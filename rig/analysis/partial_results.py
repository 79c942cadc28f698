"""What the recordings of a run that goes on amount to so far: observations, refusals, parameters once they are known.

Whoever looks on is told this. The result comes from `rig.analysis.outcome` when all is recorded, and may say more and
otherwise: of uncertainty there is the noise alone here.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.calibration import solve_vector
from rig.data.quantity import ACCELERATION, FIELD, RATE
from rig.data.run_file import RunData
from rig.errors import Fault, or_fault
from rig.estimation.arrays import Array
from rig.estimation.vector_model import VectorSolution
from rig.observation.acceleration import DwellReading, each_dwell
from rig.observation.arm_motion import ArmMotion, motion_of
from rig.observation.average import Average, Stream, on_the_arms_clock
from rig.observation.field import dwelt_beside, field_mean
from rig.observation.mean import Mean, ReadAtRest
from rig.observation.observe import Observation, each_sweep, observe_sensor
from rig.observation.observed_run import times_s
from rig.observation.timebase import TimeBase
from rig.observation.windows import finished_dwells, finished_sweeps


@dataclass(frozen=True, slots=True)
class Turned:
    """What a run tells of a gyroscope yet: each finished sweep's observation or the Fault it ends in, by its index.

    The `solution` is the vector model's, or the Fault that says what is missing yet. `bias_rad_s` (3,) is that of the
    rests alone, with its standard deviation, None without rests.
    """

    sweeps: Mapping[int, Observation | Fault]
    solution: VectorSolution | Fault
    bias_rad_s: tuple[Array, Array] | None


@dataclass(frozen=True, slots=True)
class SoFar:
    """What a run tells yet: of each gyroscope, and what others read in each finished dwell."""

    gyroscopes: Mapping[str, Turned]
    at_rest: Sequence[ReadAtRest]


@dataclass(frozen=True, slots=True)
class _Seen:
    """What one recording holds of a gyroscope, and of the accelerometer in it; no `clock` where none is found."""

    clock: TimeBase | None
    sweeps: Mapping[int, Observation | Fault]
    dwells: Mapping[int, DwellReading | Fault]
    rests: Sequence[Average]


def so_far(runs: Sequence[RunData]) -> SoFar:
    """What recordings of raw readings hold; a sweep or dwell that several hold counts in the last one."""
    sweeps: dict[str, dict[int, Observation | Fault]] = {}
    rests: dict[str, list[Average]] = {}
    at_rest: dict[tuple[str, str, int], ReadAtRest] = {}
    for run in runs:
        try:
            motion = motion_of(run)
        except Fault:
            continue  # nothing has moved yet
        seen = {name: _seen(run, name, motion) for name in run.measuring(RATE)}
        for name, each in seen.items():
            sweeps.setdefault(name, {}).update(each.sweeps)
            rests.setdefault(name, []).extend(each.rests)
        for read in (*_accelerations(run, seen), *_fields(run, seen)):
            at_rest[read.sensor, read.quantity.name, read.index] = read
    return SoFar(
        {
            name: Turned(
                dict(sorted(found.items())),
                _solution(found, rests[name], np.array(runs[-1].sensors[name].mounting)),
                _bias(rests[name]),
            )
            for name, found in sweeps.items()
        },
        sorted(at_rest.values(), key=lambda read: (read.sensor, read.index)),
    )


def _seen(run: RunData, name: str, motion: ArmMotion) -> _Seen:
    sensor = run.sensors[name]
    try:
        stream = on_the_arms_clock(run.samples[name], sensor, motion)
    except Fault as fault:  # of the sensor as a whole: its clock is not found
        dwelt = finished_dwells(run) if sensor.measures(ACCELERATION) else ()
        return _Seen(None, dict.fromkeys(finished_sweeps(run), fault), dict.fromkeys(dwelt, fault), ())
    turned, rests = _observed(run, name, stream, motion)
    return _Seen(stream.clock, turned, each_dwell(run, stream, motion, run.settings.observation), rests)


def _accelerations(run: RunData, seen: Mapping[str, _Seen]) -> Iterator[ReadAtRest]:
    gravity_m_s2 = run.settings.site.gravity_m_s2
    for name, each in seen.items():
        for index, dwell in each.dwells.items():
            words, reading = ("", dwell) if isinstance(dwell, Fault) else (dwell.name, dwell.reading)
            yield ReadAtRest(name, ACCELERATION, index, words, reading, gravity_m_s2)


def _fields(run: RunData, seen: Mapping[str, _Seen]) -> Iterator[ReadAtRest]:
    """What magnetometers read in the dwells of an accelerometer whose samples the same clock stamps."""
    expected_t = run.settings.site.magnetic_field_t
    for name in run.measuring(FIELD):
        other = dwelt_beside(run, name, (sensor for sensor, each in seen.items() if each.dwells))
        if other is None:
            continue
        clock = seen[other].clock
        time_s = np.empty(0) if clock is None else times_s(run, name, {other: clock}, other)
        for index, dwell in seen[other].dwells.items():
            words = "" if isinstance(dwell, Fault) else dwell.name
            yield ReadAtRest(name, FIELD, index, words, _field(run, name, time_s, dwell), expected_t)


def _field(run: RunData, name: str, time_s: Array, dwell: DwellReading | Fault) -> Mean | Fault:
    if isinstance(dwell, Fault):
        return dwell
    return or_fault(partial(field_mean, run, name, time_s, dwell, run.settings.observation))


def _observed(
    run: RunData, name: str, stream: Stream, motion: ArmMotion
) -> tuple[dict[int, Observation | Fault], Sequence[Average]]:
    thresholds = run.settings.observation
    found = each_sweep(run, stream, motion, thresholds)
    left_out = {index for index, each in found.items() if isinstance(each, Fault)}
    dwells = {dwell.index for dwell in run.settings.planned_dwells}
    try:
        seen = observe_sensor(run, name, motion, thresholds, left_out | dwells)
    except Fault as fault:  # of the sensor as a whole
        return dict.fromkeys(finished_sweeps(run), fault), ()
    return {**found, **{each.sweep: each for each in seen.revolutions}}, seen.rests


def _solution(
    sweeps: Mapping[int, Observation | Fault], rests: Sequence[Average], mounting: Array
) -> VectorSolution | Fault:
    observations = [each for _, each in sorted(sweeps.items()) if isinstance(each, Observation)]
    if not observations:
        return Fault("too_few_observations", "no sweep is averaged yet", "Wait for the first one")
    return or_fault(partial(solve_vector, observations, rests, mounting))


def _bias(rests: Sequence[Average]) -> tuple[Array, Array] | None:
    """Mean reading at rest, its sign turned as of g = K (m + b), weighted by inverse variance."""
    if not rests:
        return None
    weights = 1 / np.array([rest.variance_rad2_s2 for rest in rests])
    means = np.array([rest.mean_rad_s for rest in rests])
    bias: Array = -np.sum(weights * means, axis=0) / weights.sum(axis=0)
    std: Array = np.sqrt(1 / weights.sum(axis=0))
    return bias, std
