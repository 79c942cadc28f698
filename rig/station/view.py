"""What the operator sees while the rig works: a live view on a terminal, plain lines elsewhere, and the run's log."""

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

REFRESH_S = 0.1
logger = logging.getLogger("rig")


@dataclass(frozen=True, slots=True)
class Status:
    """One moment of a run. Angles and rates in SI units; `fraction` of the step from 0 to 1."""

    step: str
    fraction: float
    elapsed_s: float
    remaining_s: float
    arm_speed_rad_s: float
    samples: int
    lost: int
    rate_rad_s: tuple[float, float, float] | None


class View(Protocol):
    """Where a run reports to: `line` for what happened, `log` for the log only, `show` for how things stand."""

    def line(self, text: str) -> None: ...

    def log(self, text: str) -> None: ...

    def show(self, status: Status) -> None: ...


class PlainView:
    """Lines on stderr, one for each thing that happened: for log files, CI and pipes."""

    def line(self, text: str) -> None:
        self.log(text)
        print(text, file=sys.stderr, flush=True)

    def log(self, text: str) -> None:
        logger.info(text)

    def show(self, status: Status) -> None:
        """Progress within a step is for people watching; a log does without."""


class LiveView:
    """A panel at the foot of the terminal that refreshes while lines scroll above it."""

    def __init__(self, live: Live) -> None:
        self._live = live
        self._shown_at_s = 0.0

    def line(self, text: str) -> None:
        self.log(text)
        # Nothing in a path is markup, and a command that is to be copied must not be broken into lines.
        self._live.console.print(text, highlight=False, markup=False, soft_wrap=True)

    def log(self, text: str) -> None:
        logger.info(text)

    def show(self, status: Status) -> None:
        now_s = time.monotonic()
        if now_s - self._shown_at_s >= REFRESH_S:
            self._shown_at_s = now_s
            self._live.update(_panel(status), refresh=True)


def _panel(status: Status) -> Table:
    degrees = 57.29577951308232
    rates = "waiting" if status.rate_rad_s is None else " ".join(f"{r * degrees:+7.2f}" for r in status.rate_rad_s)
    table = Table.grid(padding=(0, 2))
    table.add_row("step", status.step)
    table.add_row("progress", ProgressBar(total=1.0, completed=status.fraction, width=40))
    table.add_row("arm speed", f"{status.arm_speed_rad_s * degrees:6.2f} °/s")
    table.add_row("reading", f"{rates} °/s")
    table.add_row("samples", f"{status.samples}, {status.lost} lost")
    table.add_row("time", f"{status.elapsed_s:5.1f} s gone, {status.remaining_s:5.1f} s left")
    return table


@contextmanager
def view(log_path: Path) -> Iterator[View]:
    """The view that suits stderr, with everything it says also written to `log_path` with the time."""
    handler = logging.FileHandler(log_path, encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    logging.raiseExceptions = False  # a full disk is reported once, by the recording
    try:
        if sys.stderr.isatty():
            with Live(console=Console(stderr=True), auto_refresh=False, transient=True) as live:
                yield LiveView(live)
        else:
            yield PlainView()
    finally:
        logger.removeHandler(handler)
        with suppress(OSError):
            handler.close()
