"""The Earth's rate from sweeps and rests: TRIAX, section III-A, on an arm that is not what it says."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.earth import DEG_H, EARTH_RATE_RAD_S
from rig.estimation.gyroscope.earth_rate import EarthRate, EarthRatePrior, find_earth_rate
from rig.estimation.gyroscope.vector_fit import explain
from rig.study.rate_table import GYRO_MATRIX
from support.motions.earth_rate_session import KVH1775, LATITUDE_RAD, LSM9DS1, MPU9250, UP, Part, Session, Truth, record

KNOWN = EarthRatePrior(UP, repeatability_rad=5e-5, state_jitter_s=2e-5)
SENSITIVE = replace(KNOWN, g_sensitivity=True)
AT_LATITUDE = replace(SENSITIVE, latitude_rad=LATITUDE_RAD)
STRAIGHT = np.eye(3)
FELT = Session(g_sensitivity_rad_s_g=tuple((np.random.default_rng(3).normal(size=9) * DEG_H).tolist()))
VIBRATING = Session(vibration_rad_s=2e-3)
SEEDS, FEW = 20, 6  # in `make proof`, and in `make test` with wider limits


@cache
def found(session: Session, seed: int, known: str = "known") -> tuple[EarthRate, Truth]:
    """`known`: "known" or "at latitude"."""
    seen, truth = record(session, seed)
    return find_earth_rate(seen, STRAIGHT, KNOWN if known == "known" else AT_LATITUDE), truth


def refused(session: Session, seed: int, known: EarthRatePrior = KNOWN) -> str:
    with pytest.raises(Fault) as caught:
        find_earth_rate(record(session, seed)[0], STRAIGHT, known)
    return caught.value.name


@pytest.mark.slow
def test_a_kvh_finds_it_and_where_it_stands() -> None:
    earth, truth = found(Session(), 1)
    std = np.sqrt(np.diag(earth.covariance_rad2_s2))
    assert (np.abs(earth.rate_rad_s - truth.earth_rad_s) < 4 * std).all()
    assert std.max() < 0.08 * DEG_H
    assert abs(earth.latitude_rad - LATITUDE_RAD) < 4 * earth.latitude_std_rad < np.radians(1.2)
    assert earth.heading_rad is not None and earth.heading_std_rad is not None
    off = np.angle(np.exp(1j * (earth.heading_rad - truth.heading_rad)))
    assert abs(off) < 4 * earth.heading_std_rad < np.radians(1.5)


@pytest.mark.slow
def test_a_vibration_of_the_standing_arm_costs_it_nothing() -> None:
    earth, truth = found(VIBRATING, 1)
    assert (np.abs(earth.rate_rad_s - truth.earth_rad_s) < 4 * np.sqrt(np.diag(earth.covariance_rad2_s2))).all()
    assert earth.norm_std_rad_s < 0.08 * DEG_H


@pytest.mark.slow
@pytest.mark.parametrize("part", [MPU9250, LSM9DS1])
def test_a_part_that_cannot_see_it_says_so(part: Part) -> None:
    assert refused(replace(Session(), part=part), 1) == "earth_rate_not_observable"


@pytest.mark.slow
def test_what_is_seen_clearly_and_is_not_the_earths_rate_is_refused() -> None:
    """A table that itself turns, or a bias that follows the attitude in another way."""
    assert refused(Session(earth_rad_s=1.1 * EARTH_RATE_RAD_S), 1) == "earth_rate_not_observable"


def test_the_earths_rate_and_a_sensitivity_to_gravity_are_not_both_found_without_a_latitude() -> None:
    assert refused(FELT, 1, SENSITIVE) == "earth_rate_and_g_sensitivity"


def test_with_a_latitude_they_are() -> None:
    earth, truth = found(FELT, 1, "at latitude")
    assert earth.vertical_fixed
    assert earth.latitude_rad == pytest.approx(LATITUDE_RAD, abs=np.radians(0.5))
    assert UP @ earth.rate_rad_s == pytest.approx(EARTH_RATE_RAD_S * np.sin(LATITUDE_RAD))
    level = np.sqrt(np.diag(earth.covariance_rad2_s2)[:2])
    assert (np.abs(earth.rate_rad_s - truth.earth_rad_s)[:2] < 4 * level).all()


@pytest.mark.slow
def test_a_sensitivity_that_is_left_out_is_noticed() -> None:
    """5 °/h/g along the vertical: the sensor would read another Earth."""
    strong = Session(g_sensitivity_rad_s_g=tuple((-5 * DEG_H * np.eye(3)).ravel().tolist()))
    assert refused(strong, 1) == "earth_rate_not_observable"


def test_one_attitude_tells_nothing_of_it() -> None:
    seen, _ = record(Session(dwell_s=0.0), 1)
    sweeps = len([joint for joint in seen.joints if joint])
    still = replace(
        seen,
        turns_rad_s=np.concatenate([seen.turns_rad_s[:sweeps], np.zeros((len(seen.joints) - sweeps, 3))]),
        attitudes=np.broadcast_to(seen.attitudes[-1], seen.attitudes.shape),
    )
    with pytest.raises(Fault, match="rank_deficient"):
        find_earth_rate(still, STRAIGHT, KNOWN)


def test_sweeps_alone_tell_it_only_of_an_arm_whose_axes_do_not_lean() -> None:
    assert refused(Session(dwell_s=0.0), 1) == "earth_rate_not_observable"
    seen, truth = record(Session(dwell_s=0.0, leaning_rad=0.0), 1)
    earth = find_earth_rate(seen, STRAIGHT, replace(KNOWN, repeatability_rad=0.0))
    assert np.linalg.norm(earth.rate_rad_s - truth.earth_rad_s) < 1.5 * DEG_H
    assert np.sqrt(np.linalg.eigvalsh(earth.covariance_rad2_s2)[-1]) < 0.5 * DEG_H


@pytest.mark.kernels
@pytest.mark.slow
def test_the_papers_matrix_and_bias_come_back() -> None:
    """On an arm that is what it says: else the rows of F turn with it."""
    exact = Session(axes=6, arm_rad=0.0, hysteresis_rad=0.0, leaning_rad=0.0)
    seen, truth = record(exact, 1)
    seen = replace(seen, axis_errors_rad_s=None)
    earth = find_earth_rate(seen, STRAIGHT, replace(KNOWN, repeatability_rad=0.0))
    solution = explain(replace(seen, earth_rate_rad_s=earth.rate_rad_s), STRAIGHT).solution
    timing = np.sqrt(2) * exact.timing_s / 6  # of a turn of six seconds, about each row's own axis
    std = np.sqrt(np.diag(solution.matrix_covariance)[:9].reshape(3, 3) + timing**2)
    assert (np.abs(solution.matrix - GYRO_MATRIX) < 3 * std).all()
    of_the_bias = np.sqrt(np.diag(solution.matrix_covariance)[9:] + np.diag(earth.covariance_rad2_s2))
    assert (np.abs(-solution.bias_rad_s - truth.bias_rad_s) < 3 * of_the_bias).all()


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("axes", [3, 6])
def test_over_many_arms_and_headings_it_is_as_good_as_stated(axes: int, thorough: bool) -> None:
    """The paper is 0.36 °/h off."""
    session, wider = Session(axes=axes), 0.0 if thorough else 0.25
    pairs = [found(session, seed) for seed in range(SEEDS if thorough else FEW)]
    off = np.array([earth.norm_rad_s - EARTH_RATE_RAD_S for earth, _ in pairs])
    stated = np.array([earth.norm_std_rad_s for earth, _ in pairs])
    ratio = rms(off / stated)
    print(f"{axes} axes: norm {rms(off) / DEG_H:.4f} deg/h, over σ {ratio:.2f}")
    assert rms(off) < 0.1 * DEG_H
    assert 0.6 - wider < ratio < 1.4 + wider, "twenty of them: within four of its own deviations of 0.8 to 1.3"
    each = np.array([e.rate_rad_s - t.earth_rad_s for e, t in pairs])
    std = np.array([np.sqrt(np.diag(e.covariance_rad2_s2)) for e, _ in pairs])
    print(f"components {rms(each) / DEG_H:.4f} deg/h, over σ {rms(each / std):.2f}")
    assert 0.8 - wider < rms(each / std) < 1.3 + wider


@pytest.mark.slow
@pytest.mark.proof
def test_on_an_arm_that_vibrates_it_is_as_good_as_stated(thorough: bool) -> None:
    """2 mrad/s at 14 Hz, which nothing tells of but the readings."""
    wider = 0.0 if thorough else 0.25
    pairs = [found(VIBRATING, seed) for seed in range(SEEDS if thorough else FEW)]
    off = np.array([earth.norm_rad_s - EARTH_RATE_RAD_S for earth, _ in pairs])
    stated = np.array([earth.norm_std_rad_s for earth, _ in pairs])
    each = np.array([e.rate_rad_s - t.earth_rad_s for e, t in pairs])
    std = np.array([np.sqrt(np.diag(e.covariance_rad2_s2)) for e, _ in pairs])
    print(f"norm {rms(off) / DEG_H:.4f} deg/h, over σ {rms(off / stated):.2f}")
    print(f"components {rms(each) / DEG_H:.4f} deg/h, over σ {rms(each / std):.2f}")
    assert rms(off) < 0.1 * DEG_H
    assert 0.6 - wider < rms(off / stated) < 1.4 + wider, (
        "twenty of them: within four of its own deviations of 0.8 to 1.3"
    )
    assert 0.8 - wider < rms(each / std) < 1.3 + wider


@pytest.mark.slow
@pytest.mark.proof
def test_with_a_latitude_and_a_sensitivity_it_is_as_good_as_stated(thorough: bool) -> None:
    wider = 0.0 if thorough else 0.25
    pairs = [found(FELT, seed, "at latitude") for seed in range(SEEDS if thorough else FEW)]
    each = np.array([(e.rate_rad_s - t.earth_rad_s)[:2] for e, t in pairs])
    std = np.array([np.sqrt(np.diag(e.covariance_rad2_s2))[:2] for e, _ in pairs])
    print(f"level components {rms(each) / DEG_H:.4f} deg/h, over σ {rms(each / std):.2f}")
    assert rms(each) < 0.1 * DEG_H
    assert 0.75 - wider < rms(each / std) < 1.3 + wider


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.parametrize("part", [MPU9250, LSM9DS1])
def test_no_part_that_cannot_see_it_ever_claims_to(part: Part) -> None:
    for axes in (3, 6):
        session = replace(Session(axes=axes), part=part)
        assert {refused(session, seed) for seed in range(SEEDS)} == {"earth_rate_not_observable"}


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def test_the_parts_noise_is_that_of_the_paper() -> None:
    """0.012 °/√h: ten seconds of rest leave 0.23 °/h."""
    assert KVH1775.density / np.sqrt(10) == pytest.approx(0.2277 * DEG_H, rel=1e-3)
