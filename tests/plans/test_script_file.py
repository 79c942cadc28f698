"""A file of somebody's own is read with care, run only when it is the one that is meant, and fails by name."""

import hashlib
import os
from pathlib import Path

import pytest
import yaml

from rig.cli import main, run_guarded
from rig.commands.configured import load_configured
from rig.data.run_folder import ScriptIdentity, script_identity
from rig.data.user_texts import note_own
from rig.errors import Refused
from rig.plans.script_file import SIZE_MAX_BYTES, find_installed_script, kept_script, load_script
from support.laboratories.commands import configuration
from support.laboratories.worlds import hardware
from support.paths import CONFIGS, ROOT

OWN = ROOT / "tests" / "support" / "motions" / "unequal_sweeps.py"


def script(folder: Path, text: str) -> Path:
    path = folder / "own.py"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("end", "said"),
    [
        ("raise SystemExit(0)", r"SystemExit: 0; own\.py, line \d+"),
        ("import sys; sys.exit()", "SystemExit"),
        ("raise SystemExit(run_script(PROCEDURE))", "SystemExit"),
        ("1 / 0", r"ZeroDivisionError: division by zero; own\.py, line \d+"),
        ("def", "SyntaxError"),
    ],
)
def test_a_script_that_fails_or_ends_itself_while_it_is_loaded_is_refused(tmp_path: Path, end: str, said: str) -> None:
    text = OWN.read_text(encoding="utf-8").partition("if __name__")[0]
    with pytest.raises(Refused, match=rf"script_failed: .*own\.py cannot be loaded \({said}"):
        load_script(script(tmp_path, text + end + "\n"))


@pytest.mark.parametrize("status", [0, None, 1, "farewell"])
def test_what_ends_the_program_inside_a_command_is_no_verdict(
    status: object, capsys: pytest.CaptureFixture[str]
) -> None:
    def command() -> int:
        raise SystemExit(status)

    assert run_guarded(command) == 3
    assert capsys.readouterr().err.startswith("rig: script_failed: ")


def test_nothing_of_another_script_than_the_kept_one_is_executed(tmp_path: Path) -> None:
    path = tmp_path / "script.py"
    path.write_text(f"open({str(tmp_path / 'trace')!r}, 'w').close()\n{OWN.read_text(encoding='utf-8')}")
    with pytest.raises(Refused, match="another_script"):
        kept_script(tmp_path, ScriptIdentity("mine.py", hashlib.sha256(OWN.read_bytes()).hexdigest()))
    kept = ScriptIdentity("mine.py", hashlib.sha256(path.read_bytes()).hexdigest())
    with pytest.raises(Refused, match="foreign_script"):
        kept_script(tmp_path, kept)
    assert not (tmp_path / "trace").exists()
    note_own(path.read_text(encoding="utf-8"))
    found = kept_script(tmp_path, kept)
    assert found.name == "mine.py" and (tmp_path / "trace").exists()


def test_a_kept_script_that_is_installed_is_taken_from_where_it_is_installed(tmp_path: Path) -> None:
    stock = find_installed_script("six_observation")
    (tmp_path / "script.py").write_text(stock.text, encoding="utf-8")
    found = kept_script(tmp_path, stock.identity)
    assert found.procedure is stock.procedure


@pytest.mark.parametrize("kind", ["pipe", "device", "huge"])
def test_only_a_regular_file_of_a_sensible_size_is_a_script(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "own.py"
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path = Path("/dev/zero")
    else:
        path.write_bytes(b"#" * (SIZE_MAX_BYTES + 1))
    with pytest.raises(Refused, match=r"no_script: .*(not a regular file|longer than 1000000 bytes)"):
        load_script(path)


@pytest.mark.slow
def test_a_run_that_was_refused_before_its_first_recording_goes_on_by_its_own_script_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    mine, out = tmp_path / "mine.py", tmp_path / "run"
    mine.write_bytes(OWN.read_bytes())
    config = configuration(tmp_path)
    document = yaml.safe_load(config.read_text(encoding="utf-8"))
    document["procedure"] = {"name": "unequal_sweeps"}
    config.write_text(yaml.safe_dump(document), encoding="utf-8")
    assert main(["run", str(hardware(config, tmp_path)), "--script", str(mine), "--out", str(out), "--yes"]) == 2
    assert "rig: no_port: " in capsys.readouterr().err and not list(out.glob("*.h5"))
    assert kept_script(out, script_identity(out)).name == "mine.py"
    kept = (out / "script.py").read_bytes()
    (out / "script.py").write_bytes(f"open({str(tmp_path / 'trace')!r}, 'w').close()\n".encode() + kept)
    assert main(["resume", str(out)]) == 2 and "rig: another_script: " in capsys.readouterr().err
    assert not (tmp_path / "trace").exists()
    (out / "script.py").write_bytes(kept)
    assert main(["resume", str(out)]) == 2 and "rig: no_port: " in capsys.readouterr().err
    (out / "script.json").write_text("[]", encoding="utf-8")
    assert main(["resume", str(out)]) == 2 and "rig: another_script: " in capsys.readouterr().err


def test_a_section_that_fails_is_refused_by_name(tmp_path: Path) -> None:
    checking = "    def problems(self, config):\n        return [1 / 0]\n\n\ndef plan("
    path = script(tmp_path, OWN.read_text(encoding="utf-8").replace("def plan(", checking, 1))
    with pytest.raises(Refused, match=r"script_failed: the section of own\.py fails \(ZeroDivisionError"):
        load_configured(CONFIGS / "demo.yaml", ["procedure={}"], path)
