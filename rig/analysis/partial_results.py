"""The partial results of a run in progress: observations, refusals, and parameters once they are identifiable.

Partial results are for display only: the final result may differ, and the uncertainty includes only the noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.gyroscope.calibration import solve_vector
from rig.data.quantity import ACCELERATION, FIELD, RATE
from rig.data.recording.run_data import RunData
from rig.errors import Fault
from rig.errors.attempts import Attempts, all_failed, attempt_each
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.observation.average import Average, Stream, synchronize_stream
from rig.observation.clocks.time_base import TimeBase
from rig.observation.field_means import field_mean, find_dwelling_companion
from rig.observation.finished_steps import complete_dwells, complete_sweeps
from rig.observation.motion.arm_motion import ArmMotion, motion_of
from rig.observation.observe import Observation, observe_each_sweep, observe_sensor
from rig.observation.observed_run import times_s
from rig.observation.reference.dwell_acceleration import DwellReading, read_each_dwell
from rig.observation.statistics.mean import QuantityInDwell, ReadAtRest

NO_SWEEP_YET = Fault("too_few_observations", "no sweep is averaged yet", "Wait for the first one")


@dataclass(frozen=True, slots=True)
class PartialGyroscope:
    """A gyroscope's partial result.

    - `sweeps`: the observations of finished sweeps, or their Faults, by the sweep's index.
    - `solution`: that of the vector model; if sweeps and rests do not suffice it is None, and `missing` says why.
    - `bias_rad_s`: the bias (3,) from the rests alone, and its standard deviation (3,); None without rests.
    """

    sweeps: Attempts[int, Observation]
    solution: VectorSolution | None
    missing: Fault | None
    bias_rad_s: tuple[Array, Array] | None


@dataclass(frozen=True, slots=True)
class PartialResults:
    """The partial results of a run: those of every gyroscope, and the means of other sensors in finished dwells."""

    gyroscopes: Mapping[str, PartialGyroscope]
    at_rest: Attempts[QuantityInDwell, ReadAtRest]


@dataclass(frozen=True, slots=True)
class _RecordedPart:
    """The observations of a gyroscope and its accelerometer in one recording; `clock` is None if undetermined."""

    clock: TimeBase | None
    sweeps: Attempts[int, Observation]
    dwells: Attempts[int, DwellReading]
    rests: Sequence[Average]


def so_far(runs: Sequence[RunData]) -> PartialResults:
    """Return the partial results of a run; if a sweep or dwell was repeated, only its last execution is used."""
    sweeps: dict[str, Attempts[int, Observation]] = {}
    rests: dict[str, list[Average]] = {}
    at_rest: Attempts[QuantityInDwell, ReadAtRest] = Attempts()
    for run in runs:
        try:
            motion = motion_of(run)
        except Fault:
            continue  # nothing has moved yet
        recorded = {name: _observe(run, name, motion) for name in run.measuring(RATE)}
        for name, sensor in recorded.items():
            sweeps[name] = sweeps.get(name, Attempts()).merge(sensor.sweeps)
            rests.setdefault(name, []).extend(sensor.rests)
        at_rest = at_rest.merge(_accelerations(run, recorded)).merge(_fields(run, recorded))
    return PartialResults(
        {
            name: _solve_gyroscope(attempts, rests[name], np.array(runs[-1].sensors[name].mounting))
            for name, attempts in sweeps.items()
        },
        at_rest,
    )


def _solve_gyroscope(sweeps: Attempts[int, Observation], rests: Sequence[Average], mounting: Array) -> PartialGyroscope:
    """Return a gyroscope's partial result, whose solution is None while sweeps and rests do not suffice."""
    observations = [observation for _, observation in sorted(sweeps.results.items())]
    solution, missing = None, NO_SWEEP_YET if not observations else None
    if observations:
        try:
            solution = solve_vector(observations, rests, mounting)
        except Fault as fault:
            missing = fault
    return PartialGyroscope(sweeps, solution, missing, _bias(rests))


def _observe(run: RunData, name: str, motion: ArmMotion) -> _RecordedPart:
    """Return the sensor's sweeps, dwells and rests so far, with the Faults of sweeps and dwells that are unusable."""
    sensor = run.sensors[name]
    try:
        stream = synchronize_stream(run.samples[name], sensor, motion)
    except Fault as fault:  # a fault of the sensor as a whole: its clock is not found
        dwells = complete_dwells(run) if sensor.measures(ACCELERATION) else ()
        return _RecordedPart(None, all_failed(complete_sweeps(run), fault), all_failed(dwells, fault), ())
    sweeps, rests = _observe_sweeps(run, name, stream, motion)
    return _RecordedPart(stream.clock, sweeps, read_each_dwell(run, stream, motion, run.settings.observation), rests)


def _accelerations(run: RunData, recorded: Mapping[str, _RecordedPart]) -> Attempts[QuantityInDwell, ReadAtRest]:
    """Return the mean acceleration in each dwell of each sensor, or the Fault of the dwell."""
    gravity_m_s2 = run.settings.site.gravity_m_s2
    results, faults = dict[QuantityInDwell, ReadAtRest](), dict[QuantityInDwell, Fault]()
    for name, sensor in recorded.items():
        faults |= {QuantityInDwell(name, ACCELERATION, i, ""): fault for i, fault in sensor.dwells.faults.items()}
        for index, dwell in sensor.dwells.results.items():
            key = QuantityInDwell(name, ACCELERATION, index, dwell.name)
            results[key] = ReadAtRest(key, dwell.reading, gravity_m_s2)
    return Attempts(results, faults)


def _fields(run: RunData, recorded: Mapping[str, _RecordedPart]) -> Attempts[QuantityInDwell, ReadAtRest]:
    """Return each magnetometer's mean in each dwell, or the dwell's Fault if the dwell could not be read.

    The dwells are those of an accelerometer that shares the magnetometer's clock and shows when the arm rests.
    """
    expected_t = run.settings.site.magnetic_field_t
    fields: Attempts[QuantityInDwell, ReadAtRest] = Attempts()
    for name in run.measuring(FIELD):
        dwelling = (sensor for sensor, part in recorded.items() if part.dwells.results or part.dwells.faults)
        other = find_dwelling_companion(run, name, dwelling)
        if other is None:
            continue
        clock, dwells = recorded[other].clock, recorded[other].dwells
        time_s = np.empty(0) if clock is None else times_s(run, name, {other: clock}, other)
        read = partial(_read_field, run, time_s, expected_t)
        by_dwell = {QuantityInDwell(name, FIELD, i, dwell.name): dwell for i, dwell in dwells.results.items()}
        fields = fields.merge(attempt_each({key: partial(read, key, dwell) for key, dwell in by_dwell.items()}))
        refused = {QuantityInDwell(name, FIELD, i, ""): fault for i, fault in dwells.faults.items()}
        fields = fields.merge(Attempts({}, refused))
    return fields


def _read_field(
    run: RunData, time_s: Array, expected_t: float | None, key: QuantityInDwell, dwell: DwellReading
) -> ReadAtRest:
    return ReadAtRest(key, field_mean(run, key.sensor, time_s, dwell, run.settings.observation), expected_t)


def _observe_sweeps(
    run: RunData, name: str, stream: Stream, motion: ArmMotion
) -> tuple[Attempts[int, Observation], Sequence[Average]]:
    """Return the observations of sweeps, or their Faults, by the sweep's index; and the averages of rests."""
    thresholds = run.settings.observation
    sweeps = observe_each_sweep(run, stream, motion, thresholds)
    dwells = {dwell.index for dwell in run.settings.planned_dwells}
    try:
        sensor = observe_sensor(run, name, motion, thresholds, sweeps.faults.keys() | dwells)
    except Fault as fault:  # a fault of the sensor as a whole
        return all_failed(complete_sweeps(run), fault), ()
    return sweeps.merge(Attempts({turn.sweep: turn for turn in sensor.revolutions})), sensor.rests


def _bias(rests: Sequence[Average]) -> tuple[Array, Array] | None:
    """Return the bias (3,), which is minus the weighted mean reading at rest, and its std; None without rests."""
    if not rests:
        return None
    weights = 1 / np.array([rest.variance_rad2_s2 for rest in rests])
    means = np.array([rest.mean_rad_s for rest in rests])
    bias: Array = -np.sum(weights * means, axis=0) / weights.sum(axis=0)
    std: Array = np.sqrt(1 / weights.sum(axis=0))
    return bias, std
