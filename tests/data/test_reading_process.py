"""Whatever reading a file takes, it ends within its limits, and nothing of it is left."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from rig.config.files.regular_file import UnfitFile
from rig.data.processes.reading_process import (
    CostlyFile,
    ReadingLimits,
    UnreadableFile,
    limits_for,
    read_apart,
    stored_bytes,
)
from support.processes.waiting import wait_for

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux has all of these limits")

LIMITS = ReadingLimits(memory_bytes=400 << 20, processor_s=1.0, idle_s=60.0, written_bytes=20_000_000)
ASLEEP = ReadingLimits(memory_bytes=400 << 20, processor_s=60.0, idle_s=1.0, written_bytes=20_000_000)
READS_WITHOUT_END = """
import sys
from pathlib import Path
from rig.data.processes.reading_process import limits_for, read_apart
read_apart("support.external.greedy:patience", Path(sys.argv[1]), {}, limits_for(1 << 40))
"""


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.usefixtures("read_by_system")
@pytest.mark.parametrize(
    ("takes", "limits", "why"),
    [
        ("memory", LIMITS, "more than 400 MiB of memory"),
        ("processor", LIMITS, "more than 1 s of a processor"),
        ("output", LIMITS, "longer than 20 MB"),
        ("room", LIMITS, "longer than 20 MB"),
        ("patience", ASLEEP, "no end of it was found in 1 s"),
    ],
)
def test_a_file_that_takes_too_much_is_given_up(tmp_path: Path, takes: str, limits: ReadingLimits, why: str) -> None:
    with pytest.raises(CostlyFile, match=why):
        read_apart(f"support.external.greedy:{takes}", tmp_path, {}, limits)


@pytest.mark.slow
@pytest.mark.usefixtures("read_by_system")
def test_what_breaks_down_or_prints_harms_nobody(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(UnreadableFile, match="reading it ended the process"):
        read_apart("support.external.greedy:crash", tmp_path, {}, LIMITS)
    with pytest.raises(UnreadableFile) as unreadable:
        read_apart("support.external.greedy:words", tmp_path, {}, LIMITS)
    assert len(str(unreadable.value)) < 400 and str(unreadable.value).isprintable()
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@pytest.mark.usefixtures("read_by_system")
def test_nobody_reads_on_for_a_program_that_was_killed(tmp_path: Path) -> None:
    command = [sys.executable, "-c", READS_WITHOUT_END, str(tmp_path)]
    with subprocess.Popen(command, env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}) as program:
        children = Path(f"/proc/{program.pid}/task/{program.pid}/children")
        wait_for((tmp_path / "asleep").exists, "something reads for the program")
        reader = Path(f"/proc/{children.read_text().split()[0]}")
        program.kill()
        program.wait()
        wait_for(lambda: not reader.exists() or "State:\tZ" in (reader / "status").read_text(), "it ends too")


def test_only_files_that_end_have_a_size(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(bytes(1000))
    (tmp_path / "folder").mkdir()
    assert stored_bytes(tmp_path / "a") > 0 and stored_bytes(tmp_path) == stored_bytes(tmp_path / "a")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(UnfitFile, match="'pipe' is not a regular file"):
        stored_bytes(tmp_path)
    with (tmp_path / "hole").open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(UnfitFile, match="it expands 0 bytes to 1099511627776"):
        stored_bytes(tmp_path / "hole")


def test_a_small_file_may_take_little_and_a_large_one_what_it_holds() -> None:
    small, large = limits_for(60_000), limits_for(500_000_000)
    assert small.memory_bytes < 400 << 20 and small.processor_s < 10 and small.written_bytes < 50_000_000
    imu_rows = 500_000_000 / 340  # of a second of 340 bytes each
    assert large.written_bytes > imu_rows * 7 * np.dtype(float).itemsize and large.processor_s > 60
