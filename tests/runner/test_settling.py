"""When sensors count as settled after a motion, by the scatter of their readings."""

from collections.abc import Callable

import numpy as np
import pytest

from rig.data.quantity import RATE
from rig.estimation.arrays import Array
from rig.runner.settling import Settling
from support.recordings.synthetic_run import Setup, synthetic_run

REST_S, POLL_S, SETTLE_S = 3.0, 0.1, 5.0
NOISE = 20.0


def settles(vibration: Callable[[Array], Array], began_s: float) -> bool:
    """Whether a sensor settles within `SETTLE_S` of `began_s`; it was at rest for the first seconds."""
    sensor = synthetic_run(Setup()).sensors["gyro"]
    rng, rate_hz, settling = np.random.default_rng(1), sensor.rate_hz, Settling()
    settling.expect("gyro", sensor)

    def send(start_s: float) -> None:
        time_s = np.arange(round(start_s * rate_hz), round((start_s + POLL_S) * rate_hz)) / rate_hz
        samples = np.zeros(len(time_s), dtype=[(sensor.channel(RATE).column, "<i2", 3)])
        counts = vibration(time_s)[:, None] + NOISE * rng.standard_normal((len(time_s), 3))
        samples[sensor.channel(RATE).column] = np.round(counts)
        settling.add("gyro", samples)

    for now_s in np.arange(0, REST_S + POLL_S, POLL_S):
        send(float(now_s))
        settling.learn_rest()
    settling.begin()
    for now_s in np.arange(began_s, began_s + SETTLE_S, POLL_S):
        send(float(now_s))
        if not settling.find_unsettled():
            return True
    return False


@pytest.mark.slow
def test_a_vibration_near_half_the_data_rate_comes_and_goes_and_does_not_decay() -> None:
    half_hz = synthetic_run(Setup()).sensors["gyro"].rate_hz / 2

    def vibrate(time_s: Array) -> Array:
        """Vibrate as in rooms with mains: in the samples almost nothing at first, half a minute later all of it."""
        return 80.0 * np.sin(2 * np.pi * (half_hz + 0.007) * time_s)

    assert settles(vibrate, 25.0)


@pytest.mark.slow
@pytest.mark.parametrize("decay_s", [3.0, 8.0])
def test_a_board_that_swings_on_has_not_settled(decay_s: float) -> None:
    def swing(time_s: Array) -> Array:
        return np.where(time_s < 10.0, 0.0, 300.0 * np.exp(-(time_s - 10) / decay_s) * np.sin(2 * np.pi * 9 * time_s))

    assert not settles(swing, 10.0)
