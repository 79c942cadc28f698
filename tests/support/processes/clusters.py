"""Dask clusters of this computer."""

import json
import os
import subprocess
import sys
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any


@contextmanager
def local_cluster(**of: Any) -> Iterator[Any]:
    from distributed import LocalCluster

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # distributed's own, about the loop it closes
        with LocalCluster(threads_per_worker=1, dashboard_address=None, **of) as cluster:
            yield cluster


@contextmanager
def killable_cluster(folder: Path) -> Iterator[tuple["subprocess.Popen[bytes]", str]]:
    """Yield the process of a scheduler with one worker, which is another process, and the scheduler's address."""
    file = folder / "scheduler.json"
    options = ("--scheduler-file", str(file), "--no-dashboard")
    with start_program("dask_scheduler", *options, "--port", "0") as scheduler:
        while not file.exists():
            assert scheduler.poll() is None
            time.sleep(0.02)
        with start_program("dask_worker", *options, "--nthreads", "1", "--no-nanny"):
            yield scheduler, json.loads(file.read_text(encoding="utf-8"))["address"]


@contextmanager
def start_program(module: str, *arguments: str) -> Iterator["subprocess.Popen[bytes]"]:
    """Run a program of the package distributed during the block, then kill it."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", f"distributed.cli.{module}", *arguments]
    with subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        try:
            yield process
        finally:
            process.kill()
