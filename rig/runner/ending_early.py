"""The end of a run before its last repeat, as soon as the target uncertainty is reached.

The arm makes only motions that pre-flight has judged: at the end, the plan's motion home from the present pose. If the
plan has none, the run continues with the next repeat.
"""

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rig.analysis.design.candidate_search import ReachedUncertainty, TargetUncertainty
from rig.analysis.design.reached_uncertainty import assess_reached
from rig.data.recording.run_data import RunData
from rig.data.recording.run_file import read_run
from rig.errors import RigError
from rig.motion.steps import POSE_TOLERANCE_RAD, Motion, Plan, Sweep, Transfer
from rig.motion.turner_state import Joints
from rig.station.events import UncertaintySoFar

WRITING_DELAY_S = 0.6  # after which the recorder has written everything
TARGET_RATIO = 0.99  # the complete recording determines clocks and noise slightly better than the present one


@dataclass(slots=True)
class EndingEarly:
    """The condition on which a run ends early; `skips` then tells the runner which motions to omit.

    - `wanted`: the target uncertainty.
    - `plan`: the remaining motions of the run.
    - `sweeps`, `repeats`: numbers of sweeps and repeats in the complete run.
    - `path`: the file of this recording.
    - `earlier`: the run's recordings before an interruption. If they end with a complete repeat, this run may end
      before its first motion.
    """

    wanted: TargetUncertainty
    plan: Plan
    sweeps: int
    repeats: int
    path: Path
    earlier: Sequence[RunData]
    estimator: str
    ended: bool = False
    _motions: int = 0  # number of motions that the script has begun
    _due: bool = False
    _recorded: bool = False  # whether this recording has sweeps
    _repeats_left: int = 0
    _home: int | None = None  # index of the motion that is still made after the end

    def __post_init__(self) -> None:
        """Mark an assessment as due if the run was interrupted after a complete repeat, before the next."""
        remaining = [sweep.index for sweep in self.plan.sweeps]
        whole = (
            bool(remaining)
            and remaining[0] % self._per_repeat == 0
            and remaining == [*range(remaining[0], self.sweeps)]
        )
        if self.earlier and whole:
            self._note_repeat_end(self.plan.start_q_rad, len(remaining))

    def note_sweep(self, sweep: Sweep) -> None:
        """Note a recorded sweep; mark an assessment as due if it completes a repeat."""
        self._recorded = True
        remaining = [motion.index for motion in self.plan.motions[self._motions :] if isinstance(motion, Sweep)]
        self._due = False
        if remaining and remaining[0] // self._per_repeat > sweep.index // self._per_repeat:
            self._note_repeat_end(sweep.end_q_rad, len(remaining))

    def due(self) -> bool:
        """Return whether the uncertainty must be assessed now, because a repeat was completed."""
        return self._due and not self.ended

    @contextmanager
    def look_in_background(self) -> Iterator["Future[ReachedUncertainty | None]"]:
        """Compute the uncertainty reached so far in a thread; yield the future of this uncertainty."""
        pool = ThreadPoolExecutor(max_workers=1)
        try:
            yield pool.submit(self._look)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def conclude(self, assessment: "Future[ReachedUncertainty | None]") -> UncertaintySoFar | None:
        """Return the uncertainty if it was computed in time; end the run if the target is met."""
        self._due = False
        reached = assessment.result() if assessment.done() else None
        if reached is None:
            return None
        self.ended = self.wanted.ratio_to_target(reached) <= TARGET_RATIO
        return UncertaintySoFar(reached.scale, reached.bias_rad_s, self._repeats_left, self.ended)

    def skips(self, motion: Motion) -> bool:
        """Return whether to skip the plan's next motion: after an early end, all but the motion to home are skipped."""
        index, self._motions = self._motions, self._motions + 1
        return self.ended and index != self._home

    def _look(self) -> ReachedUncertainty | None:
        time.sleep(WRITING_DELAY_S)
        try:
            return assess_reached([*self.earlier, *([read_run(self.path)] if self._recorded else [])], self.estimator)
        except RigError:  # the end of the run reports what is wrong with the recording
            return None

    @property
    def _per_repeat(self) -> int:
        """The number of sweeps in one repeat."""
        return self.sweeps // self.repeats

    def _note_repeat_end(self, pose: Joints, sweeps_left: int) -> None:
        """Note the repeats left; an assessment is due if `pose` is home or the remaining plan has a motion home."""
        self._repeats_left = -(-sweeps_left // self._per_repeat)
        self._home = next(
            (
                index
                for index, motion in enumerate(self.plan.motions)
                if index >= self._motions
                and isinstance(motion, Transfer)
                and _are_equal(motion.start_q_rad, pose)
                and _are_equal(motion.target_q_rad, self.plan.home_q_rad)
            ),
            None,
        )
        self._due = self._home is not None or _are_equal(pose, self.plan.home_q_rad)


def _are_equal(one: Joints, other: Joints) -> bool:
    return all(abs(mine - its) < POSE_TOLERANCE_RAD for mine, its in zip(one, other, strict=True))
