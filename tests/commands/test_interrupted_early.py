"""A Ctrl-C while the program still loads: one line, and the exit status of an interrupted command."""

import os
import subprocess
import sys

import pytest

from support.processes.waiting import PATIENCE_S

WHILE_LOADING = """
import os, signal, sys
import rig.__main__

class Interrupting:
    def find_spec(self, name, *_):
        if name == sys.argv[0]:
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupting())
sys.argv = [{module!r}, "show", "RUN"]
sys.exit(rig.__main__.main())
"""


@pytest.mark.parametrize("module", ["rig.cli", "argparse", "rig.station.plain_text", "rig.commands.documents.show"])
def test_a_command_that_still_loads_ends_with_one_line(module: str) -> None:
    command = [sys.executable, "-c", WHILE_LOADING.format(module=module)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, env=os.environ, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "rig: interrupted\n")
