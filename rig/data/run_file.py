"""The run file: everything a run saw, as it arrived, in HDF5.

The file survives `kill -9` because it is written in HDF5's single-writer/multiple-reader (SWMR) mode: all datasets and
attributes exist before that mode begins, afterwards rows are only appended, and the library writes every piece before
anything that points to it. SWMR forbids data of variable length, so the events are one stream of bytes, a line of JSON
each: any detail fits, and a line cut off by a kill is seen by its missing end.

Layout (schema "rig.run/2"): `/samples/<sensor>` (SAMPLE_DTYPE, the sensor's description as attributes), `/arm`
(ARM_STATE_DTYPE), `/events` (bytes); `schema`, `config` (YAML), `settings` and `provenance` (JSON) as attributes of the
file. Schema "rig.run/1" lacks `settings`.
"""

import json
import os
import re
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from firmware_host.samples import SAMPLE_DTYPE
from rig.arm.state import ARM_STATE_DTYPE, ArmState
from rig.data.settings import RunSettings, settings_from_json
from rig.data.settings_of_run_1 import settings_of_configuration
from rig.errors import Fault, Refused

SCHEMA = "rig.run/2"
SCHEMA_BEFORE = "rig.run/1"
FLUSH_PERIOD_S = 0.25  # half of what is promised, so that a slow flush still keeps the promise
CHUNK_ROWS = 1024
CHUNK_BYTES = 65536


@dataclass(frozen=True, slots=True)
class RecordedSensor:
    """What a reader of the file must know about one sensor.

    rate in rad/s = counts × `sensitivity_rad_s_per_count`; temperature in °C = counts × `temperature_c_per_count` +
    `temperature_offset_c`. `full_scale_counts` is the largest number the part reports: a reading there is saturated.
    `mounting` (3 rows of 3) is the nominal rotation from the flange frame to the sensor's. `mode` is "calibrated" when
    the board corrected the readings before it sent them.
    """

    part: str
    serial_number: str
    rate_hz: float
    range_rad_s: float
    sensitivity_rad_s_per_count: float
    full_scale_counts: int
    temperature_c_per_count: float
    temperature_offset_c: float
    mounting: tuple[tuple[float, ...], ...]
    mode: str = "raw"


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened: when (host's monotonic clock; controller's, if it was heard by then) and its details."""

    name: str
    host_time_s: float
    controller_time_s: float | None
    detail: dict[str, Any]


@dataclass(frozen=True, slots=True)
class RunData:
    """A run file in memory: `samples` by sensor name (n,) SAMPLE_DTYPE, `arm` (n,) ARM_STATE_DTYPE, events in order.

    `settings` say what it is judged by; `config` is the configuration's text, for people.
    """

    config: str
    settings: RunSettings
    provenance: dict[str, Any]
    sensors: dict[str, RecordedSensor]
    samples: dict[str, NDArray[Any]]
    arm: NDArray[Any]
    events: tuple[Event, ...]

    def judged_by(self, overrides: Sequence[str]) -> "RunData":
        """The same recording under other settings: see `RunSettings.with_overrides`."""
        return replace(self, settings=self.settings.with_overrides(overrides)) if overrides else self


class RunRecorder:
    """Writes a run file from any number of threads; what they hand over is on its way to the disk within 0.5 s.

    `config` is the configuration's text without its `world:` section; `provenance` must fit into JSON. The folder of
    `path` must exist and the file must not. Raises Fault `recording_failed` from the constructor, `check` and `close`.
    The adding calls never wait for the disk and do not report its failures, so that a full disk stalls neither the
    board's link nor the arm's: watch `check`.
    """

    def __init__(
        self,
        path: Path,
        *,
        config: str,
        settings: RunSettings,
        provenance: Mapping[str, Any],
        sensors: Mapping[str, RecordedSensor],
    ) -> None:
        import h5py

        self.path = path
        self._failure: Exception | None = None
        self._controller_time_s: float | None = None
        self._lock = threading.Lock()
        self._pending = _Pending({name: [] for name in sensors}, [], [])
        self._closing = threading.Event()
        try:
            _create(path, config, settings, provenance, sensors)
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
        """Append samples (n,) SAMPLE_DTYPE of a sensor named at the start. The array must not change afterwards."""
        with self._lock:
            self._pending.samples[sensor].append(samples)

    def add_arm_state(self, state: ArmState) -> None:
        """Append one arm state."""
        with self._lock:
            self._controller_time_s = state.time_s
            self._pending.arm.append(state)

    def add_event(self, name: str, *, controller_time_s: float | None = None, **detail: Any) -> None:
        """Append an event, now; its controller time is the newest arm state's unless given. Details fit into JSON."""
        with self._lock:
            known = self._controller_time_s if controller_time_s is None else controller_time_s
            line = json.dumps(
                {"name": name, "host_time_s": time.monotonic(), "controller_time_s": known, "detail": detail}
            )
            self._pending.events.append(line.encode() + b"\n")

    def check(self) -> None:
        """Raise Fault `recording_failed` if the file could not be written."""
        if self._failure is not None:
            raise self._fault(self._failure)

    def close(self) -> None:
        """Write what is pending and close the file; afterwards any HDF5 reader opens it. Closing twice is allowed."""
        self._closing.set()
        self._thread.join()
        self.check()

    def _write(self) -> None:
        """The writer thread: flush what has come, several times a second, until closed or broken."""
        try:
            closing = False
            while not closing:
                closing = self._closing.wait(FLUSH_PERIOD_S)
                self._flush()
            self._file.close()
        except Exception as error:  # whatever it is, the run must hear of it
            self._failure = error
            self._abandon()

    def _abandon(self) -> None:
        """Leave the file as the last flush left it.

        HDF5 repeats a failed write whenever anything is closed, and ends the process with a segmentation fault at exit;
        from here on it writes into nothing.
        """
        with Path(os.devnull).open("r+b") as nothing:
            os.dup2(nothing.fileno(), self._descriptor)
        self._file.close()

    def _flush(self) -> None:
        with self._lock:
            pending = self._pending
            self._pending = _Pending({name: [] for name in pending.samples}, [], [])
        for name, batches in pending.samples.items():
            if batches:
                _append(self._file["samples"][name], np.concatenate(batches))
        if pending.arm:
            records = [state.to_record() for state in pending.arm]
            _append(self._file["arm"], np.array(records, ARM_STATE_DTYPE))
        if pending.events:
            _append(self._file["events"], np.frombuffer(b"".join(pending.events), "u1"))

    def _fault(self, error: Exception) -> Fault:
        return Fault(
            "recording_failed",
            f"{self.path} cannot be written ({_reason(error)})",
            "Free space on the disk or choose another output folder, then resume the run",
        )


def read_run(path: Path) -> RunData:
    """Read a run file: finished, still being written, or left behind by a killed process.

    Rows that the kill left unwritten or torn at the end are dropped. Raises Refused: `no_run_file` when there is none,
    `not_a_run_file` when it is something else, damaged, or of another schema.
    """
    import h5py

    if not path.is_file():
        raise Refused("no_run_file", f"there is no file {path}", "Give the path of a run.h5")
    try:
        # Opened as an SWMR reader even after the fact: a plain open refuses a file whose writer was killed.
        with h5py.File(path, "r", libver="latest", swmr=True) as file:
            if file.attrs["schema"] not in (SCHEMA, SCHEMA_BEFORE):
                raise ValueError(f"its schema is {file.attrs['schema']!r}, not {SCHEMA!r}")
            return RunData(
                config=file.attrs["config"],
                settings=_settings(file.attrs),
                provenance=json.loads(file.attrs["provenance"]),
                sensors={name: _sensor(dataset) for name, dataset in file["samples"].items()},
                samples={name: _whole_rows(dataset[:]) for name, dataset in file["samples"].items()},
                arm=_whole_rows(file["arm"][:]),
                events=tuple(_events(file["events"][:].tobytes())),
            )
    except (OSError, RuntimeError, KeyError, ValueError) as error:
        raise Refused(
            "not_a_run_file",
            f"{path} cannot be read as a run ({_reason(error)})",
            "Give the path of a run.h5 the rig has written",
        ) from error


def make_plain(path: Path) -> None:
    """Rewrite the file of a killed run, which only SWMR readers open, so that any HDF5 tool does. The content stays.

    Call it only when nobody writes the file any more. Raises Refused as `read_run` does.
    """
    import h5py

    read_run(path)
    whole = path.with_name(path.name + ".part")
    with h5py.File(path, "r", libver="latest", swmr=True) as source, h5py.File(whole, "w") as target:
        target.attrs.update(source.attrs)
        for name in source:
            source.copy(name, target)
    whole.replace(path)


def _settings(attributes: Mapping[str, Any]) -> RunSettings:
    if attributes["schema"] == SCHEMA_BEFORE:
        return settings_of_configuration(attributes["config"])
    return settings_from_json(attributes["settings"])


def _sensor(dataset: Any) -> RecordedSensor:
    values = {field.name: dataset.attrs[field.name] for field in fields(RecordedSensor) if field.name != "mode"}
    values["mode"] = dataset.attrs.get("mode", "raw")  # files of before there were two modes
    values = {name: value.item() if isinstance(value, np.generic) else value for name, value in values.items()}
    mounting = tuple(tuple(row) for row in values.pop("mounting").tolist())
    return RecordedSensor(**values, mounting=mounting)


def _whole_rows(rows: NDArray[Any]) -> NDArray[Any]:
    """Without the end that never reached the disk: such rows are zeros, and a host time is never zero."""
    written = np.flatnonzero(rows["host_time_s"])
    count = int(written[-1]) + 1 if len(written) else 0
    return rows if count == len(rows) else rows[: max(count - 1, 0)]  # the last one may be torn


def _events(stream: bytes) -> Iterator[Event]:
    for line in stream.split(b"\n")[:-1]:  # what follows the last line's end was cut off
        if line.strip(b"\0"):
            yield Event(**json.loads(line))


@dataclass(slots=True)
class _Pending:
    """What waits for the writer thread."""

    samples: dict[str, list[NDArray[Any]]]
    arm: list[ArmState]
    events: list[bytes]


def _create(
    path: Path,
    config: str,
    settings: RunSettings,
    provenance: Mapping[str, Any],
    sensors: Mapping[str, RecordedSensor],
) -> None:
    """Lay out an empty run file beside its place and move it there whole, so that a kill leaves all or nothing."""
    import h5py

    if path.exists():
        raise FileExistsError(f"{path.name} is there already")
    whole = path.with_name(path.name + ".part")
    with h5py.File(whole, "w", libver="latest") as file:
        file.attrs.update(
            schema=SCHEMA, config=config, settings=settings.to_json(), provenance=json.dumps(dict(provenance))
        )
        file.create_dataset("arm", shape=(0,), maxshape=(None,), chunks=(CHUNK_ROWS,), dtype=ARM_STATE_DTYPE)
        file.create_dataset("events", shape=(0,), maxshape=(None,), chunks=(CHUNK_BYTES,), dtype="u1")
        for name, sensor in sensors.items():
            dataset = file.create_dataset(
                f"samples/{name}", shape=(0,), maxshape=(None,), chunks=(CHUNK_ROWS,), dtype=SAMPLE_DTYPE
            )
            dataset.attrs.update(asdict(sensor))
    whole.rename(path)


def _append(dataset: Any, rows: NDArray[Any]) -> None:
    start = dataset.shape[0]
    dataset.resize((start + len(rows),))
    dataset[start:] = rows
    dataset.flush()


def _reason(error: Exception) -> str:
    """HDF5 buries the system's words in several lines of its own."""
    found = re.search(r"error message = '([^']*)'", str(error))
    return found[1] if found else " ".join(str(error).split())
