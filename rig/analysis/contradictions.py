"""What contradicts itself does not pass: the checks of the verdict that hold a recording against itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.allowance import allow, allowed
from rig.analysis.calibration import SensorResult, observe_recordings, solve_observed
from rig.analysis.consistency import consistency
from rig.analysis.pieces import cut
from rig.analysis.readings import judge_readings
from rig.analysis.surroundings import surroundings_of
from rig.analysis.verdict import Check
from rig.analysis.ways import with_ways
from rig.data.run_file import RunData
from rig.errors import RigError
from rig.observation.observed_run import ObservedRun

FALSE_ALARMS = 0.001  # how often one of these checks, of any sensor, fails an undamaged run, at most
SHARES = 13  # of each sensor: its statistics, each with a share of its own; one more where ways are looked at
DISTURBED = "disturbed_sweep"


@dataclass(frozen=True, slots=True)
class Contradictions:
    """The checks, in order, and the sweeps of the plan, by index, that they name."""

    checks: tuple[Check, ...]
    disturbed: frozenset[int]


def contradictions(
    recordings: Sequence[ObservedRun], results: Mapping[str, SensorResult], sensors: Sequence[str]
) -> Contradictions:
    """Of these sensors' results; none in recordings of before there was a site, which keep the verdicts they had.

    A sweep that is named is part of the name, `gyro.disturbed_sweep.3`.
    """
    settings = recordings[0].run.settings
    if settings.site is None:
        return Contradictions((), frozenset())
    surroundings = surroundings_of(recordings) if settings.checked_by_model else None
    checks: list[Check] = []
    disturbed: set[int] = set()
    rate = FALSE_ALARMS / ((SHARES + settings.checked_by_model) * len(sensors))
    for name in sensors:
        explained = results[name].explained
        if explained is None:
            continue
        pieces = cut(name, recordings, results[name], explained, settings.site)
        allowance = None
        if surroundings is not None:
            known = allowed(surroundings, name, results[name])
            allowance = allow(known, pieces, with_ways(pieces, name, recordings, explained), explained.solution.matrix)
        found = consistency(pieces, explained.solution.matrix, rate, allowance)
        counts = [recording.run.samples[name]["counts"].astype(np.int64) for recording in recordings]
        named = {results[name].observations[place].sweep: each for place, each in found.disturbed.items()}
        sweeps = {f"{DISTURBED}.{sweep}": each for sweep, each in sorted(named.items())} or {DISTURBED: found.sweep}
        statistics = {**sweeps, **found.statistics, **judge_readings(counts, pieces.windows, rate)}
        checks += [Check(f"{name}.{what}", value, limit, "1") for what, (value, limit) in statistics.items()]
        disturbed |= named.keys()
    return Contradictions(tuple(checks), frozenset(disturbed))


def names_a_sweep(check: str) -> bool:
    """Whether a check of that name is one a disturbed sweep has failed."""
    return f".{DISTURBED}." in check


def disturbed_sweeps(runs: Sequence[RunData]) -> frozenset[int]:
    """The sweeps in the recordings of a run so far that contradict the others; none where they cannot be solved."""
    try:
        recordings = observe_recordings(runs)
        if not recordings or not runs[0].settings.planned_sweeps:
            return frozenset()
        sensors = runs[0].settings.to_calibrate
        chosen = {name: runs[0].sensors[name] for name in sensors}
        results = solve_observed(chosen, recordings, surroundings=surroundings_of(recordings))
        return contradictions(recordings, results, sensors).disturbed
    except RigError:
        return frozenset()
