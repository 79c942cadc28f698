"""`rig lines` looks at a device that lies still, then is turned: the section is right, or says what it cannot tell."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numpy as np
import pytest
import yaml

from rig.config.sensors.lines_section import LinesSection
from rig.sensors.lines.guessed_section import section
from rig.sensors.lines.guessing import Guess, find_temperature, guess
from rig.sensors.lines.shape import NoShape, Shape, TimedLine, find_shape
from support.wires.printed_lines import add_checksum

G = 9.80665
STILL_S, LASTS_S = 4.0, 10.0
Row = dict[str, float]


@dataclass(frozen=True)
class Format:
    """How a device prints a row of SI values, and what of the section must come of it; `gaps` may stand open."""

    line: Callable[[Row], bytes]
    columns: str
    wanted: dict[str, Any]
    gaps: tuple[str, ...] = ()
    rate_hz: float = 100.0
    before: tuple[str, ...] = field(default=())


@cache
def moved(rate_hz: float) -> list[Row]:
    """What a device reads that lies still, and is turned about one axis after the other by half a turn and back."""
    rng = np.random.default_rng(1)
    times = np.arange(int(LASTS_S * rate_hz)) / rate_hz
    axis = np.eye(3)[np.minimum(((times - STILL_S) / 2).astype(int), 2)]
    speed = np.where(times > STILL_S, np.pi * np.pi / 2 * np.sin(np.pi * (times - STILL_S)), 0.0)
    rates = axis * speed[:, None]
    up = np.empty_like(rates)
    attitude = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    attitude *= np.sign(np.linalg.det(attitude))
    for place, rate in enumerate(rates):
        angle = np.linalg.norm(rate) / rate_hz
        if angle:
            x, y, z = rate / np.linalg.norm(rate)
            cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
            attitude = attitude @ (np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)
        up[place] = attitude.T @ [0, 0, 1]
    field_ut = -43.0 * up  # where it points straight down
    rates = rates + rng.normal(0, 0.004, rates.shape) + [0.01, -0.02, 0.015]
    forces = G * (1.005 * up + [0.01, -0.008, 0.012]) + rng.normal(0, 0.02, up.shape)
    field_ut += rng.normal(0, 0.2, field_ut.shape)
    return [
        {"t": 3.5 + t, "n": float(n), "temp": 27.3 + 0.02 * np.sin(t) + rng.normal(0, 0.01)}
        | dict(zip(("gx", "gy", "gz"), rates[n], strict=True))
        | dict(zip(("ax", "ay", "az"), forces[n], strict=True))
        | dict(zip(("mx", "my", "mz"), field_ut[n], strict=True))
        for n, t in enumerate(times)
    ]


def arrived(row_format: Format) -> list[TimedLine]:
    """The lines, in heaps of 8 ms, with half a line and what a boot prints before."""
    rows = moved(row_format.rate_hz)
    lines = [TimedLine(0.0, "3,0.1"), *(TimedLine(0.0, text) for text in row_format.before)]
    for row in rows:
        at_s = np.ceil((row["t"] - 3.5) / 0.008) * 0.008 + 0.002
        lines.append(TimedLine(float(at_s), row_format.line(row).decode().strip("\r\n")))
    return lines[1:]


def deg(row: Row) -> tuple[float, ...]:
    return tuple(np.degrees(row[axis]) for axis in ("gx", "gy", "gz"))


def g(row: Row) -> tuple[float, ...]:
    return tuple(row[axis] / G for axis in ("ax", "ay", "az"))


def si(row: Row, kind: str) -> tuple[float, ...]:
    return tuple(row[kind + axis] for axis in "xyz")


def counts(values: tuple[float, ...], per_unit: float) -> tuple[int, ...]:
    return tuple(round(value * per_unit) for value in values)


def text(form: str, *values: float) -> bytes:
    return (form % values).encode() + b"\r\n"


US, MS = {"time": {"unit": "us"}}, {"time": {"unit": "ms"}}
DEG, G_UNIT = {"rate": {"unit": "deg/s"}}, {"acceleration": {"unit": "g"}}
IMU = "gx gy gz ax ay az"
FORMATS = {
    "micros, °/s, g": Format(
        lambda r: text("%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", 1e6 * r["t"], *deg(r), *g(r)), f"time {IMU}",
        US | {"rate": {"unit": "deg/s", "decimals": 3}, "acceleration": {"unit": "g", "decimals": 4}}),
    "millis, rad/s, m/s²": Format(
        lambda r: text("%d,%.5f,%.5f,%.5f,%.4f,%.4f,%.4f", 1e3 * r["t"], *si(r, "g"), *si(r, "a")), f"time {IMU}",
        MS | {"rate": {"unit": "rad/s"}, "acceleration": {"unit": "m/s2"}}),
    "seconds, semicolons, accelerometer first": Format(
        lambda r: text("%.4f; %.4f; %.4f; %.4f; %.3f; %.3f; %.3f", r["t"], *g(r), *deg(r)), "time ax ay az gx gy gz",
        {"time": {"unit": "s", "wrap": 0}, "separator": "semicolon"} | DEG | G_UNIT),
    "tabs, mdeg/s, mg": Format(
        lambda r: text("%d\t%.0f\t%.0f\t%.0f\t%.1f\t%.1f\t%.1f", 1e6 * r["t"], *(1e3 * v for v in deg(r)),
                       *(1e3 * v for v in g(r))), f"time {IMU}",
        US | {"separator": "tab", "rate": {"unit": "mdeg/s", "decimals": 0}, "acceleration": {"unit": "mg"}}),
    "spaces, mrad/s": Format(
        lambda r: text("%d %.2f %.2f %.2f %.4f %.4f %.4f", 1e6 * r["t"], *(1e3 * v for v in si(r, "g")), *g(r)),
        f"time {IMU}", US | {"separator": "space", "rate": {"unit": "mrad/s"}} | G_UNIT),
    "counts of an MPU-6050": Format(
        lambda r: text("%d,%d,%d,%d,%d,%d,%d", 1e6 * r["t"], *counts(g(r), 16384), *counts(deg(r), 65.5)),
        "time ax ay az gx gy gz",
        US | {"rate": {"unit": "deg/s", "scale": 1 / 65.5, "decimals": 0},
              "acceleration": {"unit": "g", "scale": 1 / 16384, "decimals": 0}}),
    "counts of an LSM6DS": Format(
        lambda r: text("%d,%d,%d,%d,%d,%d,%d", 1e3 * r["t"], *counts(deg(r), 1 / 0.035), *counts(g(r), 8192)),
        f"time {IMU}",
        MS | {"rate": {"unit": "deg/s", "scale": 0.035}, "acceleration": {"unit": "g", "scale": 1 / 8192}}),
    "a sequence and micros": Format(
        lambda r: text("%d,%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", r["n"], 1e6 * r["t"], *deg(r), *g(r)),
        f"sequence time {IMU}", US | DEG | G_UNIT),
    "a sequence of a byte, no time": Format(
        lambda r: text("%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", r["n"] % 256, *deg(r), *g(r)), f"sequence {IMU}",
        {"sequence_wrap": 256, "clock": "counted"} | DEG | G_UNIT, ("when it took a sample",)),
    "neither": Format(
        lambda r: text("%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", *deg(r), *g(r)), IMU,
        {"clock": "arrival"} | DEG | G_UNIT, ("when it took a sample",)),
    "NMEA": Format(
        lambda r: add_checksum(
            text("$IMU,%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", 1e6 * r["t"], *deg(r), *g(r)).decode().strip()
        ), f"time {IMU}",
        US | {"prefix": "$IMU,", "checksum": "nmea"} | DEG | G_UNIT),
    "the serial plotter's names": Format(
        lambda r: text("gx:%.3f,gy:%.3f,gz:%.3f,ax:%.4f,ay:%.4f,az:%.4f,ms:%d", *deg(r), *g(r), 1e3 * r["t"]),
        f"{IMU} time", MS | {"keys": ["gx:", "gy:", "gz:", "ax:", "ay:", "az:", "ms:"]} | DEG | G_UNIT),
    "JSON": Format(
        lambda r: text('{"t":%d,"acc_x":%.3f,"acc_y":%.3f,"acc_z":%.3f,"gyr_x":%.5f,"gyr_y":%.5f,"gyr_z":%.5f}',
                       1e6 * r["t"], *si(r, "a"), *si(r, "g")), "time ax ay az gx gy gz",
        US | {"rate": {"unit": "rad/s"}, "acceleration": {"unit": "m/s2"},
              "keys": ['"t":', '"acc_x":', '"acc_y":', '"acc_z":', '"gyr_x":', '"gyr_y":', '"gyr_z":']}),
    "names with =": Format(
        lambda r: text("n=%d wx=%.4f wy=%.4f wz=%.4f fx=%.3f fy=%.3f fz=%.3f us=%d", r["n"], *si(r, "g"),
                       *si(r, "a"), 1e6 * r["t"]), f"sequence {IMU} time",
        US | {"rate": {"unit": "rad/s"}, "acceleration": {"unit": "m/s2"}}),
    "a header with units, no accelerometer": Format(
        lambda r: text("%d,%.3f,%.3f,%.3f", 1e6 * r["t"], *deg(r)), "time gx gy gz", US | DEG,
        before=("booting", "time_us,gyro_x [deg/s],gyro_y [deg/s],gyro_z [deg/s]")),
    "no accelerometer, no header": Format(
        lambda r: text("%d,%.3f,%.3f,%.3f", 1e6 * r["t"], *deg(r)), "time gx gy gz", US | {"rate": {"unit": "?"}},
        ("lines.rate.unit",)),
    "ten axes": Format(
        lambda r: text("%d,%.4f,%.4f,%.4f,%.3f,%.3f,%.3f,%.2f,%.2f,%.2f,%.2f", 1e6 * r["t"], *g(r), *deg(r),
                       *si(r, "m"), r["temp"]), "time ax ay az gx gy gz mx my mz temperature",
        US | {"field": {"unit": "uT"}} | DEG | G_UNIT),
    "1000 Hz by millis": Format(
        lambda r: text("%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", 1e3 * r["t"] + 0.5, *deg(r), *g(r)), f"time {IMU}",
        {"time": {"unit": "?"}} | DEG | G_UNIT, ("counts samples or ms",), rate_hz=1000),
    "micros that wrap at a byte of bits": Format(
        lambda r: text("%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", (1e6 * r["t"]) % 2**22, *deg(r), *g(r)), f"time {IMU}",
        {"time": {"unit": "us", "wrap": 2**22}} | DEG | G_UNIT),
    "a separator behind the last, a date and a clock before": Format(
        lambda r: text("2026-11-28,12:31:%05.2f,%d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f,", r["t"], 1e6 * r["t"], *deg(r),
                       *g(r)),
        f"- - time {IMU}", US | DEG | G_UNIT),
    "ESP-IDF's log, in green": Format(
        lambda r: text("\033[0;32mI (%d) imu: %d,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f\033[0m", 1e3 * r["t"], 1e6 * r["t"],
                       *deg(r), *g(r)), f"time {IMU}",
        US | {"prefix": "I (*) imu: "} | DEG | G_UNIT),
    "seconds with two decimals": Format(
        lambda r: text("%.2f,%.3f,%.3f,%.3f,%.4f,%.4f,%.4f", r["t"] - 0.005, *deg(r), *g(r)), f"time {IMU}",
        {"time": {"unit": "s", "wrap": 0}} | DEG | G_UNIT, rate_hz=200),
    "an unknown scale, and a battery's voltage": Format(
        lambda r: text("%d,%d,%d,%d,%.3f,%.3f,%.3f,%.1f", 1e6 * r["t"], *counts(deg(r), 50.0), *si(r, "a"), 3.7),
        f"time {IMU} -", US | {"rate": {"unit": "?"}, "acceleration": {"unit": "m/s2"}},
        ("lines.rate.unit", "the gyroscope's scale", "what column 8 is, about 3.7")),
}  # fmt: skip


BESIDE = {
    "the registers of an MPU-6050, with its thermometer between": Format(
        lambda r: text("%d,%d,%d,%d,%d,%d,%d,%d", 1e6 * r["t"], *counts(g(r), 16384), (r["temp"] - 36.53) * 340,
                       *counts(deg(r), 131)), "time ax ay az - gx gy gz", {"rate": {"scale": 1 / 131}}),
    "angles before": Format(
        lambda r: text("%d,%.2f,%.2f,%.2f,%.4f,%.4f,%.4f,%.3f,%.3f,%.3f", 1e6 * r["t"],
                       *(90 * (v - at_rest) for v, at_rest in zip(g(r), g(moved(100.0)[0]), strict=True)), *g(r),
                       *deg(r)),
        "time - - - ax ay az gx gy gz", {"rate": {"unit": "deg/s"}}),
}  # fmt: skip


@pytest.mark.parametrize("name", BESIDE)
def test_the_gyroscope_is_the_triad_as_which_gravity_rotates(name: str) -> None:
    wanted = BESIDE[name]
    found = guess(find_shape(arrived(wanted)), STILL_S)
    assert found.columns == wanted.columns.split()
    for key, value in wanted.wanted["rate"].items():
        assert found.units["g"][key] == (value if isinstance(value, str) else pytest.approx(value))


def inspect_file(name: str) -> tuple[Shape, Guess]:
    shape = find_shape(arrived(FORMATS[name]))
    return shape, guess(shape, STILL_S)


@pytest.mark.one_in(4)
@pytest.mark.slow
@pytest.mark.parametrize("name", FORMATS)
def test_the_section_is_right_or_states_what_is_unknown(name: str) -> None:
    wanted = FORMATS[name]
    shape, found = inspect_file(name)
    document = yaml.safe_load(section(shape, found, "/dev/ttyUSB0", 115200))["sensors"]["imu"]
    lines = document["lines"]
    assert lines["columns"] == wanted.columns.split()
    assert document["rate_hz"] == wanted.rate_hz
    for key, value in wanted.wanted.items():
        if isinstance(value, dict):
            for each, told in value.items():
                seen = lines[key].get(each, 1)
                assert seen == (told if isinstance(told, str) else pytest.approx(told, rel=1e-6)), (key, each)
        else:
            assert lines.get(key, "comma" if key == "separator" else None) == value, key
    for gap in wanted.gaps:
        assert any(gap in each for each in found.gaps), (gap, found.gaps)
    if not wanted.gaps:
        assert found.gaps == []
    text_of_it = yaml.safe_dump(lines).replace("'?'", "us" if lines.get("time", {}).get("unit") == "?" else "deg/s")
    LinesSection.model_validate(yaml.safe_load(text_of_it))


def test_what_is_no_sample_a_line_is_said_to_be_none() -> None:
    lines = [TimedLine(0.01 * n, ("gyro: 1 2 3", "acc: 4 5", "status ok")[n % 3]) for n in range(300)]
    with pytest.raises(NoShape, match="look alike"):
        find_shape(lines)
    with pytest.raises(NoShape, match="which is too few"):
        find_shape(lines[:5])


HARM: dict[str, tuple[Callable[[int], str], str]] = {
    "numbers beyond all": (lambda n: f"{n},1e400,-1e400,0.{n}", "numbers that no sensor measures: 1e400"),
    "ten thousand columns": (lambda n: ",".join(["0.5"] * 10_000), "longer than 2000 characters"),
    "a hundred columns": (lambda n: ",".join(["0.5"] * 100), "a line holds 100 numbers"),
    "a key that writes on the terminal": (lambda n: f"\x1b[2J{n} a{n} b{n}", "has nothing in common|stands|look alike"),
    "a key of a megabyte": (lambda n: "k" * 1_000_000 + f"{n},{n},{n}", "longer than 2000 characters"),
}


@pytest.mark.slow
@pytest.mark.parametrize("harm", HARM)
def test_lines_that_no_device_prints_are_refused_at_once(harm: str) -> None:
    line, why = HARM[harm]
    with pytest.raises(NoShape, match=why) as refused:
        guess(find_shape([TimedLine(0.01 * n, line(n)) for n in range(1, 61)]), STILL_S)
    assert len(str(refused.value)) < 200 and str(refused.value).isprintable()


def test_one_impossible_number_costs_its_line_and_a_silent_device_is_reported() -> None:
    lines = [TimedLine(0.01 * n, f"{n},{n % 7},{n % 5},0.{n}") for n in range(1000)]
    lines[500] = TimedLine(5.0, "500,1e400,2,3")
    shape = find_shape(lines)
    assert len(shape.values) == 999 and shape.others == 1
    assert guess(shape, STILL_S).columns[0] == "sequence"
    with pytest.raises(NoShape, match="only 0 of its lines came while it lay still"):
        guess(shape, 0.0)


@pytest.mark.parametrize(("mean", "name"), [(9, "-"), (11, "temperature"), (59, "temperature"), (61, "-")])
def test_a_nearly_constant_column_without_a_name_is_the_temperature_from_10_to_60(mean: float, name: str) -> None:
    values = mean + 0.1 * np.sin(np.arange(50.0))[:, None]
    guessed = Guess(["-"])
    shape = Shape("comma", "", (), False, (), values, np.arange(50.0), (-1,), 0)
    find_temperature(shape, guessed, np.ones(50, np.bool_))
    assert guessed.columns == [name]
