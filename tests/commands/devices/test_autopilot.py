"""`rig autopilot store` and `restore`: the old parameters come back bit by bit, and a mixture is never silent."""

import json
import os
import signal
import subprocess
from contextlib import closing
from math import radians
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.config.load import load
from rig.sensors.errors import SensorError
from rig.sensors.mavlink.autopilot_link import AutopilotLink
from rig.sensors.mavlink.autopilot_source import look
from rig.sensors.mavlink.writing import find_unfinished_change
from support.laboratories.commands import rig_here
from support.paths import CONFIGS, ROOT
from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module
from support.wires.autopilot_on_a_wire import AutopilotOnAWire, autopilot_on_a_wire, section

pytestmark = pytest.mark.slow

LEFT = {"INS_GYROFFS_X": 0.1, "INS_ACCSCAL_Y": 1.01}  # of which no single-precision number is just that
STORED = 10  # parameters: three offsets and INS_GYR_CAL, three offsets and three scales


@pytest.fixture(autouse=True)
def own_journal(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A journal that no other test's autopilot is entered in, for they all have one number."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "share"))


def result(folder: Path) -> Path:
    """A result that passed, as of the autopilot's IMU."""
    frozen = ROOT / "tests" / "fixtures" / "recordings" / "imu" / "result.json"
    document = json.loads(frozen.read_text(encoding="utf-8"))
    for kind in ("gyroscopes", "accelerometers"):
        (entry, *_) = document[kind].values()
        entry |= {"part": "mavlink", "serial_number": "FC-1", "role": "calibrate"} if kind == "gyroscopes" else {
            "part": "mavlink", "serial_number": "FC-1"}  # fmt: skip
        document[kind] = {"imu": entry}
    document["gyroscopes"]["imu"]["range_rad_s"] = radians(2000)
    document["verdict"] = "pass"
    path = folder / "result.json"
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def configuration(folder: Path, port: str) -> Path:
    """autopilot.yaml with an autopilot at that port, and no simulated laboratory."""
    document: dict[str, Any] = yaml.safe_load(load(CONFIGS / "own_port" / "autopilot.yaml").text)
    del document["world"]
    imu = document["sensors"].pop("imu1")
    document["sensors"] = {"imu": {**imu, "serial_number": "FC-1", "mavlink": {**imu["mavlink"], "port": port}}}
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def fields(wire: AutopilotOnAWire) -> dict[str, bytes]:
    """Every parameter as it is, four bytes each."""
    return {name: wire.parameters.field(name) for name in wire.parameters.names}


def test_a_calibration_is_stored_and_the_old_one_comes_back_bit_by_bit(tmp_path: Path) -> None:
    with autopilot_on_a_wire("ardupilot", LEFT) as wire:
        before, config, found = fields(wire), configuration(tmp_path, wire.port), result(tmp_path)
        kept = tmp_path / "old.json"
        done = rig_here("autopilot", "store", config, found, "--old", kept)
        assert done.returncode == 2 and "not_confirmed" in done.stderr and fields(wire) == before, "nobody agreed"
        assert "INS_GYROFFS_X" in done.stderr and "instead of 0.1" in done.stderr
        done = rig_here("autopilot", "store", config, found, "--old", kept, "--yes")
        assert done.returncode == 0, done.stderr
        assert f"{STORED} parameters, the new ones" in done.stdout and "scale factors and axes" in done.stdout
        bias = json.loads(found.read_text(encoding="utf-8"))["gyroscopes"]["imu"]["bias_rad_s"]
        offsets = [wire.parameters[f"INS_GYROFFS_{axis}"] for axis in "XYZ"]
        assert offsets == np.negative(bias).astype(np.float32).tolist() and wire.parameters["INS_GYR_CAL"] == 0
        assert rig_here("autopilot", "restore", config, kept, "--yes").returncode == 0
        assert fields(wire) == before
        (tmp_path / "no.json").write_text("{}", encoding="utf-8")
        assert "not_an_autopilot_file" in rig_here("autopilot", "restore", config, tmp_path / "no.json").stderr
        assert "autopilot_not_kept" in rig_here("autopilot", "store", config, found, "--old", kept, "--yes").stderr


def test_of_px4_offsets_are_stored_as_it_has_them(tmp_path: Path) -> None:
    with autopilot_on_a_wire("px4") as wire:
        before, config = fields(wire), configuration(tmp_path, wire.port)
        found, kept = result(tmp_path), tmp_path / "old.json"
        done = rig_here("autopilot", "store", config, found, "--old", kept, "--yes")
        assert done.returncode == 0, done.stderr
        changed = {name for name, field in fields(wire).items() if field != before[name]}
        assert changed == {
            *(f"CAL_GYRO0_{axis}OFF" for axis in "XYZ"),
            *(f"CAL_ACC0_{axis}{what}" for axis in "XYZ" for what in ("OFF", "SCALE")),
        }
        assert rig_here("autopilot", "restore", config, kept, "--yes").returncode == 0 and fields(wire) == before


@pytest.mark.proof
def test_killed_at_any_moment_the_set_is_old_or_new_or_said_to_be_a_mixture(thorough: bool, tmp_path: Path) -> None:
    moments = [(place, applied) for place in range(STORED) for applied in (False, True)]
    told = 0
    for place, applied in moments if thorough else [moments[0], moments[9], moments[-1]]:
        folder = tmp_path / f"{place}{applied}"
        folder.mkdir()
        with autopilot_on_a_wire("ardupilot", LEFT) as wire:
            before, config = fields(wire), configuration(folder, wire.port)
            killed_after(wire, [config, result(folder), "--old", folder / "old.json", "--yes"], place, applied=applied)
            changed = [name for name, field in fields(wire).items() if field != before[name]]
            assert len(changed) == place + applied
            problems = seen(wire)
            mixed = 0 < place + applied < STORED
            assert [problem.problem.name for problem in problems] == ["autopilot_mixture"] * mixed
            told += mixed
            if mixed:
                assert f"after {place + applied} of {STORED}" in problems[0].problem.what
                assert any(isinstance(each, SensorError) for each in look({"imu": section(wire.port)}))
                assert rig_here("autopilot", "restore", config, folder / "old.json", "--new", "--yes").returncode == 0
                assert sum(field != before[name] for name, field in fields(wire).items()) == STORED
            assert rig_here("autopilot", "restore", config, folder / "old.json", "--yes").returncode == 0
            assert fields(wire) == before and not seen(wire)
    assert told == (len(moments) - 2 if thorough else 1)


def killed_after(wire: AutopilotOnAWire, arguments: list[Any], place: int, *, applied: bool) -> None:
    """Run `rig autopilot store` until the parameter of that place is there, and kill it before or after it is set."""
    process: list[subprocess.Popen[bytes]] = []
    done: list[str] = []
    set_field = wire.parameters.set_field

    def setting(name: str, field: bytes) -> None:
        if len(done) > place:
            return  # what was on its way is lost with the cable
        done.append(name)
        if len(done) <= place or applied:
            set_field(name, field)
        if len(done) > place:
            os.kill(process[0].pid, signal.SIGKILL)

    wire.parameters.set_field = setting  # pyrefly: ignore[method-assign]  # a stand-in
    process.append(start_module("autopilot", "store", *arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL))
    assert process[0].wait(PATIENCE_S) == -signal.SIGKILL
    wire.parameters.set_field = set_field  # pyrefly: ignore[method-assign]  # a stand-in


def seen(wire: AutopilotOnAWire) -> list[SensorError]:
    """What the next start says."""
    with closing(AutopilotLink("imu", wire.port, 921600)) as link:
        link.identify()
        return list(find_unfinished_change(link))
