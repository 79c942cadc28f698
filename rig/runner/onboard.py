"""The board calibrates by itself, as in SIX: it keeps the readings of a sweep, averages the revolution and solves.

What only the host knows is when the revolution was and how fast: that needs the arm's joints and both clocks. So after
each sweep the host names two board times and the measured speed, and at the end asks for the solution. All the board
answers goes into the recording, where `rig.analysis.onboard_check` holds it against the host's own arithmetic.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_host.client import Board, BoardObservation
from firmware_host.errors import BoardError
from firmware_host.protocol import METHODS
from rig.arm.motion import Sweep
from rig.arm.state import ARM_STATE_DTYPE
from rig.data.run_file import RecordedSensor, RunData, RunRecorder
from rig.data.settings import ObservationThresholds
from rig.errors import Fault
from rig.observation.average import on_the_arms_clock
from rig.observation.observe import finished_sweeps
from rig.observation.revolution import find_revolution
from rig.observation.timebase import ArmMotion
from rig.runner.acquisition import Acquisition

# From asking the board to keep its readings to the arm's first motion, and how late that may be on a busy machine.
KEEP_LONGER_S = 4.0


@dataclass(slots=True)
class BoardCalibration:
    """Takes the board through a calibration of `sensors` (name → its index on the board and its description)."""

    board: Board
    acquisition: Acquisition
    recorder: RunRecorder
    settings: ObservationThresholds
    sensors: Mapping[str, tuple[int, RecordedSensor]]
    _observed: dict[str, int] = field(default_factory=dict)

    def recall(self, earlier: Sequence[RunData], done: Collection[int]) -> None:
        """Give the board back what it observed of the sweeps `done` before the run was interrupted."""
        for name, (index, _) in self.sensors.items():
            for sweep, observation in observed_before(earlier, name, done).items():
                self.board.recall(index, self._count(name), observation["mean_rad_s"], observation["speed_rad_s"])
                self._observed[name] += 1
                self.recorder.add_event("board_recalled", sensor=name, sweep=sweep)

    def begin(self) -> None:
        """Before the first sample: the host keeps what it sees, for the clock of the first sweep."""
        self.acquisition.keep()

    def keep(self, sweep: Sweep) -> None:
        """Just before a sweep: from now on board and host keep what they see."""
        self.acquisition.keep()
        self.board.keep([index for index, _ in self.sensors.values()], sweep.duration_s + KEEP_LONGER_S)

    def observe(self, sweep: Sweep) -> None:
        """Just after it: the board averages the revolution. One that is not fit for it is noted and left out."""
        for name in self.sensors:
            try:
                found, speed_rad_s = self._observe(name, sweep)
            except (Fault, BoardError) as error:
                if error.name == "board_link_lost":
                    raise
                self.recorder.add_event("board_not_observed", sensor=name, sweep=sweep.index, reason=str(error))
                continue
            self._observed[name] += 1
            self.recorder.add_event(
                "board_observed", sensor=name, sweep=sweep.index, speed_rad_s=speed_rad_s, **asdict(found)
            )

    def solve(self) -> None:
        """After the last sweep: the board's solution by either method."""
        for name, (index, _) in self.sensors.items():
            for method in METHODS:
                solution = self.board.solve(index, method)
                self.recorder.add_event("board_solved", sensor=name, **asdict(solution))

    def _observe(self, name: str, sweep: Sweep) -> tuple[BoardObservation, float]:
        """The board's observation and the speed it was told, rad/s."""
        index, sensor = self.sensors[name]
        samples, states, new = self.acquisition.kept(index)
        arm = np.array([state.to_record() for state in states], ARM_STATE_DTYPE)
        start_us, end_us, speed_rad_s = revolution_on_the_board(
            samples, sensor, arm, asdict(sweep), first=len(arm) - new, settings=self.settings
        )
        return self.board.observe(index, self._count(name), start_us, end_us, speed_rad_s), speed_rad_s

    def _count(self, name: str) -> int:
        return self._observed.setdefault(name, 0)


def revolution_on_the_board(
    samples: NDArray[Any],
    sensor: RecordedSensor,
    arm: NDArray[Any],
    sweep: Mapping[str, Any],
    *,
    first: int,
    settings: ObservationThresholds,
) -> tuple[int, int, float]:
    """When a sweep's revolution began and ended on the board's clock, µs, and its speed by the arm's joints, rad/s.

    `samples` (n,) SAMPLE_DTYPE and `arm` (m,) ARM_STATE_DTYPE may reach further back than the sweep, which began after
    the state `first`, and should: a slow sweep alone may not stand out from the noise or hold too few samples, where
    a fast motion to where sweeps begin tells the time. Raises Fault as `estimate_time_base` and `find_revolution` do.
    """
    motion = ArmMotion(arm)
    clock = on_the_arms_clock(samples, sensor, motion).clock
    window = (float(arm["time_s"][min(first, len(arm) - 1)]), float(arm["time_s"][-1]))
    revolution = find_revolution(motion, sweep, window, settings)
    start_s, end_s = (clock.board_time_s(time_s) for time_s in (revolution.start_s, revolution.end_s))
    return round(start_s * 1e6), round(end_s * 1e6), revolution.speed_rad_s


def observed_sweeps(run: RunData, sensors: Collection[str]) -> frozenset[int]:
    """The sweeps of a recording of which the board has an observation for every one of these sensors."""
    everything = finished_sweeps(run)
    return everything.intersection(*(observed_before([run], sensor, everything) for sensor in sensors))


def observed_before(earlier: Sequence[RunData], sensor: str, done: Collection[int]) -> dict[int, dict[str, Any]]:
    """What the board observed of a sensor in earlier recordings, by sweep: the newest of each sweep in `done`."""
    return {
        event.detail["sweep"]: event.detail
        for run in earlier
        for event in run.events
        if event.name == "board_observed" and event.detail["sensor"] == sensor and event.detail["sweep"] in done
    }
