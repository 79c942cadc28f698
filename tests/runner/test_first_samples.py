"""How long the first sample of a sensor is waited for: no shorter on a busy computer than on an idle one."""

import pytest

from rig.errors import Fault
from rig.runner.first_samples import TIMEOUT_S, FirstSamples

LOOK_S = 0.005
LOOKS = round(TIMEOUT_S / LOOK_S)


def looks_until_refused(clock_rate: float | None, most: int = 12 * LOOKS) -> int | None:
    """Return how many looks a silent sensor gets; the other clock advances `clock_rate` times as fast as the looks."""
    first_samples = FirstSamples(LOOK_S)
    for look in range(1, most):
        try:
            first_samples.wait_on(["gyro"], None if clock_rate is None else 100.0 + clock_rate * look * LOOK_S)
        except Fault as fault:
            assert fault.name == "no_samples" and "gyro" in fault.what
            return look
    return None


@pytest.mark.usefixtures("no_crowd")
@pytest.mark.parametrize("clock_rate", [None, 1.0, 50.0])
def test_a_silent_sensor_is_named_after_two_seconds_of_looks(clock_rate: float | None) -> None:
    assert looks_until_refused(clock_rate) == pytest.approx(LOOKS + 1, abs=1)


def test_a_world_that_is_held_up_silences_no_sensor() -> None:
    assert looks_until_refused(clock_rate=0.0) is None


def test_a_crowded_computer_gets_as_much_longer_as_it_is_crowded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("firmware_host.computer_load.load_factor", lambda: 3.0)
    assert looks_until_refused(clock_rate=1.0) == pytest.approx(3 * LOOKS + 1, abs=1)
