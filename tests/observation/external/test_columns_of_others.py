"""A map of columns says what a file of another program holds: by number, step, sign, rate, clock and convention."""

from pathlib import Path

import numpy as np
import pytest

from rig.config.column_map import ColumnMap
from rig.data.quantity import RATE
from rig.errors import Refused
from rig.observation.external.attitude_import import read_attitudes
from rig.observation.external.csv_samples import Samples, read_sample_table, samples_in
from rig.observation.formats.column_selection import map_motion, map_samples

TIME_S = np.arange(40) * 0.25
RATES = np.column_stack([np.sin(TIME_S), np.cos(TIME_S), 0.1 * TIME_S])
AXES = ("x_rad_s", "y_rad_s", "z_rad_s")


def write(folder: Path, heading: str, times: list[str], rates: np.ndarray = RATES, divided: str = ",") -> Path:
    rows = [
        divided.join([*time, *(f"{rate:.9g}" for rate in row)]) for time, row in zip(cells(times), rates, strict=True)
    ]
    path = folder / "log.csv"
    path.write_text("\n".join([*([heading] if heading else []), *rows]) + "\n", encoding="utf-8")
    return path


def cells(times: list[str]) -> list[list[str]]:
    return [[time] if time else [] for time in times]


def in_seconds() -> list[str]:
    return [f"{time_s:.3f}" for time_s in TIME_S]


def named(**more: object) -> dict[str, dict[str, object]]:
    return {"time_s": {"column": "t"}, **{name: {"column": f"g{name[0]}", **more} for name in AXES}}


def read(path: Path, columns: dict[str, object]) -> Samples:
    table = read_sample_table(path, [RATE], map_samples(ColumnMap.model_validate(columns)))
    return samples_in(table.columns, str(path))


def check(samples: Samples, times_s: np.ndarray = TIME_S) -> None:
    assert samples.time_s - samples.time_s[0] == pytest.approx(times_s - times_s[0], abs=1e-6)
    assert samples.readings[RATE] == pytest.approx(RATES, rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("divided", [",", ";", "  ", "\t"])
def test_columns_have_numbers_where_a_file_has_no_heading(divided: str, tmp_path: Path) -> None:
    columns = {"time_s": {"column": 1}, **{name: {"column": 2 + index} for index, name in enumerate(AXES)}}
    check(read(write(tmp_path, "", in_seconds(), divided=divided), {"samples": columns}))


def test_a_name_that_stands_twice_is_chosen_by_its_number(tmp_path: Path) -> None:
    path = write(tmp_path, "t,gx,gy,gz,gx,gy,gz", in_seconds(), np.hstack([RATES + 1, RATES]))
    with pytest.raises(Refused, match=r"has the column 'gx' 2 times, as columns 2 and 5.* Give the number"):
        read(path, {"samples": named()})
    check(
        read(path, {"samples": {"time_s": {"column": "t"}, **{name: {"column": 5 + i} for i, name in enumerate(AXES)}}})
    )


@pytest.mark.parametrize("step", [{"factor": 1 / 16.4}, {"lsb_per_unit": 16.4}])
def test_steps_of_a_converter_have_a_size(step: dict[str, float], tmp_path: Path) -> None:
    path = write(tmp_path, "t,gx,gy,gz", in_seconds(), np.degrees(RATES) * 16.4)
    check(read(path, {"samples": named(unit="deg/s", **step)}))


def test_a_mirrored_axis_has_a_negative_factor(tmp_path: Path) -> None:
    columns = named()
    columns["y_rad_s"]["factor"] = -1
    check(read(write(tmp_path, "t,gx,gy,gz", in_seconds(), RATES * [1, -1, 1]), {"samples": columns}))


def test_a_rate_stands_for_times(tmp_path: Path) -> None:
    columns = {name: column for name, column in named().items() if name != "time_s"}
    check(read(write(tmp_path, "gx,gy,gz", [""] * len(RATES)), {"samples": columns, "samples_rate_hz": 4}))


def spelt(before: str, after: str, half: tuple[str, str] = ("", "")) -> list[str]:
    """Four times a second: from two seconds before a full minute that ends as `before`, then on from `after`."""
    fractions = [f"{index // 4}.{25 * (index % 4):02d}" for index in range(40)]
    first = [f"{before}:5{8 + index // 4}.{25 * (index % 4):02d}{half[0]}" for index in range(8)]
    return first + [f"{after}:0{fraction}{half[1]}" for fraction in fractions[:32]]


@pytest.mark.parametrize(
    "times",
    [
        spelt("2026-11-28T23:59", "2026-11-29 00:00"),
        spelt("2026-11-28T23:59", "2026-11-29T01:00", ("Z", "+0100")),
        spelt("23:59", "0:00"),
        spelt("11:59", "12:00", (" AM", " PM")),
        spelt("59", "60"),
    ],
    ids=["ISO 8601, over midnight", "zones", "time of day, over midnight", "twelve hours", "minutes"],
)
def test_a_time_may_be_a_text(times: list[str], tmp_path: Path) -> None:
    check(read(write(tmp_path, "t,gx,gy,gz", times), {"samples": named()}))


def test_a_text_of_time_has_no_unit(tmp_path: Path) -> None:
    path = write(tmp_path, "t,gx,gy,gz", [f"0:00:0{time_s:.2f}" for time_s in TIME_S])
    columns = named() | {"time_s": {"column": "t", "unit": "ms"}}
    with pytest.raises(Refused, match="not_a_number"):
        read(path, {"samples": columns})


def test_a_counter_goes_on_where_it_begins_again(tmp_path: Path) -> None:
    ticks = [str((65_000 + 250 * index) % 65_536) for index in range(40)]
    columns = named() | {"time_s": {"column": "t", "unit": "ms", "wraps_at": 65_536}}
    check(read(write(tmp_path, "t,gx,gy,gz", ticks), {"samples": columns}))


def test_texts_that_stand_for_a_missing_value_leave_their_row_out(tmp_path: Path) -> None:
    path = write(tmp_path, "t,gx,gy,gz", in_seconds())
    path.write_text(path.read_text("utf-8").replace("\n0.250,", "\n0.250,NaN,NaN,NaN\n0.251,"), encoding="utf-8")
    with pytest.raises(Refused, match=r"not_a_number: .*line 3"):
        read(path, {"samples": named()})
    times_s = TIME_S.copy()
    times_s[1] += 0.001
    check(read(path, {"samples": named(), "samples_missing": ["NaN"]}), times_s)


def poses(folder: Path, sign: float = 1.0) -> Path:
    half = TIME_S / 4
    path = folder / "poses.csv"
    rows = [f"{t:.2f},{sign * np.sin(a):.12g},0,0,{np.cos(a):.12g}" for t, a in zip(TIME_S, half, strict=True)]
    path.write_text("\n".join(["stamp,x,y,z,w", *rows]) + "\n", encoding="utf-8")
    return path


POSES = {"time_s": {"column": "stamp"}, **{f"q{axis}": {"column": axis} for axis in "wxyz"}}


def test_one_time_of_a_pose_is_a_moment_around_it(tmp_path: Path) -> None:
    rows = read_attitudes(poses(tmp_path), map_motion(ColumnMap.model_validate({"motion": POSES})))
    assert (rows["start_s"] + rows["end_s"]) / 2 == pytest.approx(TIME_S, abs=1e-9)
    assert (rows["end_s"] - rows["start_s"]).max() < 0.5, "a longer row would declare a rest"
    assert rows["qw"] == pytest.approx(np.cos(TIME_S / 4)) and rows["qx"] == pytest.approx(np.sin(TIME_S / 4))


def test_a_counter_of_poses_that_restarts_goes_on(tmp_path: Path) -> None:
    path = poses(tmp_path)
    heading, *rows = path.read_text(encoding="utf-8").splitlines()
    counted_s = np.mod(TIME_S + 60, 65.536)
    later = [f"{time_s:.6f},{row.partition(',')[2]}" for time_s, row in zip(counted_s.tolist(), rows, strict=True)]
    path.write_text("\n".join([heading, *later]) + "\n", encoding="utf-8")
    found = read_attitudes(path, map_motion(ColumnMap.model_validate({"motion": POSES})))
    assert (found["start_s"] + found["end_s"]) / 2 == pytest.approx(60 + TIME_S, abs=1e-6)


def test_comments_below_the_readings_are_no_rows(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = [f"{t:.2f},0.1,0.2,0.3" for t in TIME_S]
    ends = ["% Maximums : 0.1 0.2 0.3", "# done, 40 rows", "// end"]
    path.write_text("\n".join(["time_s,x_rad_s,y_rad_s,z_rad_s", *rows, *ends]) + "\n", encoding="utf-8")
    assert len(read_sample_table(path, [RATE], None).columns["x_rad_s"]) == len(TIME_S)


def test_poses_without_times_have_those_of_their_rate(tmp_path: Path) -> None:
    columns = {"motion": {name: column for name, column in POSES.items() if name != "time_s"}, "motion_rate_hz": 50}
    path = poses(tmp_path)
    lines = [line.partition(",")[2] for line in path.read_text(encoding="utf-8").splitlines()]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    rows = read_attitudes(path, map_motion(ColumnMap.model_validate(columns)))
    assert (rows["start_s"] + rows["end_s"]) / 2 == pytest.approx(np.arange(len(TIME_S)) / 50, abs=1e-9)


def test_quaternions_of_the_other_direction_are_inverted(tmp_path: Path) -> None:
    rows = read_attitudes(poses(tmp_path, -1), map_motion(ColumnMap.model_validate({"motion": POSES})), inverse=True)
    assert rows["qx"] == pytest.approx(np.sin(TIME_S / 4))


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ({"samples": named(factor=0)}, "must be between"),
        ({"samples": named(factor=2, lsb_per_unit=2)}, "factor or lsb_per_unit"),
        ({"samples": named(wraps_at=100)}, "only a counter of time"),
        ({"samples": named(), "samples_rate_hz": 100}, "or a rate, not both"),
    ],
)
def test_a_map_that_contradicts_itself_is_refused(columns: dict[str, object], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        ColumnMap.model_validate(columns)


def test_readings_and_poses_of_two_rates_may_share_a_file(tmp_path: Path) -> None:
    rows = [f"{t:.3f},0.1,0.2,0.3,,,," for t in TIME_S] + [f"{t + 0.001:.3f},,,,1,0,0,0" for t in TIME_S[::4]]
    rows.sort(key=lambda row: float(row.partition(",")[0]))
    path = tmp_path / "both.csv"
    path.write_text("\n".join(["time_s,x_rad_s,y_rad_s,z_rad_s,qw,qx,qy,qz", *rows]) + "\n", encoding="utf-8")
    columns = ColumnMap.model_validate(
        {"samples": {"time_s": {"column": "time_s"}}, "motion": {"time_s": {"column": 1}}}
    )
    table = read_sample_table(path, [RATE], map_samples(columns))
    assert len(table.columns["x_rad_s"]) == 40 and table.others == 10
    assert len(read_attitudes(path, map_motion(columns))["qw"]) == 10
