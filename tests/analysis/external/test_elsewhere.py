"""Readings from files go the way of a run: folder, certificates, history, notebook, exports."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pytest

import rig
from rig.cli import main
from rig.data.result_file import read_result
from rig.errors import Refused
from rig.report.certificate.content import certificate_of
from rig.report.certificate.statements import StatedFacts
from support.documents.certified import read
from support.documents.dcc_rules import rule_faults, schema_faults
from support.paths import DOCS

pytestmark = pytest.mark.slow

EXAMPLES = DOCS / "examples"
PLACE = ["--up=-z", "--gravity-m-s2", "9.80061", "--field-t", "47.98e-6"]


@dataclass(frozen=True)
class Example:
    """Two files of the examples, the options they are solved with, and the kinds of sensors that they tell."""

    samples: str
    motion: list[str]
    kinds: dict[str, str]


EXAMPLE = {
    "paper 2, at rest": Example(
        "still_samples.csv",
        ["--attitudes", "still_attitudes.csv", *PLACE, "--second-order"],
        {"acceleration": "accelerometer", "field": "magnetometer"},
    ),
    "paper 2, swinging": Example(
        "swinging_samples.csv", ["--attitudes", "swinging_attitudes.csv"], {"rate": "gyroscope"}
    ),
    "sweeps": Example("samples.csv", ["--sweeps", "sweeps.csv"], {"rate": "gyroscope"}),
}


@pytest.fixture(scope="module", params=EXAMPLE, ids=str)
def kept(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Example, Path]:
    example = EXAMPLE[request.param]
    folder = tmp_path_factory.mktemp("kept")
    how, motion, *options = example.motion
    told = ["--serial-number", "K-7", "--part", "kvh1775", "--recorded", "2026-11-20T09:00"]
    where = ["--out", str(folder / "run"), "--history", str(folder / "history.sqlite")]
    assert main(["solve", str(EXAMPLES / example.samples), how, str(EXAMPLES / motion), *options, *told, *where]) == 0
    return example, folder


@pytest.mark.thorough
def test_the_folder_holds_a_certificate_with_its_clauses(kept: tuple[Example, Path]) -> None:
    example, folder = kept
    certificate = certificate_of(read_result(folder / "run"), StatedFacts())
    page = read(certificate)
    assert certificate.number in (folder / "run" / "certificate.html").read_text(encoding="utf-8")
    text = " ".join(page.text.split())
    for kind in example.kinds.values():
        assert f"{kind.capitalize()} KVH1775, serial number K-7" in text
    for clause in ("7.8.2.1d", "7.8.2.1f", "7.8.2.1g", "7.8.2.1i", "7.8.2.1m", "7.8.4.1a", "7.8.4.1b", "7.8.4.1c"):
        assert page.under[clause].strip(), clause
    assert "2026-11-20" in page.under["7.8.2.1i"]
    assert example.samples in page.under["7.8.2.1f"] and "robot arm" not in text and "UR10e" not in text
    assert "No metrological traceability is claimed" in " ".join(page.under["7.8.4.1c"].split())


@pytest.mark.thorough
def test_attitudes_are_drawn_and_sweeps_in_the_notebook(kept: tuple[Example, Path]) -> None:
    example, folder = kept
    for kind in example.kinds.values():
        assert (folder / "run" / f"{kind}_imu.svg").exists() == (kind != "gyroscope")
    run = rig.load(folder / "run")
    if "rate" in example.kinds:
        read = np.genfromtxt(EXAMPLES / example.samples, delimiter=",", names=True)
        time_s, rates = run["imu"].on_arm_clock()
        np.testing.assert_array_equal(time_s, read["time_s"])
        np.testing.assert_array_equal(rates[:, 0], read["x_rad_s"])
    result = rig.solve(run)
    if example.samples == "swinging_samples.csv":  # a solution by increments keeps no residual of single rows
        with pytest.raises(Refused, match="nothing_to_plot"):
            result.plot()
        return
    picture = result.plot()
    picture.save(folder / "residuals.png")
    assert {axis.get_title("left").split(":")[0] for axis in picture.figure.axes} >= {
        f"imu, {kind}" for kind in example.kinds.values()
    }


@pytest.mark.one_in(2)  # of attitudes and of sweeps; what differs between two of attitudes is their numbers
def test_its_digital_certificate_is_valid(kept: tuple[Example, Path], capsys: pytest.CaptureFixture[str]) -> None:
    example, folder = kept
    history = ["--history", str(folder / "history.sqlite")]
    assert main(["report", str(folder / "run"), "--dcc", "--set", "site.country=DE", *history]) == 0
    xml = (folder / "run" / "certificate.xml").read_bytes()
    assert schema_faults(xml) == [] and rule_faults(xml) == []
    for kind in example.kinds.values():
        assert f"calibration of {kind} imu" in xml.decode()


def test_the_history_has_an_entry_of_each_sensor(
    kept: tuple[Example, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    example, folder = kept
    assert main(["history", "list", "--history", str(folder / "history.sqlite"), "--json"]) == 0
    said = capsys.readouterr().out
    assert all(f'"{quantity}"' in said for quantity in example.kinds) and "K-7" in said


@pytest.mark.thorough
def test_the_notebook_and_rig_solve_find_the_same_numbers(
    kept: tuple[Example, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    example, folder = kept
    document = read_result(folder / "run")
    result = rig.solve(rig.load(folder / "run"))
    entries = [*document.gyroscopes.values(), *document.accelerometers.values(), *document.magnetometers.values()]
    assert len(result) == len(entries) == len(example.kinds)
    for found, stated in zip(result.values(), entries, strict=True):
        np.testing.assert_allclose(found.scale, stated.scale, rtol=1e-12)  # pyrefly: ignore[missing-attribute]  # none is an error
    assert main(["solve", str(folder / "run"), "--json"]) == 0
    again = json.loads(capsys.readouterr().out)
    first = json.loads((folder / "run" / "result.json").read_text(encoding="utf-8"))
    again["provenance"].pop("solved_utc"), first["provenance"].pop("solved_utc")
    assert again == first


@pytest.mark.one_in(3)  # each format has its own tests
@pytest.mark.parametrize("name", ["px4", "ardupilot", "imucal", "kalibr", "csv", "parquet", "mat", "ros2"])
def test_it_is_exported_or_refused_by_name(
    name: str, kept: tuple[Example, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    example, folder = kept
    status = main(["export", str(folder / "run"), "--format", name, "--out", str(tmp_path / "out")])
    told = name in {"px4", "ardupilot", "csv", "parquet", "mat"} or "rate" in example.kinds
    assert status == (0 if told else 2)
    assert told or "rig: nothing_to_export: " in capsys.readouterr().err


@pytest.mark.one_in(4)
@pytest.mark.parametrize(
    ("command", "error"),
    [
        ("watch", "recorded_elsewhere"),
        ("reversal", "recorded_elsewhere"),
        ("solve --set observation.max_lost_fraction=0.5", "unknown_setting"),
        ("resume", "no_run"),
    ],
)
def test_what_needs_an_arm_says_that_there_is_none(
    command: str, error: str, kept: tuple[Example, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    name, *options = command.split()
    assert main([name, str(kept[1] / "run"), *options]) == 2
    assert capsys.readouterr().err.startswith(f"rig: {error}")


def test_how_a_sensor_of_files_drifts_is_read_off_its_own_readings(
    kept: tuple[Example, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["allan", str(kept[1] / "run")]) == 2
    assert capsys.readouterr().err.startswith("rig: not_at_rest: ")


def sweeps(*more: str) -> list[str]:
    return ["solve", str(EXAMPLES / "samples.csv"), "--sweeps", str(EXAMPLES / "sweeps.csv"), *more]


def test_whose_readings_nobody_said_are_in_no_history(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    history = tmp_path / "history.sqlite"
    assert main(sweeps("--out", str(tmp_path / "run"), "--history", str(history))) == 0
    said = capsys.readouterr()
    assert "not entered in a history" in said.err and not history.exists()
    assert said.out.startswith("gyroscope imu ") and "not stated" not in said.out
    assert main(sweeps("--out", str(tmp_path / "run"))) == 2
    assert "rig: run_folder: " in capsys.readouterr().err
    assert main(sweeps("--name", "../imu")) == 2
    assert "rig: bad_option: " in capsys.readouterr().err


def columns_of(table: str, keep: Callable[[str], bool]) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        rows = file[table][:]
        del file[table]
        file[table] = rows[[name for name in rows.dtype.names if keep(name)]].copy()

    return change


def of_another_type(file: h5py.File) -> None:
    rows = file["motion"][:]
    del file["motion"]
    file["motion"] = rows.astype([(name, "<f4") for name in rows.dtype.names])


def told_otherwise(file: h5py.File) -> None:
    file.attrs["elsewhere"] = json.dumps({"item": {"name": "../x"}, "tells": "sweeps"})


def spoilt(table: str, name: str, value: float) -> Callable[[h5py.File], None]:
    def change(file: h5py.File) -> None:
        rows = file[table][:]
        rows[name][3] = value
        file[table][:] = rows

    return change


def of_an_arm(file: h5py.File) -> None:
    settings = json.loads(file.attrs["settings"])
    del settings["elsewhere"]
    file.attrs["settings"] = json.dumps(settings)


DAMAGE: dict[str, Callable[[h5py.File], None]] = {
    "no time": columns_of("readings", lambda name: name != "time_s"),
    "no axis": columns_of("motion", lambda name: name != "axis_x"),
    "two of three axes": columns_of("readings", lambda name: name != "y_rad_s"),
    "neither speed nor angle": columns_of("motion", lambda name: name not in {"speed_rad_s", "angle_rad"}),
    "not a number": spoilt("readings", "x_rad_s", float("nan")),
    "an endless sweep": spoilt("motion", "end_s", float("inf")),
    "single precision": of_another_type,
    "a name that is a path": told_otherwise,
    "settings of an arm": of_an_arm,
    "no motion": lambda file: file.__delitem__("motion"),
}


@pytest.mark.one_in(3)
@pytest.mark.parametrize("what", DAMAGE)
def test_a_file_that_is_not_whole_is_refused(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(sweeps("--out", str(tmp_path / "run"))) == 0
    capsys.readouterr()
    with h5py.File(tmp_path / "run" / "run.h5", "r+") as file:
        DAMAGE[what](file)
    assert main(["solve", str(tmp_path / "run")]) == 2
    assert "rig: not_a_run_file: " in capsys.readouterr().err
