"""A calibration corrects readings of one's own, in SI units, and refuses what is none."""

from pathlib import Path

import numpy as np
import pytest

import rig
from rig.errors import Refused
from support.paths import RECORDINGS, ROOT

IMU = ROOT / "tests" / "fixtures" / "recordings" / "imu"
MAGNETOMETER = IMU.parent / "magnetometer"


@pytest.fixture(scope="module")
def gyro() -> rig.Calibration:
    return rig.load_result(IMU)["gyro"]


@pytest.fixture(scope="module")
def accelerometer() -> rig.Calibration:
    return rig.load_result(IMU)["gyro, accelerometer"]


def test_a_gyroscope_turns_at_the_speed_of_the_sweep_once_it_is_corrected(gyro: rig.Calibration) -> None:
    sweep = gyro.entry.observations[0]
    corrected = gyro.apply([sweep.mean_rad_s])
    assert corrected.shape == (1, 3)
    assert np.linalg.norm(corrected) == pytest.approx(sweep.speed_rad_s, abs=5e-3)
    assert np.linalg.norm(sweep.mean_rad_s) != pytest.approx(sweep.speed_rad_s, rel=1e-2)


def test_where_only_scale_factors_are_corrected_it_is_k_times_reading_and_bias() -> None:
    gyro = rig.load_result(RECORDINGS / "verified")["gyro"]
    readings = np.array([[0.1, -0.2, 0.3], [1.0, 2.0, np.nan]])
    corrected = gyro.apply(readings)
    np.testing.assert_allclose(corrected[0], gyro.scale * (readings[0] + gyro.bias))
    assert np.isnan(corrected[1]).all()


def test_an_accelerometer_at_rest_feels_gravity_once_it_is_corrected(accelerometer: rig.Calibration) -> None:
    dwells = np.array([dwell.mean_m_s2 for dwell in accelerometer.entry.dwells])
    gravity = accelerometer.entry.gravity_m_s2
    assert np.abs(np.linalg.norm(accelerometer.apply(dwells), axis=1) - gravity).max() < 0.02
    assert np.abs(np.linalg.norm(dwells, axis=1) - gravity).max() > 0.1


def test_a_magnetometer_reads_the_field_in_every_attitude_once_it_is_corrected() -> None:
    result = rig.load_result(MAGNETOMETER)
    magnetometer = next(result[name] for name in result if result[name].quantity.name == "field")
    dwells = np.array([dwell.mean_t for dwell in magnetometer.entry.dwells])
    sizes = np.linalg.norm(magnetometer.apply(dwells), axis=1)
    assert np.ptp(sizes) < 0.1 * np.ptp(np.linalg.norm(dwells, axis=1))
    assert sizes.mean() == pytest.approx(magnetometer.entry.field_t, rel=0.01)
    with pytest.raises(Refused, match=r"wrong_unit: .*µT or gauss.*1e-6 \* readings"):
        magnetometer.apply(dwells * 1e6)


def test_counts_are_refused_with_what_to_do(gyro: rig.Calibration) -> None:
    with pytest.raises(Refused, match=r"not_readings: .*int32.*counts.*Multiply them by"):
        gyro.apply(np.zeros((5, 3), np.int32))
    with pytest.raises(Refused, match=r"wrong_unit: .*like counts"):
        gyro.apply(np.full((5, 3), 7000.0))


def test_degrees_are_refused_with_what_to_do(gyro: rig.Calibration) -> None:
    with pytest.raises(Refused, match=r"wrong_unit: .*°/s.*numpy\.radians"):
        gyro.apply(np.array([[0.0, 60.0, 0.0]]))


def test_a_sensor_whose_range_nobody_said_takes_what_some_part_could_read() -> None:
    gyro = rig.load_result(IMU.parent / "sweeps")
    (calibration,) = gyro.values()
    assert np.isfinite(calibration.apply(np.array([[0.0, 60.0, 0.0]]))).all()
    with pytest.raises(Refused, match=r"wrong_unit: .*no such sensor reads more"):
        calibration.apply(np.array([[0.0, 2000.0, 0.0]]))


def test_g_are_refused_with_what_to_do(accelerometer: rig.Calibration) -> None:
    with pytest.raises(Refused, match=r"wrong_unit: .*look like g.*9\.80665"):
        accelerometer.apply(np.array([[0.0, 0.1, 0.99], [0.0, 0.0, 1.01]]))


@pytest.mark.parametrize("shape", [(3,), (4, 2), (2, 3, 1)])
def test_another_shape_is_refused(gyro: rig.Calibration, shape: tuple[int, ...]) -> None:
    with pytest.raises(Refused, match=r"not_readings: .*\(n, 3\)"):
        gyro.apply(np.zeros(shape))


def test_texts_are_refused_and_nothing_is_taken_as_nothing(gyro: rig.Calibration) -> None:
    with pytest.raises(Refused, match="not_readings"):
        gyro.apply([["a", "b", "c"]])
    assert gyro.apply(np.zeros((0, 3))).shape == (0, 3)
    assert np.isnan(gyro.apply(np.full((2, 3), np.nan))).all()


def test_u_is_that_of_the_budget(gyro: rig.Calibration) -> None:
    assert (*gyro.scale_expanded, *gyro.bias_expanded) == gyro.entry.budget.expanded
    np.testing.assert_allclose(gyro.coverage_factors * gyro.entry.budget.std, gyro.entry.budget.expanded)
    assert f"± {max(gyro.scale_expanded):.2g}" in repr(gyro)


def test_a_result_that_is_loaded_is_the_one_that_is_solved() -> None:
    result = rig.load_result(RECORDINGS / "verified" / "result.json")
    assert result.verdict == "pass" and result["gyro"].name == "gyro"
    assert result.to_dict()["schema"] == "rig.result/1"
    with pytest.raises(Refused, match="no_result"):
        rig.load_result(Path("nowhere"))
    with pytest.raises(Refused, match="no_run_file: there is no file nowhere"):
        rig.solve("nowhere")
