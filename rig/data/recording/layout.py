"""The layout of a run in HDF5 (schema "rig.run/1").

- `/samples/<sensor>`: its stamps and a column for each channel; attributes describe the sensor (`channels` in JSON).
- `/states`: the turner's states, of the type that `turner` describes (`rig.data.recording.recorded_turner`).
- `/events`: bytes, a line of JSON for each event, because SWMR forbids data of variable length.
- attributes of the file: `schema`, `config` (YAML), and in JSON `settings`, `provenance` and `turner`.

External readings (schema "rig.files/1") have no `/samples` and no rows in `/states`, but the tables `/readings` and
`/motion` (a float column each, by name; `rig.data.recording.motion_file`) the attribute
`elsewhere` (JSON: the calibrated item, and how its motion is known).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.config.files.safe_writing import write_new
from rig.data.recording.layout_keys import EVENTS_DTYPE, SCHEMA
from rig.data.recording.recorded_sensor import RecordedSensor, sensor_of
from rig.data.recording.recorded_turner import RecordedTurner, turner_of
from rig.data.validation import parse_json, sanitize
from rig.motion.state_rows import ARM_STATE_DTYPE

CHUNK_ROWS = 1024
CHUNK_BYTES = 65536


@dataclass(frozen=True)
class Contents:
    """The contents of a run file, not yet validated.

    - `texts`: the attributes named in `TEXTS`; `described`: the attributes of each sensor.
    - `samples` (n,) by sensor, `states` (n,) of the turner, `events` (n,) in bytes.
    - `tables` (n,): of external readings, by the names in `TABLES`.
    """

    schema: str
    texts: Mapping[str, str]
    described: Mapping[str, Mapping[str, Any]]
    samples: Mapping[str, NDArray[Any]]
    states: NDArray[Any]
    events: NDArray[Any]
    tables: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    @cached_property
    def sensors(self) -> dict[str, RecordedSensor]:
        """Sensors by name, from the attributes of their samples. Raise ValueError."""
        return {name: parse_sensor(name, attributes) for name, attributes in self.described.items()}

    @cached_property
    def turner(self) -> RecordedTurner | None:
        """The turner that the file's text describes; None for external readings. Raise ValueError."""
        return turner_of(self.texts["turner"]) if self.schema == SCHEMA else None


def empty(
    schema: str,
    texts: Mapping[str, str],
    sensors: Mapping[str, RecordedSensor],
    states_dtype: np.dtype[Any] = ARM_STATE_DTYPE,
) -> Contents:
    """Return the contents of a new recording of `sensors`, without samples or states."""
    described = {name: sensor.attributes() for name, sensor in sensors.items()}
    samples = {name: np.empty(0, sensor.sample_dtype) for name, sensor in sensors.items()}
    return Contents(schema, texts, described, samples, np.empty(0, states_dtype), np.empty(0, EVENTS_DTYPE))


def parse_sensor(name: str, attributes: Mapping[str, Any]) -> RecordedSensor:
    """Return the sensor that the attributes of its samples describe. Raise ValueError naming the wrong attribute."""
    attributes = sanitize(dict(attributes))
    channels = attributes.get("channels")
    if not isinstance(channels, str):
        raise ValueError(f"the channels of {name} are not a text")
    return sensor_of({**attributes, "channels": parse_json(channels)})


def check_rows(contents: Contents) -> None:
    """Raise ValueError if a data set's rows do not have the type that the file's attributes describe."""
    states_dtype = contents.turner.dtype if contents.turner else ARM_STATE_DTYPE
    rows = {
        f"samples/{name}": (contents.samples[name], sensor.sample_dtype) for name, sensor in contents.sensors.items()
    }
    rows |= {"states": (contents.states, states_dtype), "events": (contents.events, EVENTS_DTYPE)}
    rows |= {name: (table, table_dtype(table.dtype.names or ())) for name, table in contents.tables.items()}
    for name, (rows_found, meant) in rows.items():
        if rows_found.dtype != meant:
            raise ValueError(f"{name} holds {rows_found.dtype!s:.200}, not rows of {meant}")


def table_of(columns: Mapping[str, NDArray[np.float64]]) -> NDArray[Any]:
    """Return float columns as rows (n,)."""
    table = np.empty(len(next(iter(columns.values()))), table_dtype(tuple(columns)))
    for name, column in columns.items():
        table[name] = column
    return table


def table_dtype(names: Sequence[str]) -> np.dtype[Any]:
    """Return the NumPy type of the rows of a table with the given columns."""
    return np.dtype([(name, "<f8") for name in names])


def lay_out(path: Path, contents: Contents, *, swmr: bool) -> None:
    """Write a run file under a temporary name, then rename it, so a kill or a full disk leaves no incomplete file.

    With `swmr` the file can be opened for appending in that mode; otherwise any HDF5 tool opens it. Raise OSError.
    """
    write_new(path, _image(contents, "latest" if swmr else None))


def _image(contents: Contents, libver: str | None) -> bytes:
    """Return the bytes of a complete run file.

    h5py builds the file in memory, because HDF5 repeats a failed write to a real file at exit and crashes the process.
    """
    import h5py

    with h5py.File("in memory", "w", libver=libver, driver="core", backing_store=False) as file:
        file.attrs.update(schema=contents.schema, **contents.texts)
        _dataset(file, "states", contents.states, CHUNK_ROWS)
        _dataset(file, "events", contents.events, CHUNK_BYTES)
        for name, rows in contents.tables.items():
            _dataset(file, name, rows, CHUNK_ROWS)
        for name, rows in contents.samples.items():
            _dataset(file, f"samples/{name}", rows, CHUNK_ROWS).attrs.update(contents.described[name])
        file.flush()
        image: bytes = file.id.get_file_image()
        return image


def append(dataset: Any, rows: NDArray[Any]) -> None:
    """Add rows to a dataset of a file that is open for appending."""
    start = dataset.shape[0]
    dataset.resize((start + len(rows),))
    dataset[start:] = rows
    dataset.flush()


def _dataset(file: Any, name: str, rows: NDArray[Any], chunk: int) -> Any:
    return file.create_dataset(name, data=rows, maxshape=(None,), chunks=(chunk,), dtype=rows.dtype)
