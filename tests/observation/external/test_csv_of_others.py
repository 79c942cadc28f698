"""CSV files as loggers and spreadsheets write them: read for what they say, or refused by what is the matter."""

import gzip
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from rig.data.quantity import RATE
from rig.data.recording.motion_file import Header
from rig.errors import Refused
from rig.observation.external.csv_samples import read_samples
from rig.observation.formats.column_selection import MappedColumns
from rig.observation.formats.csv_table import read_columns

HEAD = ["time_s", "x_rad_s", "y_rad_s", "z_rad_s"]
ROWS = [f"{n / 10},0.{n},-1.5,{n}" for n in range(30)]
PLAIN = "\n".join([",".join(HEAD), *ROWS]) + "\n"
NUMBERS = np.array([[float(cell) for cell in row.split(",")] for row in ROWS])


def written(folder: Path, content: bytes) -> Path:
    path = folder / "log.csv"
    path.write_bytes(content)
    return path


def read(path: Path, mapped: MappedColumns | None = None) -> np.ndarray:
    samples = read_samples(path, [RATE], mapped)
    return np.column_stack([samples.time_s, samples.readings[RATE]])


@pytest.mark.slow
@pytest.mark.parametrize(
    "as_written",
    [
        lambda text: gzip.compress(text.encode(), mtime=0),
        lambda text: text.replace(",", "\t").encode("utf-16"),
        lambda text: text.replace("\n", "\r\r\n").encode(),
        lambda text: (text + "\n\r\n").encode(),
        lambda text: text.replace(",", ";").replace(".", ",").encode("utf-8-sig"),
        lambda text: ("# " + text.replace(",", "   ")).encode(),
        lambda text: b"% " + text.encode(),
        lambda text: text.replace("\n", ",\n").encode(),
        lambda text: ('""' + re.sub("(?m)^(.)", r'"7",\1', text)[3:]).replace(",", " ").encode(),
        lambda text: re.sub("(?m)^(.)", r"7,\1", text)[1:].encode(),
        lambda text: text.replace("\n1.0,", "\ntime_s,x_rad_s,y_rad_s,z_rad_s\ns,rad/s,rad/s,rad/s\n1.0,").encode(),
    ],
    ids=[
        "gzip",
        "UTF-16 and tabs",
        "two carriage returns",
        "empty rows at the end",
        "semicolons and BOM",
        "NumPy's spaces",
        "MATLAB's comment",
        "a separator at the end of every line",
        "R's row names",
        "pandas' index",
        "the heading and the units again",
    ],
)
def test_what_others_write_is_read(tmp_path: Path, as_written: Callable[[str], bytes]) -> None:
    assert np.array_equal(read(written(tmp_path, as_written(PLAIN))), NUMBERS)


@pytest.mark.parametrize("encoding", ["utf-8", "cp1252", "utf-16"])
def test_headings_of_a_german_logger_are_found_in_any_encoding(tmp_path: Path, encoding: str) -> None:
    headings = ["Zeit, ms", *(f"Drehrate {axis}, °/s" for axis in "xyz")]
    text = "\n".join(["Gerät; 7", "", ";".join(headings), *(row.replace(",", ";").replace(".", ",") for row in ROWS)])
    factors = (1e-3, 1.0, 1.0, 1.0)
    mapped = MappedColumns({name: (there, by) for name, there, by in zip(HEAD, headings, factors, strict=True)}, 2)
    assert read(written(tmp_path, text.encode(encoding)), mapped) == pytest.approx(NUMBERS * factors)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"Device 7\n" + PLAIN.encode(), "wrong_columns: .*neither by commas nor by semicolons, tabs or spaces"),
        ("\n".join(ROWS).encode(), "wrong_columns: .*numbers in its first row and no names"),
        (PLAIN.replace("_s,", "_s,,", 1).encode(), "wrong_columns: .*a column without a name"),
        (PLAIN.encode() + b"3,0\xff\xfe,1,1\n", "not_a_number: .*line 32"),
        (PLAIN.replace("time_s", "Zeit").encode(), "lacks time_s, has the unknown Zeit.* --columns"),
        (b"\xa3\x95\x80\x80\x59FMT\0", "no_file: .*log.csv cannot be read: it is a log of ArduPilot"),
        (b"PK\x03\x04\0\0\0\0xl/worksheets", "no_file: .*log.csv cannot be read: it is not text but a spreadsheet"),
        (gzip.compress(PLAIN.encode(), mtime=0)[:60], "no_file: .*ended before the end"),
        (gzip.compress(PLAIN.encode(), mtime=0)[:30] + b"\xff" * 60, "no_file: .*log.csv cannot be read"),
        (
            "\n".join(PLAIN.splitlines()[:9]).encode(),
            "too_few_samples: .*log.csv has 8 samples; at least 20 are needed",
        ),
        (
            PLAIN.replace("\n1.0,", "\n-1.0,").encode(),
            "time_s -1 after 0.9, in sample 11: the clock was set back by about 2 s",
        ),
    ],
)
def test_what_cannot_be_read_says_what_is_the_matter(tmp_path: Path, content: bytes, says: str) -> None:
    with pytest.raises(Refused, match=says):
        read(written(tmp_path, content))


@pytest.mark.slow
def test_a_packed_file_is_as_long_as_what_it_holds(tmp_path: Path) -> None:
    packed = gzip.compress((PLAIN + "3,0,0,0\n" * 200_000).encode(), mtime=0)
    assert len(packed) < 10_000
    with pytest.raises(Refused, match=r"no_file: .*its unpacked content is too long"):
        read_columns(written(tmp_path, packed), Header(tuple(HEAD)), 1)


@pytest.mark.parametrize(("mark", "at"), [("1e10", 9), ("-9999", 150)])
def test_a_loggers_mark_of_a_missing_value_is_no_wrong_unit(tmp_path: Path, mark: str, at: int) -> None:
    rows = [f"{n / 100},0.0{n % 7},-1.5,1.{n % 10}" for n in range(300)]
    rows[at] = f"{at / 100},0,{mark},1"
    content = "\n".join([",".join(HEAD), *rows]).encode()
    with pytest.raises(
        Refused, match=f"not_a_number: .* 1 samples that no gyroscope can read; .*sample {at + 1}, .*y_rad_s"
    ):
        read(written(tmp_path, content))
    mapped = MappedColumns({"time_s": ("time_s", 1.0)}, missing=(mark,))
    with pytest.raises(Refused, match=f"line {at + 2}: y_rad_s is blank"):
        read(written(tmp_path, content), mapped)


@pytest.mark.parametrize("value", [-3735, 293.15])
def test_counts_and_kelvins_are_no_temperature(tmp_path: Path, value: float) -> None:
    head = [*HEAD, "temperature_c"]
    content = "\n".join([",".join(head), *(f"{row},{value}" for row in ROWS)]).encode()
    with pytest.raises(Refused, match=r"wrong_unit: .*30 samples whose temperature_c is not a temperature"):
        read(written(tmp_path, content))
