"""The end of a run fits a screen, says what matters in words, and its last line is the verdict."""

import re
from dataclasses import asdict
from io import StringIO
from pathlib import Path

import pytest
from rich.console import Console

from rig.analysis.check import Check, fitness
from rig.cli import main
from rig.data.result_file import CheckEntry, ResultDocument, read_result
from rig.report.entry import entry
from rig.report.terminal.result_table import print_checks
from rig.report.terminal.run_summary import ending
from rig.report.words.check_words import check_words, what_failed, words_of
from rig.report.words.checks_page import page_text
from rig.report.words.glossary_page import page_text as glossary_text
from support.documents.ended_runs import ONE, fail_checks, make_three_parts
from support.paths import DOCS, RECORDINGS

FROZEN = sorted(path.parent for path in RECORDINGS.glob("*/result.json"))
RUN = Path("runs/2026-11-25T10-00-00Z-imu")
SINCE = ("since 2026-11-23 (no. 1): scale factor of x changed by +0.4 %, 12 U; 3 more", "else nothing changed")
COPYABLE = ("certificate: ", "all details: ")


def ended(result: ResultDocument, width: int = 80) -> list[str]:
    since = SINCE if len(result.gyroscopes) > 2 else SINCE[:1]
    everything, certificate = f"rig show {RUN} --all", RUN / "certificate.html"
    return [*ending(result, folder=RUN, everything=everything, certificate=certificate, since=since, width=width)]


def entry_of(check: Check) -> CheckEntry:
    means = {**asdict(check.means), "criterion": check.means.what}
    del means["what"]
    return entry(CheckEntry, check, coverage_factor=None, **means)


ALL = [check.name for check in make_three_parts().checks]


def test_a_failed_check_is_the_first_row_of_the_checks() -> None:
    console = Console(width=100, record=True, file=StringIO())
    last = next(
        check.name for check in ONE.checks if check.means.sensor is None
    )  # of the run, behind those of a sensor
    print_checks(fail_checks(ONE, last), console)
    first = next(line for line in console.export_text().splitlines() if line.startswith("│"))
    assert "FAILED" in first and last.split(".")[-1] in first


@pytest.mark.parametrize(
    "result",
    [
        ONE,
        fail_checks(ONE, "gyro.verification_rms"),
        fail_checks(ONE.model_copy(update={"verification": {}}), "gyro.scale_deviation"),  # what failed is not verified
    ],
    ids=["passed", "verification failed", "calibration failed"],
)
def test_one_sensor_ends_in_twelve_lines(result: ResultDocument) -> None:
    assert len(ended(result)) <= 12


@pytest.mark.one_in(2)
@pytest.mark.parametrize("width", [80, 120])
@pytest.mark.parametrize("folder", FROZEN, ids=lambda folder: f"{folder.parent.name}-{folder.name}")
def test_whatever_fails_the_end_fits_its_lines(folder: Path, width: int) -> None:
    result = read_result(folder)
    calibrated = [name for name, gyroscope in result.gyroscopes.items() if gyroscope.role != "reference"]
    beside = [*result.accelerometers, *result.magnetometers, *result.bias_drift, *result.over_temperature]
    one = len([*calibrated, *beside]) == 1
    most = 12 if one else 25
    names = [check.name for check in result.checks]
    for broken in (list[str](), *([name] for name in names), names[:2], names):
        lines = ended(fail_checks(result, *broken), width)
        assert len(lines) <= most, lines
        said = "\n".join(lines)
        told = [int(more) for more in re.findall(r"\((\d+)\s+more\s+failed\)", said)]
        assert sum(told) + said.count("FAILED ") == len(broken)


def test_a_narrow_screen_shows_the_same_as_a_wide_one() -> None:
    result = fail_checks(ONE, *(check.name for check in ONE.checks))
    assert sorted(" ".join(ended(result, 60)).split()) == sorted(" ".join(ended(result, 80)).split())


@pytest.mark.parametrize("names", [[], ALL[:1], ALL[:40]], ids=["passed", "one failed", "forty failed"])
def test_six_sensors_end_in_a_screen(names: list[str]) -> None:
    lines = ended(fail_checks(make_three_parts(), *names))
    assert len(lines) <= 25 and (len(names) < 2 or "more failed)" in " ".join(lines))


@pytest.mark.parametrize("width", [60, 80, 120])
@pytest.mark.parametrize("folder", FROZEN, ids=lambda folder: f"{folder.parent.name}-{folder.name}")
def test_every_result_fits_the_width_and_ends_with_its_verdict(folder: Path, width: int) -> None:
    result = read_result(folder)
    for lines in (ended(result, width), ended(fail_checks(result, *(check.name for check in result.checks)), width)):
        assert max(len(line) for line in lines if not line.startswith(COPYABLE) and "rig " not in line) <= width
        assert lines[-1] in {"verdict: PASS", "verdict: FAIL"}
        assert f"all details: rig show {RUN} --all" in lines
        assert not any("verdict" in line for line in lines[:-1])


def test_what_failed_is_said_in_words_with_a_command_that_can_be_copied() -> None:
    text = " ".join(" ".join(ended(fail_checks(ONE, "gyro.scale_deviation"))).split())
    assert "FAILED gyro.scale_deviation: 0.9, allowed 0.3" in text
    assert f"rig solve {RUN} --set limits.scale_deviation=VALUE" in text
    text = " ".join(" ".join(ended(fail_checks(ONE, "gyro.disturbed_sweep"))).split())
    assert "one sweep contradicts the others" in text and f"rig resume {RUN}" in text


def test_a_check_of_another_quantity_has_the_same_words_and_no_limit_that_nobody_can_set() -> None:
    for quantity in ("inclination", "field"):
        beyond, unlike = (fitness("tilt", quantity, what, 2.0, 1.0) for what in ("bias", "residuals"))
        said = what_failed(entry_of(beyond), Path("run"))
        assert said == "a bias is beyond its limit; the measurement is valid. Use another part"
        assert (what_failed(entry_of(unlike), None) or "").startswith(
            "the readings of an axis in a sweep or dwell contradict"
        )
    as_spelt = fitness("gyro.bias", "inclination", "scale_std", 2.0, 1.0)
    assert (what_failed(entry_of(as_spelt), None) or "").startswith("a scale factor is too uncertain")


def test_what_came_near_its_limit_is_named() -> None:
    checks = [
        check.model_copy(update={"value": 0.95 * check.limit}) if check.name == "gyro.bias" and check.limit else check
        for check in ONE.checks
    ]
    text = " ".join(ended(ONE.model_copy(update={"checks": tuple(checks)})))
    assert "near its limit: gyro.bias" in text


def test_a_reference_is_no_result_of_the_run() -> None:
    text = " ".join(" ".join(ended(read_result(RECORDINGS / "verified"))).split())
    assert "reference" not in text.partition("checks passed")[0]
    assert "gyro against reference: RMS at most 0." in text and " rad/s before, 0." in text


@pytest.mark.parametrize("folder", FROZEN, ids=lambda folder: f"{folder.parent.name}-{folder.name}")
def test_every_check_is_explained(folder: Path) -> None:
    assert [check.name for check in read_result(folder).checks if words_of(check) is None] == []


def test_the_page_of_checks_is_made_of_the_table() -> None:
    assert (DOCS / "checks.md").read_text(encoding="utf-8") == page_text()
    assert list(check_words()) == sorted(check_words())


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("gyro.acceleration_scale_changed", "the scale factors changed during the run"),
        ("gyro.disturbed_sweep.3", "rig resume RUN"),
        ("clocks_agree.controller_and_crystal", "two clocks differ"),
        ("wrong_axis", "an error"),
        ("limits.bias_rad_s", "magnitude of a bias, in rad/s"),
        ("U", "expanded uncertainty, U: u times the coverage factor"),
        ("u", "standard uncertainty, u: the uncertainty as one standard deviation"),
        ("k", "coverage factor, k = 2: the factor between u and U"),
        ("E_n", "Above 1 a single value has changed"),
        ("scale factor", "the factor that corrects a reading"),
        ("budget", "the list of everything that contributes"),
        ("Sweep", "one joint turning through one revolution"),
        ("revolution", "its mean rate is 2π/T"),
        ("bias", "a check of the verdict"),
        ("gyro.bias", "limits.bias_rad_s: a limit on a property of the sensor"),
        ("bias", "what is added to a reading before the scale factor"),
    ],
)
def test_a_name_is_explained(name: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", *name.split()]) == 0
    assert said in capsys.readouterr().out


def test_the_glossary_of_the_pages_is_that_of_the_terminal() -> None:
    again = "again: python -m rig.report.words.glossary_page > docs/glossary.md"
    assert (DOCS / "glossary.md").read_text(encoding="utf-8") == glossary_text(), again


def test_a_name_that_nobody_knows_is_answered_with_those_like_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", "scle_changed"]) == 2
    assert "Did you mean scale_changed" in capsys.readouterr().err


def shown(capsys: pytest.CaptureFixture[str], *options: str) -> str:
    assert main(["show", str(RECORDINGS / "verified"), *options]) == 0
    return capsys.readouterr().out


@pytest.mark.slow
def test_a_finished_run_is_shown_as_it_ended_or_in_full(capsys: pytest.CaptureFixture[str]) -> None:
    short, budget, checks = (shown(capsys, *each) for each in ((), ("--budget",), ("--checks",)))
    assert short.splitlines()[0].startswith("gyroscope gyro ") and len(short.splitlines()) <= 12
    assert "non-orthogonality" in budget and "checks of gyro" not in budget
    assert "checks of gyro" in checks and "non-orthogonality yz" not in checks
    assert shown(capsys, "--all").count("\n") > budget.count("\n") + checks.count("\n") - 4
    assert all(each.splitlines()[-1] == "verdict: PASS" for each in (short, budget, checks))
    assert "reference (known)" in budget and "reference (known)" not in shown(capsys, "--sensor", "gyro")
    assert main(["show", str(RECORDINGS / "verified"), "--sensor", "nobody"]) == 2
    assert "Choose one of: gyro, reference" in capsys.readouterr().err


@pytest.mark.slow
def test_a_recording_that_is_solved_again_ends_as_a_run_does(capsys: pytest.CaptureFixture[str]) -> None:
    again = ["solve", str(RECORDINGS / "verified")]
    assert main(again) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("gyroscope gyro ") and len(lines) <= 12 and lines[-1] == "verdict: PASS"
    assert "all details: the same command with --all" in lines
    again = ["solve", str(RECORDINGS / "six_observation")]
    assert main([*again, "--all"]) == 0
    whole = capsys.readouterr().out
    assert "checks of gyro" in whole and "non-orthogonality" in whole and whole.splitlines()[-1] == "verdict: PASS"
    assert main([*again, "--set", "limits.scale_deviation=0.01"]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert f"rig solve {RECORDINGS / 'six_observation'} --set limits.scale_deviation=VALUE" in said


def test_checks_that_failed_stand_first_and_rounding_is_not_printed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rounding = CheckEntry(
        name="gyro.board_scale", value=3.6e-20, limit=1e-4, unit="1", passed=True, kind="fitness", sensor="gyro"
    )
    broken = CheckEntry(name="gyro.spikes", value=9.5, limit=8.0, unit="1", passed=False, kind="fitness", sensor="gyro")
    result = ONE.model_copy(update={"checks": (rounding, broken), "verdict": "fail"})
    (tmp_path / "result.json").write_text(result.text(), encoding="utf-8")
    assert main(["show", str(tmp_path), "--checks"]) == 0
    rows = capsys.readouterr().out.splitlines()
    at = {name: next(i for i, row in enumerate(rows) if name in row) for name in ("spikes", "board_scale")}
    assert at["spikes"] < at["board_scale"] and "e-20" not in "".join(rows)


def test_the_formulas_of_a_gyroscope_and_an_accelerometer_tell_the_signs_of_their_biases() -> None:
    text = " ".join(" ".join(ended(read_result(RECORDINGS / "imu"))).split())
    assert "gyroscope: g = K (m + b)" in text and "accelerometer: m = F (s + φ s²) + b" in text
