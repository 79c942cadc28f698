"""A run that ends before its last repeat, once its uncertainty is what is wanted.

The arm only makes motions that pre-flight has judged: after the end, the one of the plan that leads from where it
stands to home. Where the plan has none, the run goes on to the next repeat.
"""

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rig.analysis.design.reached import assess_reached
from rig.analysis.design.shortest import ReachedUncertainty, TargetUncertainty
from rig.data.recording.run_file import RunData, read_run
from rig.errors import RigError
from rig.motion.state import Joints
from rig.motion.steps import SAME_PLACE_RAD, Motion, Plan, Sweep, Transfer
from rig.station.events import UncertaintySoFar

WRITTEN_S = 0.6  # by then the recorder has written all that it was given
# Of what is wanted: the whole recording says a little more of clocks and noise than it does before the way home.
ENOUGH = 0.99


@dataclass(slots=True)
class EndingEarly:
    """The end of a run of `repeats` with so many `sweeps` in all, of which the `plan` is what was left to do.

    It is recorded at `path`, `earlier` are the recordings before. If these are whole repeats, the run may be at its
    end before anything moves. Nothing here moves anything.
    """

    wanted: TargetUncertainty
    plan: Plan
    sweeps: int
    repeats: int
    path: Path
    earlier: Sequence[RunData]
    estimator: str
    ended: bool = False
    _motions: int = 0  # asked for so far
    _due: bool = False
    _recorded: bool = False  # whether this recording has sweeps
    _repeats_left: int = 0
    _home: int | None = None  # the place in the plan of the motion that is still made after the end

    def __post_init__(self) -> None:
        left = [sweep.index for sweep in self.plan.sweeps]
        whole = bool(left) and left[0] % self._each == 0 and left == [*range(left[0], self.sweeps)]
        if self.earlier and whole:
            self._stands_at(self.plan.start_q_rad, len(left))

    def swept(self, sweep: Sweep) -> None:
        """Note a sweep that was made."""
        self._recorded = True
        left = [each.index for each in self.plan.motions[self._motions :] if isinstance(each, Sweep)]
        self._due = False
        if left and left[0] // self._each > sweep.index // self._each:
            self._stands_at(sweep.end_q_rad, len(left))

    def due(self) -> bool:
        """Whether a repeat was completed that nobody has looked at."""
        return self._due and not self.ended

    @contextmanager
    def looking(self) -> Iterator["Future[ReachedUncertainty | None]"]:
        """The uncertainty so far, as it will be found meanwhile."""
        pool = ThreadPoolExecutor(max_workers=1)
        try:
            yield pool.submit(self._look)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def found(self, looked: "Future[ReachedUncertainty | None]") -> UncertaintySoFar | None:
        """What was found, which may end the run; what takes too long ends nothing."""
        self._due = False
        reached = looked.result() if looked.done() else None
        if reached is None:
            return None
        self.ended = self.wanted.ratio_to_target(reached) <= ENOUGH
        return UncertaintySoFar(reached.scale, reached.bias_rad_s, self._repeats_left, self.ended)

    def passes_over(self, motion: Motion) -> bool:
        """Whether the next motion of the plan is not made: after the end, all but the way home."""
        place, self._motions = self._motions, self._motions + 1
        return self.ended and place != self._home

    def _look(self) -> ReachedUncertainty | None:
        time.sleep(WRITTEN_S)
        try:
            return assess_reached([*self.earlier, *([read_run(self.path)] if self._recorded else [])], self.estimator)
        except RigError:  # what is wrong with the recording, the end of the run will say
            return None

    @property
    def _each(self) -> int:
        """The sweeps of one repeat."""
        return self.sweeps // self.repeats

    def _stands_at(self, here: Joints, sweeps_left: int) -> None:
        """Look whether it is enough, if the rest of the plan knows the way home from here."""
        self._repeats_left = -(-sweeps_left // self._each)
        self._home = next(
            (
                place
                for place, each in enumerate(self.plan.motions)
                if place >= self._motions
                and isinstance(each, Transfer)
                and _same(each.start_q_rad, here)
                and _same(each.target_q_rad, self.plan.home_q_rad)
            ),
            None,
        )
        self._due = self._home is not None or _same(here, self.plan.home_q_rad)


def _same(one: Joints, other: Joints) -> bool:
    return all(abs(mine - its) < SAME_PLACE_RAD for mine, its in zip(one, other, strict=True))
