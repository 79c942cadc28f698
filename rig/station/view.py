"""The operator's view of a run: a live panel on a terminal, plain lines elsewhere."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from math import degrees

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from rig.data.installed_kinds import channel_contents
from rig.data.quantity import select_displayed
from rig.data.recording.hand_events import HandAsked
from rig.errors.quoting import printable_lines
from rig.station.by_hand_words import live_rows
from rig.station.events import Advice, HandSeen, Progress, RunEvent, SamplesTaken, SensorSamples
from rig.station.operator_station import Listener
from rig.station.plain_text import format_for_file, plain
from rig.station.words import line

REFRESH_S = 0.1


class PlainView:
    """Lines on stderr, one for each event: for log files, CI and pipes."""

    def event(self, event: RunEvent) -> None:
        """Print an event's line; progress within a step has no line."""
        if (text := _text(event)) is not None:
            print(printable_lines(text), file=sys.stderr, flush=True)


class LiveView:
    """A panel at the foot of the terminal that refreshes while lines scroll above it."""

    def __init__(self, live: Live) -> None:
        self._live = live
        self._shown_at_s = 0.0
        self._samples = SamplesTaken(())
        self._instruction: HandAsked | None = None

    def event(self, event: RunEvent) -> None:
        """Show an event as a line, or in the panel."""
        match event:
            case SamplesTaken():
                self._samples = event
            case Progress():
                self._show(_panel(event, self._samples))
            case HandAsked():
                self._instruction = event
                self._line(event)
            case HandSeen():
                self._show(_panel_by_hand(event, self._instruction, self._samples))
            case _:
                self._line(event)

    def _line(self, event: RunEvent) -> None:
        if (text := _text(event)) is not None:
            # A path has no markup, and a command must stay in one line to be copied.
            shown = format_for_file(printable_lines(text), sys.stderr)
            self._live.console.print(shown, highlight=False, markup=False, emoji=False, soft_wrap=True)

    def _show(self, panel: Table) -> None:
        now_s = time.monotonic()
        if now_s - self._shown_at_s >= REFRESH_S:
            self._shown_at_s = now_s
            self._live.update(panel, refresh=True)


def _text(event: RunEvent) -> str | None:
    """Return the line of an event; None for advice, because the command prints it after the error."""
    return None if isinstance(event, Advice) else line(event)


def _panel(progress: Progress, samples: SamplesTaken) -> Table:
    table = Table.grid(padding=(0, 2))
    table.add_row("step", f"{progress.number} of {progress.count}: {progress.step.name}")
    table.add_row("this step", _bar(progress.fraction))
    table.add_row("the run", _bar(_fraction_of_run(progress)))
    table.add_row("arm speed", f"{degrees(progress.arm_speed_rad_s):6.2f} °/s")
    for sensor in samples.sensors:
        for name, readings in _readings(sensor):
            table.add_row(plain(name), readings)
    table.add_row("time", f"{progress.elapsed_s:5.1f} s elapsed, {progress.remaining_s:5.1f} s left")
    return table


def _bar(fraction: float) -> ProgressBar:
    """Return a progress bar that is always green, unlike the library's own."""
    return ProgressBar(total=1.0, completed=fraction, width=40, complete_style="green", finished_style="green")


def _fraction_of_run(progress: Progress) -> float:
    """Return the elapsed fraction of the planned time."""
    planned_s = progress.elapsed_s + progress.remaining_s
    return progress.elapsed_s / planned_s if planned_s > 0 else progress.fraction


def _panel_by_hand(state: HandSeen, instruction: HandAsked | None, samples: SamplesTaken) -> Table:
    table = Table.grid(padding=(0, 2))
    if instruction is not None:
        table.add_row("your turn", plain(instruction.instruction.words, "bold"))
    for name, text in live_rows(state):
        table.add_row(name, plain(text))
    for sensor in samples.sensors:
        for name, readings in _readings(sensor):
            table.add_row(plain(name), readings)
    return table


def _readings(sensor: SensorSamples) -> list[tuple[str, str]]:
    """Return the rows of a sensor, one for each of its quantities; the first has the number of samples."""
    counts, rows = f"{sensor.samples} samples, {sensor.lost} lost", list[tuple[str, str]]()
    for quantity in select_displayed(sensor.latest):
        kind = channel_contents()[quantity]
        shown = " ".join(f"{component / kind.reading.size:+7.2f}" for component in sensor.latest[quantity])
        name, more = (f"{sensor.sensor}, {kind.sensor}", "") if rows else (sensor.sensor, f", {counts}")
        rows.append((name, f"{shown} {kind.reading.name}{more}"))
    return rows or [(sensor.sensor, f"waiting, {counts}")]


@contextmanager
def view() -> Iterator[Listener]:
    """Yield a live view if stderr is a terminal, else a view that prints plain lines."""
    if sys.stderr.isatty():
        with Live(console=Console(stderr=True), auto_refresh=False, transient=True) as live:
            yield LiveView(live)
    else:
        yield PlainView()
