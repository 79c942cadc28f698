"""A `result.json` that somebody forged is refused by its place, or shown without anything that is obeyed."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rig.cli import main
from support.paths import RECORDINGS

OBEYED = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202e]|<script>alert")
HOSTILE = '\x1b[31m\x9b2J\x07\u202e<script>alert(1)</script>"{{7*7}}\r'


def forged(name: str, forge: Callable[[Any], object], folder: Path) -> Path:
    document = json.loads((RECORDINGS / name / "result.json").read_text(encoding="utf-8"))
    forge(document)
    (folder / "result.json").write_text(json.dumps(document), encoding="utf-8")
    return folder


def texts_replaced(value: Any, keys: frozenset[str]) -> None:
    """Every text of these keys is the hostile one."""
    for key, each in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(each, str) and key in keys:
            value[key] = HOSTILE
        elif isinstance(each, (dict, list)):
            texts_replaced(each, keys)


@pytest.mark.slow
def test_what_texts_hide_is_shown_and_not_obeyed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    keys = frozenset({"serial_number", "rig_version", "arm_model", "what", "fault", "criterion", "source", "reference"})
    folder = forged("imu", lambda document: texts_replaced(document, keys), tmp_path)
    assert main(["show", "--all", str(folder)]) == 0
    assert main(["report", str(folder)]) == 0
    printed = capsys.readouterr()
    assert not re.search("[\x00-\x09\x0b-\x1f\x7f-\x9f\u202e]", printed.out + printed.err)
    assert r"\x1b[31m" in printed.out
    certificate = (folder / "certificate.html").read_text(encoding="utf-8")
    assert not OBEYED.search(certificate) and r"\x1b[31m" in certificate and r"\u202e" in certificate.lower()


@pytest.mark.parametrize(
    ("name", "forge", "why"),
    [
        ("verified", lambda d: d["provenance"].update(started_utc="never"), "provenance.started_utc: "),
        ("resumed", lambda d: d["provenance"].update(resumed_utc=["x"]), "provenance.resumed_utc.0: "),
        ("bias_drift", lambda d: d["bias_drift"].update(gyro={"x": d["bias_drift"]["gyro"]["rate"]}), "not a quantity"),
        (
            "six_observation",
            lambda d: d["gyroscopes"]["gyro"]["covariance"][4].__setitem__(4, -1),
            "variance below 0",
        ),
        (
            "six_observation",
            lambda d: d["gyroscopes"]["gyro"]["vector_model"].update(matrix_covariance=[[1e-6] * 8] * 9),
            "must have as many columns as rows",
        ),
        (
            "six_observation",
            lambda d: d["gyroscopes"]["gyro"].update(scale=[1, 1, 1e300]),
            "'1e+300' is not a number that",
        ),
        ("six_observation", lambda d: d["gyroscopes"]["gyro"].update(scale=[1, 1, 10**200]), "is not a number that"),
        (
            "six_observation",
            lambda d: d["gyroscopes"]["gyro"].update(scale=[1, 1, float("nan")]),
            "'NaN' is not a number",
        ),
        ("verified", lambda d: d["verification"]["gyro"]["after"].update(delay_std_s=[]), "must be as many"),
    ],
)
def test_what_contradicts_itself_is_refused_by_its_place(
    name: str, forge: Callable[[Any], object], why: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = forged(name, forge, tmp_path)
    for command in ("show", "report"):
        assert main([command, str(folder)]) == 2
        printed = capsys.readouterr().err
        assert printed.startswith("rig: not_a_result: ") and why in printed and printed.count("\n") == 1


def test_a_key_that_stands_twice_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One reader takes the first verdict, another the last."""
    folder = forged("six_observation", lambda document: None, tmp_path)
    text = (folder / "result.json").read_text(encoding="utf-8")
    (folder / "result.json").write_text(text.replace("{", '{"verdict": "fail", ', 1), encoding="utf-8")
    assert main(["show", str(folder)]) == 2
    assert "rig: not_a_result: " in (said := capsys.readouterr().err) and "'verdict' occurs twice" in said


def test_nesting_without_end_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "result.json").write_text('{"checks": ' + "[" * 100_000, encoding="utf-8")
    assert main(["show", str(tmp_path)]) == 2
    assert capsys.readouterr().err.startswith("rig: not_a_result: ")


def test_a_size_that_a_later_version_finds_is_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def forge(document: Any) -> None:
        document["gyroscopes"]["gyro"]["by_hand"]["errors"][0]["name"] = "tremor_rad"

    assert main(["show", "--all", str(forged("by_hand", forge, tmp_path))]) == 0
    assert "by hand: " in capsys.readouterr().out
