"""Readings and motion as tables: CSV, Parquet, MATLAB.

Readings are as recorded, in each sensor's own axes. `rig solve GYRO.csv --sweeps GYRO_sweeps.csv` reads the CSV files.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rig.config.files.safe_writing import new_file, write_new
from rig.report.exports.columns import ExportTable, plain_names
from rig.report.exports.exported_recording import Exported


def tables_of(recordings: Sequence[Exported]) -> Iterator[ExportTable]:
    """Yield the tables of each recording; after the first recording, names contain the recording's number."""
    for number, recording in enumerate(recordings, start=1):
        for table in recording.tables():
            yield table if number == 1 else replace(table, name=f"{table.name}-{number}")


def write_csv(recordings: Sequence[Exported], folder: Path) -> list[Path]:
    """Write a file for each table, and `README.txt` with the tables' meanings; return the paths."""
    written = []
    lines = []
    for table in tables_of(recordings):
        path = folder / f"{table.name}.csv"
        rows = np.column_stack(list(table.columns.values()))
        with new_file(path) as file:
            np.savetxt(file, rows, fmt="%.17g", delimiter=",", header=",".join(table.columns), comments="")
        written.append(path)
        lines.append(f"{path.name}: {table.meaning}\n")
    readme = folder / "README.txt"
    write_new(readme, "".join(lines))
    return [*written, readme]


def write_parquet(recordings: Sequence[Exported], folder: Path) -> list[Path]:
    """Write a file for each table, with its meaning as the metadata `convention`; return the paths."""
    import pyarrow
    import pyarrow.parquet

    written = []
    for table in tables_of(recordings):
        path = folder / f"{table.name}.parquet"
        columns = pyarrow.table({name: np.ascontiguousarray(column) for name, column in table.columns.items()})
        with new_file(path) as file:
            pyarrow.parquet.write_table(columns.replace_schema_metadata({"convention": table.meaning}), file)
        written.append(path)
    return written


def write_mat(recordings: Sequence[Exported], folder: Path) -> list[Path]:
    """Write `run.mat`, a struct for each table with columns (n, 1) and meaning (`convention`); return its path."""
    from scipy.io import savemat

    tables = tuple(tables_of(recordings))
    names = plain_names(table.name for table in tables)
    structs = {
        names[table.name]: {name: column[:, None] for name, column in table.columns.items()}
        | {"convention": table.meaning}
        for table in tables
    }
    path = folder / "run.mat"
    with new_file(path) as file:
        savemat(file, structs, do_compression=True, long_field_names=True)  # pyrefly: ignore[bad-argument-type]  # of scipy-stubs
    return [path]
