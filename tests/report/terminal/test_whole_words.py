"""At 80 columns no table of a finished run cuts a word or a number."""

import re
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from rig.data.result_file import read_result
from rig.report.terminal.result_table import print_result
from support.paths import ROOT

FRAME = re.compile("[┏━┳┓┃┡╇┩│└─┴┘├┼┤]")
FROZEN = ROOT / "tests" / "fixtures" / "recordings"


def show(folder: Path, width: int) -> str:
    out = StringIO()
    print_result(read_result(folder), Console(file=out, width=width, highlight=False))
    assert width > 80 or all(len(line.rstrip()) <= width for line in out.getvalue().splitlines())
    return out.getvalue()


def words(folder: Path, width: int) -> set[str]:
    return {*FRAME.sub(" ", show(folder, width)).split()}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["attitudes", "by_hand", "magnetometer", "swinging", "thermal"])
def test_degrees_of_freedom_stand_in_one_line_of_80_columns(name: str) -> None:
    def degrees(width: int) -> list[str]:
        return re.findall("in u|ν (?:[0-9.]+ × 10[⁰¹²³⁴-⁹]+|[0-9∞]+)", " ".join(show(FROZEN / name, width).split()))

    assert degrees(80) == degrees(300)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["bias_drift", "by_hand", "mavlink", "thermal", "imu", "magnetometer"])
def test_every_word_is_whole_in_80_columns(name: str) -> None:
    assert words(FROZEN / name, 80) <= words(FROZEN / name, 300)
