"""The Allan deviation: equal to allantools', pooled within stretches, and read honestly or not at all."""

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.statistics.allan import AllanCurve, AllanReading, Noise, allan_curve, equivalent_dof, read_axis

RATE_HZ = 25.0
HOUR = round(3600 * RATE_HZ)


def white(seed: int, readings: int = HOUR, random_walk: float = 1.0) -> Array:
    """(n, 3) with that random walk, per √s."""
    drawn: Array = random_walk * np.sqrt(RATE_HZ) * np.random.default_rng(seed).normal(size=(readings, 3))
    return drawn


def draw_walk(seed: int, readings: int, time_constant_s: float = 20.0) -> Array:
    """(n, 3) a first-order Gauss–Markov bias of standard deviation 1."""
    keep = np.exp(-1 / RATE_HZ / time_constant_s)
    from scipy.signal import lfilter

    fresh = np.sqrt(1 - keep**2) * np.random.default_rng(seed).normal(size=(readings, 3))
    bias: Array = lfilter([1.0], [1.0, -keep], fresh, axis=0)
    return bias


def read(curve: AllanCurve) -> list[AllanReading]:
    """The random walk of all three axes."""
    found = [read_axis(curve, axis).random_walk for axis in range(3)]
    assert all(isinstance(each, AllanReading) for each in found), found
    return [each for each in found if isinstance(each, AllanReading)]


@pytest.mark.slow  # allantools takes a second to import
def test_it_equals_allantools() -> None:
    allantools = pytest.importorskip("allantools")
    readings = white(1, 5000) + np.cumsum(white(2, 5000), axis=0) / 100 + 7.0
    curve = allan_curve([readings], 1 / RATE_HZ)
    for axis in range(3):
        tau_s, theirs, *_ = allantools.oadev(readings[:, axis], rate=RATE_HZ, data_type="freq", taus=curve.tau_s)
        assert tau_s == pytest.approx(curve.tau_s, rel=1e-12)
        assert curve.deviation[:, axis] == pytest.approx(theirs, rel=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(("noise", "exponent"), [("white", 0), ("flicker", -1), ("random_walk", -2)])
def test_degrees_of_freedom_equal_allantools(noise: Noise, exponent: int) -> None:
    ci = pytest.importorskip("allantools.ci")
    for points, factor in ((101, 2), (1001, 16), (90_001, 25), (90_001, 10_000)):
        theirs = ci.edf_simple(points, factor, exponent)
        assert equivalent_dof(points, factor, noise) == pytest.approx(max(theirs, 1.0), rel=1e-12)


def test_stretches_are_never_joined() -> None:
    """The sensor is turned between them: what it reads then jumps, which within a stretch it never does."""
    parts = np.split(white(3, 9000), 9)
    turned = [part + 100.0 * number for number, part in enumerate(parts)]
    curve, without = allan_curve(turned, 1 / RATE_HZ), allan_curve(parts, 1 / RATE_HZ)
    assert curve.deviation == pytest.approx(without.deviation, rel=1e-9)
    assert curve.tau_s[-1] <= 1000 / RATE_HZ / 2
    joined = allan_curve([np.concatenate(turned)], 1 / RATE_HZ)
    assert joined.deviation[len(curve.tau_s) - 1].min() > 3 * curve.deviation[-1].max()


@pytest.mark.slow
def test_random_walk_from_an_hour_is_within_three_of_its_standard_deviations() -> None:
    """And within 3 %: σ is 0.9 % at 1 s."""
    found = np.array([[each.value for each in read(allan_curve([white(seed)], 1 / RATE_HZ))] for seed in range(5)])
    stated = read(allan_curve([white(0)], 1 / RATE_HZ))[0]
    assert stated.std / stated.value == pytest.approx(0.009, rel=0.1)
    assert np.abs(found - 1).max() < 3.5 * stated.std and np.abs(found - 1).max() < 0.03
    assert 0.7 < np.sqrt(np.mean((found - 1) ** 2)) / stated.std < 1.3


@pytest.mark.slow
def test_the_bounds_contain_the_truth_with_their_stated_probability() -> None:
    """White noise of ten minutes, at every τ that it tells."""
    hits = []
    for seed in range(15):
        curve = allan_curve([white(100 + seed, 15_000)], 1 / RATE_HZ)
        truth = 1 / np.sqrt(curve.tau_s)[:, None]
        hits.append((curve.low <= truth) & (truth <= curve.high))
    assert 0.88 < np.mean(hits) < 0.99


@pytest.mark.slow
def test_white_noise_has_no_bias_instability() -> None:
    """Its deviation falls as long as one looks."""
    for seed in range(5):
        curve = allan_curve([white(200 + seed)], 1 / RATE_HZ)
        for axis in range(3):
            found = read_axis(curve, axis).bias_instability
            assert isinstance(found, Fault) and found.name == "recording_too_short"


@pytest.mark.slow
def test_a_drifting_bias_has_a_floor() -> None:
    """Least σ of N²/τ and a Gauss–Markov bias, whose own σ² is known (IEEE Std 952, C.1.4)."""
    readings = white(5, 4 * HOUR, 0.5) + draw_walk(6, 4 * HOUR, 600.0)
    curve = allan_curve([readings], 1 / RATE_HZ)
    ratio = curve.tau_s / 600.0
    walked = 2 / ratio * (1 - (3 - 4 * np.exp(-ratio) + np.exp(-2 * ratio)) / (2 * ratio)) / 1.0
    truth = np.sqrt(0.25 / curve.tau_s + walked)
    found = read_axis(curve, 0).bias_instability
    assert isinstance(found, AllanReading)
    assert found.value == pytest.approx(truth.min() / 0.6643, abs=3 * found.std)
    assert 0.5 < found.tau_s / curve.tau_s[np.argmin(truth)] < 2.1


@pytest.mark.parametrize("seconds", [1, 8])
def test_too_short_a_recording_says_so(seconds: int) -> None:
    curve = allan_curve([white(7, round(seconds * RATE_HZ))], 1 / RATE_HZ)
    found = read_axis(curve, 0)
    for each in (found.random_walk, found.bias_instability):
        assert isinstance(each, Fault) and each.name == "recording_too_short"


def test_no_stretch_at_all_is_refused() -> None:
    with pytest.raises(Fault) as refused:
        allan_curve([np.zeros((2, 3))], 0.04)
    assert refused.value.name == "recording_too_short"


def test_three_readings_have_a_curve_of_one_point() -> None:
    readings = white(11, 3)
    curve = allan_curve([readings], 0.04)
    assert curve.tau_s.tolist() == [0.04]
    np.testing.assert_allclose(curve.deviation, np.sqrt(np.mean(np.diff(readings, axis=0) ** 2, axis=0) / 2)[None])
    assert (curve.low < curve.deviation).all() and (curve.deviation < curve.high).all()


def test_what_is_no_white_noise_has_no_random_walk() -> None:
    """A vibration of 1 Hz, or a bias that moves within seconds."""
    shaken = white(8, 15_000) + 3 * np.sin(2 * np.pi * np.arange(15_000) / RATE_HZ / 2)[:, None]
    for readings in (shaken, white(9, 15_000, 0.01) + draw_walk(10, 15_000)):
        found = read_axis(allan_curve([readings], 1 / RATE_HZ), 1).random_walk
        assert isinstance(found, Fault) and found.name == "not_white_noise"
