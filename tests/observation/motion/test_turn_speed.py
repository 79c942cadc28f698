"""The speed of a whole turn: as exact as it says, whatever the encoder's nonlinearity and the gear's ripple."""

import numpy as np
import pytest
from numpy.typing import NDArray

from rig.errors import Fault
from rig.observation.motion.turn_speed import turn_speed

STEP_RAD = 2 * np.pi / 4096
SPEED_RAD_S = np.radians(60.0)


def readings(
    seed: int, *, rate_hz: float = 100.0, turns: float = 1.25, way: float = 1.0, noise_deg: float = 0.06
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Times by a host's clock, with frames of 1 ms and jitter, and what a 12-bit encoder shows then.

    The shaft ripples by 7 %, the encoder is out by 1.0° once and by 0.3° twice a turn.
    """
    random = np.random.default_rng(seed)
    true_s = 1.0 + np.arange(0.0, turns * 2 * np.pi / SPEED_RAD_S, 1 / rate_hz) + random.uniform(0.0, 1e-3)
    even = random.uniform(0.0, 2 * np.pi) + way * SPEED_RAD_S * true_s
    shaft = even + 0.07 / 20 * np.sin(20 * even)
    once, twice = (np.sin(n * shaft + random.uniform(0.0, 2 * np.pi)) for n in (1, 2))
    read = shaft + np.radians(1.0 * once + 0.3 * twice + noise_deg * random.normal(size=len(shaft)))
    told_s = true_s + random.uniform(0.0, 1e-3, len(true_s)) + 3e-4 * random.normal(size=len(true_s))
    return told_s, np.floor(read / STEP_RAD) * STEP_RAD


def errors(seeds: range, **how: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Relative errors, and errors in standard deviations."""
    found = [(turn_speed(*readings(seed, **how)), how.get("way", 1.0)) for seed in seeds]
    off = np.array([each.speed_rad_s - way * SPEED_RAD_S for each, way in found])
    return off / SPEED_RAD_S, off / np.array([each.speed_std_rad_s for each, _ in found])


def rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.proof
def test_its_errors_are_what_it_says_and_below_5e_5(thorough: bool) -> None:
    relative, normalised = errors(range(400 if thorough else 60))
    assert rms(relative) < 5e-5
    assert np.abs(relative).max() < 2e-4
    assert 0.8 < rms(normalised) < 1.2


def test_a_falling_angle_gives_a_negative_speed() -> None:
    relative, normalised = errors(range(5), way=-1.0)
    assert np.abs(relative).max() < 1e-4 and np.abs(normalised).max() < 4.0


def test_faster_polling_and_more_beyond_the_turn_tell_more() -> None:
    few = turn_speed(*readings(1, turns=1.12)).speed_std_rad_s
    more = turn_speed(*readings(1, turns=1.5)).speed_std_rad_s
    faster = turn_speed(*readings(1, turns=1.5, rate_hz=250.0)).speed_std_rad_s
    assert faster < more < few


def test_the_nonlinearity_of_the_encoder_cancels() -> None:
    """Over half a turn the same encoder would be wrong by far more."""
    time_s, q_rad = readings(3, noise_deg=0.0)
    half = np.searchsorted(q_rad - q_rad[0], np.pi)
    by_half_a_turn = (q_rad[half] - q_rad[0]) / (time_s[half] - time_s[0])
    assert abs(by_half_a_turn / SPEED_RAD_S - 1.0) > 2e-3
    assert abs(turn_speed(time_s, q_rad).speed_rad_s / SPEED_RAD_S - 1.0) < 1e-4


@pytest.mark.parametrize("turns", [0.9, 1.02])
def test_less_than_a_turn_and_something_more_is_refused_by_name(turns: float) -> None:
    with pytest.raises(Fault) as fault:
        turn_speed(*readings(2, turns=turns))
    assert fault.value.name == "turn_too_short"


def test_a_shaft_that_stands_has_no_turn() -> None:
    with pytest.raises(Fault) as fault:
        turn_speed(np.arange(1000.0), np.zeros(1000))
    assert fault.value.name == "turn_too_short"
