"""The increments of a gyroscope: against motions that are known in closed form, and against differences."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array
from rig.estimation.gyroscope import increments as module
from rig.estimation.gyroscope.increments import increments, integrate_attitudes

MATRIX = np.array([[1.02, 0.01, -0.03], [0.004, 0.97, 0.02], [-0.01, 0.03, 1.01]])
BIAS = np.array([0.02, -0.01, 0.03])
STILL = np.eye(3), np.zeros(3)


def tumbling(time_s: Array) -> tuple[Array, Array]:
    """Attitudes (n, 3, 3), body to room, and rates (n, 3) of a body turned by hand: to 8 rad/s about changing axes."""
    yaw, pitch = 2.0 * np.sin(1.3 * time_s) + 0.5 * time_s, 1.2 * np.sin(2.1 * time_s)
    roll = 1.5 * np.sin(3.7 * time_s) + 0.2 * np.sin(17 * time_s)
    yaw_rate, pitch_rate = 2.6 * np.cos(1.3 * time_s) + 0.5, 2.52 * np.cos(2.1 * time_s)
    roll_rate = 5.55 * np.cos(3.7 * time_s) + 3.4 * np.cos(17 * time_s)
    attitudes = Rotation.from_euler("ZYX", np.column_stack([yaw, pitch, roll])).as_matrix()
    rates = np.column_stack(
        [
            roll_rate - yaw_rate * np.sin(pitch),
            pitch_rate * np.cos(roll) + yaw_rate * np.cos(pitch) * np.sin(roll),
            -pitch_rate * np.sin(roll) + yaw_rate * np.cos(pitch) * np.cos(roll),
        ]
    )
    return attitudes, rates


def angle(first: Array, second: Array) -> Array:
    return np.asarray(Rotation.from_matrix(np.swapaxes(first, -1, -2) @ second).as_rotvec())


def test_a_body_tumbled_by_hand_comes_out_where_it_is() -> None:
    """Within 10 µrad at 200 Hz; a straight line from reading to reading would be 0.7 mrad off."""
    time_s = np.arange(4001) / 200
    at_s = np.sort(np.random.default_rng(1).uniform(0, 20, 200))
    found = integrate_attitudes(time_s, tumbling(time_s)[1] @ MATRIX.T + BIAS, MATRIX, BIAS, at_s)
    truth, rates = tumbling(at_s)
    off = angle(np.swapaxes(tumbling(np.zeros(1))[0], -1, -2) @ truth, found.attitudes)
    assert np.abs(off).max() < 1e-5
    assert np.abs(found.rates_rad_s - rates).max() < 5e-5


def test_coning_leaves_nothing_behind() -> None:
    """The axis goes round at 10 Hz, 0.1 rad off: without its own term the attitude would be off by 0.4 mrad in 2 s."""
    frequency, size = 2 * np.pi * 10, 0.1
    time_s = np.arange(2001) / 1000
    rates = np.column_stack(
        [
            -np.sin(size) * np.sin(frequency * time_s) * frequency,
            np.sin(size) * np.cos(frequency * time_s) * frequency,
            np.full_like(time_s, 2 * np.sin(size / 2) ** 2 * -frequency),
        ]
    )
    tilt = Rotation.from_rotvec(
        size * np.column_stack([np.cos(frequency * time_s), np.sin(frequency * time_s), np.zeros_like(time_s)])
    ).as_matrix()
    found = increments(time_s, rates, *STILL, np.array([[0.0, 2.0]]))
    assert np.abs(angle(tilt[:1].swapaxes(1, 2) @ tilt[-1:], found.rotations)).max() < 1e-5


@pytest.mark.parametrize("parameter", range(12))
def test_the_jacobian_equals_finite_differences(parameter: int) -> None:
    time_s = np.arange(601) / 200
    readings = tumbling(time_s)[1] @ MATRIX.T + BIAS
    windows = np.array([[0.101, 0.607], [0.4, 2.9999], [1.0, 1.0]])
    found = increments(time_s, readings, MATRIX, BIAS, windows)
    by = np.zeros(12)
    by[parameter] = 1e-5
    ends = [
        increments(time_s, readings, MATRIX + way * by[:9].reshape(3, 3), BIAS + way * by[9:], windows).rotations
        for way in (1, -1)
    ]
    differences = Rotation.from_matrix(ends[0] @ ends[1].swapaxes(1, 2)).as_rotvec() / 2e-5
    assert found.jacobian[..., parameter] == pytest.approx(differences, abs=1e-3)


def test_blocks_of_a_long_recording_join(monkeypatch: pytest.MonkeyPatch) -> None:
    time_s = np.arange(1001) / 200
    readings, at_s = tumbling(time_s)[1], np.linspace(0, 5, 77)
    whole = integrate_attitudes(time_s, readings, MATRIX, BIAS, at_s)
    monkeypatch.setattr(module, "BLOCK_READINGS", 64)
    parts = integrate_attitudes(time_s, readings, MATRIX, BIAS, at_s)
    assert parts.attitudes == pytest.approx(whole.attitudes, abs=1e-12)
    assert parts.sensitivities == pytest.approx(whole.sensitivities, abs=1e-11)


@pytest.mark.slow
def test_noise_and_a_bias_random_walk_scatter_as_predicted() -> None:
    """Angle random walk N: N² T; a bias that is right at the start and walks by K: K² T³/3."""
    rng = np.random.default_rng(5)
    time_s, rate_hz = np.arange(401) / 200, 200
    walk = np.cumsum(rng.normal(size=(300, 401, 3)), axis=1) * 0.02 / np.sqrt(rate_hz)
    noisy = walk + rng.normal(size=walk.shape) * 0.01 * np.sqrt(rate_hz)
    ends = [increments(time_s, each, *STILL, np.array([[0.0, 2.0]])).rotations for each in noisy]
    scatter = float(np.mean(Rotation.from_matrix(np.concatenate(ends)).as_rotvec() ** 2))
    assert scatter == pytest.approx(0.01**2 * 2 + 0.02**2 * 2**3 / 3, rel=0.15)


@pytest.mark.parametrize("at_s", [[-0.1, 0.5], [0.5, 1.1], [0.5, 0.4]])
def test_instants_outside_the_recording_are_the_callers_mistake(at_s: list[float]) -> None:
    time_s = np.arange(201) / 200
    with pytest.raises(ValueError, match="instants"):
        integrate_attitudes(time_s, np.zeros((201, 3)), *STILL, np.array(at_s))
