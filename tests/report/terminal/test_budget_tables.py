"""A budget adds up to the U beside the value wherever it is printed, and the digital certificate says the same of k."""

import json
import math
import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, fromstring

import numpy as np
import pytest
from lxml import html

from rig.analysis.estimator_names import DEFAULT_ESTIMATOR
from rig.cli import main
from rig.config.judging.judging_sections import SiteSection
from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.budget import BudgetEntry
from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.result_file import GyroscopeEntry, ResultDocument, read_result
from rig.estimation.statistics.coverage import coverage_factors
from rig.plans.recorded_run import judge_phases, open_run
from rig.report.certificate.certificate_page import certificate_page
from rig.report.certificate.dcc import digital_certificate
from rig.report.certificate.statements import StatedFacts
from rig.report.document import document_of
from rig.report.tables.coverage_statements import coverage_sentence
from rig.report.terminal.result_table import print_outcome
from rig.report.words.printed_budget import dof_text
from rig.report.words.printed_values import figures
from support.documents.certified import certificate, everything, result
from support.documents.dcc_rules import schema_faults
from support.paths import DOCS, RECORDINGS
from support.recordings.frozen import frozen

NAMES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
GERMAN = StatedFacts(SiteSection(country="DE"))
BUDGETED = [each for each in frozen() if "budget" in (each / "result.json").read_text(encoding="utf-8")]


def budgets(document: ResultDocument) -> Iterator[tuple[BudgetEntry, tuple[float, ...]]]:
    """In the order of the certificate, each with its scale factors."""
    rest = dict(document.accelerometers)
    found: list[GyroscopeEntry | AccelerometerEntry | MagnetometerEntry] = []
    for name, sensor in document.gyroscopes.items():
        if sensor.role == "calibrate":
            found += [sensor, *([rest.pop(name)] if name in rest else [])]
    found += rest.values()
    found += [
        magnetometer for magnetometer in document.magnetometers.values() if isinstance(magnetometer, MagnetometerEntry)
    ]
    yield from ((each.budget, each.scale) for each in found if each.budget is not None)


def of_the_terminal(document: ResultDocument) -> list[BudgetEntry]:
    """In the order of the terminal: kind by kind."""
    kinds = [*document.gyroscopes.values(), *document.accelerometers.values(), *document.magnetometers.values()]
    return [kind.budget for kind in kinds if not isinstance(kind, ErrorEntry) and kind.budget is not None]


def elsewhere(samples: str, table: str, estimator: str | None) -> list[str]:
    """The arguments of `rig solve` for an example's readings."""
    files = [str(DOCS / "examples" / name) for name in (samples, table)]
    asked = [] if estimator is None else ["--estimator", estimator]
    if table == "sweeps.csv":
        return [files[0], "--sweeps", files[1], *asked]
    exact = [] if estimator is None else ["--exact-rates"]
    place = ["--gravity-m-s2", "9.80061", "--field-t", "47.98e-6", "--up=-z"]
    return [files[0], "--attitudes", files[1], *place, *asked, *exact]


def budgets_in(found: dict[str, Any]) -> list[BudgetEntry]:
    """Of a document of `rig solve`, kind by kind."""
    kinds = (found["gyroscopes"], found.get("accelerometers", {}), found.get("magnetometers", {}))
    return [BudgetEntry.model_validate(each["budget"]) for of in kinds for each in of.values()]


def named(folder: Path) -> str:
    return "/".join(folder.parts[-2:])


def printed(document: ResultDocument) -> list[list[list[str]]]:
    """The budgets on the page: rows of cells."""
    page = html.fromstring(certificate_page(certificate(document, GERMAN)))
    return [
        [[" ".join(cell.text_content().split()) for cell in row] for row in table.iter("tr")]
        for table in page.find_class("budget")
    ]


def at_the_terminal(text: str) -> list[list[list[str]]]:
    """The same rows as on the page, from what a terminal shows."""
    found: list[list[list[str]]] = []
    for line in text.splitlines():
        cells = [" ".join(cell.split()) for cell in re.split("[│┃]", line)[1:-1]]
        if cells[:1] == ["contributor"]:
            found.append([])
        if found and len(cells) == 7 and (not found[-1] or found[-1][-1][0] != "expanded U"):
            name, kind, dof, *parts = cells
            summed = name in ("combined u", "expanded U")
            found[-1].append([name, *parts] if summed else [name, kind, "", "", dof, *parts])
    return found


def check_adds_up(rows: list[list[str]], budget: BudgetEntry) -> None:
    heading, *lines, combined, expanded = rows
    for column, quantity in ((5, slice(0, 3)), (7, slice(3, 6))):
        parts = [line[column] for line in lines]
        u, big_u, k = combined[column - 4], expanded[column - 4], expanded[column - 3]
        step = 10.0 ** -len(u.partition(".")[2])
        together = math.sqrt(sum(float(part) ** 2 for part in parts))
        assert together == pytest.approx(float(u), abs=step * (0.5 + 0.5 * math.sqrt(len(parts)))), heading[column]
        factor, rounding = float(k.removeprefix("× ")), 0.005 * float(u) + 0.5 * step
        assert float(big_u) == pytest.approx(factor * float(u), abs=rounding + 0.5 * factor * step)
        axis = "xyz".index(re.findall(r"[kb]([xyz])", heading[column])[0])
        known = " ".join(dof_text(budget.effective_dof[quantity][axis]).split())
        assert combined[column - 3] == f"ν {known}"


@pytest.mark.parametrize("folder", BUDGETED, ids=named)
def test_the_lines_of_every_budget_add_up_to_the_uncertainty_that_is_printed(folder: Path) -> None:
    document = read_result(folder)
    tables, stated = printed(document), list(budgets(document))
    assert len(tables) == len(stated) > 0
    for rows, (budget, scale) in zip(tables, stated, strict=True):
        check_adds_up(rows, budget)
        for first, relative in ((0, np.array(scale)), (3, np.ones(3))):
            axis = int(np.argmax(np.array(budget.expanded[first : first + 3]) / relative))
            (shown,) = re.findall(rf"u\({'kb'[first // 3]}([xyz])\)", " ".join(rows[0]))
            assert shown == "xyz"[axis], "of the axis that is known least"
        every = np.sqrt(np.sum(np.square([line.std for line in budget.contributors]), axis=0))
        np.testing.assert_allclose(every, budget.std, rtol=1e-9, err_msg="of the others in result.json")


@pytest.mark.parametrize("folder", BUDGETED, ids=named)
def test_the_terminal_shows_the_budgets_of_the_certificate(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    document = read_result(folder)
    calibrated = {name: gyroscope for name, gyroscope in document.gyroscopes.items() if gyroscope.role == "calibrate"}
    document = document.model_copy(update={"gyroscopes": calibrated})
    print_outcome(document, as_json=False, whole=True)
    shown = capsys.readouterr().out
    assert "\\x" not in shown
    tables, numbers = at_the_terminal(shown), slice(-4, None)
    for rows, budget in zip(tables, of_the_terminal(document), strict=True):
        check_adds_up(rows, budget)
    pages = printed(document)
    assert sorted(row[numbers] for rows in tables for row in rows[1:]) == sorted(
        row[numbers] for rows in pages for row in rows[1:]
    )


@pytest.mark.one_in(2)  # of sweeps, of rests and of a swinging body
@pytest.mark.slow
@pytest.mark.parametrize(
    ("samples", "table", "estimator"),
    [
        ("samples.csv", "sweeps.csv", None),
        ("samples.csv", "sweeps.csv", "newton"),
        ("still_samples.csv", "still_attitudes.csv", None),
        ("swinging_samples.csv", "swinging_attitudes.csv", None),
        ("swinging_samples.csv", "swinging_attitudes.csv", "maximum_likelihood"),
    ],
)
def test_a_budget_of_readings_made_elsewhere_adds_up_and_every_scatter_is_counted_or_in_u(
    samples: str,
    table: str,
    estimator: str | None,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setenv("COLUMNS", "400")
    arguments = elsewhere(samples, table, estimator)
    assert main(["solve", *arguments, "--all"]) == 0
    tables = at_the_terminal(capsys.readouterr().out)
    assert main(["solve", *arguments, "--json"]) == 0
    stated = budgets_in(json.loads(capsys.readouterr().out))
    assert len(tables) == len(stated) > 0
    for rows, budget in zip(tables, stated, strict=True):
        check_adds_up(rows, budget)
        np.testing.assert_allclose(budget.coverage_factors, coverage_factors(budget.effective_dof))
        dof = {line[0]: (line[1], line[4]) for line in rows[1:-2]}
        assert all(number == "∞" for kind, number in dof.values() if kind == "B")
        assert all(number == "in u" or float(number) >= 1 for kind, number in dof.values() if kind == "A")


def test_a_budget_with_counted_freedom_adds_up_and_every_scatter_has_a_number() -> None:
    document = everything()
    for rows, (budget, _) in zip(printed(document), budgets(document), strict=True):
        check_adds_up(rows, budget)
    (sensor,) = result().gyroscopes.values()
    assert sensor.budget is not None
    (rows,) = printed(result())
    of_type = {line[0]: (line[1], line[4]) for line in rows[1:-2]}
    assert of_type["noise"][0] == "A" and re.fullmatch(r"\d+(\.\d)?( × 10[⁰¹²³⁴⁵⁶⁷⁸⁹]+)?", of_type["noise"][1])
    assert all(dof == "∞" for kind, dof in of_type.values() if kind == "B")
    assert not any(dof == "∞" for kind, dof in of_type.values() if kind == "A")


def scarce(document: ResultDocument) -> ResultDocument:
    """The same where biases are known with few degrees of freedom, differently along each axis."""
    sensor = document.gyroscopes["gyro"]
    assert sensor.budget is not None
    known, factors = (4000.0, 5000.0, 6000.0, 9.0, 17.0, 26.0), (2.0, 2.0, 2.0, 2.32, 2.16, 2.10)
    changed = {
        "degrees_of_freedom": known,
        "coverage_factors": factors,
        "coverage_factor": max(factors),
        "expanded": tuple(np.multiply(factors, sensor.budget.std).tolist()),
    }
    budget = sensor.budget.model_copy(update=changed)
    return document.model_copy(update={"gyroscopes": {"gyro": sensor.model_copy(update={"budget": budget})}})


@pytest.mark.slow
@pytest.mark.parametrize(
    "made",
    [result, lambda: scarce(result()), *(partial(read_result, each) for each in BUDGETED)],
    ids=["today", "scarce", *map(named, BUDGETED)],
)
def test_k_and_its_probability_are_the_same_on_the_page_and_in_the_digital_certificate(
    made: Callable[[], ResultDocument],
) -> None:
    document = made()
    stating = certificate(document, GERMAN)
    xml, text = digital_certificate(stating), html.fromstring(certificate_page(stating)).text_content()
    page = " ".join(text.split())
    assert schema_faults(xml) == []
    results = fromstring(xml).iterfind(".//dcc:result", NAMES)
    stated = [
        each for each in results if "reported expanded" in (each.findtext("dcc:description/dcc:content", "", NAMES))
    ]
    of = list(budgets(document))
    assert len(stated) == 2 * len(of)
    for (scale, bias), (budget, _) in zip(zip(stated[::2], stated[1::2], strict=True), of, strict=True):
        sentence = " ".join(coverage_sentence(budget).split())
        assert sentence in page
        factors, probabilities, widths = (
            [number for each in (scale, bias) for number in listed(each, name)]
            for name in ("coverageFactorXMLList", "coverageProbabilityXMLList", "uncertaintyXMLList")
        )
        np.testing.assert_allclose(np.divide(widths, factors), budget.std, rtol=1e-9)
        covers = int(re.findall(r"approximately (\d+) %", sentence)[0])
        assert covers == round(100 * min(probabilities))
        assert ("95.45 %" in sentence) == (abs(min(probabilities) - 0.9545) < 5e-5)
        assert ks_of(sentence) == [f"{factor:.2f}" for factor in factors]


@pytest.mark.slow
def test_each_value_has_the_coverage_factor_of_its_degrees_of_freedom() -> None:
    """A KVH 1775 that was at rest for little time: what its bias does is known from fifteen differences."""
    run = open_run(RECORDINGS / "kvh1775")
    document = document_of(judge_phases(run, DEFAULT_ESTIMATOR))
    by_dof = document.gyroscopes["kvh"].budget
    assert by_dof is not None
    np.testing.assert_allclose(by_dof.expanded, np.multiply(by_dof.coverage_factors, by_dof.std), rtol=1e-9)
    assert by_dof.coverage_factors == pytest.approx(coverage_factors(by_dof.effective_dof))
    assert 2.0 < by_dof.coverage_factors[0] < 2.01 and by_dof.coverage_factors[4] > 2.1
    noise = {contributor.name: contributor.degrees_of_freedom for contributor in by_dof.contributors}["noise"]
    assert noise is not None and 20 < noise < 1e6
    for rows, (budget, _) in zip(printed(document), budgets(document), strict=True):
        check_adds_up(rows, budget)
    bias = next(check for check in document.checks if check.name == "kvh.bias")
    assert bias.uncertainty in by_dof.expanded[3:] and bias.coverage_factor in by_dof.coverage_factors[3:]


def listed(found: Element, name: str) -> list[float]:
    """One for each of three values, of which one may stand for all."""
    numbers = [float(word) for word in found.findtext(f".//si:{name}", "", NAMES).split()]
    return numbers * 3 if len(numbers) == 1 else numbers


def ks_of(sentence: str) -> list[str]:
    """Of six values, from the words of the page."""
    if "scale factors k" not in sentence:
        (alike,) = re.findall(r"coverage factor k = ([\d.]+)", sentence)
        return [f"{float(alike):.2f}"] * 6
    found = []
    for group in sentence.partition("scale factors k")[2].split("biases k"):
        alike = re.findall(r"^ = ([\d.]+) ", group)
        found.extend(alike * 3 if alike else re.findall(r"[xyz] ([\d.]+) \(", group))
    return found


@pytest.mark.parametrize(("value", "said"), [(0.06, "0.06"), (615.0, "615"), (7.292115e-5, "7.29\u00a0×\u00a010⁻⁵")])
def test_a_half_width_is_printed_with_three_digits(value: float, said: str) -> None:
    assert figures(value) == said
