"""A plan cut into segments as a recording is, with readings that nothing is wrong with: what checks would see. Pure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rig.analysis.design.planned_motion import PlannedRun, measured, planned_motion, timed_of
from rig.analysis.gyroscope.segments import Segments
from rig.estimation.arrays import Array
from rig.motion.steps import Plan, Sweep
from rig.observation.consistency.raw_readings import REST
from rig.observation.consistency.segments import MotionInterval, segment_counts
from rig.observation.consistency.transfers import SPARSE_S, find_transfer, is_by_wrists, sensed_gravity_m_s2
from rig.observation.motion.arm_motion import ArmMotion


@dataclass(frozen=True, slots=True)
class Planned:
    """The segments of sweeps and rests, and these with the ways between them, as the flange turns."""

    segments: Segments
    ways: Segments

    def read_by(self, matrix: Array, angle_random_walk_rad_sqrt_s: float, rate_hz: float) -> "Planned":
        """The segments read by a sensor of F (3, 3) that noise walks the angle of: its means over T have that over √T.

        Samples that are too far apart tell nothing of the ways.
        """

        def read(segments: Segments) -> Segments:
            variances = angle_random_walk_rad_sqrt_s**2 / np.diff(segments.times_s) * np.ones(3)
            return replace(segments, means_rad_s=segments.rates_rad_s @ matrix.T, variances_rad2_s2=variances)

        return Planned(read(self.segments), read(self.ways if 1 / rate_hz <= SPARSE_S else self.segments))


@dataclass(frozen=True, slots=True)
class _Part:
    sweep: int
    position: float
    interval: MotionInterval


def planned_segments(run: PlannedRun) -> Planned:
    """The segments of a planned run. Raises Fault `no_motion`."""
    motion, extension_m = planned_motion(run.plan, run.arm), np.array(run.settings.extension_m)
    parts = list(_parts(run.plan, motion))
    ways = [_Part(REST - 1 - place, 0.0, way) for place, way in enumerate(_ways(run.plan, motion))]

    def segments(of: Sequence[_Part]) -> Segments:
        intervals = tuple(each.interval for each in of)
        nothing = np.zeros((len(of), 3))
        return Segments(
            sweep=np.array([each.sweep for each in of]),
            position=np.array([each.position for each in of]),
            means_rad_s=nothing,
            variances_rad2_s2=nothing,
            rates_rad_s=np.array([motion.mean_rate(each.start_s, each.end_s) for each in intervals]),
            gravity_m_s2=np.array([sensed_gravity_m_s2(each, run.site.down_m_s2, extension_m) for each in intervals]),
            attitudes=np.array([motion.attitude(each.start_s, each.end_s) for each in intervals]),
            speed_std=np.zeros(len(of)),
            times_s=np.array([(each.start_s, each.end_s) for each in intervals]),
            intervals=intervals,
            readings=(),
        )

    return Planned(segments(parts), segments([*parts, *ways]))


def _parts(plan: Plan, motion: ArmMotion) -> Iterator[_Part]:
    """A plan's parts, as `rig.observation.consistency.segments` divides a recording: the sweeps, then the rests."""
    parts, of_rest = segment_counts(len(plan.sweeps))
    for place, sweep in enumerate(timed_of(plan, Sweep)):
        yield from _cut(motion, sweep.window_s, place, parts)
    for each in measured(plan):
        if not isinstance(each.step, Sweep):
            yield from _cut(motion, each.window_s, REST, of_rest)


def _cut(motion: ArmMotion, window_s: tuple[float, float], sweep: int, parts: int) -> Iterator[_Part]:
    for each, ends in enumerate(pairwise(np.linspace(*window_s, parts + 1).tolist())):
        yield _Part(sweep, 2 * each / (parts - 1) - 1 if parts > 1 else 0.0, MotionInterval(motion, *ends))


def _ways(plan: Plan, motion: ArmMotion) -> list[MotionInterval]:
    """The wrists' ways between all that is measured, before it and after."""
    measured_s = [time_s for each in measured(plan) for time_s in (each.start_s, each.end_s)]
    edges_s = [0.0, *measured_s, float(motion.time_s[-1])]
    ways = [find_transfer(motion, *between_s) for between_s in zip(edges_s[::2], edges_s[1::2], strict=True)]
    return [way for way in ways if way is not None and is_by_wrists(way)]
