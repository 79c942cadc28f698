"""What the recordings of a run that goes on amount to so far: observations, refusals, parameters once they are known.

Whoever looks on is told this. The result comes from `rig.analysis.outcome` when all is recorded, and may say more and
otherwise: of uncertainty there is the noise alone here.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.calibration import solve_vector
from rig.data.quantity import ACCELERATION, RATE
from rig.data.run_file import RunData
from rig.errors import Fault, or_fault
from rig.estimation.arrays import Array
from rig.estimation.vector_model import VectorSolution
from rig.observation.acceleration import DwellReading, each_dwell
from rig.observation.arm_motion import ArmMotion, motion_of
from rig.observation.average import Average, Stream, on_the_arms_clock
from rig.observation.observe import Observation, each_sweep, observe_sensor
from rig.observation.windows import finished_dwells, finished_sweeps


@dataclass(frozen=True, slots=True)
class SoFar:
    """What a sensor's run tells yet: each finished sweep's observation or the Fault it ends in, by the sweep's index.

    `dwells` are the same of what its accelerometer read in each finished dwell; `gravity_m_s2` is the site's, None in
    recordings of before there was one. The `solution` is the vector model's, or the Fault that says what is missing
    yet. `bias_rad_s` (3,) is that of the rests alone, with its standard deviation, None without rests.
    """

    sweeps: Mapping[int, Observation | Fault]
    dwells: Mapping[int, DwellReading | Fault]
    gravity_m_s2: float | None
    solution: VectorSolution | Fault
    bias_rad_s: tuple[Array, Array] | None


Seen = tuple[dict[int, Observation | Fault], dict[int, DwellReading | Fault], Sequence[Average]]  # and the rests


def so_far(runs: Sequence[RunData]) -> dict[str, SoFar]:
    """What recordings of raw readings hold, by sensor; a sweep or dwell that several hold counts in the last one."""
    if not runs:
        return {}
    sweeps: dict[str, dict[int, Observation | Fault]] = {}
    rests: dict[str, list[Average]] = {}
    dwells: dict[str, dict[int, DwellReading | Fault]] = {}
    for run in runs:
        try:
            motion = motion_of(run)
        except Fault:
            continue  # nothing has moved yet
        for name in run.measuring(RATE):
            turned, dwelt, rested = _seen(run, name, motion)
            sweeps.setdefault(name, {}).update(turned)
            dwells.setdefault(name, {}).update(dwelt)
            rests.setdefault(name, []).extend(rested)
    site = runs[-1].settings.site
    return {
        name: SoFar(
            dict(sorted(found.items())),
            dict(sorted(dwells[name].items())),
            None if site is None else site.gravity_m_s2,
            _solution(found, rests[name], np.array(runs[-1].sensors[name].mounting)),
            _bias(rests[name]),
        )
        for name, found in sweeps.items()
    }


def _seen(run: RunData, name: str, motion: ArmMotion) -> Seen:
    sensor = run.sensors[name]
    try:
        stream = on_the_arms_clock(run.samples[name], sensor, motion)
    except Fault as fault:  # of the sensor as a whole: its clock is not found
        dwelt = finished_dwells(run) if sensor.measures(ACCELERATION) else ()
        return dict.fromkeys(finished_sweeps(run), fault), dict.fromkeys(dwelt, fault), ()
    turned, rests = _observed(run, name, stream, motion)
    return turned, each_dwell(run, stream, motion, run.settings.observation), rests


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
