"""Readings of the sensors alone, into CSV files as `rig solve` takes them, while something else turns them."""

import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from rig.board.crystal import follows_crystal
from rig.board.identify import refusing
from rig.config.models import SensorsConfig
from rig.data.quantity import select_displayed
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Refused
from rig.observation.timebase import NOMINAL_DRIFT
from rig.runner.acquisition import SensorCount
from rig.runner.board.sensors import BoardSource, board_source
from rig.runner.first_samples import FirstSamples
from rig.sensors.registry import group_by_port
from rig.sensors.source import OnSamples, SampleSource
from rig.station.events import SensorSamples

LOOK_S = 0.05


@contextmanager
def connected(config: SensorsConfig, on_samples: OnSamples) -> Iterator[tuple[SampleSource, ...]]:
    """Every sensor of a configuration, set up and silent. Raises Refused by name for what is not as it says."""
    with ExitStack() as stack:
        sources: list[SampleSource] = []
        with refusing():
            if config.parts_on_board:
                sources.append(stack.enter_context(board_source(config, on_samples, calibrated=False)))
            for _, kind, sections in group_by_port(config.sensors):
                sources.append(stack.enter_context(kind.connect(sections, on_samples)))
        yield tuple(sources)


@dataclass(frozen=True, slots=True)
class Recorded:
    """What a file holds: how many samples, and whether a board's clock followed its crystal (None: no board's)."""

    seen: SensorSamples
    follows_crystal: bool | None


class ReadingsFile:
    """A sensor's readings in SI units, a row each, by the clock that stamped them.

    A board's clock that `follows_crystal` counts too few microseconds by NOMINAL_DRIFT: its times are the crystal's.
    """

    def __init__(self, path: Path, name: str, sensor: RecordedSensor, follows_crystal: bool | None = None) -> None:
        """Raises OSError, and FileExistsError where there is such a file."""
        self.path = path
        self.follows_crystal = follows_crystal
        self._microsecond_s = 1e-6 * (1 + NOMINAL_DRIFT) if follows_crystal else 1e-6
        told = select_displayed(each.quantity for each in sensor.channels)
        self._channels = [each for each in sensor.channels if each.quantity in told]
        columns = [column for each in self._channels for column in each.measures.columns]
        self._count = SensorCount(name, sensor)
        self._file = path.open("xb", buffering=0)
        self._write(",".join(["time_s", *columns]) + "\n")
        self._format = ",".join(["%.6f", *["%.9g"] * len(columns)])
        self._began_s: float | None = None
        self.lasts_s = 0.0  # from the first reading to the last, by their clock

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def seen(self) -> SensorSamples:
        """How many there are, and how many were lost."""
        return self._count.seen

    def add(self, samples: NDArray[Any]) -> None:
        """Samples (n,) in the order they came. Raises OSError."""
        time_s = samples["board_time_us"] * self._microsecond_s
        if self._began_s is None:
            self._began_s = float(time_s[0])
        self.lasts_s = float(time_s[-1]) - self._began_s
        self._count.add(samples)
        rows = np.column_stack([time_s, *(each.values(samples) for each in self._channels)])
        self._write("".join(f"{self._format % tuple(row)}\n" for row in rows))

    def _write(self, lines: str) -> None:
        """Whole lines, or none: half a number would pass for another one. Raises OSError with the file's name."""
        whole_bytes = self._file.tell()
        rest = memoryview(lines.encode())
        try:
            while rest:  # a disk that is nearly full takes a part of it
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self._file.truncate(whole_bytes)
            raise OSError(error.errno, error.strerror, str(self.path)) from error


def record_readings(config: SensorsConfig, folder: Path, duration_s: float) -> Mapping[Path, Recorded]:
    """Record every sensor for so long by its own clock, into `folder`/<sensor>.csv; what each file holds.

    Nothing is moved. What was recorded stays when it ends early. Raises Refused as `connected`, and `run_folder`;
    Fault `no_samples`, and what a source raises.
    """
    arrived: SimpleQueue[tuple[str, NDArray[Any]]] = SimpleQueue()
    with connected(config, lambda name, samples: arrived.put((name, samples))) as sources, ExitStack() as stack:
        by_crystal = [_follows_crystal(source) for source in sources]
        files = {
            name: stack.enter_context(_new_file(folder, name, sensor, follows))
            for source, follows in zip(sources, by_crystal, strict=True)
            for name, sensor in source.sensors.items()
        }
        for source in sources:
            source.start()
        first_samples = FirstSamples(LOOK_S)
        while min(file.lasts_s for file in files.values()) < duration_s:
            time.sleep(LOOK_S)
            while not arrived.empty():
                name, samples = arrived.get()
                files[name].add(samples)
            for source in sources:
                source.check()
            silent = [name for name, file in files.items() if not file.seen.samples]
            if silent:
                first_samples.wait_on(silent)
        return {file.path: Recorded(file.seen, file.follows_crystal) for file in files.values()}


def _follows_crystal(source: SampleSource) -> bool | None:
    """Whether the board's clock does, by its own word; None of what has a port of its own."""
    if not isinstance(source, BoardSource):
        return None
    with refusing():
        return follows_crystal(source.board)


def _new_file(folder: Path, name: str, sensor: RecordedSensor, follows_crystal: bool | None) -> ReadingsFile:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return ReadingsFile(folder / f"{name}.csv", name, sensor, follows_crystal)
    except OSError as error:
        raise Refused(
            "run_folder", f"{folder}/{name}.csv cannot be made: {error}", "Choose another with --out"
        ) from error
