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


def words(folder: Path, width: int) -> set[str]:
    out = StringIO()
    print_result(read_result(folder), Console(file=out, width=width, highlight=False))
    assert width > 80 or all(len(line.rstrip()) <= width for line in out.getvalue().splitlines())
    return {*FRAME.sub(" ", out.getvalue()).split()}


@pytest.mark.parametrize("name", ["bias_drift", "by_hand", "mavlink", "thermal", "imu", "magnetometer"])
def test_every_word_is_whole_in_80_columns(name: str) -> None:
    assert words(FROZEN / name, 80) <= words(FROZEN / name, 300)
