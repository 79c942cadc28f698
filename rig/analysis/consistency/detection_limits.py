"""What may happen while a sensor is recorded, from what size on that is told, and what it does to a result."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from rig.analysis.consistency.alternatives import DAMAGES, Means
from rig.analysis.consistency.reference_alternatives import DAMAGES as REFERENCE_DAMAGES
from rig.analysis.gyroscope.calibration import SensorResult
from rig.analysis.gyroscope.vector_inputs import unknown_of
from rig.analysis.surroundings import Surroundings
from rig.data.quantity import RATE, Quantity
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import Unknown, budget
from rig.estimation.gyroscope.vector_fit import Explained, explain
from rig.observation.consistency.raw_readings import REST


@dataclass(frozen=True, slots=True)
class ToldFrom:
    """The size, in `unit`, from which on a check tells that `what` happened, in 95 of 100 recordings.

    Infinite where no size is told. Just below it the scale factor or bias farthest off is off by so many times the U
    that is stated then, where that is known.
    """

    what: str
    check: str
    size: float
    unit: str
    off_by_expanded: float | None = None


def of_gyroscope(
    sizes: Mapping[str, float], name: str, result: SensorResult, surroundings: Surroundings
) -> Iterator[ToldFrom]:
    """What may happen to the gyroscope `name`, which its checks tell from these `sizes` on."""
    explained = result.explained
    if explained is None:
        return
    means, mounting = _means(explained), np.array(result.sensor.mounting)
    unknown = unknown_of(surroundings, name, result.earth)
    for each in DAMAGES:
        if (size := sizes.get(each.what)) is None:
            continue
        off_by = None
        if np.isfinite(size) and result.uncertainty is not None:
            off_by = _off_by(size * each.patterns(means), explained, mounting, unknown)
        yield ToldFrom(each.what, each.check, size, each.unit or RATE.unit, off_by)


def of_reference(sizes: Mapping[str, float], quantity: Quantity) -> tuple[ToldFrom, ...]:
    """The damages that are told of what gravity or the field calibrates, whose checks are named by its quantity."""
    return tuple(
        ToldFrom(each.what, f"{quantity}_{each.check}", sizes[each.what], each.unit or quantity.unit)
        for each in REFERENCE_DAMAGES
        if each.what in sizes
    )


def _means(explained: Explained) -> Means:
    """The averages that the solution was found from."""
    seen = explained.seen
    turns = np.flatnonzero(seen.turns_rad_s.any(axis=1))
    sweep = np.full(len(seen.turns_rad_s), REST)
    sweep[turns] = np.arange(len(turns))
    return Means(seen.rates_rad_s @ explained.solution.matrix.T, seen.windows_s, sweep)


def _off_by(patterns: Array, explained: Explained, mounting: Array, unknown: Unknown) -> float | None:
    """How wrong a result is, in U, by that of the patterns (k, N, 3) to which the solution responds most.

    Solved anew: a bias that seems to wander because of it has a larger U too. None where it has no solution.
    """
    solution, seen = explained.solution, explained.seen
    response = np.einsum("qni,kni->kq", solution.response, patterns) / np.sqrt(np.diag(solution.covariance))
    worst = patterns[int(np.argmax(np.abs(response).max(axis=1)))]
    try:
        damaged = explain(replace(seen, means_rad_s=seen.means_rad_s + worst), mounting)
    except Fault:
        return None
    found, undamaged = damaged.solution, solution
    off = np.concatenate([found.scale - undamaged.scale, found.bias_rad_s - undamaged.bias_rad_s])
    return float(np.max(np.abs(off) / budget(damaged, unknown).expanded))
