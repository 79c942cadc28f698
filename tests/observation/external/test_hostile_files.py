"""Whatever a bag, a log or a table holds, it is refused by name, in a line that does no harm, and leaves nothing."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest

from rig.data.processes.reading_process import limits_for
from rig.data.quantity import RATE
from rig.errors import Refused
from rig.observation.external.csv_samples import read_samples
from support.external.hostile_files import FILES
from support.paths import DOCS

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform == "win32", reason="no pipes and no limits there")]

NAMES = (
    "no_file",
    "file_too_costly",
    "bag_topic",
    "ulog_topic",
    "wrong_columns",
    "not_a_number",
    "time_not_increasing",
    "too_few_samples",
)
PEAK = """
import resource, sys
from pathlib import Path
from rig.cli import main
status = main(sys.argv[1:])
own = Path("/proc/self/status").read_text().partition("VmHWM:")[2].split()[0]  # getrusage tells what the parent had too
print(status, own, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)
"""
MOST_KIB = 450 << 10  # a chunk may take 256 MiB, the libraries that read it 100
DEAREST = ("a chunk of 2 GB", "a chunk of a million records", "a view without end", "packed rows of 1 GB")


@pytest.mark.one_in(8)
@pytest.mark.parametrize("name", FILES)
def test_a_file_that_was_made_to_harm_is_refused_by_name(tmp_path: Path, name: str) -> None:
    path = FILES[name](tmp_path)
    with pytest.raises(Refused) as refused:
        read_samples(path, [RATE])
    said = str(refused.value)
    assert refused.value.name in NAMES
    assert said.isprintable() and len(said) < 1500 + len(str(path)), said


@pytest.mark.thorough
@pytest.mark.one_in(4)
@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells what a process took at most")
@pytest.mark.parametrize("name", DEAREST)
def test_it_takes_no_more_memory_than_its_limit(tmp_path: Path, name: str) -> None:
    """Of the command and of what reads for it together."""
    command = ["solve", FILES[name](tmp_path), "--sweeps", DOCS / "examples" / "sweeps.csv"]
    done = subprocess.run([sys.executable, "-c", PEAK, *map(str, command)], capture_output=True, text=True, check=True)
    status, *peaks_kib = map(int, done.stdout.split())
    assert status == 2 and len(done.stderr.splitlines()) == 1, done.stderr
    assert sum(peaks_kib) < MOST_KIB


def test_the_limits_leave_room_for_a_bag_of_hours() -> None:
    """Half a gigabyte is 25 minutes of an IMU at 1 kHz, by db3; packed by zstd it is two hours."""
    assert resource.getrlimit(resource.RLIMIT_CPU)[0] == resource.RLIM_INFINITY
    rows = 2 * 3600 * 1000
    limits = limits_for(500_000_000)
    assert limits.written_bytes > 7 * 8 * rows and limits.processor_s > 60e-6 * rows
