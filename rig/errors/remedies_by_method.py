"""The remedies of errors that differ by the method of calibration: the table remedies_by_method.txt."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal, get_args

CalibrationMethod = Literal["hand", "file", "arm"]
TABLE = Path(__file__).with_name("remedies_by_method.txt")


def remedies_by_method(name: str) -> Mapping[CalibrationMethod, str]:
    """Return an error's remedy by method of calibration; empty if all methods share one.

    Raise ValueError for a line of another form than `name | way | what to do`.
    """
    remedies: dict[CalibrationMethod, str] = {}
    for number, line in enumerate(TABLE.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("#"):
            continue
        cells = line.split(" | ")
        if len(cells) != 3 or cells[1] not in get_args(CalibrationMethod):
            raise ValueError(
                f"{TABLE.name}, line {number}: not `name | {' or '.join(get_args(CalibrationMethod))} | what to do`"
            )
        if cells[0] == name:
            remedies[next(method for method in get_args(CalibrationMethod) if method == cells[1])] = cells[2]
    return remedies
