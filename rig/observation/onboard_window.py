"""The window of a revolution that the board is to average, and the sweeps that the board has averaged."""

from collections.abc import Collection, Sequence
from typing import Any

from numpy.typing import NDArray

from rig.data.recording.recorded_events import BoardObserved
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.motion.chain import DenavitHartenberg
from rig.motion.steps import Sweep
from rig.observation.average import synchronize_stream
from rig.observation.finished_steps import complete_sweeps
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.windows import Window


def revolution_on_the_board(
    samples: NDArray[Any],
    sensor: RecordedSensor,
    states: NDArray[Any],
    sweep: Sweep,
    *,
    first: int,
    settings: ObservationThresholds,
    kinematics: DenavitHartenberg,
    reading_std_rad: float = 0.0,
) -> tuple[int, int, float]:
    """Return a revolution's start and end on the board's clock, µs, and its speed from the joint angles, rad/s.

    The sweep began after the state with the index `first`. `samples` (n,) of SAMPLE_DTYPE and the turner's
    `states` (m,) should include the arm's motion to the sweep's start, because a slow sweep alone may not determine the
    time base. Raise Fault as `estimate_time_base` and `ArmMotion.turn` do.
    """
    names = [f"joint {number}" for number in range(kinematics.joints)]
    motion = ArmMotion(states, kinematics, names, reading_std_rad=reading_std_rad)
    clock = synchronize_stream(samples, sensor, motion).clock
    window = Window(float(states["time_s"][min(first, len(states) - 1)]), float(states["time_s"][-1]))
    revolution = motion.turn(sweep, window, settings)
    start_s, end_s = (clock.board_time_s(time_s) for time_s in (revolution.start_s, revolution.end_s))
    return round(start_s * 1e6), round(end_s * 1e6), revolution.speed_rad_s


def find_averaged_sweeps(run: RunData, sensors: Collection[str]) -> frozenset[int]:
    """Return the finished sweeps that the board has averaged for all those of `sensors` that it reads."""
    sweeps = complete_sweeps(run)
    on_board = [sensor for sensor in sensors if run.sensors[sensor].on_board]
    return sweeps.intersection(*(find_board_averages([run], sensor, sweeps) for sensor in on_board))


def find_board_averages(earlier: Sequence[RunData], sensor: str, done: Collection[int]) -> dict[int, BoardObserved]:
    """Return the board's averages of a sensor from earlier recordings, by sweep: the newest of each sweep in `done`."""
    return {
        event.sweep: event
        for run in earlier
        for event in (recorded.event for recorded in run.events)
        if isinstance(event, BoardObserved) and event.sensor == sensor and event.sweep in done
    }
