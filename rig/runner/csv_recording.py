"""Recordings of the sensors alone, as CSV files for `rig solve`, while another machine turns them."""

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
from rig.observation.clocks.time_base import NOMINAL_DRIFT
from rig.runner.acquisition import SensorCount
from rig.runner.board.sensors import BoardSource, open_board_source
from rig.runner.first_samples import FirstSamples
from rig.sensors.sample_source import OnSamples, SampleSource
from rig.sensors.sensor_registry import group_by_port
from rig.station.events import SensorSamples

POLL_S = 0.05


@contextmanager
def connect_sensors(config: SensorsConfig, on_samples: OnSamples) -> Iterator[tuple[SampleSource, ...]]:
    """Set up every sensor of a configuration and yield the sources. Raise Refused if a device differs."""
    with ExitStack() as stack:
        sources: list[SampleSource] = []
        with refusing():
            if config.parts_on_board:
                sources.append(stack.enter_context(open_board_source(config, on_samples, calibrated=False)))
            for _, kind, sections in group_by_port(config.sensors):
                sources.append(stack.enter_context(kind.connect(sections, on_samples)))
        yield tuple(sources)


@dataclass(frozen=True, slots=True)
class RecordedFile:
    """The counts of a file's samples, and whether the board's clock followed its crystal (None without a board)."""

    summary: SensorSamples
    follows_crystal: bool | None


class ReadingsFile:
    """A CSV file of a sensor's readings in SI units, one per row, on the clock that stamped them.

    `follows_crystal`: whether the stamps are of a board's clock that runs by its crystal, None without a board. Such a
    clock counts too few microseconds, by the fraction NOMINAL_DRIFT; the times are corrected for this.
    """

    def __init__(self, path: Path, name: str, sensor: RecordedSensor, follows_crystal: bool | None = None) -> None:
        """Create the file with its header. Raise OSError; FileExistsError if the file exists."""
        self.path = path
        self.follows_crystal = follows_crystal
        self._microsecond_s = 1e-6 * (1 + NOMINAL_DRIFT) if follows_crystal else 1e-6
        displayed = select_displayed(channel.quantity for channel in sensor.channels)
        self._channels = [channel for channel in sensor.channels if channel.quantity in displayed]
        columns = [column for channel in self._channels for column in channel.measures.columns]
        self._count = SensorCount(name, sensor)
        self._file = path.open("xb", buffering=0)
        self._write(",".join(["time_s", *columns]) + "\n")
        self._format = ",".join(["%.6f", *["%.9g"] * len(columns)])
        self._began_s: float | None = None
        self.lasts_s = 0.0  # duration from the first reading to the last, by the sensor's clock

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def summary(self) -> SensorSamples:
        """The numbers of samples and of lost samples."""
        return self._count.summary

    def add(self, samples: NDArray[Any]) -> None:
        """Write samples (n,), in the order of their arrival. Raise OSError."""
        time_s = samples["board_time_us"] * self._microsecond_s
        if self._began_s is None:
            self._began_s = float(time_s[0])
        self.lasts_s = float(time_s[-1]) - self._began_s
        self._count.add(samples)
        rows = np.column_stack([time_s, *(channel.values(samples) for channel in self._channels)])
        self._write("".join(f"{self._format % tuple(row)}\n" for row in rows))

    def _write(self, lines: str) -> None:
        """Write complete lines or nothing: half a number would read as another. Raise OSError with the file's name."""
        whole_bytes = self._file.tell()
        rest = memoryview(lines.encode())
        try:
            while rest:  # a nearly full disk accepts only a part
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self._file.truncate(whole_bytes)
            raise OSError(error.errno, error.strerror, str(self.path)) from error


def record_readings(config: SensorsConfig, folder: Path, duration_s: float) -> Mapping[Path, RecordedFile]:
    """Record each sensor for `duration_s` by its own clock; return the summaries of the files `folder`/<sensor>.csv.

    Nothing moves. If recording ends early, the files contain the readings until then. Raise Refused `run_folder`, and
    as `connect_sensors` does; Fault `no_samples`, and the faults of a source.
    """
    arrived: SimpleQueue[tuple[str, NDArray[Any]]] = SimpleQueue()
    with connect_sensors(config, lambda name, samples: arrived.put((name, samples))) as sources, ExitStack() as stack:
        by_crystal = [_follows_crystal(source) for source in sources]
        files = {
            name: stack.enter_context(_new_file(folder, name, sensor, follows))
            for source, follows in zip(sources, by_crystal, strict=True)
            for name, sensor in source.sensors.items()
        }
        for source in sources:
            source.start()
        first_samples = FirstSamples(POLL_S)
        while min(file.lasts_s for file in files.values()) < duration_s:
            time.sleep(POLL_S)
            while not arrived.empty():
                name, samples = arrived.get()
                files[name].add(samples)
            for source in sources:
                source.check()
            silent = [name for name, file in files.items() if not file.summary.samples]
            if silent:
                first_samples.wait_on(silent)
        return {file.path: RecordedFile(file.summary, file.follows_crystal) for file in files.values()}


def _follows_crystal(source: SampleSource) -> bool | None:
    """Return whether a board's clock follows its crystal, by the board's report; None for other sources."""
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
