"""The board's own calibration, as in the paper SIX: the board stores a sweep's readings, averages them and solves.

Only the host knows the revolution's times and speed, from the arm's joints and both clocks. After each sweep the host
sends two board times and the speed, and at the end it requests the solution. All answers are recorded;
`rig.analysis.gyroscope.onboard_check` compares them with the host's own results.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial

import numpy as np
import numpy.fft  # NumPy loads this and the next one at their first use, which would be while the arm moves
import numpy.ma

from firmware_host.client import Board, BoardObservation
from firmware_host.errors import BoardError
from firmware_host.protocol import METHODS
from rig.data.recording.recorded_events import BoardNotObserved, BoardObserved, BoardRecalled, BoardSolved, Event
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.recorded_turner import RecordedTurner
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import Fault
from rig.errors.attempts import Attempts, attempt_each
from rig.motion.steps import Sweep
from rig.observation.onboard_window import find_board_averages, revolution_on_the_board
from rig.runner.acquisition import Acquisition

KEEPING_MARGIN_S = 4.0  # from the request to keep readings to the arm's first motion, on a busy computer

Revolution = tuple[int, int, float]  # two board times, µs, and the speed between them, rad/s


@dataclass(slots=True)
class BoardCalibration:
    """The board's own calibration of `sensors`, which maps each name to an index on the board and a description.

    `note` records and reports the board's answers.
    """

    board: Board
    acquisition: Acquisition
    note: Callable[[Event], None]
    settings: ObservationThresholds
    sensors: Mapping[str, tuple[int, RecordedSensor]]
    turner: RecordedTurner
    _observed: dict[str, int] = field(default_factory=dict)

    def recall(self, earlier: Sequence[RunData], done: Collection[int]) -> None:
        """Send the board its observations of the sweeps `done` before an interruption."""
        for name, (index, _) in self.sensors.items():
            for sweep, observed in find_board_averages(earlier, name, done).items():
                self.board.recall(index, self._count(name), observed.observation.mean_rad_s, observed.speed_rad_s)
                self._observed[name] += 1
                self.note(BoardRecalled(name, sweep))

    def begin(self) -> None:
        """Make the host keep samples and states from now on; the first sweep's time base is estimated from them."""
        self.acquisition.keep()

    def keep(self, sweep: Sweep) -> None:
        """Make board and host keep their readings, beginning just before a sweep."""
        self.acquisition.keep()
        self.board.keep([index for index, _ in self.sensors.values()], sweep.duration_s + KEEPING_MARGIN_S)

    def revolutions(self, sweep: Sweep) -> Attempts[str, Revolution]:
        """Return each sensor's window of the revolution just finished; this may take seconds."""
        return attempt_each({name: partial(self._revolution, name, sweep) for name in self.sensors})

    @contextmanager
    def look_in_background(self, sweep: Sweep) -> Iterator["Future[Attempts[str, Revolution]]"]:
        """Find the revolution of each sensor in a thread; yield the future of these revolutions, by sensor."""
        pool = ThreadPoolExecutor(max_workers=1)
        try:
            yield pool.submit(self.revolutions, sweep)
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def observe(self, sweep: Sweep, revolutions: Attempts[str, Revolution]) -> None:
        """Make the board average the revolutions; those that it cannot use are recorded as such and omitted."""
        for name, fault in revolutions.faults.items():
            self.note(BoardNotObserved(name, sweep.index, str(fault)))
        for name, revolution in revolutions.results.items():
            try:
                observation, speed_rad_s = self._observe(name, revolution)
            except (Fault, BoardError) as error:
                if error.name in ("board_link_lost", "board_error"):
                    raise
                self.note(BoardNotObserved(name, sweep.index, str(error)))
                continue
            self._observed[name] += 1
            self.note(BoardObserved(name, sweep.index, speed_rad_s, observation))

    def solve(self) -> None:
        """Record the board's solution by each method, after the last sweep."""
        for name, (index, _) in self.sensors.items():
            for method in METHODS:
                self.note(BoardSolved(name, self.board.solve(index, method)))

    def _observe(self, name: str, revolution: Revolution) -> tuple[BoardObservation, float]:
        """Let the board average a revolution; return its observation and the speed sent to the board, rad/s."""
        start_us, end_us, speed_rad_s = revolution
        index, _ = self.sensors[name]
        return self.board.observe(index, self._count(name), start_us, end_us, speed_rad_s), speed_rad_s

    def _revolution(self, name: str, sweep: Sweep) -> Revolution:
        """Return the sweep's revolution, computed from the board's samples and the turner's states."""
        _, sensor = self.sensors[name]
        samples, states, new = self.acquisition.collect_kept(name)
        turned = np.array([state.to_record() for state in states], self.turner.dtype)
        return revolution_on_the_board(
            samples,
            sensor,
            turned,
            sweep,
            first=len(turned) - new,
            settings=self.settings,
            kinematics=self.turner.geometry,
            reading_std_rad=self.turner.reading_std_rad,
        )

    def _count(self, name: str) -> int:
        return self._observed.setdefault(name, 0)
