"""Lines of text become numbers: exactly what was printed, and nothing else."""

from typing import Any

import numpy as np
import pytest

from rig.config.sensors.lines_section import LinesSection
from rig.sensors.lines.decoding import LineBatch, LineReader
from support.wires.printed_lines import add_checksum, lines_section

THREE: dict[str, Any] = {"columns": ("gx", "gy", "gz"), "time": None, "acceleration": None, "clock": "arrival"}


def read(section: LinesSection, data: bytes, piece: int = 10**6) -> tuple[np.ndarray, list[LineBatch]]:
    """All values of `data`, which comes in pieces after the end of a line that had begun before."""
    reader = LineReader(section)
    data = b"half a line\n" + data
    found = [reader.feed(data[at : at + piece]) for at in range(0, len(data), piece)]
    return np.concatenate([each.values for each in found]), found


@pytest.mark.parametrize("piece", [1, 7, 100, 10**6])
def test_numbers_are_exactly_what_was_printed_in_pieces_of_any_size(piece: int) -> None:
    rng = np.random.default_rng(piece)
    rows = np.column_stack([np.arange(60) * 10_000, rng.normal(0, 300, (60, 6)).round(rng.integers(0, 9))])
    text = b"".join(",".join(repr(float(v)) for v in row).encode() + b"\r\n" for row in rows)
    values, _ = read(lines_section(), text, piece)
    assert np.array_equal(values, rows)


@pytest.mark.parametrize(
    ("section", "line"),
    [
        ({}, b"1.5,-2,+3e-05"),
        ({}, b" 1.5 , -2,3e-5 "),
        ({"separator": "semicolon"}, b"1.5;-2.;.00003"),
        ({"separator": "tab"}, b"1.5\t-2\t3E-05"),
        ({"separator": "space"}, b"  1.5   -2 0.00003"),
        ({"prefix": "$IMU,"}, b"$IMU,1.5,-2,0.00003"),
        ({"prefix": "$IMU,", "checksum": "nmea"}, add_checksum("$IMU,1.5,-2,0.00003").strip()),
        ({"keys": ("gx:", "gy:", "gz:")}, b"gx:1.5,gy:-2,gz:0.00003"),
        ({"keys": ("x=", "yx=", "zyx=")}, b"x=1.5 yx=-2 zyx=0.00003"),
        ({"keys": ('"gx":', '"gy":', '"gz":')}, b'{"gx":1.5, "gy": -2, "gz":3e-05}'),
    ],
)  # fmt: skip
def test_the_usual_ways_to_print(section: dict[str, Any], line: bytes) -> None:
    values, _ = read(lines_section(**THREE, **section), line + b"\n" + line + b"\r\n")
    assert values.tolist() == [[1.5, -2.0, 3e-05]] * 2


NAN = float("nan")


@pytest.mark.parametrize(
    ("section", "line", "values"),
    [
        ({}, b"1.5,-2,3,", [1.5, -2, 3]),
        ({"separator": "semicolon"}, b"1.5; -2; 3; ", [1.5, -2, 3]),
        ({}, b"\x1b[0;32m1.5,-2,3\x1b[0m", [1.5, -2, 3]),
        ({"prefix": "I (*) imu: "}, b"\x1b[0;32mI (40917) imu: 1.5,-2,3\x1b[0m", [1.5, -2, 3]),
        ({"columns": ("-", "-", "gx", "gy", "gz")}, b"2026-11-28,12:31:07.5,1.5,-2,3,", [NAN, NAN, 1.5, -2, 3]),
        ({"columns": ("-", "gx", "gy", "gz"), "separator": "tab"}, b"run 7\t1.5\t-2\t3", [NAN, 1.5, -2, 3]),
        ({"columns": ("gx", "gy", "gz", "temperature")}, b"1.5,-2,3,nan", [1.5, -2, 3, NAN]),
        ({"columns": ("gx", "gy", "gz", "temperature")}, b"1.5,-2,3,", [1.5, -2, 3, NAN]),
        ({"columns": ("gx", "gy", "gz", "temperature")}, b"1.5,-2,3,,", [1.5, -2, 3, NAN]),
        ({"columns": ("temperature", "gx", "gy", "gz")}, b"NULL,1.5,-2,3", [NAN, 1.5, -2, 3]),
        (
            {"columns": ("gx", "gy", "gz", "temperature"), "keys": ("gx:", "gy:", "gz:", "t:")},
            b"gx:1.5 gy:-2 gz:3 t:null",
            [1.5, -2, 3, NAN],
        ),
    ],
)
def test_what_stands_around_the_numbers_and_what_is_none_costs_no_sample(
    section: dict[str, Any], line: bytes, values: list[float]
) -> None:
    found, _ = read(lines_section(**{**THREE, "temperature": None, **section}), (line + b"\r\n") * 2)
    np.testing.assert_array_equal(found, [values] * 2)


@pytest.mark.parametrize(
    ("section", "line"),
    [
        ({}, b"1,2"), ({}, b"1,2,3,4"), ({}, b"1,,2,3"), ({}, b"1,2,"), ({}, b",1,2 3"), ({}, b"1 2,3"), ({}, b"1,2,x"),
        ({}, b"1,2,3-4"), ({}, b"1.2.3,2,3"), ({}, b"-,2,3"), ({}, b".,2,3"), ({}, b"1,2,--3"), ({}, b"1,2,nan"),
        ({}, b"1,2,1e999"), ({}, b"1,2,\xff3"), ({}, b"1;2;3"), ({"separator": "space"}, b"1 2-3"),
        ({"prefix": "$IMU,"}, b"$GPS,1,2,3"), ({"prefix": "$IMU,"}, b"1,2,3"),
        ({"keys": ("a:", "b:", "c:")}, b"a:1,c:2,b:3"), ({"keys": ("a:", "b:", "c:")}, b"a:1,b:2,d:3"),
        ({"keys": ("a:", "b:", "c:")}, b"1,2,3"), ({"keys": ("a:", "b:", "c:")}, b"\x801,\x812,\x823"),
        ({"checksum": "nmea"}, b"1,2,3"), ({"checksum": "nmea"}, b"1,2,3*00"), ({"checksum": "nmea"}, b"1,2,3*0"),
    ],
)  # fmt: skip
def test_what_is_no_sample_is_counted_and_costs_no_other(section: dict[str, Any], line: bytes) -> None:
    told = lines_section(**THREE, **section)
    keys = section.get("keys", ("",) * 3)
    body = section.get("prefix", "") + ",".join(key + value for key, value in zip(keys, "789", strict=True))
    body = body if section.get("separator") != "space" else "7 8 9"
    good = add_checksum(body) if told.checksum == "nmea" else body.encode() + b"\n"
    values, (found,) = read(told, good + line + b"\n# 1,2,3\n\n" + good)
    assert values.tolist() == [[7, 8, 9]] * 2
    assert (found.samples_before.tolist(), found.comments, found.first_rejected) == ([1], 1, line)


def test_the_first_line_is_left_out_for_it_may_be_half_of_one() -> None:
    """A number whose first digits are missing looks like any other."""
    assert LineReader(lines_section(**THREE)).feed(b"23,1,2\n123,1,2\n").values.tolist() == [[123, 1, 2]]


def test_what_has_no_end_is_no_line() -> None:
    reader = LineReader(lines_section(**THREE))
    for _ in range(100):
        reader.feed(b"1,2,3," * 100)
    assert len(reader.feed(b"\n1,2,3\n").values) == 1


def damaged(count: int, seed: int) -> tuple[bytes, np.ndarray, list[int]]:
    """So many lines with a sum, of each of which one or several bytes are wrong; what was printed; bytes wrong."""
    rng = np.random.default_rng(seed)
    readings = rng.normal(0, 50, (count, 6))
    lines = []
    sizes = []
    for number, row in enumerate(readings):
        line = bytearray(add_checksum(f"$IMU,{number * 1000}," + ",".join(f"{each:.2f}" for each in row))[:-2])
        size = int(rng.integers(1, 6))
        for place in rng.choice(np.arange(1, len(line)), size, replace=False):
            line[place] ^= int(rng.integers(1, 256))
        lines.append(bytes(line) + b"\n")
        sizes.append(size)
    return b"".join(lines), readings, sizes


@pytest.mark.slow
@pytest.mark.parametrize("count", [6_000, pytest.param(1_000_000, marks=[pytest.mark.proof, pytest.mark.thorough])])
def test_damaged_lines_pass_a_sum_no_oftener_than_one_in_256(count: int) -> None:
    """One wrong byte never passes; several do by chance, and most of what does is no number any more."""
    section = lines_section(prefix="$IMU,", checksum="nmea")
    passed = counted = 0
    for seed in range(0, count, 2000):
        data, readings, _ = damaged(min(2000, count), seed)
        values, (found,) = read(section, data)
        # A number written another way (01 for 1) is no wrong reading.
        true = {row.round(2).tobytes() for row in readings}
        passed += sum(row[1:].tobytes() not in true for row in values)
        counted += len(values) + len(found.samples_before) + found.comments
    print(f"{passed} of {count} damaged lines passed, {count // 256} may; {counted} counted")
    assert counted >= count, "all are counted; a byte that becomes an end makes two lines of one"
    assert passed <= count / 256
    one_byte = b"".join(
        bytes([*line[:place], line[place] ^ 1 << bit, *line[place + 1 :]])
        for line in [add_checksum("$IMU,1000,1.25,-2.50,3.75,0.01,-0.02,0.98")]
        for place in range(1, len(line) - 2)
        for bit in range(8)
    )
    values, _ = read(section, one_byte)
    assert (values == [1000, 1.25, -2.5, 3.75, 0.01, -0.02, 0.98]).all(), "a digit of the sum in small letters"
