"""How fast a thermometer changes is judged by when it was read, not by when a busy computer hears of it."""

import math
from collections.abc import Iterable

import numpy as np
import pytest

from rig.config.procedures.procedure_sections import ThermalSection
from rig.data.quantity import RATE
from rig.data.recording.channel import thermometer_channel, triad_channel
from rig.data.recording.recorded_events import Event
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Fault
from rig.plans.motions.temperature_course import TemperatureCourse
from rig.runner.acquisition import Acquisition
from rig.runner.warming import Warming

C_PER_COUNT = 1 / 16  # an LSM9DS1's
SENSOR = RecordedSensor(
    "lsm9ds1", "1", 59.5, (triad_channel(RATE, 1e-4, 32767, 4.0), thermometer_channel(C_PER_COUNT, 25.0))
)
LIMIT_K_PER_MIN = 2.0


def ignore(_event: Event) -> None:
    pass


def warmed(looks: Iterable[tuple[float, float]], k_per_min: float) -> None:
    """Watch a sensor that warms so fast from 25 °C on; `looks` are when by the board, and by the controller as seen."""
    acquisition = Acquisition()
    acquisition.expect("gyro", SENSOR)
    section = ThermalSection(from_c=20, to_c=60, max_rate_k_per_min=LIMIT_K_PER_MIN)
    warming = Warming(section, acquisition, ignore, ("gyro",), None, 40.0, TemperatureCourse(20, 60, 5, True))
    heard_s = 0.0
    for board_s, controller_s in looks:
        while heard_s <= board_s:  # whatever the host did meanwhile, all that the board sent comes in its order
            batch = np.zeros(1, SENSOR.sample_dtype)
            batch["board_time_us"] = round(1e6 * heard_s)
            batch["temperature_counts"] = math.floor(k_per_min / 60 * heard_s / C_PER_COUNT)
            acquisition.on_samples("gyro", batch)
            heard_s += 0.1
        warming.check(controller_s)


def test_a_host_that_was_busy_sees_no_other_rate() -> None:
    """After 10 s the controller's states come late, and then all of them at once; the board's readings do not."""
    late = [(t, t) for t in np.arange(0, 10, 0.3)]
    late += [(t, 10 + (t - 10) / 4) for t in np.arange(10, 50, 1.2)]
    late += [(50 + t, 20 + t * 31) for t in (0.5, 1.0)]
    late += [(51 + t, 51 + t) for t in np.arange(0.3, 40, 0.3)]
    warmed(late, 1.6)


@pytest.mark.slow
@pytest.mark.parametrize("gap_s", [0.3, 8.0])
@pytest.mark.parametrize("k_per_min", [2.4, -2.4])
def test_what_changes_too_fast_ends_by_name_however_seldom_the_host_looks(gap_s: float, k_per_min: float) -> None:
    with pytest.raises(Fault) as ended:
        warmed([(t, t) for t in np.arange(0, 60, gap_s)], k_per_min)
    assert ended.value.name == "too_fast"
