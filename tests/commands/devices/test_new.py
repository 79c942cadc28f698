"""`rig new` and `rig lines --write`: a first configuration that is complete, or says by key what is to be filled in."""

import os
import pty
import subprocess
import sys
from itertools import count
from pathlib import Path

import pytest
import yaml

from firmware_host.serial_port import describe_ports, find_ports
from rig.cli import main
from rig.commands.devices.configuration_writing import write_checked
from rig.config.config_schema import config_schema
from rig.config.first_configuration import Answers
from rig.config.load import load
from support.processes.waiting import PATIENCE_S
from support.wires.printed_lines import pty_printing

ON_BOARD = ("--sensor", "board", "--part", "lsm9ds1", "--port", "/dev/ttyACM0", "--serial-number", "G-1")
ARM = ("--turner", "arm", "--host", "10.0.0.3", "--model", "ur5e", "--payload-kg", "0.4")
SERVO = ("--turner", "servo", "--servo-port", "/dev/ttyUSB0", "--model", "xl430_w250")
AUTOPILOT = ("--sensor", "autopilot", "--port", "/dev/ttyACM0", "--serial-number", "FC-1")
KVH = ("--sensor", "kvh1775", "--port", "COM4", "--serial-number", "K-1")
LINES = ("--sensor", "lines", "--port", "COM4", "--listen", "no")


@pytest.mark.slow
@pytest.mark.parametrize(
    "words",
    [
        ("--turner", "hand", *ON_BOARD),
        ("--turner", "hand", *AUTOPILOT),
        (*ARM, *ON_BOARD),
        (*ARM, *AUTOPILOT),
        (*ARM, *KVH),
        (*SERVO, *ON_BOARD),
    ],
    ids=lambda words: "-".join(words[1:2] + words[words.index("--sensor") + 1 :][:1]),
)
def test_a_file_of_answers_is_complete_and_satisfies_its_schema(
    words: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from jsonschema import Draft202012Validator

    path = tmp_path / "my.yaml"
    assert main(["new", str(path), *words]) == 0
    assert "checked: it is complete" in capsys.readouterr().out
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# yaml-language-server: $schema=") and "world" not in text
    assert not [*Draft202012Validator(config_schema()).iter_errors(yaml.safe_load(text))]
    assert all(len(line) <= 110 for line in text.splitlines()[3:])


def test_what_nobody_said_stays_open_and_is_named_by_its_key(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["new", str(tmp_path / "my.yaml"), "--turner", "hand", *LINES, "--serial-number", "E-1"]) == 1
    said = capsys.readouterr().out
    for key in ("range_deg_s", "acceleration.range_g", "lines.time.unit", "lines.rate.unit", "lines.acceleration.unit"):
        assert f"sensors.imu.{key} (line" in said
    assert "serial_number" not in said


def test_the_section_that_a_look_gives_becomes_a_whole_file(tmp_path: Path) -> None:
    section = "\n".join(
        [
            "sensors:",
            "  imu:",
            "    {part: lines, serial_number: E-1, rate_hz: 100, range_deg_s: 500, acceleration: {range_g: 8},",
            "     serial: {port: COM4, baud: 115200},",
            "     lines: {columns: [time, gx, gy, gz, ax, ay, az], time: {unit: us}, rate: {unit: deg/s},",
            "             acceleration: {unit: g}}}",
        ]
    )
    path = tmp_path / "my.yaml"
    assert write_checked(path, Answers("hand", "lines", "COM4", sensors=section)) == 0
    config = load(path).config
    assert config.procedure.name == "by_hand" and config.uncertainty.crystal_ppm == 50 and config.board is None


def test_nothing_is_asked_without_a_terminal_and_no_file_is_replaced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "my.yaml"
    assert main(["new", str(path), "--turner", "arm"]) == 2
    assert "not_answered" in (said := capsys.readouterr().err) and "--sensor" in said
    assert not path.exists()
    path.write_text("mine", encoding="utf-8")
    assert main(["new", str(path), "--turner", "hand", *ON_BOARD]) == 2
    assert "configuration_not_written" in capsys.readouterr().err and path.read_text(encoding="utf-8") == "mine"


@pytest.mark.slow
def test_at_a_terminal_it_asks_until_the_answer_can_be_used(tmp_path: Path) -> None:
    operator, terminal = pty.openpty()
    words = [sys.executable, "-m", "rig", "new", str(tmp_path / "my.yaml"), *ON_BOARD[:-2], *ARM[-4:]]
    os.write(operator, b"seven\n2\nmy arm\n10.0.0.3\nG-\xc3\xa4\nG-1\n")  # what turns; its address; the serial number
    with subprocess.Popen(words, stdin=terminal, stdout=terminal, stderr=terminal) as process:
        os.close(terminal)
        assert process.wait(PATIENCE_S) == 0
    said = os.read(operator, 65536).decode(errors="replace")
    os.close(operator)
    assert "type a number from 1 to 3" in said and "plain ASCII" in said and "checked: it is complete" in said
    assert "neither an IP address nor a host name" in said
    config = load(tmp_path / "my.yaml").config
    assert (config.turner.address, config.sensors["gyro"].serial_number) == ("10.0.0.3", "G-1")


@pytest.mark.slow
def test_of_a_device_that_was_not_turned_no_file_is_written_and_the_remedy_is_to_turn_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    at_rest = (f"{10_000 * n},0.{n % 3},0.{n % 2},-0.1,0.01,-0.02,1.00{n % 4}\r\n".encode() for n in count())
    with pty_printing(at_rest) as (port, _):
        stated = ("--baud", "115200", "--serial-number", "E-1", "--range-deg-s", "500", "--range-g", "8")
        command = ["lines", port, "--seconds", "1", "1", "--write", str(tmp_path / "my.yaml"), *stated]
        assert main(command) == 2
    said = capsys.readouterr().err
    assert "lines_not_turned" in said and "turn the device about every axis" in said
    assert not (tmp_path / "my.yaml").exists()


@pytest.mark.slow
def test_enter_at_the_terminal_means_the_usual_arm_and_no_accelerometer(tmp_path: Path) -> None:
    operator, terminal = pty.openpty()
    words = [
        sys.executable,
        "-m",
        "rig",
        "new",
        str(tmp_path / "my.yaml"),
        "--turner",
        "arm",
        *LINES,
        *ARM[2:4],
        *ARM[-2:],
    ]
    os.write(operator, b"\nE-1\n500\n\n")  # which arm; serial number; full scales of gyroscope and accelerometer
    with subprocess.Popen(words, stdin=terminal, stdout=terminal, stderr=terminal) as process:
        os.close(terminal)
        assert process.wait(PATIENCE_S) == 1  # an example's columns are to be filled in
    os.close(operator)
    text = (tmp_path / "my.yaml").read_text(encoding="utf-8")
    assert "model: ur10e" in text and "range_deg_s: 500" in text


@pytest.mark.slow
def test_of_a_device_that_prints_json_no_file_is_written_and_the_remedy_is_to_print_numbers(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = (f'{{"t":{10_000 * n},"gyr":[0.{n % 3},0.1,-0.1],"acc":[0.01,-0.02,1.0]}}\r\n'.encode() for n in count())
    with pty_printing(lines) as (port, _):
        stated = ("--baud", "115200", "--serial-number", "E-1", "--range-deg-s", "500", "--range-g", "8")
        assert main(["lines", port, "--seconds", "1", "1", "--write", str(tmp_path / "my.yaml"), *stated]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "column 2 is text" in said and "lines_no_pattern" in said and "no JSON" in said
    assert not (tmp_path / "my.yaml").exists()


@pytest.mark.parametrize("port", ["1", "", "ttyUSB0", "yes"])
def test_what_is_no_port_is_refused_with_the_ports_that_there_are(
    port: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ("--turner", "hand", "--sensor", "lines", "--port", port, "--listen", "no", "--serial-number", "E-1")
    assert main(["new", str(tmp_path / "my.yaml"), *words]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert f"bad_option: --port {port}: must be the name of a serial port, such as /dev/ttyUSB0 or COM3" in said
    assert f"; {describe_ports()}" in said
    assert all(words in said for words in find_ports().values())
