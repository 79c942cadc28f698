"""Plan, check, run, report and export from Python: what they say, ask and refuse is what the commands do."""

import json
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import rig
from rig.cli import main
from rig.errors import Refused
from rig.motion.steps import Rest
from support.laboratories.worlds import World, hardware
from support.paths import CONFIGS, DEMO, RECORDINGS
from support.processes.waiting import PATIENCE_S


@pytest.mark.slow
def test_a_plan_is_that_of_the_command(capsys: pytest.CaptureFixture[str]) -> None:
    changed = {"procedure.speed_deg_s": 90, "procedure.rest_s": 1e-5 + 3}
    plan = rig.plan(DEMO, changed)
    printed = capsys.readouterr().out
    words = [word for key, value in changed.items() for word in ("--set", f"{key}={value}")]
    assert main(["plan", str(DEMO), *words]) == 0
    assert capsys.readouterr().out == printed
    assert main(["plan", str(DEMO), *words, "--json"]) == 0
    assert json.loads(json.dumps(plan.to_dict())) == json.loads(capsys.readouterr().out)
    assert f"{plan.duration_s:.1f} s" in repr(plan) and len(plan.steps) > 6


def test_an_error_in_the_file_or_in_a_change_is_refused_by_name() -> None:
    with pytest.raises(Refused, match="speed_deg_s"):
        rig.plan(DEMO, {"procedure.speed_deg_s": "fast"})
    with pytest.raises(Refused, match=r"bad_option: procedure\.speed_deg_s"):
        rig.plan(DEMO, {"procedure.speed_deg_s": object()})


@pytest.mark.slow
def test_a_small_number_is_a_number() -> None:
    rests = [step for step in rig.plan(DEMO, {"procedure.rest_s": 1e-5}).steps if isinstance(step, Rest)]
    assert any(step.duration_s == 1e-5 for step in rests)


@pytest.mark.slow
def test_a_certificate_and_an_export_are_written_and_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIG_HISTORY", "off")
    folder = Path(shutil.copytree(RECORDINGS / "verified", tmp_path / "run"))
    run = rig.load(folder)
    written = rig.write_certificate(run, {"certificate.customer": "Sons & Co: all"})
    assert written == [folder / "certificate.html"]
    assert "Sons &amp; Co: all" in written[0].read_text(encoding="utf-8")
    files = rig.export(run, "imucal", out=tmp_path / "export")
    assert files and all(file.parent == tmp_path / "export" and file.exists() for file in files)
    assert capsys.readouterr().out.split() == [str(path) for path in (*written, *files)]
    with pytest.raises(Refused, match=r"bad_option: .*'xlsx'.*csv, parquet"):
        rig.export(run, "xlsx")


def test_a_run_is_started_from_the_thread_that_hears_ctrl_c(tmp_path: Path) -> None:
    said: list[str] = []

    def start() -> None:
        try:
            rig.run(CONFIGS / "ci.yaml", out=tmp_path / "run")
        except Refused as error:
            said.append(error.name)

    thread = threading.Thread(target=start)
    thread.start()
    thread.join()
    assert said == ["not_main_thread"] and not (tmp_path / "run").exists()


RUN = """
import sys, rig
try:
    rig.run(sys.argv[1], out=sys.argv[2])
except rig.Refused as error:
    print(error.name)
"""


@pytest.mark.thorough
@pytest.mark.slow
def test_nothing_moves_from_python_when_nobody_agrees(world: World, tmp_path: Path) -> None:
    handle = world()
    config = hardware(handle.config_path, tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", RUN, str(config), str(tmp_path / "run")],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert done.stdout.split() == ["not_confirmed"], done.stderr
    assert "First it goes home" in done.stderr
    assert not handle.state()["moving"] and handle.state()["q_rad"][5] == pytest.approx(0, abs=1e-6)
