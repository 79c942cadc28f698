"""The remedies that differ by the method of calibration, from the table remedies_by_method.txt."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, get_args

from rig.errors.table_rows import read_rows

CalibrationMethod = Literal["hand", "file", "arm"]
TABLE = Path(__file__).with_name("remedies_by_method.txt")


def remedies_by_method(name: str) -> Mapping[CalibrationMethod, str]:
    """Return an error's remedy by method of calibration; empty if all methods share one.

    Raise ValueError for a line of another form than `name | method | what to do`.
    """
    methods: tuple[CalibrationMethod, ...] = get_args(CalibrationMethod)
    rows = [*read_rows(TABLE, f"name | {' or '.join(methods)} | what to do", 1, methods)]
    remedies = {(key, method): remedy for key, method, remedy in rows}
    return {method: remedies[name, method] for method in methods if (name, method) in remedies}
