"""What every simulated sensor must do, whatever its registers: obey its truth, its data rate, its range, its seed."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_host.emulator.accelerometer import AccelerometerTruth
from firmware_host.emulator.bus import Violation
from firmware_host.emulator.gyroscope import GyroTruth
from firmware_host.emulator.spi_device import Fault
from support.spi_master import NO_ERRORS, Adis16465Driver, Driver, Lsm9ds1Driver, Mpu9250Driver, Rate, still

DISCARD_S = 0.1  # every part's filters have settled


@dataclass(frozen=True)
class Part:
    """A part's datasheet: `per_count_deg_s`, `per_count_g`: range → sensitivity; `forbidden`: accesses."""

    name: str
    new: Callable[..., Driver]
    identity: int
    other_identity: int
    rates_hz: Sequence[float]
    per_count_deg_s: dict[float, float]
    per_count_g: dict[float, float]
    temperature_counts: Callable[[float], float]
    forbidden: Sequence[tuple[str, bytes]]

    def driver(
        self,
        rate_at: Rate = still,
        truth: GyroTruth = NO_ERRORS,
        *,
        rate_hz: float | None = None,
        range_deg_s: float = 500.0,
        range_g: float = 8.0,
        **others: Any,
    ) -> Driver:
        """A part that runs, by default at its fastest rate here and in the ranges that all parts have."""
        driver = self.new(rate_at, truth, range_deg_s=range_deg_s, **others)
        driver.start(rate_hz or self.rates_hz[-1], range_deg_s, range_g)
        return driver

    def per_count_rad_s(self, range_deg_s: float = 500.0) -> float:
        return math.radians(self.per_count_deg_s[range_deg_s])


PARTS = (
    Part(
        name="LSM9DS1",
        new=Lsm9ds1Driver,
        identity=0x68,
        other_identity=0x69,
        rates_hz=(14.9, 59.5, 119.0, 238.0, 476.0, 952.0),
        per_count_deg_s={245.0: 8.75e-3, 500.0: 17.5e-3, 2000.0: 70.0e-3},
        per_count_g={2.0: 0.061e-3, 4.0: 0.122e-3, 8.0: 0.244e-3, 16.0: 0.732e-3},
        temperature_counts=lambda temperature_c: 16 * (temperature_c - 25),
        forbidden=(
            ("unmodelled_register", b"\xa6\x00"),
            ("unmodelled_register", b"\x06\x01"),
            ("unmodelled_bits", b"\x21\x04"),  # the accelerometer's second filter
        ),
    ),
    Part(
        name="MPU-9250",
        new=Mpu9250Driver,
        identity=0x71,
        other_identity=0x70,
        rates_hz=(4.0, 100.0, 200.0, 500.0, 1000.0),
        per_count_deg_s={250.0: 1 / 131, 500.0: 1 / 65.5, 1000.0: 1 / 32.8, 2000.0: 1 / 16.4},
        per_count_g={2.0: 1 / 16384, 4.0: 1 / 8192, 8.0: 1 / 4096, 16.0: 1 / 2048},
        temperature_counts=lambda temperature_c: 333.87 * (temperature_c - 21),
        forbidden=(
            ("unmodelled_register", b"\xf2\x00"),  # FIFO count
            ("unmodelled_register", b"\x26\x01"),
            ("unmodelled_register", b"\x77\x00"),  # the accelerometer's offset, which is the factory's trim
            ("unmodelled_bits", b"\x1b\xe0"),  # self-test
            ("unmodelled_bits", b"\x6a\x40"),  # FIFO on
        ),
    ),
    Part(
        name="ADIS16465",
        new=Adis16465Driver,
        identity=0x4051,
        other_identity=0x4056,
        rates_hz=(1.0, 100.0, 200.0, 500.0, 2000.0),
        per_count_deg_s={125.0: 1 / 160, 500.0: 1 / 40, 2000.0: 1 / 10},
        per_count_g={8.0: 1 / 4000},
        temperature_counts=lambda temperature_c: 10 * temperature_c,
        forbidden=(
            ("unmodelled_register", b"\x24\x00"),  # delta angle
            ("unmodelled_register", b"\xf6\x01"),  # user scratch
            ("unmodelled_bits", b"\xe0\x04"),  # external sync
            ("unmodelled_bits", b"\xe8\x04"),  # self-test
        ),
    ),
)

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
def test_its_identity_is_the_datasheets_unless_it_is_another_part(part: Part) -> None:
    driver = part.new()
    assert driver.identity() == part.identity
    driver.part.fault = Fault.OTHER_PART
    assert driver.identity() == part.other_identity


@every_rate
def test_conversions_come_at_the_data_rate(part: Part, rate_hz: float) -> None:
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
def test_its_own_oscillator_sets_the_pace(part: Part) -> None:
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
def test_sensitivity_is_the_datasheets(part: Part, range_deg_s: float) -> None:
    rate = np.radians(range_deg_s) * np.array([0.9, -0.5, 0.1])
    driver = part.driver(lambda _time_s: rate.tolist(), range_deg_s=range_deg_s)
    error = settled(driver) - rate / part.per_count_rad_s(range_deg_s)
    assert np.all(np.abs(error) <= 0.5)


@every_part
def test_too_much_saturates(part: Part) -> None:
    range_deg_s = min(part.per_count_deg_s)
    much = np.radians(10 * range_deg_s)
    driver = part.driver(lambda _time_s: (much, -much, 0.0), range_deg_s=range_deg_s)
    assert settled(driver).tolist() == [32767, -32768, 0]


vectors = st.tuples(*[st.floats(-3, 3)] * 3)


@every_part
@settings(max_examples=20)
@given(vectors, st.tuples(*[st.floats(0.7, 1.3)] * 3), st.tuples(*[st.floats(-0.2, 0.2)] * 3))
def test_the_truth_is_g_equals_k_times_m_plus_b(
    part: Part, rate: tuple[float, ...], scale: tuple[float, ...], bias_rad_s: tuple[float, ...]
) -> None:
    reading = settled(part.driver(lambda _time_s: rate, GyroTruth(scale, bias_rad_s), rate_hz=part.rates_hz[-2]))
    per_count = part.per_count_rad_s()
    recovered = np.array(scale) * (reading * per_count + np.array(bias_rad_s))
    slack = 1.0 if part.name == "ADIS16465" else 0.5001  # it averages here, and a burst alone rounds down
    assert np.all(np.abs(recovered - rate) <= slack * per_count * np.array(scale))


@every_part
def test_non_orthogonal_axes_pick_up_their_neighbours(part: Part) -> None:
    xy, xz, yz = 0.02, -0.01, 0.03
    truth = GyroTruth(non_orthogonality_rad=(xy, xz, yz))
    columns = [settled(part.driver(partial(constant, axis), truth)) for axis in np.eye(3).tolist()]
    axes = np.array(columns).T * part.per_count_rad_s()
    assert np.linalg.norm(axes, axis=1) == pytest.approx(1.0, abs=1e-3)
    assert axes @ [1, 0, 0] == pytest.approx([1, math.sin(xy), math.sin(xz)], abs=3e-4)
    assert axes @ [0, 1, 0] == pytest.approx([0, math.cos(xy), math.sin(yz)], abs=3e-4)


@every_part
def test_noise_is_white_and_as_strong_as_told(part: Part) -> None:
    noise_rad_s, count = 0.035, 3000
    driver = part.driver(truth=GyroTruth(noise_rad_s=noise_rad_s), seed=3)
    readings = counts(driver, count) * part.per_count_rad_s()
    assert np.all(np.abs(readings.mean(axis=0)) < 4 * noise_rad_s / math.sqrt(count))
    assert readings.std(axis=0) == pytest.approx(noise_rad_s, rel=4 / math.sqrt(2 * count))
    correlations = np.corrcoef(np.column_stack([readings[1:], readings[:-1]]).T)
    assert np.all(np.abs(correlations - np.eye(6)) < 4.5 / math.sqrt(count))


@every_part
def test_noise_follows_the_seed_and_not_the_reader(part: Part) -> None:
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
def test_temperature(part: Part, temperature_c: float) -> None:
    driver = part.driver(temperature_c=temperature_c)
    driver.await_data()
    assert driver.read()[1] == round(part.temperature_counts(temperature_c))


@every_part
def test_what_has_no_model_is_refused_by_name(part: Part) -> None:
    for name, access in part.forbidden:
        driver = part.new()
        with pytest.raises(Violation) as caught:
            driver.exchange(access)
        assert caught.value.name == name, access
        assert part.name in caught.value.what


@pytest.mark.parametrize(
    ("part", "range_g"), [(p, r) for p in PARTS for r in p.per_count_g], ids=lambda v: getattr(v, "name", None)
)
def test_sensitivity_to_acceleration_is_the_datasheets(part: Part, range_g: float) -> None:
    force_g = range_g * np.array([0.9, -0.5, 0.1])
    driver = part.driver(lambda _time_s: (0.1, 0.2, 0.3, *force_g.tolist()), range_g=range_g)
    error = settled_acceleration(driver) - force_g / part.per_count_g[range_g]
    assert np.all(np.abs(error) <= 0.5)


@every_part
def test_too_much_acceleration_saturates(part: Part) -> None:
    driver = part.driver(lambda _time_s: (0.0, 0.0, 0.0, 90.0, -90.0, 0.0))
    assert settled_acceleration(driver).tolist() == [32767, -32768, 0]


@every_part
def test_a_motion_without_force_shows_a_part_at_rest_with_z_up(part: Part) -> None:
    assert settled_acceleration(part.driver()).tolist() == [0, 0, round(1 / part.per_count_g[8.0])]


@every_part
def test_a_motion_is_asked_for_once_though_two_triads_feel_it(part: Part) -> None:
    asked: list[float] = []

    def motion_at(time_s: float) -> Sequence[float]:
        asked.append(time_s)
        return 0.0, 0.0, 0.0, 0.0, 0.0, 1.0

    driver = part.driver(motion_at, acceleration=AccelerometerTruth(noise_m_s2=0.01))
    driver.advance(driver.part.next_event_s + 0.2)
    assert len(asked) > 0.19 * part.rates_hz[-1]
    assert len(asked) == len(set(asked))


@every_part
def test_what_the_accelerometer_does_leaves_the_rates_as_they_are(part: Part) -> None:
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
