"""Runs on a servo with a device that prints lines and with an autopilot's IMU: errors are as large as is said."""

import numpy as np
import pytest

from rig.analysis.analyses import calibrate
from rig.estimation.arrays import Array
from support.motions.drawn_servo import Source, drawn_servo
from support.motions.servo_other_sources import sample_autopilot, sample_lines

pytestmark = pytest.mark.slow

SOURCES = {"lines": sample_lines, "autopilot": sample_autopilot}
NOISE_RAD_S = 0.01
QUICK = ("turner.state_rate_hz=100", "procedure.speed_deg_s=150", "procedure.rest_s=1.5")


def off(source: Source, seed: int) -> Array:
    """(6,) errors of scale and bias by their combined u, of a run whose checks are passed."""
    drawn = drawn_servo(seed, QUICK, noise_rad_s=NOISE_RAD_S, source=source)
    outcome = calibrate(drawn.runs, "newton")
    assert not [check.name for check in outcome.checks if not check.passed]
    result = outcome.results["gyro"]
    assert result.uncertainty is not None
    error = np.array([*(result.scale - drawn.scale), *(result.bias_rad_s - drawn.bias_rad_s)])
    in_u: Array = error / result.uncertainty.std
    return in_u


# `make test` has both parts of it by themselves: what reads such a device in tests/sensors and, on an arm's clock, in
# tests/runner/devices/test_own_ports.py; a servo's turns in tests/observation/motion/test_uneven_turns.py.
@pytest.mark.thorough
@pytest.mark.one_in(2)
@pytest.mark.parametrize("source", SOURCES)
def test_a_servo_calibrates_what_is_on_a_port_of_its_own(source: str) -> None:
    assert np.abs(off(SOURCES[source], 3)).max() < 4


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("source", SOURCES)
def test_errors_on_a_servo_are_as_large_as_stated(source: str) -> None:
    """Each with an encoder ±1.3° out, ripple, play and an adapter a degree off, as with a board."""
    in_u = np.array([off(SOURCES[source], seed) for seed in range(6)])
    scale, bias = (float(np.sqrt(np.mean(np.square(each)))) for each in np.hsplit(in_u, 2))
    print(f"{source} on a servo: RMS of error / u {scale:.2f} of the scale, {bias:.2f} of the bias")
    assert 0.70 < np.sqrt(np.mean(np.square(in_u))) < 1.31, "99 % of the means of 36 squares lie between"
