"""Other programs read what is exported, with the values, units and signs of the result."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from firmware_host.samples import IMU_SAMPLE_DTYPE
from rig.cli import main
from rig.data.entries.accelerometer import AlignmentEntry
from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.entries.result_types import ErrorEntry, PlacementEntry
from rig.data.quantity import ACCELERATION
from rig.data.recording.channel import triad_channel
from rig.data.recording.run_file import read_run
from rig.data.result_file import ResultDocument, VectorEntry, read_result
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.estimation.sensor_axes import SensorAxes
from rig.observation.observed_run import ObservedRun, observe_runs
from rig.plans.recorded_run import open_run
from rig.report.exports.autopilots import ardupilot_files, px4_files
from rig.report.exports.columns import plain_names
from rig.report.exports.exported_corrections import NOT_ALIGNED, calibrations
from rig.report.exports.exported_recording import WithMotion, export_recordings
from rig.report.exports.formats import CALIBRATION_FORMATS, FORMATS, texts_of_calibrations, writer_of_readings
from rig.report.exports.imucal import imucal_files
from rig.report.exports.kalibr import kalibr_files, triangular
from support.documents.certified import accelerometer, everything, result
from support.paths import RECORDINGS

GRAVITY_M_S2 = 9.81


def rows(matrix: Array) -> Any:
    return tuple(map(tuple, matrix.tolist()))


@pytest.fixture(scope="module")
def sensed() -> ResultDocument:
    """The result with a sensor of skew axes, felt gravity, and an accelerometer beside it."""
    rng = np.random.default_rng(5)
    sensor = result().gyroscopes["gyro"]
    vector = sensor.vector_model
    assert isinstance(vector, VectorEntry)
    changed = vector.model_copy(update={"g_sensitivity_rad_s_per_m_s2": rows(1e-3 * rng.normal(size=(3, 3)))})
    aligned = AlignmentEntry(rotation_rad=(0.0, 0.0, 0.0), std_rad=(1e-4, 1e-4, 1e-4))
    beside = accelerometer(rows(np.eye(3) + 0.02 * rng.normal(size=(3, 3)))).model_copy(update={"alignment": aligned})
    return result().model_copy(
        update={
            "gyroscopes": {"gyro": sensor.model_copy(update={"vector_model": changed})},
            "accelerometers": {"gyro": beside},
        }
    )


@pytest.fixture(scope="module")
def recordings() -> tuple[WithMotion, ...]:
    return tuple(map(WithMotion, observe_runs(open_run(RECORDINGS / "six_observation").movement)))


def felt(document: ResultDocument, rate_flange: Array, up_flange: Array) -> tuple[Array, Array]:
    """What gyroscope and accelerometer read, by the models of the result, of a rate and of gravity from above."""
    sensor = document.gyroscopes["gyro"]
    vector = sensor.vector_model
    assert isinstance(vector, VectorEntry) and vector.g_sensitivity_rad_s_per_m_s2 is not None
    down = -GRAVITY_M_S2 * up_flange
    reading = np.array(vector.matrix) @ rate_flange + np.array(vector.g_sensitivity_rad_s_per_m_s2) @ down
    force = np.array(vector.mounting) @ -down
    beside = document.accelerometers["gyro"]
    acceleration = np.linalg.inv(np.array(beside.correction_matrix)) @ force + np.array(beside.bias_m_s2)
    return reading - np.array(sensor.bias_rad_s), acceleration


def motion() -> tuple[Array, Array]:
    rng = np.random.default_rng(7)
    up = rng.normal(size=3)
    return rng.normal(size=3), up / np.linalg.norm(up)


@pytest.mark.slow
def test_imucal_takes_readings_to_the_true_rate_and_force(sensed: ResultDocument) -> None:
    from imucal import CalibrationInfo

    (text,) = imucal_files(calibrations(sensed)).values()
    found = CalibrationInfo.from_json(text)
    rate, up = motion()
    reading, acceleration = felt(sensed, rate, up)
    force, turned = found.calibrate(acceleration[None], reading[None], "m/s^2", "rad/s")
    model = sensed.gyroscopes["gyro"].vector_model
    assert isinstance(model, VectorEntry)
    mounting = np.array(model.mounting)
    np.testing.assert_allclose(turned[0], mounting @ rate, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(force[0], GRAVITY_M_S2 * mounting @ up, rtol=1e-12, atol=1e-15)
    assert "b_g = -b" in found.comment and "Left out" in found.comment


def test_imucal_of_a_gyroscope_alone_leaves_accelerations_as_they_are() -> None:
    from imucal import CalibrationInfo

    old = read_result(RECORDINGS / "six_observation")
    found = CalibrationInfo.from_json(*imucal_files(calibrations(old)).values())
    force, _ = found.calibrate(np.ones((1, 3)), np.ones((1, 3)), "m/s^2", "rad/s")
    np.testing.assert_array_equal(force, np.ones((1, 3)))
    assert "No accelerometer" in found.comment and "K_ga is zero" in found.comment


def test_kalibr_s_intrinsics_say_the_same_of_the_same_motion(sensed: ResultDocument) -> None:
    text = kalibr_files(calibrations(sensed))["gyro_intrinsics.yaml"]
    imu = yaml.safe_load(text)["imu0"]
    scaled, sensitivity, turned = (np.array(imu["gyroscopes"][name]) for name in ("M", "A", "C_gyro_i"))
    of_force = np.array(imu["accelerometers"]["M"])
    for lower in (scaled, of_force):
        assert np.array_equal(lower, np.tril(lower))
    np.testing.assert_allclose(turned @ turned.T, np.eye(3), atol=1e-12)
    model = sensed.gyroscopes["gyro"].vector_model
    assert isinstance(model, VectorEntry)
    mounting = np.array(model.mounting)
    beside = sensed.accelerometers["gyro"]
    _, body = triangular(np.linalg.inv(np.array(beside.correction_matrix)))
    rate, up = motion()
    reading, acceleration = felt(sensed, rate, up)
    rate_body, force_body = body @ mounting @ rate, GRAVITY_M_S2 * body @ mounting @ up
    without_bias = reading + np.array(sensed.gyroscopes["gyro"].bias_rad_s)
    np.testing.assert_allclose(
        scaled @ turned @ rate_body + sensitivity @ turned @ force_body, without_bias, rtol=1e-12, atol=1e-15
    )
    np.testing.assert_allclose(of_force @ force_body, acceleration - np.array(beside.bias_m_s2), rtol=1e-12, atol=1e-15)


def test_an_accelerometer_that_a_file_of_attitudes_calibrated_is_turned_into_its_gyroscope_s_frame() -> None:
    from imucal import CalibrationInfo

    sensor = result().gyroscopes["gyro"]
    assert isinstance(sensor.vector_model, VectorEntry)
    to_gyroscope = np.array(sensor.vector_model.mounting)
    turned = Rotation.from_euler("zyx", [90, 20, -5], degrees=True).as_matrix()  # another chip, soldered otherwise
    skew = np.array([[1.02, 0.003, -0.002], [0.004, 0.98, 0.001], [-0.001, 0.003, 1.01]])
    matrix = skew @ turned @ to_gyroscope
    placement = PlacementEntry(
        placement_std=None, placement_uncertainty=None, rests_without_attitude=0, rows_omitted=0, covariance=(),
        covariance_order=(),
    )  # fmt: skip
    beside = accelerometer(rows(SensorAxes.from_matrix(matrix).correction_matrix))
    beside = beside.model_copy(update={"matrix": rows(matrix), "placement": placement})
    document = result().model_copy(update={"accelerometers": {"gyro": beside}})
    rate, up = motion()
    force = GRAVITY_M_S2 * up
    read = np.array(beside.matrix) @ force + np.array(beside.bias_m_s2)
    (imucal,) = imucal_files(calibrations(document)).values()
    corrected, _ = CalibrationInfo.from_json(imucal).calibrate(read[None], np.zeros((1, 3)), "m/s^2", "rad/s")
    np.testing.assert_allclose(corrected[0], to_gyroscope @ force, rtol=1e-9)
    text = kalibr_files(calibrations(document))["gyro_intrinsics.yaml"]
    imu = yaml.safe_load(text)["imu0"]
    scaled, of_force = np.array(imu["gyroscopes"]["M"]), np.array(imu["accelerometers"]["M"])
    # The frame of the accelerometer's triangular matrix is that in which C_gyro_i takes rates.
    body = np.linalg.solve(of_force, np.array(beside.matrix))
    without_bias = np.array(sensor.vector_model.matrix) @ rate
    np.testing.assert_allclose(scaled @ np.array(imu["gyroscopes"]["C_gyro_i"]) @ body @ rate, without_bias, rtol=1e-9)
    assert "not known: this file" not in text + imucal
    unknown = document.model_copy(update={"accelerometers": {"gyro": accelerometer()}})
    for files in (kalibr_files(calibrations(unknown)), imucal_files(calibrations(unknown))):
        assert any(NOT_ALIGNED in text for text in files.values())


def test_kalibr_s_noise_is_that_of_rests_over_the_root_of_the_rate(sensed: ResultDocument) -> None:
    text = kalibr_files(calibrations(sensed))["gyro_imu.yaml"]
    found = yaml.safe_load(text)
    assert found["update_rate"] == pytest.approx(238, rel=0.01)
    assert found["gyroscope_noise_density"] == pytest.approx(0.035 / 238**0.5, rel=0.05)
    assert found["accelerometer_noise_density"] == pytest.approx(0.02 / 200**0.5)
    assert "Lost: gyroscope_random_walk, accelerometer_random_walk" in text
    alone = kalibr_files(calibrations(read_result(RECORDINGS / "six_observation")))["gyro_imu.yaml"]
    assert "accelerometer_noise_density" not in yaml.safe_load(alone)
    assert "Lost: accelerometer_noise_density" in alone


def test_autopilots_subtract_minus_b(sensed: ResultDocument) -> None:
    bias = sensed.gyroscopes["gyro"].bias_rad_s
    px4, ardupilot = texts_of(sensed)
    lines = [line.split("\t") for line in px4.splitlines() if not line.startswith("#")]
    assert [line[2] for line in lines[:3]] == ["CAL_GYRO0_XOFF", "CAL_GYRO0_YOFF", "CAL_GYRO0_ZOFF"]
    assert [float(line[3]) for line in lines[:3]] == [-b for b in bias]
    pairs = dict(line.split(",") for line in ardupilot.splitlines() if not line.startswith("#"))
    assert [float(pairs[f"INS_GYROFFS_{axis}"]) for axis in "XYZ"] == [-b for b in bias]
    assert pairs["INS_GYR_CAL"] == "0"
    assert float(pairs["INS_GYR1_CALTEMP"]) == sensed.gyroscopes["gyro"].temperature_c
    for text in (px4, ardupilot):
        assert "Lost: scale factors" in text and "rad/s" in text


def test_autopilots_correct_accelerometers_as_the_result_does(sensed: ResultDocument) -> None:
    found, reading = sensed.accelerometers["gyro"], np.array([0.3, -9.7, 1.1])
    px4, ardupilot = parameters_of(sensed)
    for offset, scale in ((px4("CAL_ACC0_{}OFF"), px4("CAL_ACC0_{}SCALE")),
                          (ardupilot("INS_ACCOFFS_{}"), ardupilot("INS_ACCSCAL_{}"))):  # fmt: skip
        np.testing.assert_allclose((reading - offset) * scale, (reading - found.bias_m_s2) * found.scale)


def test_autopilots_correct_a_magnetometer_to_the_size_that_the_result_makes_it() -> None:
    document = read_result(RECORDINGS / "magnetometer")
    ((_, found),) = document.magnetometers.items()
    assert isinstance(found, MagnetometerEntry)
    px4, ardupilot = parameters_of(document)
    reading_t = np.array([31e-6, -12e-6, 38e-6])
    right = np.array(found.correction_matrix) @ (reading_t - found.bias_t)
    gauss = ellipsoid(px4("CAL_MAG0_{}SCALE"), px4("CAL_MAG0_{}ODIAG")) @ (reading_t / 1e-4 - px4("CAL_MAG0_{}OFF"))
    milli = ellipsoid(ardupilot("COMPASS_DIA_{}"), ardupilot("COMPASS_ODI_{}"))
    milli = milli @ (reading_t / 1e-7 + ardupilot("COMPASS_OFS_{}"))
    for field_t in (1e-4 * gauss, 1e-7 * milli):
        assert np.linalg.norm(field_t) == pytest.approx(np.linalg.norm(right))
        assert np.linalg.norm(field_t - right) < 0.02 * np.linalg.norm(right)  # it is turned by what axes lean


def test_a_file_without_gyroscopes_leaves_their_calibration_at_boot_alone() -> None:
    document = read_result(RECORDINGS / "magnetometer")
    text = ardupilot_files(calibrations(document))["ardupilot.param"]
    assert "COMPASS_OFS_X" in text and "INS_GYR" not in text.replace("# ", "")


def test_sensors_keep_their_numbers_when_one_before_them_was_not_calibrated(sensed: ResultDocument) -> None:
    field = read_result(RECORDINGS / "magnetometer").magnetometers["compass"]
    fields = {"inner": ErrorEntry(error="no field"), "outer": field}
    two = {"gyroscopes": dict.fromkeys(("a", "b"), sensed.gyroscopes["gyro"]), "magnetometers": fields}
    document = sensed.model_copy(update={**two, "accelerometers": {"b": sensed.accelerometers["gyro"]}})
    px4, ardupilot = texts_of(document)
    assert "CAL_ACC1_XOFF" in px4 and "CAL_ACC0" not in px4 and "INS_ACC2OFFS_X" in ardupilot
    assert "CAL_MAG1_XOFF" in px4 and "CAL_MAG0" not in px4 and "COMPASS_OFS2_X" in ardupilot
    assert "# inner, magnetometer, not calibrated: no field" in px4


def texts_of(document: ResultDocument) -> tuple[str, str]:
    """The files of PX4 and ArduPilot."""
    found = calibrations(document)
    return px4_files(found)["px4.params"], ardupilot_files(found)["ardupilot.param"]


def parameters_of(document: ResultDocument) -> tuple[Callable[[str], Array], Callable[[str], Array]]:
    """What the files of PX4 and ArduPilot say: three values by the name with `{}` for the axis."""
    px4, ardupilot = texts_of(document)
    found = [
        {line.split("\t")[2]: float(line.split("\t")[3]) for line in px4.splitlines() if line[0] != "#"},
        {name: float(value) for name, value in (line.split(",") for line in ardupilot.splitlines() if line[0] != "#")},
    ]

    def of(said: dict[str, float]) -> Callable[[str], Array]:
        return lambda name: np.array([said[name.format(axis)] for axis in "XYZ"])

    return of(found[0]), of(found[1])


def ellipsoid(diagonal: Array, beside: Array) -> Array:
    """As both autopilots put it together."""
    (xx, yy, zz), (xy, xz, yz) = diagonal, beside
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def test_a_second_gyroscope_has_parameters_of_its_own(sensed: ResultDocument) -> None:
    two = sensed.model_copy(update={"gyroscopes": dict.fromkeys(("a", "b"), sensed.gyroscopes["gyro"])})
    assert "INS_GYR2OFFS_X," in ardupilot_files(calibrations(two))["ardupilot.param"]
    assert "CAL_GYRO1_XOFF" in px4_files(calibrations(two))["px4.params"]


@pytest.mark.parametrize("name", CALIBRATION_FORMATS)
def test_a_hostile_serial_number_stays_in_its_comment(sensed: ResultDocument, name: str) -> None:
    sensor = sensed.gyroscopes["gyro"].model_copy(update={"serial_number": "1\nINS_GYROFFS_X,9\n- ]}"})
    hostile = sensed.model_copy(update={"gyroscopes": {"gyro": sensor}})
    for text in texts_of_calibrations(name)(calibrations(hostile)).values():
        assert "\nINS_GYROFFS_X,9" not in text


@pytest.mark.parametrize("name", CALIBRATION_FORMATS)
def test_what_a_format_has_no_place_for_is_named_in_it(name: str) -> None:
    found = calibrations(everything())
    tilt = replace(found.sensors[0], sensor="tilt", quantity=replace(ACCELERATION, name="tilt", sensor="inclinometer"))
    texts = texts_of_calibrations(name)(replace(found, sensors=(*found.sensors, tilt)))
    said = "\n".join(texts.values())
    assert "tilt, inclinometer" in said
    takes_fields = "CAL_MAG0_XOFF" in said or "COMPASS_OFS_X" in said
    assert takes_fields == (name in ("px4", "ardupilot")) and takes_fields != ("compass, magnetometer" in said)


def test_nothing_calibrated_is_nothing_to_export() -> None:
    with pytest.raises(Refused, match="nothing_to_export"):
        _ = calibrations(result().model_copy(update={"gyroscopes": {}})).imus


def test_names_stay_apart_where_blanks_are_not_taken() -> None:
    assert plain_names(["my gyro", "my-gyro", "2nd"]) == {"my gyro": "my_gyro", "my-gyro": "my_gyro_", "2nd": "s_2nd"}


@pytest.mark.slow
def test_csv_solves_to_the_same_calibration(
    recordings: tuple[WithMotion, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = {path.name for path in writer_of_readings("csv")(recordings, tmp_path)}
    assert files == {"arm.csv", "gyro.csv", "gyro_sweeps.csv", "README.txt"}
    solving = ["solve", str(tmp_path / "gyro.csv"), "--sweeps", str(tmp_path / "gyro_sweeps.csv"), "--json"]
    assert main(solving) == 0
    again = json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]
    first = read_result(RECORDINGS / "six_observation").gyroscopes["gyro"]
    std = np.sqrt(np.diag(first.covariance))
    off = np.array([*again["scale"], *again["bias_rad_s"]]) - np.array([*first.scale, *first.bias_rad_s])
    assert np.all(np.abs(off) < std)  # the arm's vibration is noise there
    said = (tmp_path / "README.txt").read_text(encoding="utf-8")
    assert all(f"{name}: " in said for name in files - {"README.txt"}) and "Not here" in said


@pytest.mark.slow
def test_parquet_and_matlab_hold_the_readings(recordings: tuple[WithMotion, ...], tmp_path: Path) -> None:
    import pyarrow.parquet
    from scipy.io import loadmat

    stream = recordings[0].observed.stream("gyro")
    writer_of_readings("parquet")(recordings, tmp_path)
    table = pyarrow.parquet.read_table(tmp_path / "gyro.parquet")
    assert b"raw readings in the sensor's own axes" in table.schema.metadata[b"convention"]
    writer_of_readings("mat")(recordings, tmp_path)
    struct = loadmat(tmp_path / "run.mat", simplify_cells=True)["gyro"]
    assert "raw readings" in struct["convention"]
    for i, name in enumerate(("x_rad_s", "y_rad_s", "z_rad_s")):
        np.testing.assert_array_equal(table[name].to_numpy(), stream.readings_rad_s[:, i])
        np.testing.assert_array_equal(struct[name], stream.readings_rad_s[:, i])
    np.testing.assert_array_equal(struct["time_s"], stream.time_s)


@pytest.mark.slow
def test_a_ros_2_bag_holds_the_readings(recordings: tuple[WithMotion, ...], tmp_path: Path) -> None:
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    (path,) = writer_of_readings("ros2")(recordings, tmp_path)
    store = get_typestore(Stores.ROS2_JAZZY)
    stream = recordings[0].observed.stream("gyro")
    with Reader(str(path)) as bag:
        (connection,) = bag.connections
        assert connection.topic == "/gyro/imu"
        messages: list[Any] = [store.deserialize_cdr(data, connection.msgtype) for _, _, data in bag.messages()]
    rates = np.array([[m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z] for m in messages])
    np.testing.assert_allclose(rates, stream.readings_rad_s, rtol=1e-12, atol=1e-15)
    since_s = np.array([m.header.stamp.sec % 10**6 + 1e-9 * m.header.stamp.nanosec for m in messages])
    np.testing.assert_allclose(np.diff(since_s), np.diff(stream.time_s), atol=1e-8)
    first: Any = messages[0]
    assert first.orientation_covariance[0] == first.linear_acceleration_covariance[0] == -1
    sensor = recordings[0].observed.sensors["gyro"]
    noise = np.array([rest.noise_rad_s for rest in sensor.rests] or [np.zeros(3)])  # zero says that it is not known
    variance = first.angular_velocity_covariance.reshape(3, 3)
    np.testing.assert_allclose(np.diag(variance), np.mean(noise**2, axis=0))
    bag_s_own = yaml.safe_load((path / "metadata.yaml").read_text(encoding="utf-8"))["rosbag2_bagfile_information"]
    said = bag_s_own["custom_data"]["convention"]
    assert "orientation_covariance[0] = -1" in said and "the arm controller's clock" in said
    with pytest.raises(Refused, match="report_folder"):
        writer_of_readings("ros2")(recordings, tmp_path)


def with_accelerations(observed: ObservedRun) -> ObservedRun:
    """The same of a sensor whose accelerometer was read, at 1, 2, 3 counts."""
    old = observed.run.samples["gyro"]
    samples = np.zeros(len(old), IMU_SAMPLE_DTYPE)
    for name in old.dtype.names or ():
        samples[name] = old[name]
    samples["acceleration_counts"] = (1, 2, 3)
    sensor = observed.run.sensors["gyro"]
    sensor = replace(sensor, channels=(*sensor.channels, triad_channel(ACCELERATION, 0.25, 32767, 20.0)))
    return replace(observed, run=replace(observed.run, samples={"gyro": samples}, sensors={"gyro": sensor}))


@pytest.mark.slow
def test_accelerations_are_exported_beside_the_rates(recordings: tuple[WithMotion, ...], tmp_path: Path) -> None:
    from rosbags.rosbag2 import Reader
    from rosbags.typesys import Stores, get_typestore

    felt = [WithMotion(with_accelerations(recordings[0].observed))]
    writer_of_readings("csv")(felt, tmp_path)
    header, first, *_ = (tmp_path / "gyro_acceleration.csv").read_text(encoding="utf-8").splitlines()
    assert header == "time_s,x_m_s2,y_m_s2,z_m_s2" and first.endswith(",0.25,0.5,0.75")
    (path,) = writer_of_readings("ros2")(felt, tmp_path)
    store = get_typestore(Stores.ROS2_JAZZY)
    with Reader(str(path)) as bag:
        connection, _, data = next(iter(bag.messages()))
        message: Any = store.deserialize_cdr(data, connection.msgtype)
    force = message.linear_acceleration
    assert (force.x, force.y, force.z) == (0.25, 0.5, 0.75)
    assert message.linear_acceleration_covariance[0] == 0  # nothing stood still in attitudes: not known


BY_HAND, ELSEWHERE = RECORDINGS / "by_hand", RECORDINGS


@pytest.mark.slow
@pytest.mark.parametrize(
    ("run", "files", "again"),
    [
        pytest.param(
            BY_HAND,
            {"gyro.csv", "README.txt"},
            "--turns --clock-ppm 30 --name gyro",  # as the run says of its crystal
            id="by hand",
        ),
        pytest.param(
            ELSEWHERE / "sweeps",
            {"imu.csv", "imu_sweeps.csv", "README.txt"},
            "--sweeps imu_sweeps.csv",
            id="sweeps of a file",
        ),
        pytest.param(
            ELSEWHERE / "attitudes",
            {"imu.csv", "imu_attitudes.csv", "README.txt"},
            "--attitudes imu_attitudes.csv --up=-z --gravity-m-s2 9.80061 --field-t 47.98e-6 --second-order",
            id="attitudes of a file",
        ),
    ],
)
def test_readings_that_no_arm_turned_are_exported_with_what_is_known_of_their_motion(
    run: Path, files: set[str], again: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(run), "--format", "csv", "--out", str(tmp_path)]) == 0
    assert {Path(line).name for line in capsys.readouterr().out.splitlines()} == files
    (readings,) = (name for name in files if name.count("_") == 0 and name.endswith(".csv"))
    options = [str(tmp_path / word) if word.endswith(".csv") else word for word in again.split()]
    main(["solve", str(tmp_path / readings), *options, "--json"])
    solved = json.loads(capsys.readouterr().out)
    first = json.loads((run / "result.json").read_text(encoding="utf-8"))
    for kind in ("gyroscopes", "accelerometers", "magnetometers"):
        assert solved.get(kind, {}).keys() == first.get(kind, {}).keys()
        for name, entry in first.get(kind, {}).items():
            np.testing.assert_allclose(solved[kind][name]["scale"], entry["scale"], rtol=1e-9)


@pytest.mark.slow
def test_readings_of_a_file_are_a_ros_2_bag_where_a_gyroscope_is_among_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from rosbags.rosbag2 import Reader

    run = read_run(ELSEWHERE / "sweeps" / "run.h5")
    (path,) = writer_of_readings("ros2")(export_recordings([run]), tmp_path)
    with Reader(str(path)) as bag:
        assert bag.message_count == len(run.samples["imu"])
        assert bag.duration * 1e-9 == pytest.approx(np.ptp(run.samples["imu"]["host_time_s"]))
    still = ["export", str(ELSEWHERE / "attitudes"), "--format", "ros2", "--out", str(tmp_path / "still")]
    assert main(still) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith("rig: nothing_to_export: no gyroscope was recorded")


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_every_format_by_the_command_line(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", str(RECORDINGS / "six_observation"), "--format", name, "--out", str(tmp_path / "made")]) == 0
    told = [Path(line) for line in capsys.readouterr().out.splitlines()]
    assert told and all(path.exists() for path in told)
