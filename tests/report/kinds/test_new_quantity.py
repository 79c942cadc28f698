"""A quantity that a test alone declares, a field of an entry and a row, is in every outlet of a result."""

import io
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from rich.console import Console

from rig.cli import main
from rig.data.entries.result_types import Freedom3, Vector3
from rig.data.quantity import Quantity
from rig.data.result_file import GyroscopeEntry, ResultDocument
from rig.history.entered.finished_run import FinishedRun, compact
from rig.history.entered.recomputed_result import differing_parts
from rig.history.series import subjects, trends
from rig.history.series_plots import draw_trends
from rig.history.store import Selection, open_history
from rig.history.terminal.change_words import name_in_words
from rig.notebook.results import Result
from rig.page.outcome_screen import outcome_rows
from rig.page.rows import parameter_rows
from rig.report.certificate.dcc import digital_certificate
from rig.report.exports.exported_corrections import calibrations
from rig.report.exports.formats import CALIBRATION_FORMATS, texts_of_calibrations
from rig.report.findings import characteristics
from rig.report.findings.characteristic import OUTLETS, Characteristic, Series, Units, read_fields
from rig.report.findings.history_records import BIASES, SCALES
from rig.report.findings.result_kind import NoOutlet, ResultKind
from rig.report.kinds import kind_registry
from rig.report.kinds.kind_registry import history_records, kinds
from rig.report.terminal.result_table import print_result
from support.documents.certified import LABORATORY, certificate, everything, over_temperature, read
from support.documents.dcc_rules import schema_faults

SIZE = np.pi / 180 / 60  # °/√h
VALUES, STDS = (1e-4, 2e-4, 3e-4), (4e-6, 5e-6, 6e-6)


def units(quantity: Quantity) -> Units:
    return Units(f"{quantity.unit}/√Hz", rf"{quantity.d_si}\hertz\tothe{{-0.5}}", quantity.walk_unit)


DENSITY = Characteristic(
    "density of noise",
    ("x", "y", "z"),
    units,
    read_fields("noise_density", "rad_sqrt_s"),
    Series("bow_", "the density of noise along {}", drawn=True),  # begins as biases do, and is none
)


class DensityEntry(GyroscopeEntry):
    """What the entry of a gyroscope would be with three fields more."""

    noise_density_rad_sqrt_s: Vector3 | None = None
    noise_density_std_rad_sqrt_s: Vector3 | None = None
    noise_density_degrees_of_freedom: Freedom3 | None = None


class DensityDocument(ResultDocument):
    """Such a result."""

    gyroscopes: dict[str, DensityEntry]  # pyrefly: ignore[bad-override]  # of one kind more special


def plain() -> ResultDocument:
    return everything().model_copy(update={"over_temperature": {"gyro": {"rate": over_temperature()}}})


@pytest.fixture
def document(monkeypatch: pytest.MonkeyPatch) -> Iterator[ResultDocument]:
    """A result that states it, while the table of characteristics has its row."""
    gyroscope = next(kind for kind in kind_registry.RIG_KINDS if kind.name == "gyroscope")
    with_it = replace(gyroscope, characteristics=(*gyroscope.characteristics, DENSITY))
    others = [kind for kind in kind_registry.RIG_KINDS if kind is not gyroscope]
    monkeypatch.setattr(kind_registry, "RIG_KINDS", (with_it, *others))
    monkeypatch.setattr(characteristics, "RIG_CHARACTERISTICS", (*characteristics.RIG_CHARACTERISTICS, DENSITY))
    kinds.cache_clear()
    said = plain().model_dump(mode="json", by_alias=True, exclude_unset=True)
    said["gyroscopes"]["gyro"] |= {
        "noise_density_rad_sqrt_s": VALUES,
        "noise_density_std_rad_sqrt_s": STDS,
        "noise_density_degrees_of_freedom": (None, None, 12.0),
    }
    yield DensityDocument.model_validate(said)
    monkeypatch.undo()
    kinds.cache_clear()


def test_result_json_and_its_schema_have_the_field(document: ResultDocument) -> None:
    assert json.loads(document.text())["gyroscopes"]["gyro"]["noise_density_rad_sqrt_s"] == list(VALUES)
    assert "noise_density_rad_sqrt_s" in json.dumps(type(document).model_json_schema())


def test_the_terminal_says_it(document: ResultDocument) -> None:
    console = Console(width=200, file=io.StringIO(), record=True)
    print_result(document, console)
    (line,) = (line for line in console.export_text().splitlines() if "density of noise" in line)
    assert line.startswith("density of noise: x 0.344 ± 0.028  y 0.688 ± 0.034  z ")
    assert line.endswith(" °/√h (U, k = 2 to 2.23)")


@pytest.mark.slow
def test_both_certificates_state_it_with_u(document: ResultDocument) -> None:
    page = " ".join(read(certificate(document)).text.split())
    assert "gyro, density of noise: x 0.344 ± 0.028 °/√h, y 0.688 ± 0.034 °/√h, z " in page
    assert "(± U, k = 2 to 2.23)." in page
    xml = digital_certificate(certificate(document, LABORATORY))
    (found,) = (
        result
        for result in ElementTree.fromstring(xml).iter("{https://ptb.de/dcc}result")
        if "density of noise" in [each.text for each in result.iter("{https://ptb.de/dcc}content")]
    )
    said = [each.text or "" for each in found.iter() if each.tag.startswith("{https://ptb.de/si}")]
    assert any("0.0001 0.0002 0.0003" in each for each in said)
    assert any(r"\radian\second\tothe{-1}\hertz\tothe{-0.5}" in each for each in said)


def test_the_digital_certificate_with_it_is_one(document: ResultDocument) -> None:
    assert schema_faults(digital_certificate(certificate(document, LABORATORY))) == []


def test_page_and_notebook_show_it(document: ResultDocument) -> None:
    (row,) = (row for row in parameter_rows(document) if row["sensor"] == "gyro: density of noise")
    assert row["bias"] == pytest.approx(np.divide(VALUES, SIZE)) and row["scale"] is None
    assert (row["labels"], row["unit"], row["of"]) == (["x", "y", "z"], "°/√h", "combined")
    (first,) = (row for row in outcome_rows(document, {}) if row["name"] == "gyro: density of noise")
    assert first["bias"]["texts"][0] == "0.344" and first["bias"]["u"][0] == "0.028"
    result = Result(document)
    assert "gyro: density of noise x" in result._repr_html_()
    found = result["gyro"].characteristics["density of noise"]
    assert found.values.tolist() == list(VALUES) and found.unit == "rad/s/√Hz" and found.labels == ("x", "y", "z")
    assert found.expanded[:2].tolist() == pytest.approx([2 * STDS[0], 2 * STDS[1]]) and found.expanded[2] > 2 * STDS[2]


@pytest.mark.slow
def test_a_history_follows_it(document: ResultDocument, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (of,) = (each for each in history_records(document) if (each.sensor, each.quantity) == ("gyro", "rate"))
    assert [parameter.name for parameter in of.parameters if parameter.name in DENSITY.parameters] == [
        "bow_x",
        "bow_y",
        "bow_z",
    ]
    place, serial = str(tmp_path / "history.sqlite"), document.gyroscopes["gyro"].serial_number
    text = compact(json.loads(document.text()))
    with open_history(place) as history:
        history.enter(FinishedRun(text, document, "bench", (), False, "here", "/runs/1", ()))
        past = next(
            calibration
            for calibration in history.calibrations(Selection(serial_number=serial))
            if calibration.quantity == "rate"
        )
    names = list(past.parameters)
    assert names.index("gzz") < names.index("bow_x")  # after those of the rig's own
    assert past.parameters["bow_z"].unit == "rad/s/√Hz" and past.parameters["bow_z"].value == VALUES[2]
    assert main(["history", "list", serial, "--history", place]) == 0
    assert "bow_x rad/s/√Hz" in capsys.readouterr().out
    assert name_in_words("bow_y") == "the density of noise along y"
    (subject,) = (subject for subject in subjects([past]) if subject[2] == "rate")
    picture = draw_trends({subject: trends([past])}, tmp_path)[1].read_text(encoding="utf-8")
    assert "bow_x" in picture


def test_a_result_of_before_that_does_not_state_it_is_still_what_its_recordings_give(document: ResultDocument) -> None:
    assert differing_parts(plain(), document) == []
    other = document.gyroscopes["gyro"].model_copy(update={"noise_density_rad_sqrt_s": (1.1e-4, 2e-4, 3e-4)})
    changed = document.model_copy(update={"gyroscopes": {"gyro": other}})
    assert any("bow_x" in each for each in differing_parts(changed, document))


@pytest.mark.parametrize("name", CALIBRATION_FORMATS)
def test_exports_say_that_they_have_no_place_for_it(name: str, document: ResultDocument) -> None:
    texts = "\n".join(texts_of_calibrations(name)(calibrations(document)).values())
    assert "gyro, density of noise" in texts


@pytest.mark.parametrize("characteristic", characteristics.every_characteristic(), ids=lambda each: each.name)
def test_a_characteristic_is_in_every_outlet_or_says_in_a_line_why_not(characteristic: Characteristic) -> None:
    assert set(characteristic.exempt) <= set(OUTLETS)
    assert all(len(why.split()) > 3 and "\n" not in why for why in characteristic.exempt.values())
    assert (characteristic.series is None) == ("history" in characteristic.exempt)
    assert not set(characteristic.parameters) & {*SCALES, *BIASES}


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.name)
def test_no_two_characteristics_of_a_kind_share_a_name(kind: ResultKind[Any]) -> None:
    names = [
        name for characteristic in kind.characteristics for name in (characteristic.name, *characteristic.parameters)
    ]
    assert len(set(names)) == len(names)
    assert all(characteristic in characteristics.every_characteristic() for characteristic in kind.characteristics)


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.name)
def test_an_outlet_that_a_kind_has_not_tells_none_of_its_characteristics(kind: ResultKind[Any]) -> None:
    through = {"certificate": kind.block, "digital certificate": kind.measured, "history": kind.followed}
    for outlet in [outlet for outlet, of in through.items() if isinstance(of, NoOutlet)]:
        assert all(outlet in characteristic.exempt for characteristic in kind.characteristics)
