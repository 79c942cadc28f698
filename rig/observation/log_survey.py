"""A survey of a log's readings: their sampling, the rests of the body, and its turns."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.estimation.arrays import Array
from rig.observation.by_hand.rests import find_rests
from rig.observation.external.csv_samples import Samples
from rig.observation.time_stamps.sampling import Sampling, find_sampling
from rig.observation.windows import Window, inside

MIN_TURN_RAD = 0.3  # between two rests
MIN_AXIS_FRACTION = 0.9  # of a turn's angle about one axis


@dataclass(frozen=True, slots=True)
class SurveyedTurn:
    """A turn from rest to rest by `angle_rad`; its `axis` is "+x", for example, or "other" if it is oblique."""

    window: Window
    axis: str
    angle_rad: float


@dataclass(frozen=True, slots=True)
class LogSurvey:
    """A log's sampling, rests and turns.

    - rests: windows in which the body lay still.
    - turns: from rest to rest, in the order of time.
    - at_rest: by quantity, the norm of the mean reading at rest, as the median over the rests.
    - largest: by quantity, the largest absolute reading of any axis.
    - faces: the number of directions of gravity at rest more than 45° apart.
    """

    span_s: float
    sampling: Sampling
    rests: tuple[Window, ...]
    turns: tuple[SurveyedTurn, ...]
    at_rest: dict[Quantity, float]
    largest: dict[Quantity, float]
    faces: int


def survey_log(samples: Samples) -> LogSurvey:
    """Return the survey of a log's readings."""
    time_s, readings = samples.time_s, samples.readings
    sampling = samples.sampling or find_sampling(time_s)
    rests = find_rests(time_s, {quantity: readings[quantity] for quantity in readings})
    cuts = [inside(time_s, rest) for rest in rests]
    at_rest = {
        quantity: float(np.median([np.linalg.norm(values[cut].mean(axis=0)) for cut in cuts]))
        for quantity, values in readings.items()
        if cuts
    }
    return LogSurvey(
        span_s=float(time_s[-1] - time_s[0]),
        sampling=sampling,
        rests=rests,
        turns=tuple(_find_turns(time_s, readings[RATE], rests)) if RATE in readings else (),
        at_rest=at_rest,
        largest={quantity: float(np.abs(values).max()) for quantity, values in readings.items()},
        faces=_count_faces([readings[ACCELERATION][cut].mean(axis=0) for cut in cuts])
        if ACCELERATION in readings
        else 0,
    )


def _find_turns(time_s: Array, rates: Array, rests: Sequence[Window]) -> Iterator[SurveyedTurn]:
    """Yield the turn between any two adjacent rests, unless it is too small.

    It is the integral of the rates minus the bias, which is the mean reading in the two rests.
    """
    for before, after in pairwise(rests):
        bias = np.mean([rates[inside(time_s, rest)].mean(axis=0) for rest in (before, after)], axis=0)
        window = Window(before.end_s, after.start_s)
        cut = inside(time_s, window)
        if cut.stop - cut.start < 2:
            continue
        turned = rates[cut] - bias
        angles = ((turned[1:] + turned[:-1]) / 2 * np.diff(time_s[cut])[:, None]).sum(axis=0)
        angle_rad = float(np.linalg.norm(angles))
        if angle_rad < MIN_TURN_RAD:
            continue
        axis = int(np.argmax(np.abs(angles)))
        is_about_one = abs(angles[axis]) >= MIN_AXIS_FRACTION * angle_rad
        name = f"{'+' if angles[axis] > 0 else '-'}{'xyz'[axis]}" if is_about_one else "other"
        yield SurveyedTurn(window, name, angle_rad)


def _count_faces(directions: Sequence[Array]) -> int:
    faces: list[Array] = []
    for direction in directions:
        unit = direction / (np.linalg.norm(direction) or np.inf)
        if unit.any() and all(float(unit @ face) < np.cos(np.pi / 4) for face in faces):
            faces.append(unit)
    return len(faces)
