"""`rig history recompute`: every recording by today's method, and what it changes; nothing is overwritten."""

import argparse
import csv
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.commands.history import command as history_command
from rig.commands.history.recompute import recompute_history
from rig.commands.history.recompute_worker import Task
from rig.data.result_file import ResultDocument
from rig.history.recompute.result_comparison import Answer, RecomputedResult
from rig.history.store import History, open_history
from rig.report.kinds.kind_registry import history_records
from support.history.kept_recordings import certify, keep
from support.history.past_runs import finish_run
from support.laboratories.commands import rig_here
from support.paths import RECORDINGS
from support.processes.clusters import killable_cluster, local_cluster
from support.processes.waiting import alive, wait_for

VERIFIED = RECORDINGS / "verified"


@pytest.fixture
def history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[History]:
    """An empty history, the one that is meant, in the working folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    with open_history(str(tmp_path / "history.sqlite")) as opened:
        yield opened


def rows(folder: Path = Path("recomputed")) -> list[dict[str, str]]:
    with (folder / "recomputed.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def in_file(folder: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def shifted(document: ResultDocument) -> ResultDocument:
    """Half of U beside what the recording gives, in kx."""
    gyro = document.gyroscopes["gyro"]
    (kx,) = (parameter for parameter in history_records(document)[0].parameters if parameter.name == "kx")
    scale = (gyro.scale[0] + 0.5 * kx.expanded, *gyro.scale[1:])
    return document.model_copy(update={"gyroscopes": {"gyro": gyro.model_copy(update={"scale": scale})}})


@pytest.mark.proof
@pytest.mark.slow
def test_two_verdicts_change_by_another_limit_and_no_file_does(
    history: History, tmp_path: Path, thorough: bool
) -> None:
    """By two processes in `make proof`; how work is given to them, test_spread.py holds."""
    for i in range(2):
        run = keep(history, tmp_path / "runs" / f"wide {i}")
        certify(history, run, f"RIG-{i}")
    certify(history, keep(history, tmp_path / "runs" / "narrow", VERIFIED), "RIG-V")
    before = in_file(tmp_path / "runs")
    by = ["--jobs", "2"] if thorough else []
    done = rig_here("history", "recompute", "--set", "limits.scale_std=0.0005", *by)
    assert done.returncode == 1, done.stderr
    assert "3 results: 3 solved" in done.stdout
    assert "verdicts that changed: 2; certificates to withdraw: 2" in done.stdout
    found = rows()
    changed = {row["run"] for row in found if row["verdict"] != row["verdict_now"]}
    assert changed == {str(i) for i in range(1, 3)}
    assert {row["failed_now"] for row in found if row["run"] in changed} == {"gyro.scale_std"}
    assert in_file(tmp_path / "runs") == before
    assert "0 changed, 0 missing" in rig_here("history", "verify").stdout


@pytest.mark.slow
def test_moved_missing_and_damaged_are_named_counted_and_gone_on_with(history: History, tmp_path: Path) -> None:
    same = keep(history, tmp_path / "same")
    moved = keep(history, tmp_path / "moved", change=shifted)
    for run, number in ((same, "RIG-1"), (moved, "RIG-2")):
        certify(history, run, number)
    certify(history, keep(history, tmp_path / "damaged"), "RIG-3")
    keep(history, tmp_path / "missing")
    recording = tmp_path / "damaged" / "run.h5"
    whole = recording.read_bytes()
    recording.write_bytes(whole[:5000] + bytes(each ^ 255 for each in whole[5000:5010]) + whole[5010:])
    (tmp_path / "missing").rename(tmp_path / "elsewhere")
    done = rig_here("history", "recompute")
    assert done.returncode == 1 and "4 results: 2 solved, 1 damaged, 1 missing" in done.stdout
    assert "moved by more than 0.1 U: 1; verdicts that changed: 0; certificates to withdraw: 1" in done.stdout
    assert "not solved: 1" in done.stdout
    first, second, third, fourth = rows()
    assert (first["moved"], second["moved"], second["parameter"]) == ("False", "True", "kx")
    assert float(second["shift_over_u"]) == pytest.approx(0.5, abs=0.05)
    assert (second["certificates_to_withdraw"], third["certificates_unconfirmed"]) == ("RIG-2", "RIG-3")
    assert (third["state"], fourth["state"]) == ("damaged", "missing") and "SHA-256" in third["why"]
    assert "RIG-2" in Path("recomputed/recomputed.html").read_text(encoding="utf-8")
    recording.write_bytes(whole)
    (tmp_path / "elsewhere").rename(tmp_path / "missing")
    done = rig_here("history", "recompute", "--u-fraction", "0.9")
    assert "2 of 4 are already solved" in done.stderr and "4 results: 4 solved" in done.stdout and done.returncode == 0


@pytest.mark.thorough
@pytest.mark.slow
def test_workers_of_a_cluster_give_the_same_numbers_as_one_by_one(history: History, tmp_path: Path) -> None:
    for i in range(3):
        keep(history, tmp_path / f"run {i}")
    with local_cluster(n_workers=2, processes=True) as cluster:
        there = rig_here("history", "recompute", "--dask", cluster.scheduler_address, "--out", "there")
    here = rig_here("history", "recompute", "--out", "here")
    assert (there.returncode, here.returncode) == (0, 0), there.stderr
    assert rows(Path("there")) == rows(Path("here"))
    noted = [sorted((Path(each) / "recomputed.jsonl").read_text().splitlines()) for each in ("there", "here")]
    assert noted[0] == noted[1] and len(noted[0]) == 4


@pytest.mark.thorough
@pytest.mark.slow
def test_a_scheduler_that_is_killed_is_named_and_a_second_call_goes_on(history: History, tmp_path: Path) -> None:
    for i in range(5):
        keep(history, tmp_path / f"run {i}")
    journal = Path("recomputed/recomputed.jsonl")
    with killable_cluster(tmp_path) as (scheduler, address):
        command = [sys.executable, "-m", "rig", "history", "recompute", "--dask", address]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:

            def two_are_done() -> bool:
                return journal.exists() and journal.read_text(encoding="utf-8").count("\n") >= 2

            wait_for(two_are_done, "two calibrations", meanwhile=alive(process))
            scheduler.kill()
            said, errors = process.communicate()
    assert process.returncode == 3 and "cluster_lost" in errors and "Traceback" not in errors
    assert "5 results: " in said and "not reached" in said
    solved = journal.read_text(encoding="utf-8").count("\n") - 1
    assert 1 <= solved < 5
    done = rig_here("history", "recompute")
    assert f"{solved} of 5 are already solved" in done.stderr
    assert "5 results: 5 solved" in done.stdout and done.returncode == 0


@pytest.mark.slow
def test_another_estimator_moves_what_it_moves_and_answers_are_not_mixed(history: History, tmp_path: Path) -> None:
    keep(history, tmp_path / "run")
    done = rig_here("history", "recompute", "--estimator", "newton", "--u-fraction", "0.01")
    assert done.returncode == 1
    (row,) = rows()
    solved = rig_here("solve", "run", "--estimator", "newton", "--json")
    document = ResultDocument.model_validate_json(solved.stdout)
    (now,) = (parameter for parameter in history_records(document)[0].parameters if parameter.name == row["parameter"])
    assert float(row["now"]) == now.value and float(row["now_expanded"]) == now.expanded
    refused = rig_here("history", "recompute")
    assert refused.returncode == 2 and "another_question" in refused.stderr


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--set", "limits.scale_st=1"), "unknown_setting"),
        (("--estimator", "best"), "unknown_estimator"),
        (("--u-fraction", "0"), "bad_option"),
        (("--jobs", "0"), "bad_option"),
        (("--serial", "G-9"), "not_in_history"),
    ],
)
def test_what_cannot_be_asked_is_refused_by_name(words: tuple[str, ...], named: str, history: History) -> None:
    history.enter(finish_run(0))
    done = rig_here("history", "recompute", *words)
    assert done.returncode == 2 and named in done.stderr


@pytest.mark.slow
def test_an_interrupted_one_is_gone_on_with(history: History) -> None:
    """With a stand-in for the solving: what is in the journal is not solved again."""
    runs = {run.content_sha256: run for run in map(finish_run, range(40))}
    for run in runs.values():
        history.enter(run)
    asked: list[str] = []

    def solve(task: Task) -> Answer:
        if len(asked) == 15:
            asked.append("interrupted")
            raise KeyboardInterrupt
        asked.append(task.key)
        return RecomputedResult("pass", (), history_records(runs[task.key].document))

    parser = argparse.ArgumentParser()
    history_command.add(parser)
    options = parser.parse_args(["recompute"])
    with pytest.raises(KeyboardInterrupt, match="continues"):
        recompute_history(options, solve)
    assert recompute_history(options, solve) == 0
    asked.remove("interrupted")
    assert sorted(asked) == sorted(runs) and len(rows()) == 40
