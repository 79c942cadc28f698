"""What is kept for the clock of the next sweep, however long something was waited for before it."""

import numpy as np
import pytest

from firmware_host.samples import SAMPLE_DTYPE
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.motion.turner_state import ArmState
from rig.runner.acquisition import CLOCK_DATA_S, Acquisition
from support.recordings.synthetic_run import SENSOR

STILL = (0.0,) * 6


def taken(acquisition: Acquisition, from_s: float, to_s: float, sensor: RecordedSensor = SENSOR) -> None:
    """States and samples of so much time, ten of each a second; the board was switched on a minute before the arm."""
    for time_s in np.arange(from_s, to_s, 0.1).tolist():
        acquisition.on_state(ArmState(time_s, 1.0, STILL, STILL, 1.0, 1.0, 7, 1, 2, 3, 1))
        sample = np.zeros(1, SAMPLE_DTYPE)
        sample["board_time_us"] = round(1e6 * (time_s + 60))
        acquisition.on_samples("gyro", sample)


@pytest.mark.thorough
@pytest.mark.slow
def test_hours_of_waiting_before_a_sweep_are_not_looked_through_for_its_clock() -> None:
    acquisition = Acquisition()
    acquisition.expect("gyro", SENSOR)
    acquisition.keep()
    taken(acquisition, 0.0, 10.0)
    acquisition.keep()
    taken(acquisition, 10.0, 3000.0)
    acquisition.keep()
    taken(acquisition, 3000.0, 3010.0)
    samples, states, new = acquisition.collect_kept("gyro")
    assert new == 100 and abs(states[-new].time_s - 3000) < 1e-6
    assert abs(states[0].time_s - (3000 - CLOCK_DATA_S)) < 0.11
    assert abs(samples["board_time_us"][0] * 1e-6 - 60 - states[0].time_s) < 0.11
    assert abs(len(samples) - len(states)) <= 1


def test_what_came_shortly_before_is_all_kept() -> None:
    acquisition = Acquisition()
    acquisition.expect("gyro", SENSOR)
    assert len(acquisition.collect_kept("gyro")[0]) == 0
    acquisition.keep()
    taken(acquisition, 5.0, 20.0)
    acquisition.keep()
    taken(acquisition, 20.0, 30.0)
    samples, states, new = acquisition.collect_kept("gyro")
    assert (len(samples), len(states), new) == (250, 250, 100)
