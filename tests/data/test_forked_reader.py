"""A reading process that is forked is limited, and harms nobody, as one is that the system starts."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks them")]

READS = """
import os, sys, threading
from pathlib import Path
from rig.data.processes.forked_reader import can_fork
from rig.data.processes.reading_process import ReadingLimits, UnreadableFile, read_apart
assert can_fork()
held = open(sys.argv[2])
limits = ReadingLimits(400 << 20, 1.0, 60.0, 20_000_000)
asleep = ReadingLimits(400 << 20, 60.0, 1.0, 20_000_000)
for takes in ("memory", "processor", "output", "patience", "crash", "words"):
    try:
        read_apart(f"support.external.greedy:{takes}", Path(sys.argv[1]), {}, asleep if takes == "patience" else limits)
    except UnreadableFile as error:
        print(takes, str(error)[:60])
assert not Path(f"/proc/{os.getpid()}/task/{os.getpid()}/children").read_text()
waiting = threading.Thread(target=threading.Event().wait, daemon=True)
waiting.start()
print("beside a thread:", can_fork())
"""


def test_it_ends_within_its_limits_and_is_forked_from_one_thread_only(tmp_path: Path) -> None:
    command = [sys.executable, "-c", READS, str(tmp_path), __file__]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0 and not done.stderr, done.stderr
    endings = dict(line.split(" ", 1) for line in done.stdout.splitlines()[:-1])
    assert endings["memory"].startswith("it takes more than") and endings["memory"].endswith("MiB of memory to be read")
    assert endings["processor"] == "it takes more than 1 s of a processor to be read"
    assert endings["output"] == "its unpacked content is longer than 20 MB"
    assert endings["patience"] == "no end of it was found in 1 s"
    assert endings["crash"] == "reading it ended the process that read it"
    assert "words" in endings
    assert done.stdout.splitlines()[-1] == "beside a thread: False"


def test_a_program_that_has_loaded_hdf5_with_plugins_forks_none() -> None:
    command = "import h5py; from rig.data.processes.forked_reader import can_fork; print(can_fork())"
    done = subprocess.run([sys.executable, "-c", command], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
    loads = "from rig.data.processes.forked_reader import can_fork, load_hdf5; print(load_hdf5(), can_fork())"
    done = subprocess.run([sys.executable, "-c", loads], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "True True"
