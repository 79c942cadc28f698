"""The run file: all data of a run, as received, in HDF5.

The file survives `kill -9` because it is written in HDF5's single-writer/multiple-reader (SWMR) mode: all datasets and
attributes exist before that mode begins. Afterwards rows are only appended, and the library writes every block before
anything that points to it. See `rig.data.recording.layout` for the layout.
"""

import json
import os
import threading
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from rig.config.section import SensorName
from rig.data.processes.reading_process import ReadingTask, UnreadableFile
from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.extract import reason
from rig.data.recording.layout import Contents, append, check_rows, empty, lay_out, table_of
from rig.data.recording.layout_keys import EVENTS_DTYPE, EXTERNAL_SCHEMA, SCHEMA, TABLES
from rig.data.recording.motion_file import MOTIONS, ExternalHeader, ExternalReadings, samples_header
from rig.data.recording.provenance import Provenance
from rig.data.recording.recorded_events import Event, TimedEvent, decode_events, encode_event
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.recorded_turner import RecordedTurner, check_joints
from rig.data.recording.run_data import RunData
from rig.data.recording.run_reading import begin_reading
from rig.data.recording.settings import RunSettings, settings_from_json
from rig.data.validation import MAX_NUMBER, parse_json, validate
from rig.errors import Fault, Refused
from rig.errors.quoting import quote
from rig.motion.turner_state import State

FLUSH_PERIOD_S = 0.25  # half of the promised time, so that a slow flush still keeps the promise
MAX_STATE = 1e12  # of a turner, in SI units, times included


class RunRecorder:
    """The writer of a run file, for any number of threads at once; data are passed to the disk within 0.5 s.

    `config` is the configuration's text without its `world:` section. The folder of `path` must exist and the file must
    not. The methods that add data never wait for the disk and do not report the disk's failures, so that a full disk
    stalls neither the board's link nor the turner's. Call `check` for these failures. Raise Fault `recording_failed`
    from the constructor, `check` and `close`.
    """

    def __init__(
        self,
        path: Path,
        *,
        config: str,
        settings: RunSettings,
        provenance: Provenance,
        turner: RecordedTurner,
        sensors: Mapping[str, RecordedSensor],
    ) -> None:
        """Lay out the file for the given sensors and turner, and start the writer thread."""
        import h5py

        self.path = path
        self._failure: Exception | None = None
        self.removed = False  # whether the file is no longer in its place
        self._controller_time_s: float | None = None
        self._lock = threading.Lock()
        self._pending = _PendingData({name: [] for name in sensors}, [], [])
        self._states_dtype = turner.dtype
        self._closing = threading.Event()
        try:
            if path.exists():
                raise FileExistsError(f"{path.name} is there already")
            texts = {"config": config, "settings": settings.to_json(), "provenance": json.dumps(provenance.document())}
            texts["turner"] = turner.to_json()
            lay_out(path, empty(SCHEMA, texts, sensors, turner.dtype), swmr=True)
            self._file = h5py.File(path, "r+", libver="latest")
            self._file.swmr_mode = True
            self._descriptor: int = self._file.id.get_vfd_handle()
        except (OSError, RuntimeError) as error:
            raise self._fault(error) from error
        self._thread = threading.Thread(target=self._write, name="recorder", daemon=True)
        self._thread.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def add_samples(self, sensor: str, samples: NDArray[Any]) -> None:
        """Append samples (n,) of a declared sensor, of its dtype. The array must not change afterwards."""
        with self._lock:
            self._pending.samples[sensor].append(samples)

    def add_state(self, state: State) -> None:
        """Append one state of the turner."""
        with self._lock:
            self._controller_time_s = state.time_s
            self._pending.states.append(state)

    def add(self, event: Event, *, controller_time_s: float | None = None) -> None:
        """Append an event at the present time; its controller time is by default the newest state's."""
        with self._lock:
            time_s = self._controller_time_s if controller_time_s is None else controller_time_s
            self._pending.events.append(encode_event(TimedEvent(event, time.monotonic(), time_s)))

    def check(self) -> None:
        """Raise Fault `recording_failed` if the file could not be written."""
        if self._failure is not None:
            raise self._fault(self._failure)

    def close(self) -> None:
        """Write pending data and close the file, which any HDF5 reader then opens. Closing twice is allowed."""
        self._closing.set()
        self._thread.join()
        self.check()

    def _write(self) -> None:
        """Run the writer thread: flush new data several times a second, until closed or failed."""
        try:
            closing = False
            while not closing:
                closing = self._closing.wait(FLUSH_PERIOD_S)
                self._flush()
                # Checked here: a disk that hangs may block this thread, but no other.
                self.removed = not self.path.exists()
            self._file.close()
        except Exception as error:  # any error: the run must be informed
            self._failure = error
            self._abandon()

    def _abandon(self) -> None:
        """Close the file in the state that the last complete flush left, after a write has failed.

        HDF5 would repeat the failed write whenever anything is closed, and crash the process at exit. So all its
        further writes are discarded.
        """
        with Path(os.devnull).open("r+b") as nothing:
            os.dup2(nothing.fileno(), self._descriptor)
        self._file.close()

    def _flush(self) -> None:
        """Write the pending samples, states and events to the file."""
        with self._lock:
            pending = self._pending
            self._pending = _PendingData({name: [] for name in pending.samples}, [], [])
        for name, batches in pending.samples.items():
            if batches:
                append(self._file["samples"][name], np.concatenate(batches))
        if pending.states:
            records = [state.to_record() for state in pending.states]
            append(self._file["states"], np.array(records, self._states_dtype))
        if pending.events:
            append(self._file["events"], np.frombuffer(b"".join(pending.events), EVENTS_DTYPE))

    def _fault(self, error: Exception) -> Fault:
        return Fault(
            "recording_failed",
            f"{self.path} cannot be written ({reason(error)})",
            "Free space on the disk or choose another output folder, then resume the run",
        )


def read_run(path: Path, timeout_s: float | None = None, *, begun: ReadingTask | None = None) -> RunData:
    """Return the content of a run file: finished, still being written, or left behind by a killed process.

    `begun` is the result of `begin_reading`, if that was called before. Rows that a killed process did not write
    completely are dropped. Reading may take `timeout_s`, by default a time that depends on the file's size; waits due
    to a busy machine do not count. Raise Refused `no_run_file`; `not_a_run_file` for a damaged file, another kind or
    schema of file, or one that takes longer; `temporary_folder_full`.
    """
    contents = _contents(path, timeout_s, begun)
    try:
        validate(_SensorNames, {"sensors": [*contents.described]}, "samples")
        external = _read_external(contents) if contents.tables else None
        sensors = contents.sensors
        samples = {name: _whole_rows(rows) for name, rows in contents.samples.items()}
        if external is not None:
            sensors, samples = {external.item.name: external.sensor}, {external.item.name: external.samples}
        settings = _settings(contents, sensors)
        provenance = validate(Provenance, parse_json(contents.texts["provenance"]), "provenance")
        events = tuple(decode_events(contents.events.tobytes()))
        turner = None
        if external is None:
            turner = _turner(contents, provenance)
            check_joints(turner, settings, events)
        states = _whole_rows(contents.states)
        _check_numbers("states", states, MAX_STATE)
        for name, rows in samples.items():
            _check_numbers(name, rows, MAX_NUMBER)
        return RunData(
            config=contents.texts["config"],
            settings=settings,
            provenance=provenance,
            turner=turner,
            sensors=sensors,
            samples=samples,
            states=states,
            events=events,
            external=external,
        )
    except (ValueError, RecursionError) as error:
        raise _not_a_run_file(path, str(error)) from None


def write_elsewhere(path: Path, run: RunData) -> None:
    """Write a new run file of external readings. Raise OSError."""
    read = run.external
    assert read is not None, "external readings"
    provenance = json.dumps(run.provenance.document())
    texts = {"config": run.config, "settings": run.settings.to_json(), "provenance": provenance}
    header = ExternalHeader(read.item, read.tells, read.origin_s, read.other_rows, read.note)
    texts["elsewhere"] = json.dumps(asdict(header))
    tables = {"readings": table_of(read.readings), "motion": table_of(read.motion)}
    lay_out(path, replace(empty(EXTERNAL_SCHEMA, texts, {}), tables=tables), swmr=False)


def make_plain(path: Path) -> None:
    """Rewrite a killed run's file, which only SWMR readers can open, so that any HDF5 tool can open it.

    No process may be writing the file. Raise Refused as `read_run` does, and OSError if the file cannot be written.
    """
    contents = _contents(path, None)
    samples = {name: _whole_rows(rows) for name, rows in contents.samples.items()}
    lay_out(path, replace(contents, samples=samples, states=_whole_rows(contents.states)), swmr=False)


def _contents(path: Path, timeout_s: float | None, begun: ReadingTask | None = None) -> Contents:
    """Return the contents of a run file, read in a process of its own, which can be ended. Raise as `read_run` does."""
    try:
        with begun or begin_reading(path, timeout_s) as reading:
            header, *arrays = reading.parts()
    except UnreadableFile as error:
        raise _not_a_run_file(path, str(error)) from error
    fields, rows = cast("dict[str, Any]", header), iter(cast("list[NDArray[Any]]", arrays))
    contents = Contents(
        **fields,
        samples={name: next(rows) for name in fields["described"]},
        states=next(rows),
        events=next(rows),
        tables={name: next(rows) for name in (TABLES if fields["schema"] == EXTERNAL_SCHEMA else ())},
    )
    try:
        check_rows(contents)
    except (ValueError, RecursionError) as error:
        raise _not_a_run_file(path, str(error)) from None
    return contents


def _not_a_run_file(path: Path, why: str) -> Refused:
    return Refused(
        "not_a_run_file",
        f"{path} cannot be read as a run ({why})",
        "Give the path of a run.h5 that the rig has written and that was not damaged since",
    )


def _settings(contents: Contents, sensors: Mapping[str, RecordedSensor]) -> RunSettings:
    """Return the settings of a file. Raise ValueError if they contradict its schema or its sensors."""
    settings = settings_from_json(contents.texts["settings"])
    if (settings.elsewhere is None) != (contents.schema != EXTERNAL_SCHEMA):
        raise ValueError("its settings are those of other readings")
    if settings.elsewhere is not None:
        return settings
    named = (*settings.to_calibrate, *([settings.reference.name] if settings.reference else []))
    if missing := [name for name in named if name not in sensors or not sensors[name].measures(RATE)]:
        raise ValueError(f"it holds no samples of {', '.join(missing)}, a sensor of its settings")
    for name, sensor in sensors.items():
        moved = sensor.measures(RATE) or sensor.measures(ACCELERATION)
        if moved and not settings.stated_uncertainty.knows(name):
            raise ValueError(f"its settings state no uncertainty of its sensor {quote(name)}")
    return settings


def _turner(contents: Contents, provenance: Provenance) -> RecordedTurner:
    turner = contents.turner
    assert turner is not None, "its schema has the text of one"
    if provenance.arm_kinematics not in (None, turner.geometry):
        raise ValueError("its provenance has another geometry than its turner")
    return turner


def _read_external(contents: Contents) -> ExternalReadings:
    tables = [contents.tables[name] for name in TABLES]
    readings, motion = ({name: rows[name] for name in rows.dtype.names or ()} for rows in tables)
    header = validate(ExternalHeader, parse_json(contents.texts["elsewhere"]), "elsewhere")
    samples_header().check(readings)
    MOTIONS[header.tells].check(motion)
    return ExternalReadings(
        header.item, readings, header.tells, motion, header.origin_s, header.other_rows, header.note
    )


def _whole_rows(rows: NDArray[Any]) -> NDArray[Any]:
    """Return the rows that a killed process wrote completely. Rows that it had only reserved have the host time 0."""
    written = np.flatnonzero(rows["host_time_s"])
    count = int(written[-1]) + 1 if len(written) else 0
    return rows if count == len(rows) else rows[: max(count - 1, 0)]  # the last row may be incomplete


def _check_numbers(name: str, rows: NDArray[Any], most: float) -> None:
    """Raise ValueError for numbers that overflow in calculations, and for a host time that is not finite.

    Other numbers that are not finite raise only when they are used.
    """
    if not np.isfinite(rows["host_time_s"]).all():
        raise ValueError(f"a host time of {name} is not a number")
    for column in rows.dtype.names or ():
        values = rows[column]
        if values.dtype.kind == "f" and (np.abs(values[np.isfinite(values)]) > most).any():
            raise ValueError(f"a value in {column} of {name} cannot have been measured")


@dataclass(frozen=True, slots=True)
class _SensorNames:
    """The sensors' names, validated as in a configuration, because files are named after them."""

    sensors: tuple[SensorName, ...]


@dataclass(slots=True)
class _PendingData:
    """Data that wait for the writer thread."""

    samples: dict[str, list[NDArray[Any]]]
    states: list[State]
    events: list[bytes]
