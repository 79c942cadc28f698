"""Whatever has become of a run file: it is read, or refused by name. Nothing hangs, nothing ends in a traceback."""

import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from firmware_host.computer_load import load_factor
from rig.analysis.analyses import calibrate
from rig.data.recording.layout import Contents, lay_out
from rig.data.recording.layout_keys import SCHEMA, TEXTS
from rig.data.recording.run_file import read_run
from rig.errors import Fault, Refused
from support.paths import RECORDINGS
from support.processes.as_nobody import drop_root
from support.processes.full_disk import full_disk
from support.processes.waiting import PATIENCE_S, alive, wait_for

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("read_by_system")]

RECORDING = RECORDINGS / "six_observation" / "run.h5"
TIMEOUT_S = 5.0 * load_factor()
ALONE_S = 0.8  # reading the recording takes half of that where there is a processor for it
METADATA_BYTES = 12_000  # where a run file's first structures lie
DAMAGES = 24


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return Path(shutil.copy(RECORDING, tmp_path / "run.h5"))


def refused(path: Path) -> str:
    with pytest.raises(Refused) as refusal:
        read_run(path, TIMEOUT_S)
    assert refusal.value.name == "not_a_run_file"
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 700
    return str(refusal.value)


def cut(data: bytearray, random: np.random.Generator) -> bytearray:
    return data[: int(random.integers(1, len(data)))]


def scratched(data: bytearray, random: np.random.Generator) -> bytearray:
    for place in random.integers(0, len(data), 20):
        data[place] = int(random.integers(256))
    return data


def scratched_structures(data: bytearray, random: np.random.Generator) -> bytearray:
    for place in random.integers(0, METADATA_BYTES, 3):
        data[place] ^= 1 << int(random.integers(8))
    return data


def overwritten(data: bytearray, random: np.random.Generator) -> bytearray:
    start = int(random.integers(len(data)))
    data[start : start + 4096] = bytes(min(4096, len(data) - start))
    return data


@pytest.mark.parametrize("damage", [cut, scratched, scratched_structures, overwritten])
@pytest.mark.proof
@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.thorough) for n in range(1, DAMAGES // 4))])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of NumPy, about numbers that never were any
def test_a_damaged_recording_is_refused_by_name_or_solved(
    tmp_path: Path, damage: Callable[[bytearray, np.random.Generator], bytearray], seed: int
) -> None:
    path = tmp_path / "run.h5"
    path.write_bytes(damage(bytearray(RECORDING.read_bytes()), np.random.default_rng(seed)))
    try:
        calibrate([read_run(path, TIMEOUT_S)])
    except (Refused, Fault) as error:
        assert error.name


def test_a_recording_cut_short_is_said_to_be(recording: Path) -> None:
    size = recording.stat().st_size
    recording.write_bytes(recording.read_bytes()[:100])
    assert f"cut short: 100 of its {size} bytes" in refused(recording)


def test_a_recording_whose_reading_does_not_end_is_given_up(recording: Path) -> None:
    """A file that nobody closed is read as one that grows, where the library waits for torn structures to be whole."""
    data = bytearray(recording.read_bytes())
    data[11] |= 0x05  # as if its writer had been killed
    recording.write_bytes(data[:5000])
    with pytest.raises(Refused, match="not_a_run_file"):
        read_run(recording, 1.0)


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells who waits for a processor")
def test_a_sound_recording_is_read_however_little_of_a_processor_there_is() -> None:
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(before)})  # for the reading process and the others alike
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(6)]
    try:
        begun = time.monotonic()
        assert len(read_run(RECORDING, ALONE_S).states)
        assert time.monotonic() - begun > ALONE_S, "the machine was not busy"
    finally:
        for other in others:
            other.kill()
            other.wait()
        os.sched_setaffinity(0, before)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells who has opened what")
def test_a_signal_ends_the_reading(recording: Path) -> None:
    with h5py.File(recording) as file:
        texts = {name: file.attrs[name] for name in TEXTS[SCHEMA]}
        whole = Contents(SCHEMA, texts, {}, {}, file["states"][:], file["events"][:])
    lay_out(recording, whole, swmr=True)
    data = bytearray(recording.read_bytes())
    data[11] |= 0x05  # as one is left that is still being written
    recording.write_bytes(data[:5000])
    interrupted_while_it_reads(recording, "solve", recording)


@pytest.mark.thorough
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells who has opened what")
def test_a_signal_ends_the_reading_of_a_log_of_millions_of_lines(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time_s,x_rad_s,y_rad_s,z_rad_s\n" + "0.001,0.1,0.2,0.3\n" * 10_000_000, encoding="utf-8")
    interrupted_while_it_reads(log, "allan", log)


def interrupted_while_it_reads(file: Path, *words: str | Path) -> None:
    command = [sys.executable, "-m", "rig", *map(str, words)]
    with subprocess.Popen(command, stderr=subprocess.PIPE) as process:
        try:
            wait_for(lambda: is_open_in(process.pid, file), "that it reads", meanwhile=alive(process))
            process.terminate()
            _, said = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert (process.returncode, said) == (130, b"rig: interrupted\n")


def is_open_in(pid: int, file: Path) -> bool:
    """In the process, or in one that it has started."""
    within = Path(f"/proc/{pid}")
    try:
        opened = {path.readlink() for path in (within / "fd").iterdir()}
        children = (within / "task" / str(pid) / "children").read_text().split()
    except OSError:  # a descriptor, or the process, has just gone
        return False
    return file in opened or any(is_open_in(int(child), file) for child in children)


@pytest.mark.skipif(sys.platform == "win32", reason="no limit for files there")
def test_a_full_temporary_folder_is_not_the_recordings_fault(recording: Path) -> None:
    # The reading process inherits the limit.
    with full_disk(10_000), pytest.raises(Refused, match="no room") as refusal:
        read_run(recording)
    assert refusal.value.name == "temporary_folder_full"


def attribute(name: str, value: object, place: str = "/") -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        file[place].attrs[name] = value

    return change


def of_channel(key: str, value: object) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        attributes = file["samples/gyro"].attrs
        first, *others = json.loads(attributes["channels"])
        attributes["channels"] = json.dumps([{**first, key: value}, *others])

    return change


def without(name: str) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[name]

    return change


def instead(name: str, make: Callable[[h5py.File, str], object]) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        del file[name]
        make(file, name)

    return change


def rows(dtype: object, shape: tuple[int, ...] = (10,)) -> Callable[[h5py.File, str], object]:
    return lambda file, name: file.create_dataset(name, shape, dtype)


def number(file: h5py.File, name: str) -> None:
    file[name] = np.frombuffer(b"3\n", "u1")


def linked(file: h5py.File, name: str) -> None:
    file[name] = h5py.ExternalLink("/dev/zero", "/states")


def announced(file: h5py.File) -> None:
    file["states"].resize((10**12,))


def events(change: Callable[[dict[str, Any]], object]) -> Callable[[h5py.File], None]:
    """Every event changed alike."""

    def rewrite(file: h5py.File) -> None:
        lines = [json.loads(line) for line in file["events"][:].tobytes().splitlines()]
        for line in lines:
            change(line)
        data = np.frombuffer(b"".join(json.dumps(line).encode() + b"\n" for line in lines), "u1")
        del file["events"]
        file["events"] = data

    return rewrite


def sweep(**changes: object) -> Callable[[h5py.File], None]:
    return events(lambda line: line["detail"].get("sweep") and line["detail"].update(sweep=changes))


def provenance(**changes: object) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        file.attrs["provenance"] = json.dumps({**json.loads(file.attrs["provenance"]), **changes})

    return change


SHAPES: dict[str, tuple[Callable[[h5py.File], None], str]] = {
    "a sensor without samples": (instead("samples/gyro", lambda file, name: None), "no samples of gyro"),
    "no sensors": (without("samples"), "it has no samples"),
    "no states": (without("states"), "it has no states"),
    "another schema": (attribute("schema", "rig.run/9"), r"schema is 'rig\.run/9'"),
    "a number for a schema": (attribute("schema", 3), "its schema is not a text"),
    "a number for a configuration": (attribute("config", 3), "its config is not a text"),
    "provenance that is a list": (attribute("provenance", "[]"), r"provenance is \[\]"),
    "provenance nested without end": (attribute("provenance", "[" * 60_000), "not_a_run_file"),
    "provenance without a version": (provenance(rig_version=None), r"provenance\.rig_version"),
    "provenance with a number for a serial number": (provenance(arm_serial_number=3), r"provenance\.arm_serial_number"),
    "package versions that are a list": (provenance(package_versions=[]), r"provenance\.package_versions"),
    "serial numbers of numbers": (provenance(sensor_serial_numbers={"gyro": 1}), r"sensor_serial_numbers\.gyro"),
    "stored calibrations of text": (provenance(stored_calibrations="gyro"), r"provenance\.stored_calibrations"),
    "a stored calibration of nothing": (provenance(stored_calibrations={"gyro": {}}), r"stored_calibrations\.gyro"),
    "a script that is a list": (provenance(script=["own.py"]), r"provenance\.script"),
    "provenance that is no JSON": (attribute("provenance", "{"), "not_a_run_file"),
    "provenance of bytes": (attribute("provenance", np.void(b"\xff\x00")), "not_a_run_file"),
    "mounting of one row": (attribute("mounting", [1.0, 0.0, 0.0], "samples/gyro"), r"sensor\.mounting"),
    "mounting of zeros": (attribute("mounting", np.zeros((3, 3)), "samples/gyro"), "not a rotation"),
    "mounting of text": (attribute("mounting", "+x", "samples/gyro"), r"sensor\.mounting"),
    "a negative sensitivity": (of_channel("unit_per_count", -1.0), "unit_per_count"),
    "a sensitivity of text": (of_channel("unit_per_count", "low"), "unit_per_count"),
    "a sensitivity that is none": (of_channel("unit_per_count", None), "unit_per_count"),
    "an unknown mode": (attribute("mode", "cooked", "samples/gyro"), r"sensor\.mode"),
    "a part of nothing": (attribute("part", h5py.Empty("f8"), "samples/gyro"), "not_a_run_file"),
    "samples of numbers": (instead("samples/gyro", rows("f8")), "the channels of gyro are not a text"),
    "states in two dimensions": (instead("states", rows("f8", (2, 3))), "states holds float64 in 2 dimensions"),
    "a group of states": (instead("states", lambda file, name: file.create_group(name)), "states is not a dataset"),
    "a dataset for the samples": (instead("samples", rows("u1")), "samples is not a group"),
    "events of text": (instead("events", rows("f4")), "events holds float32"),
    "an external link": (instead("states", linked), "states is a link to somewhere else"),
    "10^12 rows": (announced, "states announces 1000000000000 rows but holds"),
    "an event that is a number": (instead("events", number), "event 1 cannot be understood"),
    "an unknown event": (events(lambda line: line.update(name="sweep_danced")), "no event 'sweep_danced'"),
    "an event without a time": (events(lambda line: line.pop("host_time_s")), "host_time_s"),
    "an event at no time": (events(lambda line: line.update(controller_time_s=np.nan)), "event 1 .* 'NaN' is no"),
    "details that are a list": (events(lambda line: line.update(detail=[])), "no name and no details"),
    "a sweep of nothing": (sweep(), r"sweep_started\.sweep\.index"),
}  # fmt: skip


@pytest.mark.one_in(7)
@pytest.mark.parametrize("shape", SHAPES)
def test_a_file_of_another_shape_is_refused_with_what_is_wrong(recording: Path, shape: str) -> None:
    change, complaint = SHAPES[shape]
    with h5py.File(recording, "r+") as file:
        change(file)
    said = refused(recording)
    assert re.search(complaint, said), said


def test_of_provenance_more_may_be_said_than_this_version_knows(recording: Path) -> None:
    with h5py.File(recording, "r+") as file:
        provenance(operator={"name": "R. Feynman"})(file)
    assert read_run(recording).provenance == read_run(RECORDING).provenance


def test_a_file_that_may_not_be_read_is_not_said_to_be_damaged(recording: Path) -> None:
    recording.chmod(0)
    with drop_root(), pytest.raises(Refused, match=r"no_run_file: .*run\.h5 cannot be read: Permission denied"):
        read_run(recording)
