"""What is done to the page by others ends no run, and takes nothing that stopping needs."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from rig.motion.turner_state import REST_SPEED_RAD_S
from support.laboratories.commands import configuration, wait_for_log
from support.laboratories.worlds import World, WorldHandle, hardware
from support.page.flood import flood
from support.processes.waiting import PATIENCE_S, wait_for

pytestmark = pytest.mark.slow

DESCRIPTORS = 1024  # as most systems allow a process
MANY = 1100


@dataclass
class Running:
    """A `rig run --page` that may open so many descriptors."""

    process: "subprocess.Popen[str]"
    said: Path
    out: Path

    @property
    def url(self) -> str:
        return str(wait_for(lambda: re.search(r"^page: (\S+)$", self.told(), re.M), "the address")[1])

    def told(self) -> str:
        return self.said.read_text(encoding="utf-8")

    def child(self, words: bytes) -> int:
        """The child whose command line holds these words."""
        for path in Path("/proc").glob("[0-9]*"):
            try:
                parent = int((path / "stat").read_text().rpartition(")")[2].split()[1])
                if parent == self.process.pid and words in (path / "cmdline").read_bytes():
                    return int(path.name)
            except OSError:
                continue
        return 0


Start = Callable[..., Running]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    running: list[Running] = []

    def started(config: Path) -> Running:
        out, said = tmp_path / "run", tmp_path / "stderr"
        command = [sys.executable, "-m", "rig", "run", str(config), "--yes", "--out", str(out)]
        limited = ["sh", "-c", f'ulimit -n {DESCRIPTORS} && exec "$@"', "sh", *command, "--page"]
        with said.open("w", encoding="utf-8") as errors:
            process = subprocess.Popen(
                [*limited, "--page-address", "127.0.0.1:0"],
                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=errors, text=True,
            )  # fmt: skip
        running.append(Running(process, said, out))
        return running[-1]

    yield started
    for each in running:
        each.process.kill()
        each.process.communicate()


@pytest.fixture
def laboratory(world: World) -> WorldHandle:
    return world({"procedure": {"speed_deg_s": 150, "rest_s": 0.5}, "world": {"time_scale": 2}})


def moving(laboratory: WorldHandle) -> bool:
    return bool(max(map(abs, laboratory.state()["qd_rad_s"])) > 10 * REST_SPEED_RAD_S)


@pytest.mark.thorough
def test_half_requests_end_no_run(start: Start, tmp_path: Path) -> None:
    running = start(configuration(tmp_path))
    with flood(running.url, MANY):
        stdout, _ = running.process.communicate(timeout=PATIENCE_S)
    assert running.process.returncode == 0, running.told()
    assert "verdict: PASS" in stdout and "[Errno" not in running.told()


@pytest.mark.thorough
def test_the_stop_button_works_while_half_requests_are_held(
    start: Start, laboratory: WorldHandle, tmp_path: Path
) -> None:
    running = start(hardware(laboratory.config_path, tmp_path))
    with flood(running.url, MANY):
        wait_for(lambda: moving(laboratory), "motion")
        place = urlsplit(running.url)
        asking = HTTPConnection(place.hostname or "", place.port, timeout=PATIENCE_S)
        asking.request("POST", "/stop", headers={"Authorization": f"Bearer {place.fragment}"})
        assert asking.getresponse().status == 202
        asking.close()
        wait_for(lambda: not moving(laboratory), "rest")
        assert running.process.wait(PATIENCE_S) == 130, running.told()


@pytest.mark.thorough
def test_a_frozen_driver_is_answered_by_a_stop_while_half_requests_are_held(
    start: Start, laboratory: WorldHandle, tmp_path: Path
) -> None:
    running = start(hardware(laboratory.config_path, tmp_path))
    with flood(running.url, MANY):
        wait_for(lambda: moving(laboratory), "motion")
        os.kill(running.child(b"multiprocessing.spawn"), signal.SIGSTOP)
        wait_for(lambda: not moving(laboratory), "rest")
        assert running.process.wait(PATIENCE_S) == 3
    assert "the controller says that its program has ended" in running.told()


@pytest.mark.thorough
def test_a_run_whose_pages_helper_is_killed_ends_with_its_verdict(start: Start, tmp_path: Path) -> None:
    running = start(configuration(tmp_path))
    wait_for_log(running.out, "sweep")
    helper: Any = wait_for(lambda: running.child(b"rig.page.live_analysis"), "the helper")
    os.kill(helper, signal.SIGKILL)
    stdout, _ = running.process.communicate(timeout=PATIENCE_S)
    assert running.process.returncode == 0, running.told()
    assert "verdict: PASS" in stdout and "The page shows no new observations" in running.told()
