"""`rig board info` and `calibration` as a technician uses them, on a board that stands in a simulated laboratory."""

import json
import os
import pty
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from firmware_host.client import Board, BoardIdentity, SensorInfo
from firmware_host.parts import BOARD_PARTS, GYROSCOPES, MAGNETOMETERS
from firmware_host.protocol import FIRMWARE_VERSION
from rig.board.flash_store import calibration_of, store
from rig.board.identify import find_sensor, read_stored_calibration, refuse_other_firmware
from rig.config.sensors.sensor_sections import SensorSection
from rig.data.result_file import read_passed_result, read_result, write_result
from rig.errors import Refused
from support.documents.certified import over_temperature
from support.documents.results import SENSOR, VERIFIED, result_document
from support.laboratories import commands
from support.laboratories.worlds import World, WorldHandle, worlds
from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module

pytestmark = pytest.mark.slow

SENSORS: dict[str, dict[str, Any]] = {
    "gyro": {"part": "lsm9ds1", "serial_number": "LSM9DS1-001", "rate_hz": 238, "range_deg_s": 245},
    "other": {"part": "mpu9250", "serial_number": "MPU9250-001"},
    "reference": {"part": "adis16465", "serial_number": "ADIS16465-001", "role": "reference"},
}
TRUTH = {"scale": [1.0, 1.0, 1.0], "bias_rad_s": [0.0, 0.0, 0.0]}
SCALE = {"gyro": [1.1771, 1.1554, 1.144], "other": [1.0065, 0.9955, 0.995]}
BIAS = {"gyro": [0.0077, -0.01, -0.0051], "other": [0.0411, -0.0099, 0.0101]}


def rig(*arguments: str | Path, stdin: int = subprocess.DEVNULL) -> subprocess.CompletedProcess[str]:
    return commands.rig("board", *arguments, stdin=stdin)


def answered(keyboard: int, terminal: int, answer: bytes, *arguments: str | Path) -> subprocess.CompletedProcess[str]:
    """The command at that terminal, whose question is answered when it is asked: earlier is no answer."""
    command = ("board", *arguments)
    with start_module(*command, stdin=terminal, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None and process.stderr is not None
        said = b""
        while b"Type yes to" not in said and (more := os.read(process.stderr.fileno(), 4096)):
            said += more
        os.write(keyboard, answer)
        out, rest = process.communicate(timeout=PATIENCE_S)
    return subprocess.CompletedProcess(command, process.returncode, out.decode(), (said + rest).decode())


def result(folder: Path, **changes: Any) -> Path:
    """A result.json in a run folder, as a run leaves it; `changes` go into the entry of the sensor gyro."""
    entries = {
        name: SENSOR.model_dump()
        | {
            "part": SENSORS[name]["part"],
            "serial_number": SENSORS[name]["serial_number"],
            "range_rad_s": radians(245 if name == "gyro" else 250),
            "temperature_c": 22.5,
            "scale": SCALE[name],
            "correction_matrix": np.diag(SCALE[name]).tolist(),
            "bias_rad_s": BIAS[name],
        }
        for name in ("gyro", "other")
    }
    entries["gyro"] |= changes
    folder.mkdir(exist_ok=True)
    document = json.loads(VERIFIED.text()) | {"gyroscopes": entries}
    (folder / "result.json").write_text(json.dumps(document))
    return folder


@pytest.fixture(scope="module")
def laboratory(tmp_path_factory: pytest.TempPathFactory) -> Iterator[WorldHandle]:
    """A laboratory that stands for the whole module: the board remembers from one command to the next."""
    with worlds(tmp_path_factory.mktemp("world")) as start:
        sensors = dict.fromkeys(SENSORS, TRUTH)
        yield start({"sensors": SENSORS, "world": {"sensors": sensors, "time_scale": 1}})


@pytest.fixture(scope="module")
def config(laboratory: WorldHandle) -> Path:
    """A configuration that connects to the laboratory as to hardware."""
    document = yaml.safe_load(laboratory.config_path.read_text(encoding="utf-8"))
    del document["world"]
    path = laboratory.config_path.with_name("connect.yaml")
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def stored(config: Path) -> dict[str, Any]:
    done = rig("calibration", "read", config, "--json")
    assert done.returncode == 0, done
    sensors: dict[str, Any] = json.loads(done.stdout)["sensors"]
    return sensors


def test_a_calibration_is_stored_read_back_kept_through_a_reset_and_erased(
    laboratory: WorldHandle, config: Path, tmp_path: Path
) -> None:
    assert stored(config) == {"gyro": None, "other": None, "reference": None}

    done = rig("calibration", "write", config, result(tmp_path), "--yes")
    assert done.returncode == 0 and done.stdout.count("stored: ") == 2, done
    laboratory.control({"do": "reset_board"})

    found = stored(config)
    assert found["reference"] is None
    for name, part, range_deg_s in (("gyro", "LSM9DS1", 245), ("other", "MPU-9250", 250)):
        assert found[name]["scale"] == pytest.approx(SCALE[name], rel=1e-7)
        assert found[name]["bias_rad_s"] == pytest.approx(BIAS[name], rel=1e-7)
        assert (found[name]["part"], found[name]["range_deg_s"], found[name]["sequence"]) == (part, range_deg_s, 1)
        assert found[name]["serial_number"] == SENSORS[name]["serial_number"]
    table = rig("calibration", "read", config, "--sensor", "gyro").stdout
    assert "LSM9DS1-001 at 245 °/s, 22.5 °C" in table and "1.177100" in table and "-0.005100" in table
    info = rig("info", config)
    assert info.returncode == 0 and "LSM9DS1-001, " in info.stdout and FIRMWARE_VERSION in info.stdout, info

    # The same calibration within the same second would be the record that is stored already.
    warmer = result(tmp_path, temperature_c=23.5)
    assert rig("calibration", "write", config, warmer, "--yes", "--sensor", "gyro").returncode == 0
    assert [stored(config)[name]["sequence"] for name in ("gyro", "other")] == [2, 1]

    assert rig("calibration", "erase", config, "--sensor", "other", "--yes").stdout == "erased: other\n"
    assert [name for name, record in stored(config).items() if record is not None] == ["gyro"]
    assert rig("calibration", "erase", config, "--yes").stdout == "erased: gyro\n"
    assert "nothing to erase" in rig("calibration", "erase", config, "--yes").stdout


def test_a_calibration_over_temperature_is_stored_with_its_polynomials_and_shown(config: Path, tmp_path: Path) -> None:
    folder, found = result(tmp_path), over_temperature()
    document = json.loads((folder / "result.json").read_text())
    document["over_temperature"] = {"gyro": {"rate": found.model_dump(mode="json")}}
    (folder / "result.json").write_text(json.dumps(document))
    try:
        done = rig("calibration", "write", config, folder, "--sensor", "gyro", "--yes")
        assert done.returncode == 0 and "corrected by temperature from 20.0 to 40.0 °C" in done.stdout, done
        entry = stored(config)["gyro"]
        assert entry["temperature_c"] == pytest.approx(found.reference_c)
        kept = entry["over_temperature"]
        assert kept["range_c"] == pytest.approx(found.range_c)
        for n in range(3):
            shares = [each / one for each, one in zip(found.scale[n + 1], found.scale[0], strict=True)]
            assert kept["scale_change"][n] == pytest.approx(shares, rel=1e-6)
            assert kept["bias_change_rad_s"][n] == pytest.approx(found.bias[n + 1], rel=1e-6)
        table = rig("calibration", "read", config, "--sensor", "gyro").stdout
        assert "corrected by temperature from" in table and f"{found.bias[1][0]:+.2e}" in table
    finally:
        rig("calibration", "erase", config, "--sensor", "gyro", "--yes")


def test_nothing_is_changed_unless_somebody_agrees(config: Path, tmp_path: Path) -> None:
    write = ("calibration", "write", config, result(tmp_path), "--sensor", "gyro")
    done = rig(*write)
    assert done.returncode == 2 and "rig: not_confirmed: " in done.stderr and done.stdout == ""
    assert stored(config)["gyro"] is None

    keyboard, terminal = pty.openpty()
    try:
        assert answered(keyboard, terminal, b"no\n", *write).returncode == 2
        done = answered(keyboard, terminal, b"yes\n", *write)
        assert done.returncode == 0 and "gyro: scale 1.17710 1.15540 1.14400" in done.stderr, done
        done = answered(keyboard, terminal, b"yes\n", "calibration", "erase", config)
        assert done.returncode == 0 and "erases record 1" in done.stderr, done
    finally:
        os.close(keyboard)
        os.close(terminal)


def failed(folder: Path) -> Path:
    """A run folder whose verdict failed."""
    write_result(result_document({"gyro": SENSOR}, passed=False), folder)
    return folder / "result.json"


@pytest.mark.parametrize(
    ("make", "name", "words"),
    [
        (lambda folder: folder, "no_result", "result.json cannot be read"),
        (lambda folder: Path(__file__), "not_a_result", "JSON"),
        (lambda folder: Path(sys.executable), "not_a_result", "it is not text"),
        (lambda folder: result(folder, scale=[1.1, 0.0, 1.1]), "not_a_result", "gyroscopes.gyro.scale.1"),
        (lambda folder: result(folder, bias_rad_s=[0.1, 0.2]), "not_a_result", "gyroscopes.gyro.bias_rad_s"),
        (failed, "verdict_failed", "(gyro.verification_reference)"),
    ],
)
def test_what_is_no_calibration_that_passed_is_refused(
    make: Callable[[Path], Path], name: str, words: str, tmp_path: Path
) -> None:
    with pytest.raises(Refused) as refusal:
        read_passed_result(make(tmp_path))
    assert refusal.value.name == name and words in refusal.value.what


@pytest.mark.parametrize(
    ("changes", "name", "words"),
    [
        ({"part": "mpu9250"}, "another_sensor", "gyro is of mpu9250 LSM9DS1-001"),
        ({"serial_number": "LSM9DS1-002"}, "another_sensor", "gyro is of lsm9ds1 LSM9DS1-002"),
        ({"range_rad_s": radians(500)}, "another_range", "gyro holds for 500 °/s"),
        ({"role": "reference"}, "not_in_result", "no calibration for sensors.gyro"),
    ],
)
def test_what_is_not_this_sensors_calibration_is_not_stored(
    changes: dict[str, Any], name: str, words: str, config: Path, tmp_path: Path
) -> None:
    done = rig("calibration", "write", config, result(tmp_path, **changes), "--yes")
    assert done.returncode == 2 and done.stderr.startswith(f"rig: {name}: ") and words in done.stderr, done
    assert done.stderr.count("\n") == 1


def test_a_sensor_that_is_not_there_to_be_calibrated_is_refused_by_name(config: Path, tmp_path: Path) -> None:
    done = rig("calibration", "write", config, result(tmp_path), "--sensor", "reference", "--yes")
    assert done.returncode == 2 and "no_such_sensor" in done.stderr and "gyro, other" in done.stderr


def test_a_missing_part_and_another_part_in_its_place_are_named(laboratory: WorldHandle, config: Path) -> None:
    laboratory.control({"do": "sensor_fault", "sensor": "gyro", "fault": "other_part"})
    laboratory.control({"do": "sensor_fault", "sensor": "other", "fault": "other_part"})
    laboratory.control({"do": "sensor_fault", "sensor": "reference", "fault": "absent"})
    try:
        done = commands.rig("check", config)
        info = json.loads(rig("info", config, "--json").stdout)
    finally:
        for name in SENSORS:
            laboratory.control({"do": "sensor_fault", "sensor": name, "fault": None})
    assert done.returncode == 2
    gyro, other, reference = done.stderr.splitlines()
    assert gyro.startswith("missing: sensor_mismatch: sensors.gyro: ") and "an LSM6DS3, identity 0x69" in gyro
    assert other.startswith("missing: sensor_mismatch: sensors.other: ") and "an MPU-6500, identity 0x70" in other
    assert reference.startswith("missing: sensor_missing: sensors.reference: the board finds no adis16465")
    assert len(info["sensors"]) == len(BOARD_PARTS) and not any(sensor["present"] for sensor in info["sensors"])
    named = [sensor["configured_as"] for sensor in info["sensors"]]
    assert named == ["gyro", "other", "reference", *[None] * (len(BOARD_PARTS) - 3)]
    quantities = ["rate"] * len(GYROSCOPES) + ["field"] * len(MAGNETOMETERS)
    assert [sensor["quantity"] for sensor in info["sensors"]] == quantities


def test_a_calibration_of_another_sensor_or_range_corrects_nothing(laboratory: WorldHandle, tmp_path: Path) -> None:
    section = SensorSection.model_validate(SENSORS["gyro"])
    found = read_result(result(tmp_path)).gyroscopes["gyro"]
    with Board(laboratory.board_port, 921600, lambda batch: None) as board:
        board.configure(0, section.rate_hz, section.range_deg_s)
        store(board, 0, calibration_of(found))
        for changes, name, words in (
            ({"serial_number": "LSM9DS1-002"}, "another_sensor", "on the board is of lsm9ds1 LSM9DS1-001"),
            ({"range_deg_s": 500.0}, "another_range", "holds for 245 °/s"),
        ):
            with pytest.raises(Refused) as refusal:
                read_stored_calibration(board, "gyro", section.model_copy(update=changes))
            assert refusal.value.name == name and words in refusal.value.what
        assert read_stored_calibration(board, "gyro", section).calibration.scale == pytest.approx(SCALE["gyro"])
        board.erase_calibration(0)


def test_check_names_what_a_verification_lacks(config: Path) -> None:
    limits = ("limits.verification_rms_rad_s=1", "limits.verification_mean_rad_s=1", "procedure.name=verify")
    done = commands.rig("check", config, *(word for limit in limits for word in ("--set", limit)))
    assert done.returncode == 2 and done.stdout.endswith("not ready: 2 to correct\n"), done
    assert [line.split(": ")[1:3] for line in done.stderr.splitlines()] == [
        ["no_calibration", "sensors.gyro"],
        ["no_calibration", "sensors.other"],
    ]


@pytest.mark.thorough
def test_a_laboratory_of_its_own_is_started_for_the_command(world: World, tmp_path: Path) -> None:
    handle = world()
    handle.stop()
    done = rig("info", handle.config_path)
    assert done.returncode == 0 and "gyro" in done.stdout, done
    assert "follows the crystal" in done.stdout and "not fitted" in done.stdout, "a demonstration has no alarm"
    assert "0xff" not in done.stdout and "NOT" not in done.stdout
    assert "its board's memory too, unless world.board.flash_file" in done.stderr
    file = tmp_path / "flash.bin"
    done = rig("info", handle.config_path, "--set", f"world.board.flash_file={file}")
    assert done.returncode == 0 and f"its board's memory is kept in {file}" in done.stderr, done


IDENTITY = BoardIdentity(2, FIRMWARE_VERSION, "0123456789abcdef01234567", "power", ())


def test_other_firmware_than_the_shipped_is_refused_with_the_remedy() -> None:
    refuse_other_firmware(IDENTITY)
    with pytest.raises(Refused) as refusal:
        refuse_other_firmware(replace(IDENTITY, firmware="0.1.0"))
    assert refusal.value.name == "firmware_version" and "rig board flash" in refusal.value.remedy
    assert "0.1.0" in refusal.value.what and FIRMWARE_VERSION in refusal.value.what


@pytest.mark.one_in(2)
@pytest.mark.parametrize(
    ("part", "board_part", "who_am_i", "name", "words"),
    [
        ("adis16465", "ADIS16465", 16470, "sensor_mismatch", "an ADIS16470, identity 0x4056"),
        ("mpu9250", "MPU-9250", 0x73, "sensor_mismatch", "an MPU-9255"),
        ("lsm9ds1", "LSM9DS1", 0x42, "sensor_mismatch", "an unknown part, identity 0x42"),
        ("mpu9250", "MPU-9250", 0xFF, "sensor_missing", "nothing answers"),
        ("adis16465", "ADIS16465", 0x0000, "sensor_missing", "nothing answers"),
        ("mpu9250", "LSM9DS1", 0x68, "sensor_missing", "no driver for it"),
    ],
)
def test_what_answers_in_a_sensors_place(part: str, board_part: str, who_am_i: int, name: str, words: str) -> None:
    identity = replace(IDENTITY, sensors=(SensorInfo(0, board_part, who_am_i, False, "rate"),))
    section = SensorSection.model_validate({"part": part, "serial_number": "a"})
    with pytest.raises(Refused) as refusal:
        find_sensor(identity, "gyro", section)
    assert refusal.value.name == name and words in refusal.value.what
