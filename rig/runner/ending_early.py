"""A run that ends before its last repeat, once its uncertainty is what is wanted.

The arm only makes motions that pre-flight has judged: every repeat ends in one pose, where the plan's last way home
begins. Where a repeat ends in another pose, the run goes on.
"""

import time
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from rig.analysis.reached import reached_so_far
from rig.analysis.shortest import Reached, Wanted
from rig.data.run_file import RunData, read_run
from rig.errors import RigError
from rig.motion.steps import SAME_PLACE_RAD, Motion, Plan, Sweep, Transfer
from rig.station.events import WantedReached

WRITTEN_S = 0.6  # by then the recorder has written all that it was given


@dataclass(slots=True)
class EndingEarly:
    """The end of a run of `repeats` with so many `sweeps` in all, of which the `plan` is what was left to do.

    It is recorded at `path`, `earlier` are the recordings before. Nothing here moves anything.
    """

    wanted: Wanted
    plan: Plan
    sweeps: int
    repeats: int
    path: Path
    earlier: Sequence[RunData]
    estimator: str
    ended: bool = False
    _motions: int = 0  # asked for so far
    _last: Sweep | None = None  # made, and not looked at yet
    _repeats_left: int = field(default=0)

    def swept(self, sweep: Sweep) -> None:
        """Note a sweep that was made."""
        each = self.sweeps // self.repeats
        complete = (sweep.index + 1) % each == 0 and sweep.index + 1 < self.sweeps
        self._repeats_left = self.repeats - (sweep.index + 1) // each
        self._last = sweep if complete and self._home_begins_at(sweep) else None

    def due(self) -> bool:
        """Whether a repeat was completed that nobody has looked at."""
        return self._last is not None and not self.ended

    @contextmanager
    def looking(self) -> Iterator["Future[Reached | None]"]:
        """The uncertainty so far, as it will be found meanwhile."""
        pool = ThreadPoolExecutor(max_workers=1)
        try:
            yield pool.submit(self._look)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def found(self, looked: "Future[Reached | None]") -> WantedReached | None:
        """What was found, where it ends the run; what takes too long ends nothing."""
        self._last = None
        reached = looked.result() if looked.done() else None
        if reached is None or not self.wanted.met_by(reached):
            return None
        self.ended = True
        return WantedReached(reached.scale, reached.bias_rad_s, self._repeats_left)

    def passes_over(self, motion: Motion) -> bool:
        """Whether the next motion of the plan is not made: after the end, all but the last way home."""
        self._motions += 1
        return self.ended and self._motions <= len(self.plan.motions) - len(self._home())

    def _look(self) -> Reached | None:
        time.sleep(WRITTEN_S)
        try:
            return reached_so_far([*self.earlier, read_run(self.path)], self.estimator)
        except RigError:  # what is wrong with the recording, the end of the run will say
            return None

    def _home(self) -> list[Motion]:
        """The transfers after the last sweep."""
        motions = list(self.plan.motions)
        last = max((place for place, each in enumerate(motions) if isinstance(each, Sweep)), default=-1)
        return [each for each in motions[last + 1 :] if isinstance(each, Transfer)]

    def _home_begins_at(self, sweep: Sweep) -> bool:
        home = self._home()
        ends = home[0].start_q_rad if home else self.plan.home_q_rad
        return all(abs(mine - its) < SAME_PLACE_RAD for mine, its in zip(sweep.end_q_rad, ends, strict=True))
