"""Readings, sweeps and arm states as tables: CSV, Parquet, MATLAB.

Readings are those the board sent, in each sensor's own axes, on the arm controller's clock. `rig solve GYRO.csv
--sweeps GYRO_sweeps.csv` reads the CSV files.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.config.written_file import new_file, write_new
from rig.data.quantity import ACCELERATION, RATE
from rig.data.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array
from rig.observation.observed_run import ObservedRun
from rig.report.exports.names import plain_names

CLOCK = "Times are seconds of the arm controller's clock."
LOST = "Not here: counts, the board's and the computer's times, events, settings; they are in run.h5."


@dataclass(frozen=True, slots=True)
class Table:
    """Columns (n,) by name, which carries the unit, and what they mean."""

    name: str
    columns: Mapping[str, Array]
    said: str


def tables_of(recordings: Sequence[ObservedRun]) -> Iterator[Table]:
    """The tables of each recording: the arm, of each sensor its readings, of each gyroscope its sweeps as well."""
    for number, recording in enumerate(recordings, start=1):
        after = "" if number == 1 else f"-{number}"
        said = f"Joint angles and rates, from the ground on. {CLOCK} {LOST}"
        yield Table(f"arm{after}", recording.motion.table(), said)
        for name, sensor in recording.run.sensors.items():
            yield from _readings(recording, name, sensor, after)
            if sensor.measures(RATE):
                turned = "Turns by an angle about a unit vector in the flange's frame; those of angle 0 are rests."
                yield Table(f"{name}_sweeps{after}", _sweeps(recording, name), f"{turned} {CLOCK} {LOST}")


def _readings(recording: ObservedRun, name: str, sensor: RecordedSensor, after: str) -> Iterator[Table]:
    """A sensor's channels in one table, but for accelerations beside rates."""
    time_s = recording.time_s(name)
    beside = [each for each in sensor.channels if sensor.measures(RATE) and each.quantity == ACCELERATION.name]
    own = [each for each in sensor.channels if each not in beside]
    whose = f"{name}, {sensor.part} {sensor.serial_number}, {sensor.mode} readings"
    if sensor.has_axes:
        whose += " in the sensor's own axes"
    for table, channels, said in (("", own, ""), ("_acceleration", beside, "Upwards at rest. ")):
        if channels:
            columns = {"time_s": time_s}
            for each in channels:
                values = each.values(recording.run.samples[name])
                columns |= _split(each.measures.columns, values.reshape(len(time_s), -1))
            yield Table(f"{name}{table}{after}", columns, f"{whose}. {said}{CLOCK} {LOST}")


def _sweeps(recording: ObservedRun, name: str) -> dict[str, Array]:
    seen = recording.sensors[name]
    rows = [(turn.average.start_s, turn.average.end_s, *turn.axis_flange, turn.angle_rad) for turn in seen.revolutions]
    rows += [(rest.start_s, rest.end_s, 0.0, 0.0, 0.0, 0.0) for rest in seen.rests]
    names = ("start_s", "end_s", "axis_x", "axis_y", "axis_z", "angle_rad")
    return _split(names, np.array(sorted(rows), dtype=np.float64).reshape(-1, len(names)))


def _split(names: Sequence[str], columns: Array) -> dict[str, Array]:
    return {name: columns[:, i] for i, name in enumerate(names)}


def write_csv(recordings: Sequence[ObservedRun], folder: Path) -> list[Path]:
    """A file for each table, and `README.txt`, since a table of numbers has no room for words."""
    written, said = [], []
    for table in tables_of(recordings):
        path = folder / f"{table.name}.csv"
        rows = np.column_stack(list(table.columns.values()))
        with new_file(path) as file:
            np.savetxt(file, rows, fmt="%.17g", delimiter=",", header=",".join(table.columns), comments="")
        written.append(path)
        said.append(f"{path.name}: {table.said}\n")
    readme = folder / "README.txt"
    write_new(readme, "".join(said))
    return [*written, readme]


def write_parquet(recordings: Sequence[ObservedRun], folder: Path) -> list[Path]:
    """A file for each table, its meaning as metadata `convention`."""
    import pyarrow
    import pyarrow.parquet

    written = []
    for table in tables_of(recordings):
        path = folder / f"{table.name}.parquet"
        columns = pyarrow.table({name: np.ascontiguousarray(column) for name, column in table.columns.items()})
        with new_file(path) as file:
            pyarrow.parquet.write_table(columns.replace_schema_metadata({"convention": table.said}), file)
        written.append(path)
    return written


def write_mat(recordings: Sequence[ObservedRun], folder: Path) -> list[Path]:
    """`run.mat`: a struct for each table, columns as fields (n, 1), its meaning as field `convention`."""
    from scipy.io import savemat

    tables = tuple(tables_of(recordings))
    names = plain_names(table.name for table in tables)
    structs = {names[table.name]: {**_columns(table), "convention": table.said} for table in tables}
    path = folder / "run.mat"
    with new_file(path) as file:
        savemat(file, structs, do_compression=True, long_field_names=True)  # type: ignore[arg-type]  # says scipy-stubs
    return [path]


def _columns(table: Table) -> dict[str, Array]:
    return {name: column[:, None] for name, column in table.columns.items()}
