"""What to do about an error by the way in use: every row is of an error that there is, and says what can be done."""

from argparse import Namespace
from pathlib import Path
from typing import get_args

import pytest

from rig.cli import main
from rig.commands.documents import explain
from rig.config.files import supplied_files
from rig.data.latest_run import note_run
from rig.errors.catalogue import catalogue
from rig.errors.remedies_by_method import TABLE, CalibrationMethod, remedies_by_method

NAMES = {
    line.partition(" | ")[0] for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")
}


def test_every_row_is_of_an_error_and_ends_without_a_full_stop() -> None:
    assert {entry.name for entry in catalogue()} >= NAMES
    remedies = [remedy for name in NAMES for remedy in remedies_by_method(name).values()]
    assert remedies and not [remedy for remedy in remedies if remedy.endswith(".") or not remedy[0].isupper()]


@pytest.mark.parametrize(
    ("configuration", "way"),
    [("turner: {kind: hand}\n", "by hand"), ("arm: {host: h}\n", "on an arm"), (None, "with readings from files")],
)
def test_the_way_of_the_latest_run_comes_first(
    configuration: str | None,
    way: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "share"))
    (tmp_path / "run").mkdir()
    if configuration is not None:
        (tmp_path / "run" / "config.yaml").write_text(configuration, encoding="utf-8")
    note_run(tmp_path / "run")
    assert main(["explain", "rank_deficient"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("What to do")]
    assert len(lines) == len(get_args(CalibrationMethod)) and lines[0].startswith(f"What to do {way}")
    assert "as in your latest run" in lines[0] and not any("as in" in line for line in lines[1:])


@pytest.mark.slow
def test_no_answer_ends_with_two_stops(capsys: pytest.CaptureFixture[str]) -> None:
    for entry in catalogue():
        explain.run(Namespace(name=[entry.name]))
    main(["explain", "ac"])
    said = capsys.readouterr()
    assert ".." not in said.out + said.err and "?." not in said.out + said.err


@pytest.mark.parametrize("name", ["gyro.scale_changed", "limits.scale_std", "no_port", "sweep", "estimator"])
def test_pages_are_named_only_if_the_program_has_them(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def read_words() -> str:
        assert explain.run(Namespace(name=[name])) == 0 and main([]) == 0
        return capsys.readouterr().out

    assert "\nMore: docs/" in (words := read_words()) and "Step by step: docs/README.md" in words
    monkeypatch.setattr(supplied_files, "PACKAGE", tmp_path / "site-packages" / "rig")
    (tmp_path / "site-packages" / "docs").mkdir(parents=True)  # of another package
    assert "docs/" not in read_words()


def test_a_name_that_is_like_several_is_offered_once_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "condtion"]) == 2
    offered = capsys.readouterr().err.partition("Did you mean ")[2].strip().rstrip("?").split(" or ")
    assert "condition" in offered and len(offered) == len(set(offered))


def test_a_part_of_a_word_leads_to_the_word_and_a_verdict_is_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "scale"]) == 2
    assert "Did you mean scale factor?" in capsys.readouterr().err
    assert main(["explain", "PASS"]) == 0
    assert "every check is passed" in capsys.readouterr().out
