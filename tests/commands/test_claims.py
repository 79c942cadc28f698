"""Two rigs on one computer: what one works with the other is refused by name, until the first has ended, however."""

import json
import os
import pty
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest
import yaml

from rig.commands.laboratory.claims import claim_arm, claim_board, claim_sensor
from rig.commands.laboratory.own_address import find_own_address
from rig.config.load import load
from rig.data.run_folder import ScriptIdentity, new_folder
from rig.errors import Refused
from rig.turners.turner_registry import sections
from support.laboratories.commands import rig
from support.laboratories.worlds import World, fresh_host, hardware
from support.paths import CONFIGS, DEMO, ROOT
from support.processes.warm import start_module

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="claims are names of Linux' kernel")

HOLD = """
import sys
from rig.commands.laboratory.claims import claim_arm
with claim_arm(sys.argv[1]):
    print(flush=True)
    sys.stdin.read()
"""


@contextmanager
def arm_held_elsewhere(host: str) -> Iterator[subprocess.Popen[str]]:
    """Another process that works with the arm."""
    command = [sys.executable, "-c", HOLD, host]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=ROOT) as process:
        assert process.stdout is not None
        process.stdout.readline()
        yield process


@pytest.mark.slow
def test_a_claim_is_refused_to_others_and_ends_with_its_process() -> None:
    host = fresh_host()
    with arm_held_elsewhere(host) as other:
        with pytest.raises(Refused, match=f"arm_claimed: the arm at {host} .*process {other.pid}: -c "):
            claim_arm(host).__enter__()
        with claim_arm(fresh_host()), claim_board(f"socket://{host}:7321"):  # other things are free
            pass
        other.kill()
        other.wait()
        with claim_arm(host):
            pass


def test_an_arm_and_a_port_are_known_by_every_name_they_have(tmp_path: Path) -> None:
    device, link = tmp_path / "ttyACM0", tmp_path / "by-id"
    device.touch()
    link.symlink_to(device)
    with claim_arm("localhost"), pytest.raises(Refused, match=r"arm_claimed: the arm at 127\.0\.0\.1 "):
        claim_arm("127.0.0.1").__enter__()
    with claim_board(str(link)):
        with pytest.raises(Refused, match=f"board_claimed: the board at {device} "):
            claim_board(str(device)).__enter__()
        with pytest.raises(Refused, match=f"sensor_claimed: the sensor kvh at {device} "):
            claim_sensor("kvh", str(device)).__enter__()


@pytest.mark.slow
def test_a_second_simulated_laboratory_moves_to_an_address_of_its_own() -> None:
    host = fresh_host()
    here, text = load(DEMO, [f"arm.host={host}", f"board.port=socket://{host}:7321"]).config, DEMO.read_text("utf-8")
    with find_own_address(here, text) as first, find_own_address(here, text) as second:
        assert first == [] and len(second) == 2
        moved = load(DEMO, second).config
        assert moved.board is not None and moved.board.port == f"socket://{moved.arm.host}:7321"
        assert moved.arm.host not in (host, load(DEMO).config.arm.host)
    with arm_held_elsewhere(host), find_own_address(here, text) as moved_away:
        assert moved_away != []
    with find_own_address(here, text) as again:
        assert again == [], "what has ended takes no address"


@pytest.mark.slow
def test_a_laboratory_without_an_arm_is_at_the_address_of_its_sensors(capsys: pytest.CaptureFixture[str]) -> None:
    host, lines = fresh_host(), CONFIGS / "by_hand_lines.yaml"
    here = load(lines, [f"sensors.imu.serial.port=socket://{host}:7341"], turners=sections()).config
    with find_own_address(here, lines.read_text("utf-8")) as first:
        assert first == []
        with find_own_address(here, lines.read_text("utf-8")) as second:
            assert [override.split("=")[0] for override in second] == ["sensors.imu.serial.port"]
    assert f"another one is at {host}, so this one is at 127." in capsys.readouterr().err


@pytest.mark.slow
def test_hardware_is_found_at_its_configured_address() -> None:
    host = fresh_host()
    config = load(DEMO, [f"arm.host={host}"]).config
    with arm_held_elsewhere(host), find_own_address(config, None) as moved:
        assert moved == []


def test_runs_that_begin_in_one_second_have_a_folder_each(tmp_path: Path) -> None:
    loaded = load(DEMO, [f"output.folder={tmp_path}"])
    folders = {new_folder(None, loaded, "", ScriptIdentity("", "")) for _ in range(5)}
    assert len(folders) == 5
    assert all(re.fullmatch(r"[0-9TZ-]+-six_observation(-[2-5])?", folder.name) for folder in folders)


@pytest.mark.slow
def test_a_second_rig_has_neither_the_arm_nor_the_board_until_the_first_has_ended(world: World, tmp_path: Path) -> None:
    config = hardware(world({"world": {"time_scale": 1}}).config_path, tmp_path)
    document = yaml.safe_load(config.read_text(encoding="utf-8"))
    document["arm"]["host"] = fresh_host()  # where nobody answers; the board is the same
    other_arm = tmp_path / "other_arm.yaml"
    other_arm.write_text(yaml.safe_dump(document), encoding="utf-8")

    operator, terminal = pty.openpty()
    command = ("run", config, "--out", tmp_path / "first")
    with start_module(*command, stdin=terminal, stderr=terminal) as first, ExitStack() as ended:
        ended.callback(first.kill)
        os.close(terminal)
        said = b""
        while b"Type go to start" not in said:
            said += os.read(operator, 4096)
        for number, second, name in ((2, config, "arm_claimed"), (3, other_arm, "board_claimed")):
            refused = rig("run", second, "--out", tmp_path / str(number), "--yes")
            assert refused.returncode == 2, refused.stderr
            assert f"rig: {name}: " in refused.stderr and f"process {first.pid}: " in refused.stderr
            assert f"{name}: " in (tmp_path / str(number) / "log.txt").read_text(encoding="utf-8")
        told = json.loads(rig("check", config, "--json").stdout)
        assert not told["ready"] and {each["name"] for each in told["missing"]} >= {"arm_claimed", "board_claimed"}
        looked = rig("check", config)
        assert looked.returncode == 2
        assert "missing: arm_claimed: " in looked.stderr and "missing: board_claimed: " in looked.stderr
        assert first.poll() is None, "it is not disturbed"
        first.send_signal(signal.SIGKILL)
        first.wait()
    os.close(operator)
    looked = rig("check", config)
    assert looked.returncode == 0 and looked.stdout.endswith("ready\n"), looked.stderr
    told = json.loads(rig("check", config, "--json").stdout)
    assert told["ready"] and not told["missing"] and looked.stdout.splitlines()[:-1] == told["seen"]
