"""`rig look` states nothing about a column that neither its heading nor gravity shows, and says why it does not."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.analysis.log_contents import look_at
from rig.estimation.arrays import Array
from rig.sensors.lines.log_columns import LogColumns

pytestmark = pytest.mark.slow

TIME_S = np.arange(600) / 100
NOISE = np.random.default_rng(1).normal(size=(len(TIME_S), 3))
ANGLES = np.clip(TIME_S - 2, 0, 2)[:, None] * [0.5, -0.4, 0.3]  # at rest, turning, at rest
FORCES = Rotation.from_rotvec(ANGLES).inv().apply([0.0, 1.0, 9.75]) + 0.01 * NOISE
RATES = np.gradient(ANGLES, TIME_S, axis=0) + 1e-3 * NOISE[::-1]


def guess(path: Path, heading: str, *columns: Array) -> LogColumns:
    """Return the guess at a file with this heading, if any, and these columns."""
    rows = [",".join(f"{cell:.12g}" for cell in row) for row in np.column_stack(columns)]
    path.write_text("\n".join([*([heading] if heading else []), *rows]) + "\n", encoding="utf-8")
    looked = look_at(path).guess
    assert looked is not None
    return looked


def test_rows_of_a_rotation_matrix_are_no_quaternion(tmp_path: Path) -> None:
    matrices = Rotation.from_rotvec(np.add(ANGLES, [0.001, 0.002, 0.01])).as_matrix().reshape(-1, 9)
    names = ",".join(f"M{row}{column}" for row in "123" for column in "123")
    for heading in (f"time,roll,pitch,yaw,{names}", ""):
        guessed = guess(tmp_path / "log.csv", heading, TIME_S, 1e-4 * NOISE, matrices)
        (gap,) = [gap for gap in guessed.gaps if "rotation matrices" in gap]
        assert not guessed.motion and "from_matrix(M.reshape(-1, 3, 3)).as_quat(scalar_first=True)" in gap


@pytest.mark.parametrize(
    ("heading", "column"), [("LOCATION Latitude", None), ("heading", None), ("board temp", 5), ("T [°C]", 5), ("", 5)]
)
def test_a_temperature_has_a_name_that_says_so_or_none(heading: str, column: int | None, tmp_path: Path) -> None:
    numbers = 33.9 + 0.1 * np.sin(TIME_S)
    guessed = guess(tmp_path / "log.csv", f"time,gx,gy,gz,{heading}", TIME_S, RATES, numbers)
    read = guessed.samples.get("temperature_c")
    assert read is None if column is None else read == {"column": heading or column, "unit": "C"}


@pytest.mark.parametrize(
    ("unit", "spelled", "size"),
    [("rad/s", "in radians/s", 1.0), ("mdeg/s", "mDeg/s", 57295.78), ("m/s²", "m/s²", 0.97), ("g", "in G's", 0.1)],
)
def test_units_in_words_are_read_and_m_s2_is_no_other_unit_than_m_s_squared(
    unit: str, spelled: str, size: float, tmp_path: Path
) -> None:
    kind, readings = ("x_m_s2", FORCES) if unit in ("m/s²", "g") else ("x_rad_s", RATES)
    heading = f"time,x ({spelled}),y ({spelled}),z ({spelled})"
    guessed = guess(tmp_path / "log.csv", heading, TIME_S, size * readings)
    assert guessed.samples[kind]["unit"] == unit and not guessed.gaps


def test_an_accelerometer_that_reads_0_93_at_rest_is_nearest_to_g(tmp_path: Path) -> None:
    guessed = guess(tmp_path / "log.csv", "time,ax,ay,az", TIME_S, 0.093 * FORCES)
    assert guessed.samples["x_m_s2"]["unit"] == "g" and any("nearest to 1 g in g" in gap for gap in guessed.gaps)


@pytest.mark.parametrize(
    ("file", "names", "readings", "reason"),
    [
        ("log.csv", "LINEAR ACCELERATION {}", np.subtract(FORCES, [0.0, 1.0, 9.75]), "gravity is removed"),
        ("log.csv", "FreeAcc_{}", FORCES, "gravity is removed"),
        ("Gravity.csv", "{}", FORCES, "gravity is computed"),
        ("log.csv", "imu.linear_acceleration.{}", FORCES, ""),
    ],
)
def test_accelerations_without_gravity_are_not_read(
    file: str, names: str, readings: Array, reason: str, tmp_path: Path
) -> None:
    heading = ",".join(["time", *map(names.format, "xyz")])
    guessed = guess(tmp_path / file, heading, TIME_S, readings)
    assert ("x_m_s2" in guessed.samples) == (not reason)
    assert reason in "".join(guessed.reasons) and bool(guessed.reasons) == bool(reason)


def test_the_unit_in_a_heading_counts_more_than_a_letter(tmp_path: Path) -> None:
    guessed = guess(tmp_path / "log.csv", "time,fx_uT,fy_uT,fz_uT", TIME_S, 4 * FORCES)
    assert "x_t" in guessed.samples and "x_m_s2" not in guessed.samples


def test_three_columns_with_names_of_other_things_are_no_gyroscope(tmp_path: Path) -> None:
    heading = "time,right knee,left knee,right hip,left hip"
    guessed = guess(tmp_path / "log.csv", heading, TIME_S, 50 * RATES, 50 * RATES[:, 0])
    assert not guessed.samples and any(
        "what right knee left knee right hip left hip are" in gap for gap in guessed.gaps
    )


def test_columns_without_a_heading_are_taken_by_threes_and_only_if_gravity_shows_them(tmp_path: Path) -> None:
    field = Rotation.from_rotvec(ANGLES).inv().apply([20.0, 0.0, -40.0]) + 0.1 * NOISE
    guessed = guess(tmp_path / "log.csv", "", TIME_S, FORCES, RATES, field)
    assert [guessed.samples[f"x_{unit}"]["column"] for unit in ("m_s2", "rad_s", "t")] == [2, 5, 8] and not guessed.gaps
    for forces, rates, field_read in ((0.083 * FORCES, 100 * RATES[::-1], field), (FORCES[:, ::-1] - 8, NOISE, field)):
        guessed = guess(tmp_path / "log.csv", "", TIME_S, forces, rates, field_read)
        assert all(entry.get("unit") == "?" for name, entry in guessed.samples.items() if name != "time_s")
        (gap,) = guessed.gaps
        assert gap.startswith("what 2 3 4 5 6 7 8 9 10 are: no heading says it")
    guessed = guess(tmp_path / "log.csv", "", TIME_S, RATES[:, :1], FORCES, RATES)
    assert "x_m_s2" not in guessed.samples, "no three begin at the second reading"


@pytest.mark.parametrize(
    ("names", "is_stuck", "reason"),
    [
        ("WatchGyro", False, "they are a second gyroscope, and of each kind one is read"),
        ("WatchAcc", True, "the numbers of WatchAccX never change"),
    ],
)
def test_three_columns_of_a_sensor_that_are_not_read_are_listed_with_the_reason(
    names: str, is_stuck: bool, reason: str, tmp_path: Path
) -> None:
    heading = ",".join(["time", *(f"{name}{axis}" for name in ("Gyro", names) for axis in "XYZ")])
    other = FORCES * [0, 1, 1] if is_stuck else 2 * RATES
    guessed = guess(tmp_path / "log.csv", heading, TIME_S, RATES, other)
    assert guessed.samples["x_rad_s"]["column"] == "GyroX"
    assert guessed.reasons == [f"{names}X {names}Y {names}Z are not read: {reason}"]


@pytest.mark.parametrize("name", ["gyro_{}_filtered", "{} Gyro", "SENSgyro.{}", "w_RS_S_{} [rad s^-1]"])
def test_an_axis_may_be_anywhere_in_the_name_of_a_sensor(name: str, tmp_path: Path) -> None:
    heading = ",".join(["time", *map(name.format, "xyz")])
    assert "x_rad_s" in guess(tmp_path / "log.csv", heading, TIME_S, RATES).samples
