"""`rig report`: the certificate of a run folder as page, as PDF with its data inside, as digital certificate."""

import subprocess
import sys
from pathlib import Path

import pytest

from rig.cli import main
from rig.data.entries.magnetometer import ReversalDocument
from rig.data.result_file import write_result
from rig.errors import Refused
from rig.report.certificate import pdf
from rig.report.words.printed_values import round_to_u
from support.documents.certified import everything, result, reversal
from support.laboratories.commands import rig
from support.paths import CONFIGS, RECORDINGS
from support.processes.waiting import PATIENCE_S

SIMULATED = "Simulated laboratory: no real item was calibrated"


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A run folder of the simulated laboratory, whose configuration says in which country it is."""
    folder = tmp_path / "run"
    folder.mkdir()
    write_result(result(), folder)
    demo = (CONFIGS / "demo.yaml").read_text(encoding="utf-8")
    (folder / "config.yaml").write_text(f"{demo}site: {{country: DE, laboratory: Ours}}\n", encoding="utf-8")
    return folder


@pytest.mark.slow
def test_page_and_digital_certificate_lie_in_the_run_folder(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(run), "--dcc"]) == 0
    assert capsys.readouterr().out.split() == [str(run / "certificate.html"), str(run / "certificate.xml")]
    page = (run / "certificate.html").read_text(encoding="utf-8")
    assert SIMULATED in page and "Ours" in page
    main(["report", str(run), "--dcc"])
    assert (run / "certificate.html").read_text(encoding="utf-8") == page


def test_a_result_alone_has_a_certificate_that_states_nothing(tmp_path: Path) -> None:
    assert (
        main(["report", str(RECORDINGS / "verified" / "result.json"), "--out", str(tmp_path / "new" / "folder")]) == 0
    )
    assert "not stated" in (tmp_path / "new" / "folder" / "certificate.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_an_amended_certificate_names_the_customer_and_what_it_replaces(run: Path) -> None:
    said = [
        "--set",
        "certificate.customer=Sons & Co",
        "--set",
        "certificate.replaces=RIG-1",
        "--set",
        "site.place=room 3",
    ]
    assert main(["report", str(run), *said]) == 0
    page = (run / "certificate.html").read_text(encoding="utf-8")
    assert "Sons &amp; Co" in page and "replaces RIG-1" in page and "room 3" in page


@pytest.mark.slow
def test_a_magnetometer_that_was_turned_over_is_certified_so(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    document = everything()
    write_result(document, run)
    file = run / "reversal.json"
    found = {"schema": "rig.reversal/1", "magnetometers": {"compass": reversal(document)}}
    file.write_text(ReversalDocument.model_validate(found).text(), encoding="utf-8")
    assert main(["report", str(run), "--dcc", "--reversal", str(file)]) == 0
    assert "turned over" in (run / "certificate.html").read_text(encoding="utf-8")
    assert "own bias" in (run / "certificate.xml").read_text(encoding="utf-8")
    capsys.readouterr()
    for other, name in ((run / "none.json", "no_result"), (run / "result.json", "not_a_result")):
        assert main(["report", str(run), "--reversal", str(other)]) == 2
        assert name in capsys.readouterr().err


def test_what_was_measured_cannot_be_said_otherwise(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(run), "--set", "site.latitude_deg=0"]) == 2
    assert "unknown_setting" in capsys.readouterr().err
    assert not (run / "certificate.html").exists()


def test_a_folder_that_cannot_be_written_is_named(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", str(run), "--out", str(run / "result.json")]) == 2
    assert "report_folder" in capsys.readouterr().err


def test_without_weasyprint_the_page_can_be_printed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    with pytest.raises(Refused, match="no_weasyprint"):
        pdf.pdf_of("", {})


def test_what_cannot_be_made_is_told_and_the_rest_is_written(
    run: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (run / "config.yaml").unlink()  # with it the country is gone
    monkeypatch.setitem(sys.modules, "weasyprint", None)
    assert main(["report", str(run), "--pdf", "--dcc"]) == 2
    said = capsys.readouterr()
    assert said.out.split() == [str(run / "certificate.html")] and (run / "certificate.html").exists()
    assert "left out: no_digital_certificate" in said.err and "--set site.country=DE" in said.err
    assert "left out: no_weasyprint" in said.err and "pip install" in said.err


def told(*command: str | Path) -> str:
    return subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=PATIENCE_S, check=True).stdout


@pytest.mark.slow
def test_the_pdf_holds_every_value_and_its_data(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = rig("report", run, "--pdf", "--dcc", "--out", out)
    assert done.returncode == 0 and done.stderr == "", done
    made = out / "certificate.pdf"
    text = told("pdftotext", "-layout", made, "-")
    sensor = result().gyroscopes["gyro"]
    assert sensor.budget is not None
    for value, expanded in zip([*sensor.scale, *sensor.bias_rad_s], sensor.budget.expanded, strict=True):
        found = round_to_u(value, expanded)
        assert f"{found.value_text} ± {found.uncertainty_text}" in text
    pages = text.split("\f")[:-1]
    assert 1 <= len(pages) <= 2
    for number, page in enumerate(pages, start=1):
        assert f"Page {number} of {len(pages)}" in page and SIMULATED in page and "Calibration certificate RIG-" in page
    attached = tmp_path / "attached"
    attached.mkdir()
    told("pdfdetach", "-saveall", "-o", attached, made)
    assert sorted(path.name for path in attached.iterdir()) == ["certificate.xml", "result.json"]
    for file in (run / "result.json", out / "certificate.xml"):
        assert (attached / file.name).read_bytes() == file.read_bytes()
    metadata = told("pdfinfo", "-meta", made)
    assert 'pdfaid:part="3" pdfaid:conformance="B"' in metadata


@pytest.mark.thorough
@pytest.mark.slow
def test_a_pdf_of_a_laboratory_in_no_country_says_what_is_not_attached(run: Path) -> None:
    (run / "config.yaml").unlink()
    done = rig("report", run, "--pdf")
    assert done.returncode == 0, done
    assert "no digital certificate is attached: the laboratory's country is not stated" in done.stderr
    assert told("pdfdetach", "-list", run / "certificate.pdf").splitlines() == ["1 embedded files", "1: result.json"]
    assert not (run / "certificate.xml").exists()
