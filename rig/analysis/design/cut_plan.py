"""A plan divided into segments like a recording, with faultless readings. Pure functions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rig.analysis.design.planned_motion import PlannedRun, measuring_steps, predict_motion, time_steps_of
from rig.analysis.gyroscope.segment_table import Segments
from rig.estimation.arrays import Array
from rig.motion.steps import Plan, Sweep
from rig.observation.consistency.raw_readings import REST
from rig.observation.consistency.segments import MotionInterval, segment_counts
from rig.observation.consistency.transfers import MAX_STEP_S, find_transfer, is_by_wrists, mean_specific_force_m_s2
from rig.observation.motion.arm_motion import ArmMotion


@dataclass(frozen=True, slots=True)
class PlannedSegments:
    """The segments of sweeps and rests, without and with the transfers between them."""

    segments: Segments
    with_transfers: Segments

    def read_with(self, matrix: Array, angle_random_walk_rad_sqrt_s: float, rate_hz: float) -> "PlannedSegments":
        """Return the segments with the mean readings of a sensor with matrix F (3, 3), and with their variances.

        The variances are those of the angle random walk. Transfers are omitted if samples at `rate_hz` are too far
        apart to resolve them.
        """

        def read(segments: Segments) -> Segments:
            variances = angle_random_walk_rad_sqrt_s**2 / np.diff(segments.times_s) * np.ones(3)
            return replace(segments, means_rad_s=segments.rates_rad_s @ matrix.T, variances_rad2_s2=variances)

        return PlannedSegments(
            read(self.segments), read(self.with_transfers if 1 / rate_hz <= MAX_STEP_S else self.segments)
        )


@dataclass(frozen=True, slots=True)
class _PlannedSegment:
    sweep: int
    position: float
    interval: MotionInterval


def plan_segments(run: PlannedRun) -> PlannedSegments:
    """Return the segments of a planned run. Raise Fault `no_motion`."""
    motion, extension_m = predict_motion(run.plan, run.arm), np.array(run.settings.extension_m)
    parts = list(_list_parts(run.plan, motion))
    with_transfers = [
        _PlannedSegment(REST - 1 - index, 0.0, transfer)
        for index, transfer in enumerate(_find_transfers(run.plan, motion))
    ]

    def segments(parts: Sequence[_PlannedSegment]) -> Segments:
        intervals = tuple(part.interval for part in parts)
        nothing = np.zeros((len(parts), 3))
        return Segments(
            sweep=np.array([part.sweep for part in parts]),
            position=np.array([part.position for part in parts]),
            means_rad_s=nothing,
            variances_rad2_s2=nothing,
            rates_rad_s=np.array([motion.mean_rate(interval.start_s, interval.end_s) for interval in intervals]),
            gravity_m_s2=np.array(
                [mean_specific_force_m_s2(interval, run.site.down_m_s2, extension_m) for interval in intervals]
            ),
            attitudes=np.array([motion.attitude(interval.start_s, interval.end_s) for interval in intervals]),
            speed_std=np.zeros(len(parts)),
            times_s=np.array([(interval.start_s, interval.end_s) for interval in intervals]),
            intervals=intervals,
            readings=(),
        )

    return PlannedSegments(segments(parts), segments([*parts, *with_transfers]))


def _list_parts(plan: Plan, motion: ArmMotion) -> Iterator[_PlannedSegment]:
    """Yield the segments of sweeps, then rests, as `rig.observation.consistency.segments` divides a recording."""
    parts, parts_of_rest = segment_counts(len(plan.sweeps))
    for index, sweep in enumerate(time_steps_of(plan, Sweep)):
        yield from _cut_window(motion, sweep.window_s, index, parts)
    for measuring_step in measuring_steps(plan):
        if not isinstance(measuring_step.step, Sweep):
            yield from _cut_window(motion, measuring_step.window_s, REST, parts_of_rest)


def _cut_window(motion: ArmMotion, window_s: tuple[float, float], sweep: int, parts: int) -> Iterator[_PlannedSegment]:
    for index, ends in enumerate(pairwise(np.linspace(*window_s, parts + 1).tolist())):
        yield _PlannedSegment(sweep, 2 * index / (parts - 1) - 1 if parts > 1 else 0.0, MotionInterval(motion, *ends))


def _find_transfers(plan: Plan, motion: ArmMotion) -> list[MotionInterval]:
    """Return the transfers by wrists alone, before, between and after the plan's measurements."""
    measured_s = [
        time_s for measuring_step in measuring_steps(plan) for time_s in (measuring_step.start_s, measuring_step.end_s)
    ]
    edges_s = [0.0, *measured_s, float(motion.time_s[-1])]
    transfers = [find_transfer(motion, *between_s) for between_s in zip(edges_s[::2], edges_s[1::2], strict=True)]
    return [transfer for transfer in transfers if transfer is not None and is_by_wrists(transfer)]
