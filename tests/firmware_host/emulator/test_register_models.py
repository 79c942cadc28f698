"""What every simulated sensor must do, whatever its registers: obey its truth, its data rate, its range, its seed."""

import math
from collections.abc import Sequence
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.chip.spi_device import Fault
from firmware_host.emulator.parts.accelerometer import AccelerometerTruth
from firmware_host.emulator.parts.gyroscope import GyroTruth
from support.board.data_sheet import DataSheet
from support.board.spi_master import Driver
from support.parts import SHEETS

PARTS = tuple(SHEETS.values())
DISCARD_S = 0.1  # every part's filters have settled


every_part = pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
every_rate = pytest.mark.parametrize(
    ("part", "rate_hz"), [(p, r) for p in PARTS for r in p.rates_hz], ids=lambda v: getattr(v, "name", None)
)
every_range = pytest.mark.parametrize(
    ("part", "range_deg_s"), [(p, r) for p in PARTS for r in p.per_count_deg_s], ids=lambda v: getattr(v, "name", None)
)


def counts(driver: Driver, conversions: int) -> np.ndarray:
    """The next conversions, (n, 3)."""
    read = []
    for _ in range(conversions):
        driver.await_data()
        read.append(driver.read()[0])
    return np.array(read)


def settled(driver: Driver) -> np.ndarray:
    """One conversion, (3,), after the part has settled."""
    end_s = driver.part.next_event_s + DISCARD_S
    rates: Sequence[float] = ()
    while driver.part.next_event_s < end_s:
        driver.await_data()
        rates, _temperature = driver.read()
    return np.array(rates)


def settled_acceleration(driver: Driver) -> np.ndarray:
    """The accelerations of one conversion, (3,), after the part has settled."""
    settled(driver)
    driver.await_data()
    return np.array(driver.accelerations())


def constant(rate: Sequence[float], _time_s: float) -> Sequence[float]:
    return rate


@every_part
def test_its_identity_is_the_datasheets_unless_it_is_another_part(part: DataSheet) -> None:
    driver = part.new()
    assert driver.identity() == part.identity
    driver.part.fault = Fault.OTHER_PART
    assert driver.identity() == part.other_identity


@pytest.mark.one_in(3)
@every_rate
def test_conversions_come_at_the_data_rate(part: DataSheet, rate_hz: float) -> None:
    asked: list[float] = []

    def rate_at(time_s: float) -> Sequence[float]:
        asked.append(time_s)
        return (0.0, 0.0, 0.0)

    driver = part.driver(rate_at, rate_hz=rate_hz)
    driver.await_data()
    asked.clear()
    driver.advance(driver.part.next_event_s + 12 / rate_hz)
    assert len(asked) >= 12
    assert np.diff(asked) == pytest.approx(1 / rate_hz, rel=1e-9)


@every_part
def test_its_own_oscillator_sets_the_pace(part: DataSheet) -> None:
    def ready_s(ppm: float) -> list[float]:
        driver = part.driver(ppm=ppm)
        times_s = []
        for _ in range(11):
            driver.await_data()
            times_s.append(driver.part.next_event_s)
            driver.read()
        return times_s

    exact, fast = (sum(b - a for a, b in pairwise(ready_s(ppm))) for ppm in (0.0, 10_000.0))
    assert exact / fast == pytest.approx(1.01, rel=1e-6)


@every_range
def test_sensitivity_is_the_datasheets(part: DataSheet, range_deg_s: float) -> None:
    rate = np.radians(range_deg_s) * np.array([0.9, -0.5, 0.1])
    driver = part.driver(lambda _time_s: rate.tolist(), range_deg_s=range_deg_s)
    error = settled(driver) - rate / part.per_count_rad_s(range_deg_s)
    assert np.all(np.abs(error) <= 0.5)


@every_part
def test_too_much_saturates(part: DataSheet) -> None:
    range_deg_s = min(part.per_count_deg_s)
    much = np.radians(10 * range_deg_s)
    driver = part.driver(lambda _time_s: (much, -much, 0.0), range_deg_s=range_deg_s)
    assert settled(driver).tolist() == [32767, -32768, 0]


vectors = st.tuples(*[st.floats(-3, 3)] * 3)


@pytest.mark.slow
@every_part
@settings(max_examples=20)
@given(vectors, st.tuples(*[st.floats(0.7, 1.3)] * 3), st.tuples(*[st.floats(-0.2, 0.2)] * 3))
def test_the_truth_is_g_equals_k_times_m_plus_b(
    part: DataSheet, rate: tuple[float, ...], scale: tuple[float, ...], bias_rad_s: tuple[float, ...]
) -> None:
    reading = settled(part.driver(lambda _time_s: rate, GyroTruth(scale, bias_rad_s), rate_hz=part.rates_hz[-2]))
    per_count = part.per_count_rad_s()
    recovered = np.array(scale) * (reading * per_count + np.array(bias_rad_s))
    slack = 1.0 if part.name == "ADIS16465" else 0.5001  # it averages here, and a burst alone rounds down
    assert np.all(np.abs(recovered - rate) <= slack * per_count * np.array(scale))


@every_part
def test_non_orthogonal_axes_pick_up_their_neighbours(part: DataSheet) -> None:
    xy, xz, yz = 0.02, -0.01, 0.03
    truth = GyroTruth(non_orthogonality_rad=(xy, xz, yz))
    columns = [settled(part.driver(partial(constant, axis), truth)) for axis in np.eye(3).tolist()]
    axes = np.array(columns).T * part.per_count_rad_s()
    assert np.linalg.norm(axes, axis=1) == pytest.approx(1.0, abs=1e-3)
    assert axes @ [1, 0, 0] == pytest.approx([1, math.sin(xy), math.sin(xz)], abs=3e-4)
    assert axes @ [0, 1, 0] == pytest.approx([0, math.cos(xy), math.sin(yz)], abs=3e-4)


@pytest.mark.slow
@every_part
def test_noise_is_white_and_as_strong_as_configured(part: DataSheet) -> None:
    noise_rad_s, count = 0.035, 3000
    driver = part.driver(truth=GyroTruth(noise_rad_s=noise_rad_s), seed=3)
    readings = counts(driver, count) * part.per_count_rad_s()
    assert np.all(np.abs(readings.mean(axis=0)) < 4 * noise_rad_s / math.sqrt(count))
    assert readings.std(axis=0) == pytest.approx(noise_rad_s, rel=4 / math.sqrt(2 * count))
    correlations = np.corrcoef(np.column_stack([readings[1:], readings[:-1]]).T)
    assert np.all(np.abs(correlations - np.eye(6)) < 4.5 / math.sqrt(count))


@every_part
def test_noise_follows_the_seed_and_not_the_reader(part: DataSheet) -> None:
    truth = GyroTruth(noise_rad_s=0.035)
    eager, lazy, other = (part.driver(truth=truth, seed=seed) for seed in (3, 3, 4))
    eager_counts = counts(eager, 200)
    lazy.await_data()
    lazy.advance(lazy.part.next_event_s + 197.7 / part.rates_hz[-1])  # nobody reads these
    lazy.read()
    lazy.await_data()
    assert lazy.read()[0] in eager_counts[-3:].tolist()
    assert not np.array_equal(counts(other, 200), eager_counts)


@every_part
@pytest.mark.parametrize("temperature_c", [25.0, 22.0, 85.0, -40.0])
def test_temperature(part: DataSheet, temperature_c: float) -> None:
    driver = part.driver(temperature_c=temperature_c)
    driver.await_data()
    assert driver.read()[1] == round(part.temperature_counts(temperature_c))


@every_part
def test_what_has_no_model_is_refused_by_name(part: DataSheet) -> None:
    for name, access in part.forbidden:
        driver = part.new()
        with pytest.raises(Violation) as caught:
            driver.exchange(access)
        assert caught.value.name == name, access
        assert part.name in caught.value.what


@pytest.mark.parametrize(
    ("part", "range_g"), [(p, r) for p in PARTS for r in p.per_count_g], ids=lambda v: getattr(v, "name", None)
)
def test_sensitivity_to_acceleration_is_the_datasheets(part: DataSheet, range_g: float) -> None:
    force_g = range_g * np.array([0.9, -0.5, 0.1])
    driver = part.driver(lambda _time_s: (0.1, 0.2, 0.3, *force_g.tolist()), range_g=range_g)
    error = settled_acceleration(driver) - force_g / part.per_count_g[range_g]
    assert np.all(np.abs(error) <= 0.5)


@every_part
def test_too_much_acceleration_saturates(part: DataSheet) -> None:
    driver = part.driver(lambda _time_s: (0.0, 0.0, 0.0, 90.0, -90.0, 0.0))
    assert settled_acceleration(driver).tolist() == [32767, -32768, 0]


@every_part
def test_a_motion_without_force_shows_a_part_at_rest_with_z_up(part: DataSheet) -> None:
    assert settled_acceleration(part.driver()).tolist() == [0, 0, round(1 / part.per_count_g[8.0])]


@every_part
def test_a_motion_is_asked_for_once_though_two_triads_feel_it(part: DataSheet) -> None:
    asked: list[float] = []

    def motion_at(time_s: float) -> Sequence[float]:
        asked.append(time_s)
        return 0.0, 0.0, 0.0, 0.0, 0.0, 1.0

    driver = part.driver(motion_at, acceleration=AccelerometerTruth(noise_m_s2=0.01))
    driver.advance(driver.part.next_event_s + 0.2)
    assert len(asked) > 0.19 * part.rates_hz[-1]
    assert len(asked) == len(set(asked))


@every_part
def test_what_the_accelerometer_does_leaves_the_rates_as_they_are(part: DataSheet) -> None:
    """Byte for byte: its noise is drawn from a seed of its own."""
    noisy = AccelerometerTruth(noise_m_s2=0.1, random_walk_m_s2_per_sqrt_s=0.1)
    truth = GyroTruth(noise_rad_s=0.035, random_walk_rad_s_per_sqrt_s=0.01)
    with_it, without = (part.driver(truth=truth, acceleration=acceleration) for acceleration in (noisy, None))
    assert np.array_equal(counts(with_it, 100), counts(without, 100))
    with_it.await_data()
    first = with_it.accelerations()
    with_it.read()
    with_it.await_data()
    assert with_it.accelerations() != first
