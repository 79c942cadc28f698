"""Many calibrations in a row in one laboratory: their results, and the resources held by the permanent processes.

Two processes are permanent: the world, and a station, an interpreter that executes one command line of `rig` after the
other, as a notebook or a laboratory's script does. Some runs are processes of their own.
"""

import json
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from scipy import stats

from firmware_host.client import Board, BoardStatus
from firmware_host.protocol import BAUD_RATE
from rig.data.recording.run_file import read_run
from rig.data.result_file import read_result
from support.fault_matrix.setups import COVERAGE, SETUPS, errors_in_u
from support.laboratories.worlds import WorldHandle, hardware, merge, worlds

SETUP = merge(SETUPS["six_observation"], {"world": {"time_scale": 50}})
PARAMETERS = ("kx", "ky", "kz", "bx", "by", "bz")
OWN_EVERY, STORED_EVERY = 4, 10  # one run of these is a process of its own; one is stored on the board
WRAP_US = 1 << 32  # of the board's counter
GROWTH_MAX = 0.05
WITHIN_U = 5.0  # of the truth
END_S = 300.0

# Replies go to its original standard output; the commands' output does not.
STATION = """
import json, os, sys
replies = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)
from rig.cli import main
for line in sys.stdin:
    replies.write(f"{main(json.loads(line))}\\n")
    replies.flush()
"""


@dataclass(frozen=True, slots=True)
class Footprint:
    """The resources of a process: resident memory (bytes), threads, child processes, and open files by kind."""

    rss: int
    threads: int
    children: int
    files: Counter[str]

    @classmethod
    def measure(cls, pid: int) -> Self:
        """Return the footprint of a running process."""
        process = Path("/proc") / str(pid)
        memory = (process / "smaps_rollup").read_text().splitlines()
        rss_kib = next(line.split()[1] for line in memory if line.startswith("Rss:"))
        files: Counter[str] = Counter()
        for link in (process / "fd").iterdir():
            files[str(link.readlink()).split(":[")[0]] += 1
        tasks = list((process / "task").iterdir())
        children = sum(len((task / "children").read_text().split()) for task in tasks)
        return cls(int(rss_kib) * 1024, len(tasks), children, files)


@dataclass(frozen=True, slots=True)
class Calibration:
    """One run: its end, its solution with standard uncertainties, and the board times (µs) of its samples."""

    number: int
    in_station: bool
    status: int
    wall_s: float
    solution: tuple[float, ...] = ()
    std: tuple[float, ...] = ()
    error_u: float = 0.0
    board_us: tuple[int, int] = (0, 0)
    world: Footprint | None = None
    station: Footprint | None = None

    @property
    def wraps(self) -> int:
        """The number of wraps of the board's counter during sampling."""
        return self.board_us[1] // WRAP_US - self.board_us[0] // WRAP_US


@dataclass(frozen=True, slots=True)
class Life:
    """All runs, and the board's status before the first run and after the last."""

    runs: Sequence[Calibration]
    board: tuple[BoardStatus, BoardStatus]

    @property
    def wraps(self) -> int:
        """The number of wraps of the board's counter in all runs."""
        return int(self.board[1].uptime_s * 1e6) // WRAP_US


class Station:
    """One rig process that carries out one command after the other."""

    def __init__(self, log: Path, history: Path) -> None:
        self._log = log.open("w", encoding="utf-8")
        self._process = subprocess.Popen(
            [sys.executable, "-c", STATION],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._log,
            text=True,
            env={**os.environ, "RIG_HISTORY": str(history)},
        )
        self.pid = self._process.pid

    def rig(self, *arguments: str) -> int:
        """Run `rig` with these arguments and return its exit status."""
        assert self._process.stdin is not None and self._process.stdout is not None
        self._process.stdin.write(json.dumps(arguments) + "\n")
        self._process.stdin.flush()
        return int(self._process.stdout.readline() or self._process.wait(END_S))

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.communicate()
        self._log.close()


@dataclass(frozen=True, slots=True)
class Bench:
    """A laboratory with a station in it: where runs are written, and by which configuration."""

    folder: Path
    config: Path
    world: WorldHandle
    station: Station
    history: Path


def live(folder: Path, runs: int) -> Iterator[Calibration | Life]:
    """Run `runs` calibrations in one laboratory; yield each at its end, then all together.

    Before the third the laboratory waits so long that the board's counter should wrap during that run.
    """
    done: list[Calibration] = []
    history = folder / "history.sqlite"
    with worlds(folder) as start, Station(folder / "station.log", history) as station:
        world = start(SETUP)
        config = hardware(world.config_path, folder)
        bench = Bench(folder, config, world, station, history)
        before = _status(world)
        for number in range(runs):
            began_s = float(world.state()["time_s"])
            done.append(_run(bench, number))
            yield done[-1]
            if number == 1:
                _wait_until(world, WRAP_US * 1e-6 - (sum(done[-1].board_us) / 2e6 - began_s))
        yield Life(done, (before, _status(world)))


def _wait_until(world: WorldHandle, time_s: float) -> None:
    """Let the world's time pass as fast as it can."""
    left_s = time_s - float(world.state()["time_s"])
    if left_s > 0.0:
        world.control({"do": "pace", "time_scale": 1000.0})
        while left_s > 0.0:  # a piece at a time, each answered before patience ends
            world.control({"do": "advance", "duration_s": min(left_s, 200.0)})
            left_s -= 200.0
        world.control({"do": "pace", "time_scale": SETUP["world"]["time_scale"]})
        world.control({"do": "run"})


def _run(bench: Bench, number: int) -> Calibration:
    """Make one calibration and return it with its duration; every few runs have a process of their own."""
    out, in_station = bench.folder / f"run-{number:03}", number % OWN_EVERY != OWN_EVERY - 1
    arguments = ["run", str(bench.config), "--out", str(out), "--yes"]
    began_s = time.monotonic()
    if in_station:
        status = bench.station.rig(*arguments)
    else:
        with (bench.folder / "processes.log").open("a", encoding="utf-8") as log:
            status = subprocess.run(
                [sys.executable, "-m", "rig", *arguments],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log, timeout=END_S, check=False,
                env={**os.environ, "RIG_HISTORY": str(bench.history)},
            ).returncode  # fmt: skip
    if status == 0 and number % STORED_EVERY == 0:
        status = bench.station.rig("board", "calibration", "write", str(bench.config), str(out), "--yes")
    wall_s = time.monotonic() - began_s
    if status != 0:
        return Calibration(number, in_station, status, wall_s)
    gyro = read_result(out).gyroscopes["gyro"]
    times_us = read_run(out / "run.h5").samples["gyro"]["board_time_us"]
    bench.world.state()  # after this the world knows that the rig has hung up
    return Calibration(
        number, in_station, status, wall_s,
        solution=(*gyro.scale, *gyro.bias_rad_s),
        std=tuple(np.sqrt(np.diag(np.array(gyro.covariance))).tolist()),
        error_u=errors_in_u(out),
        board_us=(int(times_us.min()), int(times_us.max())),
        world=Footprint.measure(bench.world.process.pid),
        station=Footprint.measure(bench.station.pid),
    )  # fmt: skip


def _status(world: WorldHandle) -> BoardStatus:
    with Board(world.board_port, BAUD_RATE, lambda batch: None) as board:
        return board.status()


# -- defects ---------------------------------------------------------------------------------------------------------
@dataclass(frozen=True, slots=True)
class Course:
    """One parameter over the runs: its mean, slope per run with its standard uncertainty, and its spread.

    `chi2` is the sum of squared distances from the mean in stated standard uncertainties; of `dof` degrees.
    """

    name: str
    mean: float
    slope: float
    slope_std: float
    chi2: float
    dof: int


def courses(runs: Sequence[Calibration]) -> list[Course]:
    """Return the course of every parameter over the passed runs; the slope's uncertainty is that of their scatter."""
    number = np.array([run.number for run in runs], float)
    measured, std = np.array([run.solution for run in runs]), np.array([run.std for run in runs])
    deviation = number - number.mean()
    courses = []
    for index, name in enumerate(PARAMETERS):
        values = measured[:, index]
        slope = float(deviation @ values / (deviation @ deviation))
        rest = values - values.mean() - slope * deviation
        slope_std = float(np.sqrt(rest @ rest / (len(runs) - 2) / (deviation @ deviation)))
        chi2 = float((((values - values.mean()) / std[:, index]) ** 2).sum())
        courses.append(Course(name, float(values.mean()), slope, slope_std, chi2, len(runs) - 1))
    return courses


def complaints(life: Life, warm_up: int, sigma: float = 3.0) -> list[str]:
    """Return broken promises after the first `warm_up` runs, with limits of `sigma` standard deviations."""
    texts = [f"run {run.number} ended with status {run.status}" for run in life.runs if run.status]
    if texts:
        return texts
    tail = float(stats.norm.sf(sigma))
    for course in courses(life.runs):
        if abs(course.slope) > stats.t.isf(tail, course.dof - 1) * course.slope_std:
            texts.append(f"{course.name} drifts by {course.slope:.2g} ± {course.slope_std:.2g} a run")
        low, high = stats.chi2.isf(1 - tail, course.dof), stats.chi2.isf(tail, course.dof)
        if not low < course.chi2 < high:
            texts.append(f"{course.name} scatters by χ² = {course.chi2:.0f} of {course.dof} about its mean")
    texts += [
        f"run {run.number} is {run.error_u:.1f} U (k = {COVERAGE:g}) from the truth"
        for run in life.runs
        if run.error_u > WITHIN_U
    ]
    for name in ("world", "station"):
        warm, last = (getattr(life.runs[index], name) for index in (warm_up, -1))
        if last.rss > warm.rss * (1 + GROWTH_MAX):
            texts.append(f"the {name} has grown from {warm.rss / 2**20:.1f} to {last.rss / 2**20:.1f} MiB")
        if (last.files, last.threads, last.children) != (warm.files, warm.threads, warm.children):
            texts.append(f"the {name} held {warm} and holds {last}")
    before, after = life.board
    if after.uptime_s <= before.uptime_s or after.reset_cause != before.reset_cause:
        texts.append(f"the board was reset: {before}, {after}")
    if after.tx_overruns or after.bus_errors or after.rx_errors or after.fault_pc:
        texts.append(f"the board counts errors: {after}")
    return texts
