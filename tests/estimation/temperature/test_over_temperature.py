"""Scale and bias over temperature: what the polynomials say, how well they say it, and where they say nothing."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.temperature.over_temperature import fit_over_temperature
from rig.estimation.temperature.temperature_polynomials import OverTemperature
from support.motions.warmed_sweeps import (
    FROM_C,
    REFERENCE_C,
    TO_C,
    Drawn,
    calibrate,
    drawn,
    readings,
    repeat_means,
    session,
)

FIVE_C = (22.0, 30.0, 40.0, 50.0, 58.0)
NONE = np.zeros((12, 3))
WALK = 1e-5  # rad/s per √s, as in configs/demo.yaml


def upright(seed: int, **planted: float) -> tuple[Drawn, np.random.Generator]:
    """A sensor about axes that do not lean, as files have them; unless `walk` says so its bias does not wander."""
    rng = np.random.default_rng([31, seed])
    return replace(drawn(rng, **{"walk": 0.0, **planted}), leaning=NONE), rng


def errors(sensor: Drawn, found: OverTemperature) -> tuple[Array, Array]:
    """(5, 6) errors at five temperatures, over u and over U."""
    held = [found.evaluate(each) for each in FIVE_C]
    off = np.array([each.values - sensor.evaluate(warm) for each, warm in zip(held, FIVE_C, strict=True)])
    return off / [each.std for each in held], off / [each.expanded for each in held]


def covered(sensors: int, **planted: float) -> tuple[float, float]:
    """How often values at five temperatures lie within U, and the RMS of their errors over u.

    Every other sensor's bias wanders, so much that its slopes suffer and so little that its readings hardly show it.
    """
    both = []
    for seed in range(sensors):
        walk = WALK * (seed % 2)
        sensor, rng = upright(seed, **{"walk": walk, **planted})
        both.append(errors(sensor, calibrate(sensor, session(), rng)))
    over_u, over_expanded = (np.concatenate(each) for each in zip(*both, strict=True))
    return float(np.mean(np.abs(over_expanded) <= 1)), float(np.sqrt(np.mean(over_u**2)))


@pytest.mark.slow
@pytest.mark.proof
def test_u_covers_the_truth_at_five_temperatures(thorough: bool) -> None:
    share, rms = covered(6 if thorough else 3)

    assert share > 0.88 and 0.7 < rms < 1.25


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
def test_u_covers_the_truth_of_forty_sensors() -> None:
    share, rms = covered(40)
    print(f"within U {share:.3f}, RMS over u {rms:.2f}")

    assert 0.93 <= share <= 0.975


@pytest.mark.slow
def test_what_is_left_of_the_bias_is_thirty_times_less_than_before() -> None:
    before = []
    after = []
    u = []
    for seed in range(2):
        sensor, rng = upright(seed, gradient_k=0.0)
        found = calibrate(sensor, session(), rng)
        for warm in np.linspace(*found.range_c, 9):
            held = found.evaluate(float(warm))
            before.append(sensor.evaluate(warm)[3:] - sensor.evaluate(REFERENCE_C)[3:])
            after.append(held.values[3:] - sensor.evaluate(warm)[3:])
            u.append(held.std[3:])

    assert np.sqrt(np.mean(np.square(before))) > 30 * np.sqrt(np.mean(np.square(after)))
    assert np.sqrt(np.mean(np.square(after))) <= 1.2 * np.sqrt(np.mean(np.square(u)))


@pytest.mark.slow
def test_what_leans_in_every_repeat_tells_nothing_of_temperature() -> None:
    sensor, rng = upright(1)
    of = session()
    means = readings(sensor, of, rng)
    straight = fit_over_temperature(repeat_means(means, of, sensor.noise), REFERENCE_C, 0.1)
    leaning = np.random.default_rng(2).normal(0, 1e-2, NONE.shape)[of.places]
    leant = fit_over_temperature(repeat_means(means + leaning, of, sensor.noise), REFERENCE_C, 0.1)

    assert np.allclose(leant.bias[1:], straight.bias[1:], rtol=1e-3, atol=1e-9)
    assert np.allclose(leant.scale[1] / leant.scale[0], straight.scale[1] / straight.scale[0], rtol=0.05, atol=1e-8)


@pytest.mark.slow
def test_u_grows_towards_both_ends_and_there_is_none_beyond() -> None:
    sensor, rng = upright(0, gradient_k=0.0)
    of = session()
    found = fit_over_temperature(repeat_means(readings(sensor, of, rng), of, sensor.noise), REFERENCE_C, 0.0)
    low, middle, high = (found.evaluate(each).std for each in (FROM_C + 0.1, 40.0, found.range_c[1]))

    assert (low > middle).all() and (high > middle).all()
    for outside in (FROM_C - 1, TO_C + 1):
        with pytest.raises(Fault) as refused:
            found.evaluate(outside)
        assert refused.value.name == "temperature_outside"


@pytest.mark.slow
def test_the_order_is_that_of_the_sensor() -> None:
    rng = np.random.default_rng(4)
    sensor = drawn(rng)
    straight = replace(sensor, scale=sensor.scale * [[1], [0], [0]], bias=sensor.bias * [[1], [1], [0]], walk=0.0)
    of = session()
    found = fit_over_temperature(repeat_means(readings(straight, of, rng), of, sensor.noise), REFERENCE_C, 0.1)

    assert found.orders[0] <= 1 and 1 <= found.orders[1] <= 2
    assert np.abs(found.bias[1] - straight.bias[1]).max() < 2e-5


@pytest.mark.slow
def test_a_hysteresis_is_found_and_covered() -> None:
    sensor, rng = upright(3, hysteresis=2e-3)
    found = calibrate(sensor, session(), rng)
    assert found.hysteresis is not None
    loop, std = found.hysteresis

    assert (np.abs(loop[3:] - sensor.hysteresis) < 4 * std[3:] + 1e-4).all()
    for way in (-1, 1):  # whoever warms, whoever cools
        held = found.evaluate(40.0)
        assert (
            np.abs(held.values[3:] - sensor.evaluate(40.0)[3:] - way * sensor.hysteresis) < 1.3 * held.expanded[3:]
        ).all()


@pytest.mark.slow
def test_a_sensor_that_only_warmed_says_nothing_of_hysteresis() -> None:
    sensor, rng = upright(3)

    assert calibrate(sensor, session(both_directions=False), rng).hysteresis is None


@pytest.mark.slow
def test_the_lag_of_the_thermometer_is_found() -> None:
    sensor, rng = upright(5)
    found = calibrate(replace(sensor, lag_s=20.0), session(), rng)

    assert abs(found.lag_s - 20.0) < 4 * found.lag_std_s + 2.0


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"temperature_c": np.linspace(24, 27, 168)}, "temperature_range_too_small"),
        ({"poses": np.arange(168)}, "too_few_observations"),
        ({"temperature_c": np.linspace(30, 60, 168)}, "temperature_outside"),
        ({"temperature_c": np.full(168, np.nan)}, "not_finite"),
    ],
)
def test_what_tells_no_polynomial_is_refused_by_name(changed: dict[str, Any], name: str) -> None:
    sensor, rng = upright(0)
    of = session()
    with pytest.raises(Fault) as refused:
        fit_over_temperature(
            replace(repeat_means(readings(sensor, of, rng), of, sensor.noise), **changed), REFERENCE_C, 0.1
        )

    assert refused.value.name == name
