"""A run file that somebody made to do harm: it opens no other file, takes no memory, and is refused by name."""

import json
import os
import shutil
import struct
import subprocess
import sys
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from rig.data.recording.extract import extract, reason
from rig.data.recording.motion_file import MOTIONS
from rig.data.recording.recorded_events import decode_events
from rig.data.recording.recorded_turner import turner_of
from rig.data.recording.run_file import read_run
from rig.data.recording.settings import settings_from_json
from rig.errors import Refused
from support.paths import RECORDINGS

pytestmark = pytest.mark.usefixtures("read_by_system")

RECORDING = RECORDINGS / "six_observation" / "run.h5"
SAID_BY_HAND = {"clock_ppm": [50.0], "box_rad": [0.003], "closure": [1.0], "gravity_m_s2": [9.81], "first_face": [4.0]}
MEMORY_BYTES = 1_000_000_000
TIMEOUT_S = 60.0
# The most that a process of its own saw one of its children use, in kilobytes: a worker of pytest has had many.
READ_AND_TELL = """
import resource, sys
from pathlib import Path
from rig.data.recording.run_file import read_run
from rig.errors import Refused
try:
    read_run(Path(sys.argv[1]), float(sys.argv[2]))
except Refused as refused:
    print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss, refused)
"""


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return Path(shutil.copy(RECORDING, tmp_path / "run.h5"))


def zeros(count: int) -> bytes:
    """So many zeros, packed as zlib does."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    block = packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)
    last = zlib.compressobj(9, zlib.DEFLATED, -15).flush()
    return b"\x78\xda" + block * (count >> 20) + last + struct.pack(">I", (count % 65521) << 16 | 1)


def swollen(file: h5py.File, chunk: int) -> None:
    """Ten states in a packed piece of gigabytes."""
    dtype = file["states"].dtype
    del file["states"]
    rows = file.create_dataset("states", (10,), dtype, chunks=(chunk,), maxshape=(None,), compression="gzip")
    rows.id.write_direct_chunk((0,), zeros(3 << 30))


def packed_by_a_plugin(file: h5py.File, _: Path) -> None:
    dtype = file["states"].dtype
    del file["states"]
    wanted = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    wanted.set_chunk((1024,))
    wanted.set_filter(32004, h5py.h5z.FLAG_OPTIONAL, ())
    space = h5py.h5s.create_simple((10,), (h5py.h5s.UNLIMITED,))
    rows = h5py.Dataset(h5py.h5d.create(file.id, b"states", h5py.h5t.py_create(dtype), space, dcpl=wanted))
    rows.id.write_direct_chunk((0,), bytes(1024 * dtype.itemsize), 0)


def rows_in(other: str) -> Callable[[h5py.File, Path], None]:
    """The rows of the states are those of another file, however many it has."""

    def change(file: h5py.File, folder: Path) -> None:
        dtype = file["states"].dtype
        del file["states"]
        layout = h5py.VirtualLayout((10,), dtype, maxshape=(None,))
        source = h5py.VirtualSource(str(folder / other), "states", (10,), dtype=dtype, maxshape=(None,))
        layout[0 : h5py.h5s.UNLIMITED] = source[0 : h5py.h5s.UNLIMITED]
        file.create_virtual_dataset("states", layout)

    return change


def linked_to(link: Callable[[Path], object], name: str) -> Callable[[h5py.File, Path], None]:
    def change(file: h5py.File, folder: Path) -> None:
        del file[name]
        file[name] = link(folder)

    return change


def attribute(name: str, value: object) -> Callable[[h5py.File, Path], None]:
    def change(file: h5py.File, _: Path) -> None:
        file.attrs[name] = value

    return change


def not_utf_8(file: h5py.File, _: Path) -> None:
    file.attrs["provenance"] = np.bytes_(b"\xff\xfe{}")


STRUCTURES: dict[str, tuple[Callable[[h5py.File, Path], None], str]] = {
    "rows in a pipe": (rows_in("pipe"), "the rows of states lie somewhere else"),
    "a link to a pipe": (linked_to(lambda folder: h5py.ExternalLink(str(folder / "pipe"), "/"), "states"), "is a link"),
    "a link to itself": (linked_to(lambda _: h5py.SoftLink("/states"), "states"), "states is a link"),
    "samples that are linked": (linked_to(lambda _: h5py.SoftLink("/samples"), "samples"), "samples is a link"),
    "settings of nothing": (attribute("settings", h5py.Empty("f8")), "its settings is not a text"),
    "a text that is no UTF-8": (not_utf_8, "its provenance is not "),
}  # fmt: skip


@pytest.mark.parametrize("structure", STRUCTURES)
def test_a_file_reaches_no_other(recording: Path, structure: str) -> None:
    """A pipe would not let go whoever opens it."""
    change, complaint = STRUCTURES[structure]
    os.mkfifo(recording.parent / "pipe")
    with h5py.File(recording, "r+") as file:
        change(file, recording.parent)
    with pytest.raises(ValueError, match=complaint):
        next(extract(recording))


@pytest.mark.slow
@pytest.mark.one_in(2)
@pytest.mark.parametrize("chunk", [1024, 29_000_000])
def test_rows_that_unpack_without_end_take_no_memory(recording: Path, chunk: int) -> None:
    with h5py.File(recording, "r+") as file:
        swollen(file, chunk)
    command = [sys.executable, "-c", READ_AND_TELL, str(recording), str(TIMEOUT_S)]
    took = subprocess.run(command, capture_output=True, text=True, check=True)
    peak_kib, _, refusal = took.stdout.partition(" ")
    assert int(peak_kib) * 1024 < MEMORY_BYTES
    assert refusal.startswith("not_a_run_file: ") and "its rows cannot be unpacked" in refusal


@pytest.mark.slow
def test_no_plugin_is_loaded_to_read_a_file(recording: Path) -> None:
    with h5py.File(recording, "r+") as file:
        packed_by_a_plugin(file, recording)
    with pytest.raises(Refused, match="packed by a filter that is not one of the HDF5 library's own"):
        read_run(recording)


def test_the_reason_for_exhausted_memory_is_reported() -> None:
    assert "cannot be unpacked" in reason(MemoryError())


def attributes() -> dict[str, str]:
    with h5py.File(RECORDING) as file:
        return {name: file.attrs[name] for name in ("settings", "turner")}


def lines() -> list[dict[str, Any]]:
    with h5py.File(RECORDING) as file:
        return [json.loads(line) for line in file["events"][:].tobytes().splitlines()]


def within(text: str, key: str, value: str) -> str:
    """The JSON with that in the place of one of its keys' values."""
    return json.dumps({**json.loads(text), key: "@"}).replace('"@"', value)


@pytest.mark.parametrize(
    ("key", "value", "complaint"),
    [
        ("planned_sweeps", "[" + "{}," * 300_000 + "{}]", "over 50000 values"),
        ("home_q_rad", "[" + "[]," * 300_000 + "[]]", "over 50000 values"),
        ("home_q_rad", "[" * 100_000, "over 50000 values"),
        ("home_q_rad", "[" * 40_000, "recursion"),
        ("stage", "9" * 5000, "not a number that can be measured"),
        ("extension_m", "[NaN, 0, 0]", "'NaN' is not a number"),
        ("extension_m", "[1e101, 0, 0]", "'1e101' is not a number"),
    ],
)
def test_settings_that_no_run_has_are_refused(key: str, value: str, complaint: str) -> None:
    with pytest.raises((ValueError, RecursionError), match=complaint):
        settings_from_json(within(attributes()["settings"], key, value))


def test_what_a_terminal_would_obey_is_made_seen() -> None:
    assert turner_of(within(attributes()["turner"], "maker", r'"\u001b[2J\n"')).maker == r"\x1b[2J\n"


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"name": []}, "no event"),
        ({"name": {}}, "no event"),
        ({"detail": {"reason": [{}] * 60_000}, "name": "board_not_observed"}, "over 50000"),
        ({"host_time_s": float("inf")}, "'Infinity' is not a number"),
    ],
)  # fmt: skip
def test_an_event_that_never_was_is_refused(changes: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ValueError, match=f"event 1 cannot be understood: .*{complaint}"):
        list(decode_events(json.dumps({**lines()[0], **changes}).encode() + b"\n"))


@pytest.mark.parametrize("key", ["speed_rad_s", "acceleration_rad_s2", "duration_s"])
@pytest.mark.parametrize("value", [0, -1, 1e-9, 1e99])
def test_a_sweep_that_no_joint_makes_is_refused(key: str, value: float) -> None:
    first = lines()[0]
    first["detail"]["sweep"][key] = value
    with pytest.raises(ValueError, match="no such sweep"):
        list(decode_events(json.dumps(first).encode() + b"\n"))


@pytest.mark.parametrize("index", [-1, 10**9])
def test_a_sweep_that_no_plan_counts_is_refused(index: int) -> None:
    first = lines()[0]
    first["detail"]["sweep"]["index"] = index
    with pytest.raises(ValueError, match="no such sweep"):
        list(decode_events(json.dumps(first).encode() + b"\n"))


def column(name: str, key: str, value: float) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        rows = file[name][:]
        rows[key][len(rows) // 2] = value
        file[name][:] = rows

    return change


def without_uncertainty(file: h5py.File) -> None:
    settings = json.loads(file.attrs["settings"])
    settings["uncertainty"]["nonlinearity_percent"] = {}
    file.attrs["settings"] = json.dumps(settings)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "complaint"),
    [
        (column("states", "q_rad", 1e308), "a value in q_rad of states cannot have been measured"),
        (column("states", "host_time_s", np.nan), "a host time of states is not a number"),
        (without_uncertainty, "its settings state no uncertainty of its sensor 'gyro'"),
    ],
    ids=["angles that overflow", "no time", "a sensor of which nothing is stated"],
)
def test_rows_that_cannot_be_reckoned_with_are_refused(
    recording: Path, change: Callable[[h5py.File], None], complaint: str
) -> None:
    with h5py.File(recording, "r+") as file:
        change(file)
    with pytest.raises(Refused, match=complaint):
        read_run(recording)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({name: [] for name in SAID_BY_HAND}, "it has 0 rows of clock_ppm, not one"),
        ({name: value * 2 for name, value in SAID_BY_HAND.items()}, "it has 2 rows of clock_ppm, not one"),
        ({"clock_ppm": [0.0]}, "its clock_ppm must be above 0"),
        ({"box_rad": [-0.003]}, "its box_rad must be above 0"),
        ({"box_rad": [1.0]}, "and at most 0.2"),
        ({"closure": [7.0]}, "its closure must be above -1 and at most 1"),
        ({"gravity_m_s2": [-9.81]}, "its gravity_m_s2 must be above 0"),
        ({"first_face": [6.0]}, "its first_face must be above -1 and at most 5"),
        ({"first_face": [-1.0]}, "its first_face must be above -1 and at most 5"),
    ],
)
def test_what_nobody_said_of_a_session_by_hand_is_refused(changes: dict[str, list[float]], complaint: str) -> None:
    columns = {name: np.array(value) for name, value in {**SAID_BY_HAND, **changes}.items()}
    with pytest.raises(ValueError, match=complaint):
        MOTIONS["turns"].check(columns)
    MOTIONS["turns"].check({name: np.array(value) for name, value in SAID_BY_HAND.items()})
