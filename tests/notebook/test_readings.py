"""Every sensor of a run can be read: rates, accelerations, fields, temperatures, as arrays and as tables."""

import subprocess
import sys

import numpy as np
import pytest

import rig
from rig.errors import Refused
from support.paths import RECORDINGS
from support.processes.waiting import PATIENCE_S


@pytest.fixture(scope="module")
def imu() -> rig.Readings:
    return rig.load(RECORDINGS / "imu")["gyro"]


@pytest.fixture(scope="module")
def magnetic() -> rig.Run:
    return rig.load(RECORDINGS / "magnetometer")


@pytest.mark.slow
def test_an_accelerometer_is_read_beside_its_gyroscope(imu: rig.Readings) -> None:
    found = imu.acceleration
    assert found.values.shape == (len(found.time_s), 3) and found.unit == "m/s²"
    assert np.median(np.linalg.norm(found.values, axis=1)) == pytest.approx(9.81, rel=0.05)
    np.testing.assert_array_equal(found.time_s, imu.rate.time_s)
    np.testing.assert_array_equal(imu.rate.values, imu.on_arm_clock()[1])
    assert 10 < imu.temperature.values.mean() < 50 and imu.temperature.values.ndim == 1


@pytest.mark.slow
def test_a_magnetometer_is_read_on_the_arms_clock(magnetic: rig.Run) -> None:
    name = next(name for name in magnetic if "field" in magnetic[name].quantities)
    field = magnetic[name].field
    assert 1e-5 < np.median(np.linalg.norm(field.values, axis=1)) < 1e-4
    arm = magnetic.recorded.movement[0].states["time_s"]
    assert arm[0] - 1 < field.time_s[0] < field.time_s[-1] < arm[-1] + 1
    assert list(field.to_frame().columns) == ["x_t", "y_t", "z_t"]


@pytest.mark.slow
def test_a_sweep_is_a_table_with_units_in_its_names(imu: rig.Readings) -> None:
    whole, sweep = imu.to_frame(), imu.to_frame(sweep=3)
    assert whole.index.name == "time_s" and len(whole) == len(imu.samples)
    assert {"x_rad_s", "z_rad_s", "x_m_s2", "temperature_c"} <= set(sweep.columns)
    speeds = [np.linalg.norm(each[["x_rad_s", "y_rad_s", "z_rad_s"]], axis=1) for each in (sweep, whole)]
    assert 0 < len(sweep) < len(whole) / 4
    assert np.median(speeds[0]) > 2 and np.quantile(speeds[1], 0.2) < 0.2


@pytest.mark.slow
def test_what_was_not_measured_is_refused_by_name(imu: rig.Readings) -> None:
    with pytest.raises(Refused, match=r"no_such_quantity: .*field.*rate, .*acceleration"):
        imu.field  # noqa: B018
    with pytest.raises(Refused, match=r"no_such_sweep: .*99"):
        imu.to_frame(sweep=99)


def test_two_sensors_that_are_no_gyroscopes_are_not_compared(magnetic: rig.Run) -> None:
    name = next(name for name in magnetic if "rate" not in magnetic[name].quantities)
    with pytest.raises(Refused, match=r"nothing_to_compare: .*measures no rates"):
        rig.compare(magnetic, name, name)


def test_a_table_without_pandas_says_which_extra_it_needs(imu: rig.Readings, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(Refused, match=r"missing_extra: .*pandas.*\[pandas\]"):
        imu.to_frame()


@pytest.mark.thorough
@pytest.mark.slow
def test_nothing_loads_pandas_before_a_table_is_asked_for() -> None:
    program = (
        "import sys, rig\n"
        "for name in rig.__all__: assert getattr(rig, name).__doc__ or name == '__version__', name\n"
        f"result = rig.load_result({str(RECORDINGS / 'verified')!r}); result['gyro'].apply([[0.1, 0.2, 0.3]])\n"
        "print([name for name in ('pandas', 'matplotlib', 'rtde_control', 'rig.turners.ur.arm_driver')"
        " if name in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE_S, check=True
    )
    assert done.stdout.strip() == "[]"
