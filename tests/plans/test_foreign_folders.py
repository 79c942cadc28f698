"""A run folder that came from somebody else is data: what lies in it is neither executed nor connected to."""

import hashlib
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest

import rig as public
from rig.errors import Refused
from rig.world.board.flash_file import open_flash
from support.laboratories.commands import configuration, rig_here
from support.paths import RECORDINGS, ROOT

OWN = ROOT / "tests" / "support" / "motions" / "unequal_sweeps.py"


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another computer, or another user: nothing was run here yet."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "nothing yet"))


@pytest.fixture
def foreign(elsewhere: None, tmp_path: Path) -> Path:
    """A finished run's folder, by a script of its sender's own that leaves a trace where it is executed."""
    folder = tmp_path / "came by e-mail"
    shutil.copytree(RECORDINGS / "six_observation", folder)
    text = f"open({str(tmp_path / 'trace')!r}, 'w').close()\n" + OWN.read_text(encoding="utf-8")
    said = {"script": "theirs.py", "script_sha256": hashlib.sha256(text.encode()).hexdigest()}
    (folder / "script.py").write_text(text, encoding="utf-8")
    identity = {"name": said["script"], "sha256": said["script_sha256"]}
    (folder / "script.json").write_text(json.dumps(identity), encoding="utf-8")
    with h5py.File(folder / "run.h5", "r+") as file:
        recorded = json.loads(file.attrs["provenance"])
        file.attrs["provenance"] = json.dumps({**recorded, **said, "script_installed": False})
    return folder


def solved_in_a_notebook(folder: Path) -> None:
    assert public.solve(public.load(folder))["gyro"].scale[0] > 1


@pytest.mark.one_in(5)  # all open it alike
@pytest.mark.slow
@pytest.mark.parametrize(
    "read",
    [
        lambda folder: rig_here("solve", folder, "--json"),
        lambda folder: rig_here("solve", folder / "run.h5", "--json"),
        lambda folder: rig_here("history", "import", folder, "--solve", "--history", folder.parent / "history.sqlite"),
        lambda folder: rig_here("report", folder),
        lambda folder: rig_here("export", folder, "--format", "csv"),
        lambda folder: rig_here("allan", folder),
        lambda folder: rig_here("reversal", folder, folder),
        solved_in_a_notebook,
    ],
    ids=["solve", "solve a file", "import", "report", "export", "allan", "reversal", "notebook"],
)
def test_nothing_that_reads_a_run_executes_its_script(
    foreign: Path, tmp_path: Path, read: Callable[[Path], object]
) -> None:
    read(foreign)
    assert not (tmp_path / "trace").exists()


@pytest.mark.slow
def test_a_run_by_anothers_script_is_solved_without_it_and_says_so(foreign: Path) -> None:
    done = rig_here("solve", foreign, "--json")
    assert done.returncode == 0 and "recorded by the script theirs.py" in done.stderr
    numbers = json.loads(done.stdout)["gyroscopes"]["gyro"]
    expected = json.loads((RECORDINGS / "six_observation" / "result.json").read_text(encoding="utf-8"))
    assert numbers["scale"] == pytest.approx(expected["gyroscopes"]["gyro"]["scale"], rel=1e-9)


@pytest.mark.slow
def test_a_script_that_the_user_names_is_executed(foreign: Path, tmp_path: Path) -> None:
    done = rig_here("solve", foreign, "--script", foreign / "script.py")
    assert done.returncode == 0 and done.stderr == "" and (tmp_path / "trace").exists()
    other = rig_here("solve", foreign, "--script", OWN)
    assert other.returncode == 2 and "rig: another_script: " in other.stderr


@pytest.mark.slow
def test_a_run_by_anothers_script_goes_on_by_a_script_that_the_user_names_or_not_at_all(
    foreign: Path, tmp_path: Path
) -> None:
    (foreign / "result.json").unlink()
    config = configuration(tmp_path).read_text(encoding="utf-8")
    (foreign / "config.yaml").write_text(config.replace("six_observation", "unequal_sweeps"), encoding="utf-8")
    refused = rig_here("resume", foreign, "--yes")
    assert refused.returncode == 2 and "rig: foreign_script: " in refused.stderr, refused.stderr
    assert f"--script '{foreign / 'script.py'}'" in refused.stderr
    assert not (tmp_path / "trace").exists()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("laid", "command"),
    [
        ("certificate.html", ["report"]),
        ("export", ["export", "--format", "csv"]),
        ("log.txt", ["resume", "--yes"]),
    ],
)
@pytest.mark.parametrize("kind", ["link", "pipe"])
def test_nothing_is_written_through_what_somebody_laid_into_a_folder(
    foreign: Path, tmp_path: Path, laid: str, command: list[str], kind: str
) -> None:
    target = tmp_path / "precious"
    target.write_text("mine", encoding="utf-8")
    (foreign / laid).unlink(missing_ok=True)
    if kind == "pipe":
        os.mkfifo(foreign / laid)
    else:
        (foreign / laid).symlink_to(target)
    if command[0] == "resume":
        (foreign / "result.json").unlink()
    refused = rig_here(command[0], foreign, *command[1:])
    assert refused.returncode == 2 and "rig: not_written_through: " in refused.stderr, refused.stderr
    assert target.read_text(encoding="utf-8") == "mine"


@pytest.mark.slow
@pytest.mark.parametrize("endless", ["pipe", "/dev/zero"])
def test_a_recording_that_never_ends_ends_no_import(foreign: Path, endless: str) -> None:
    (foreign / "run.h5").unlink()
    if endless == "pipe":
        os.mkfifo(foreign / "run.h5")
    else:
        (foreign / "run.h5").symlink_to(endless)
    for solved in ((), ("--solve",)):
        done = rig_here("history", "import", foreign, *solved, "--history", foreign.parent / "history.sqlite")
        assert done.returncode == 1 and "it is not a regular file" in done.stderr, done.stderr


@pytest.mark.parametrize("command", [("report",), ("history", "import")])
def test_a_result_of_millions_of_wrong_values_is_refused_before_they_are_reported(
    foreign: Path, tmp_path: Path, command: tuple[str, ...]
) -> None:
    (foreign / "result.json").write_text('{"checks": [' + "{}," * 300_000 + "{}]}", encoding="utf-8")
    refused = rig_here(*command, foreign)
    assert refused.returncode in (1, 2) and "it holds over 200000 values" in refused.stderr


@pytest.mark.slow
def test_a_recording_with_an_endless_text_is_refused(foreign: Path) -> None:
    with h5py.File(foreign / "run.h5", "r+", libver="latest") as file:
        file.attrs["config"] = "# " + "x" * 2_000_000
    refused = rig_here("solve", foreign)
    assert refused.returncode == 2 and "rig: not_a_run_file: " in refused.stderr and "longer than any" in refused.stderr


def test_a_deeply_nested_script_identity_is_refused_by_name(foreign: Path, tmp_path: Path) -> None:
    (foreign / "result.json").unlink()
    shutil.copy(configuration(tmp_path), foreign / "config.yaml")
    (foreign / "script.json").write_text("[" * 9000, encoding="utf-8")
    refused = rig_here("resume", foreign, "--yes")
    assert refused.returncode == 2 and "rig: another_script: " in refused.stderr


@pytest.mark.parametrize("name", ["../../x", "a\nb", "a\x1b[2J", ".."])
def test_a_name_that_is_no_sensors_names_no_file(foreign: Path, tmp_path: Path, name: str) -> None:
    document = json.loads((foreign / "result.json").read_text(encoding="utf-8"))
    document["gyroscopes"][name] = document["gyroscopes"].pop("gyro")
    (foreign / "result.json").write_text(json.dumps(document), encoding="utf-8")
    before = {*tmp_path.rglob("*")}
    refused = rig_here("export", foreign, "--format", "kalibr")
    assert refused.returncode == 2 and "rig: not_a_result: " in refused.stderr and {*tmp_path.rglob("*")} == before


@pytest.mark.slow
def test_a_recording_that_unpacks_without_end_is_refused_before_it_does(foreign: Path) -> None:
    with h5py.File(foreign / "run.h5", "r+") as file:
        rows = file["samples/gyro"]
        attributes, dtype = dict(rows.attrs), rows.dtype
        del file["samples/gyro"]
        packed = file.create_dataset(
            "samples/gyro", (3_000_000,), dtype, chunks=(100_000,), compression="gzip", compression_opts=1
        )
        packed[:] = 0
        packed.attrs.update(attributes)
    refused = rig_here("solve", foreign)
    assert refused.returncode == 2 and "rig: not_a_run_file: " in refused.stderr and "unpacks" in refused.stderr


@pytest.mark.slow
def test_a_recording_of_sensors_that_are_announced_alone_is_refused(foreign: Path) -> None:
    with h5py.File(foreign / "run.h5", "r+") as file:
        rows = file["samples/gyro"]
        attributes, dtype = dict(rows.attrs), rows.dtype
        for number in range(60):
            file.create_dataset(f"samples/s{number}", (100_000,), dtype, chunks=(100_000,)).attrs.update(attributes)
    refused = rig_here("solve", foreign)
    assert refused.returncode == 2 and "rig: not_a_run_file: " in refused.stderr and "unpack" in refused.stderr


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "SEEK_DATA"), reason="holes are not told apart here")
def test_a_recording_full_of_holes_is_refused(foreign: Path) -> None:
    with h5py.File(foreign / "run.h5", "r+") as file:
        rows = file["samples/gyro"]
        attributes, kind, first = dict(rows.attrs), h5py.h5t.py_create(rows.dtype, logical=True), rows[:]
        del file["samples/gyro"]
        allotted = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        allotted.set_alloc_time(h5py.h5d.ALLOC_TIME_EARLY)
        allotted.set_fill_time(h5py.h5d.FILL_TIME_NEVER)
        space = h5py.h5s.create_simple((30_000_000,))
        holed = h5py.Dataset(h5py.h5d.create(file["samples"].id, b"gyro", kind, space, allotted))
        holed.attrs.update(attributes)
        holed[: len(first)] = first
    refused = rig_here("solve", foreign)
    assert refused.returncode == 2 and "rig: not_a_run_file: " in refused.stderr and " bytes to " in refused.stderr


@pytest.mark.slow
@pytest.mark.parametrize(("time_s", "name"), [(3e7, "impossible_times"), (float("nan"), "not_finite")])
def test_a_recording_that_claims_to_last_for_a_year_is_not_replayed(foreign: Path, time_s: float, name: str) -> None:
    with h5py.File(foreign / "run.h5", "r+") as file:
        last = file["states"][-1]
        last["time_s"] = time_s
        file["states"][-1] = last
    refused = rig_here("watch", foreign, "--page-address", "127.0.0.1:0")
    assert refused.returncode == 2 and f"rig: {name}: " in refused.stderr


def test_attitudes_over_thousands_of_years_are_put_on_no_grid(tmp_path: Path) -> None:
    examples, attitudes = ROOT / "docs" / "examples", tmp_path / "attitudes.csv"
    text = (examples / "swinging_attitudes.csv").read_text(encoding="utf-8").rstrip()
    last = text.splitlines()[-1].split(",")
    attitudes.write_text("\n".join([text, ",".join(["99999999998", "1e11", *last[2:]])]), encoding="utf-8")
    refused = rig_here("solve", examples / "swinging_samples.csv", "--attitudes", attitudes, "--estimate-clock-offset")
    assert refused.returncode == 2 and "rig: impossible_times: the states or attitudes" in refused.stderr


@pytest.mark.slow
def test_a_line_of_ten_million_columns_is_refused(tmp_path: Path) -> None:
    samples, sweeps = tmp_path / "samples.csv", ROOT / "docs" / "examples" / "sweeps.csv"
    samples.write_text("time_s" + ",x_rad_s" * 1_000_000, encoding="utf-8")
    refused = rig_here("solve", samples, "--sweeps", sweeps)
    assert refused.returncode == 2 and "a line is longer than 10000 characters" in refused.stderr


def test_a_foreign_simulation_keeps_its_board_s_flash_in_no_file_that_is_not_named(
    foreign: Path, tmp_path: Path
) -> None:
    (foreign / "result.json").unlink()
    kept = tmp_path / "in your home"
    config = configuration(tmp_path, {"world": {"board": {"flash_file": str(kept)}}})
    shutil.copy(config, foreign / "config.yaml")
    refused = rig_here("resume", foreign, "--yes")
    assert refused.returncode == 2 and "rig: foreign_folder: " in refused.stderr, refused.stderr
    assert f"--connect '{kept}'" in refused.stderr
    assert "foreign_script" in rig_here("resume", foreign, "--yes", "--connect", kept).stderr and not kept.exists()


@pytest.mark.parametrize("kind", ["another file", "link", "pipe"])
def test_a_configuration_cannot_have_a_file_replaced_that_is_no_boards_flash(tmp_path: Path, kind: str) -> None:
    file, target = tmp_path / "flash.bin", tmp_path / "precious"
    target.write_bytes(bytes(300_000))
    if kind == "another file":
        file.write_bytes(target.read_bytes())
    elif kind == "link":
        file.symlink_to(target)
    else:
        os.mkfifo(file)
    with pytest.raises(Refused, match=r"flash_file: .* is not the flash of a simulated board"):
        open_flash(file)
    assert target.read_bytes() == bytes(300_000)
