"""Every kind of result is shown everywhere, or says why it is not."""

import io
from dataclasses import fields
from typing import Any

import pytest
from rich.console import Console

from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.result_file import ResultDocument
from rig.page.rows import parameter_rows
from rig.report.certificate.dcc import digital_certificate
from rig.report.findings.result_kind import NoOutlet, ResultKind
from rig.report.header import calibration_header
from rig.report.kinds.kind_registry import history_records, kinds
from rig.report.terminal.result_table import print_result
from support.documents.certified import LABORATORY, certificate, everything, over_temperature, read

NAMES = [kind.name for kind in kinds()]


@pytest.fixture(scope="module")
def document() -> ResultDocument:
    return everything().model_copy(update={"over_temperature": {"gyro": {"rate": over_temperature()}}})


@pytest.mark.parametrize("kind", kinds(), ids=NAMES)
def test_a_kind_has_every_outlet_or_says_in_a_line_why_not(kind: ResultKind[Any]) -> None:
    for outlet in fields(kind):
        said = getattr(kind, outlet.name)
        assert said is not None
        if isinstance(said, NoOutlet):
            assert len(said.why.split()) > 4 and "\n" not in said.why


def test_there_is_something_of_every_kind_in_the_result(document: ResultDocument) -> None:
    there = {kind.name for kind in kinds() if list(kind.find(document))}
    assert there >= set(NAMES) - {"verification"}


def test_the_terminal_shows_every_kind(document: ResultDocument) -> None:
    console = Console(width=200, file=io.StringIO(), record=True)
    print_result(document, console)
    text = console.export_text()
    for said in ("gyro: ", "gyro, accelerometer: ", "compass, magnetometer as mounted: ", "Earth's rate found"):
        assert said in text
    assert "gyro, gyroscope: bias by repeat" in text


def test_the_page_shows_every_kind_that_has_numbers(document: ResultDocument) -> None:
    rows = {row["sensor"]: row for row in parameter_rows(document)}
    assert set(rows) >= {"gyro", "gyro, accelerometer", "compass, magnetometer",
                         "gyro: the Earth's rate in the arm's base",
                         "gyro, gyroscope: largest change of the bias"}  # fmt: skip
    assert rows["compass, magnetometer"]["unit"] == "µT"
    field = document.magnetometers["compass"]
    assert isinstance(field, MagnetometerEntry)
    assert rows["compass, magnetometer"]["bias"] == pytest.approx([1e6 * each for each in field.bias_t])
    earth = rows["gyro: the Earth's rate in the arm's base"]
    assert earth["unit"] == "°/h" and earth["scale"] is None


def test_a_history_follows_every_kind_that_has_numbers(document: ResultDocument) -> None:
    found = {(each.sensor, each.quantity) for each in history_records(document)}
    assert found >= {("gyro", "rate"), ("gyro", "acceleration"), ("compass", "field"), ("gyro", "Earth's rate")}


def test_both_certificates_and_the_header_hold_every_kind_they_can(document: ResultDocument) -> None:
    page = " ".join(read(certificate(document)).text.split())
    digital = digital_certificate(certificate(document, LABORATORY)).decode()
    for kind in ("gyroscope", "accelerometer", "magnetometer"):
        assert f"{kind.capitalize()} LSM9DS1" in page
        assert f"calibration of {kind}" in digital
    assert "Earth's rate, measured" in page and "Earth's rate measured by gyroscope gyro" in digital
    assert "by repeat" in page and "bias by repeat of gyro, rate" in digital
    header = calibration_header(document)
    for function in ("gyro_calibrate(", "gyro_calibrate_acceleration(", "compass_calibrate_field("):
        assert function in header
