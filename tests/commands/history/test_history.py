"""`rig history`: what is entered, shown, drawn, compared, verified; and the end of a run."""

import csv
import io
import json
import re
import shutil
from datetime import timedelta
from pathlib import Path

import pytest

from rig.cli import main
from rig.commands.history.remember import remember
from rig.config.judging.judging_sections import HistorySection
from rig.history.store import open_history
from rig.station.events import NotRemembered, Remembered
from rig.station.words import line
from support.history.kept_rows import forge
from support.history.past_runs import FIRST, finish_run
from support.laboratories.commands import configuration, rig
from support.paths import CONFIGS, RECORDINGS


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """An empty history, the one that is meant."""
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    return str(tmp_path / "history.sqlite")


@pytest.fixture
def year(place: str) -> str:
    """A check standard that drifts, calibrated twelve times."""
    with open_history(place) as history:
        for i in range(12):
            scatter = ((5 * i) % 7 - 3) * 1e-5
            scale = (1.01 + 3e-4 * i + scatter, 0.99 - scatter, 1.0 + 2 * scatter)
            history.enter(finish_run(30 * i, scale, check_standard=True))
    return place


def told(capsys: pytest.CaptureFixture[str], *arguments: str | Path, status: int = 0) -> str:
    assert main(["history", *map(str, arguments)]) == status
    return capsys.readouterr().out


@pytest.mark.parametrize("command", [["verify"], ["show", "1"], ["void", "1", "--reason", "x"], ["rigs"]])
def test_a_history_that_is_not_there_is_no_empty_one(
    place: str, capsys: pytest.CaptureFixture[str], command: list[str]
) -> None:
    assert main(["history", *command]) == 2
    assert f"no_history: there is no history {place}" in capsys.readouterr().err
    assert f"No calibration is in {place} yet" in told(capsys)
    assert not Path(place).exists()


@pytest.mark.slow
def test_runs_are_imported_once_and_what_is_none_is_named(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    bad = Path(place).parent / "bad"
    bad.mkdir()
    (bad / "result.json").write_text("{}", encoding="utf-8")
    runs = Path(place).parent / "runs"
    for name in ("six_observation", "verified"):
        shutil.copytree(RECORDINGS / name, runs / name)
    assert main(["history", "import", str(runs), str(bad)]) == 1
    printed = capsys.readouterr()
    assert printed.out.splitlines()[-1] == "2 entered, 0 already there, 1 refused"
    assert f"{bad}: not_a_result" in printed.err
    assert "0 entered, 2 already there, 0 refused" in told(capsys, "import", runs)
    assert "LSM9DS1-CI" in told(capsys) and "ADIS16465-001" in told(capsys, "list")


@pytest.mark.slow
def test_a_recording_without_a_result_is_solved_on_request(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    folder = Path(place).parent / "run"
    folder.mkdir()
    shutil.copy(RECORDINGS / "six_observation" / "run.h5", folder)
    told(capsys, "import", folder, status=1)
    assert "1 entered" in told(capsys, "import", "--solve", folder)
    assert not (folder / "result.json").exists()


@pytest.mark.slow
def test_one_flipped_byte_of_a_recording_is_named(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    folder = Path(place).parent / "run"
    shutil.copytree(RECORDINGS / "verified", folder)
    told(capsys, "import", folder)
    assert "5 ok, 0 changed, 0 missing" in told(capsys, "verify")
    recording = bytearray((folder / "verify.h5").read_bytes())
    recording[len(recording) // 2] ^= 1
    (folder / "verify.h5").write_bytes(recording)
    found = told(capsys, "verify", status=1).splitlines()
    assert found[0].startswith(f"changed: {folder / 'verify.h5'}: ") and len(found) == 3
    (folder / "verify.h5").unlink()
    assert f"missing: {folder / 'verify.h5'}" in told(capsys, "verify", status=1)
    moved = folder.rename(folder.with_name("archive"))
    shutil.copytree(RECORDINGS / "verified", moved, dirs_exist_ok=True)
    assert f"missing: {folder}" in told(capsys, "verify", status=1)
    told(capsys, "import", moved)
    assert "5 ok, 0 changed, 0 missing" in told(capsys, "verify")


@pytest.mark.slow
def test_a_result_that_was_changed_in_the_database_is_named(year: str, capsys: pytest.CaptureFixture[str]) -> None:
    forge(year, "UPDATE run SET result = replace(result, '\"pass\"', '\"fail\"') WHERE id = 3")
    assert "changed: run 3, calibration 3: " in told(capsys, "verify", status=1)


@pytest.mark.slow
def test_trends_are_told_for_people_and_for_machines(year: str, capsys: pytest.CaptureFixture[str]) -> None:
    printed = told(capsys, "G-1")
    assert "drift a year" in printed and "U includes noise only" in printed
    document = json.loads(told(capsys, "G-1", "--json"))
    assert document["schema"] == "rig.history/1" and len(document["calibrations"]) == 12
    (trend,) = document["trends"]
    kx = trend["parameters"]["kx"]
    assert kx["drift_per_year"] == pytest.approx(3e-4 / 30 * 365.25, rel=0.02)
    assert kx["drift_p_value"] < 1e-6 and kx["chart"]["out_of_control"] and kx["recall"] is not None
    rows = list(csv.DictReader(io.StringIO(told(capsys, "G-1", "--csv"))))
    assert len(rows) == 12 * 10
    first = next(row for row in rows if row["parameter"] == "kx")
    assert float(first["value"]) == document["calibrations"][0]["parameters"]["kx"]["value"]
    late = (FIRST + timedelta(days=300)).date().isoformat()
    assert len(json.loads(told(capsys, "G-1", "--since", late, "--json"))["calibrations"]) == 2
    assert "need 5 calibrations; there are 2" in " ".join(told(capsys, "G-1", "--since", late).split())


@pytest.mark.slow
def test_a_calibration_is_shown_and_compared(year: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "stored on bench in /runs/0" in told(capsys, "show", "1")
    assert json.loads(told(capsys, "show", "1", "--json"))["schema"] == "rig.result/1"
    assert told(capsys, "show", "G-1") == told(capsys, "show", "12")
    found = json.loads(told(capsys, "compare", "1", "12", "--json"))["parameters"]
    assert found["kx"]["normalised_error"] > 1 > found["bx"]["normalised_error"]
    assert found["kx"]["changed"] and not found["bx"]["changed"]
    assert found["kx"]["normalised_error"] > found["kx"]["normalised_error_limit"] > 1
    said = " ".join(told(capsys, "compare", "1", "12").split())
    assert "changed" in said and re.search(r"10 are compared, so a change is significant if E_n", said)
    with open_history(year) as history:
        history.enter(finish_run(400, serial_number="G-2"))
    assert main(["history", "compare", "1", "13"]) == 2
    assert "not_comparable" in capsys.readouterr().err
    with pytest.raises(SystemExit):
        main(["history", "compare", "G-1", "G-2"])
    assert "`rig history G-1` lists those of a serial number" in capsys.readouterr().err


@pytest.mark.slow
def test_check_standards_tell_of_the_rig_by_the_exit_status(year: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert "OUT OF CONTROL" in told(capsys, "rigs", status=1)
    document = json.loads(told(capsys, "rigs", "--json", status=1))
    assert document["rigs"][0]["check_standards"] == ["G-1"] and document["effects"] == {}


@pytest.mark.slow
def test_a_wrong_entry_is_voided_not_deleted(year: str, capsys: pytest.CaptureFixture[str]) -> None:
    told(capsys, "void", "12", "--reason", "another sensor was mounted")
    document = json.loads(told(capsys, "G-1", "--json"))
    assert document["calibrations"][-1]["voided"] == "another sensor was mounted"
    assert document["trends"][0]["parameters"]["kx"]["calibrations"] == 11


@pytest.mark.slow
def test_what_was_never_entered_is_refused_by_name(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    with open_history(place):
        pass
    for arguments in (["nobody"], ["show", "7"], ["show", "nobody"], ["plot", "nobody"], ["compare", "1", "2"]):
        assert main(["history", *arguments]) == 2
        assert "not_in_history" in capsys.readouterr().err


@pytest.mark.slow
def test_a_configuration_names_the_history(year: str, capsys: pytest.CaptureFixture[str]) -> None:
    config = configuration(Path(year).parent, {"history": {"url": year}})
    assert "12" in told(capsys, "show", "12", "--history", config)


@pytest.mark.slow
def test_a_certificate_is_remembered_with_who_ran_the_rig(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    """That of the run when it is entered, amended ones when they are made; one of a simulated laboratory says so."""
    folder = Path(place).parent / "run"
    shutil.copytree(RECORDINGS / "verified", folder)
    demo = (CONFIGS / "demo.yaml").read_text(encoding="utf-8")
    said = "history: {operator: A. Person, note: 'after [the] move'}\n"
    (folder / "config.yaml").write_text(f"{demo}{said}", encoding="utf-8")
    assert main(["report", str(folder)]) == 0
    assert "is in no history" in capsys.readouterr().err
    told(capsys, "import", folder)
    first = re.findall(r"RIG-\d{8}-[0-9A-F]{12}", (folder / "certificate.html").read_text(encoding="utf-8"))[0]
    assert main(["report", str(folder), "--set", f"certificate.replaces={first}"]) == 0
    assert capsys.readouterr().err == ""
    shown = " ".join(told(capsys, "show", "1").split())
    assert "operator: A. Person" in shown and "note: after [the] move" in shown
    assert f"calibration certificate {first}, issued " in shown and f"replaces {first}; Simulated laboratory" in shown
    assert shown.count("certificate.html of it: SHA-256") == 2 and shown.count(", replaced;") == 1
    (entry, _) = json.loads(told(capsys, "--json"))["calibrations"]
    assert (entry["operator"], entry["note"], entry["simulated"]) == ("A. Person", "after [the] move", True)
    assert "6 ok, 0 changed, 0 missing" in told(capsys, "verify")
    with (folder / "certificate.html").open("a", encoding="utf-8") as page:
        page.write("<!-- better -->")
    assert f"changed: {folder / 'certificate.html'}: " in told(capsys, "verify", status=1)


@pytest.mark.slow
def test_a_series_is_drawn(year: str, capsys: pytest.CaptureFixture[str]) -> None:
    out = Path(year).parent / "plots"
    drawn = told(capsys, "plot", "G-1", "--out", out).split()
    assert drawn == [str(out / "history_G_1_rate.png"), str(out / "history_G_1_rate.svg")]
    assert all(Path(each).stat().st_size > 10_000 for each in drawn)
    assert json.loads(told(capsys, "compare", "1", "12", "--json", "--plot", out))["parameters"]
    assert all((out / f"compare_1_12.{kind}").stat().st_size > 5_000 for kind in ("png", "svg"))


@pytest.mark.slow
def test_a_run_goes_on_whatever_becomes_of_the_history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    for broken in (str(tmp_path / "file" / "history.sqlite"), f"postgresql://rig@/x?host={tmp_path}", "what://ever"):
        monkeypatch.setenv("RIG_HISTORY", broken)
        event, beside = remember(RECORDINGS / "verified", HistorySection())
        assert isinstance(event, NotRemembered) and beside == ()
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    event, _ = remember(tmp_path / "nothing", HistorySection())
    assert isinstance(event, NotRemembered)
    event, _ = remember(RECORDINGS / "verified", HistorySection())
    assert isinstance(event, Remembered) and event.numbers == (1, 2) and event.usual
    named = str(tmp_path / "named.sqlite")
    monkeypatch.setenv("RIG_HISTORY", "")
    event, _ = remember(RECORDINGS / "verified", HistorySection(url=named))
    assert event is not None and (line(event) or "").endswith(f"(rig history show 1 --history {named})")
    monkeypatch.delenv("RIG_HISTORY")
    assert remember(RECORDINGS / "verified", HistorySection(off=True)) == (None, ())


@pytest.mark.thorough
@pytest.mark.slow
def test_a_run_enters_itself_and_is_held_against_the_last(place: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The last calibration of the same simulated sensor was half a year ago, and another, on another board."""
    told(capsys, "import", RECORDINGS / "six_observation")
    folder = Path(place).parent
    other = {"sensors": {"gyro": {"bias_rad_s": [0.2, 0.1, -0.1]}}, "board": {"unique_id": "f" * 24}}
    config = configuration(folder, {"world": other, "limits": {"bias_rad_s": 1}})
    refused = rig("run", config, "--out", folder / "refused", "--yes")
    assert refused.returncode == 2 and "rig: other_board: lsm9ds1 LSM9DS1-CI was last calibrated" in refused.stderr
    assert f"{'f' * 24}. Correct sensors.gyro.serial_number; or, where" in " ".join(refused.stderr.split())
    assert "done: " not in (folder / "refused" / "log.txt").read_text(encoding="utf-8")
    done = rig("run", config, "--out", folder / "run", "--other-board", "LSM9DS1-CI")
    assert done.returncode == 0, done.stderr
    printed = " ".join(done.stdout.split())
    assert "(no. 1): bias of x changed by +" in printed and "more: rig history compare 1 2" in printed
    assert done.stdout.splitlines()[-1].startswith("verdict: ")
    log = (folder / "run" / "log.txt").read_text(encoding="utf-8")
    assert f"entered in {place} as calibration 2 (rig history show 2)" in log
    assert "changed by" not in done.stderr, "which is said once"
    assert "0 entered, 1 already there" in told(capsys, "import", folder / "run")
    assert "0 changed, 0 missing" in told(capsys, "verify")


@pytest.mark.slow
def test_a_calibration_is_not_void_without_a_reason(year: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["history", "void", "1", "--reason", " "]) == 2
    assert "bad_option: --reason is blank" in capsys.readouterr().err
