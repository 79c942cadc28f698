"""What has no budget has U by its degrees of freedom, the same at the terminal, on the page and in the digital one."""

import io
from collections.abc import Callable
from xml.etree.ElementTree import fromstring

import numpy as np
import pytest
from rich.console import Console

from rig.config.judging.judging_sections import SiteSection
from rig.data.quantity import RATE
from rig.data.result_file import ResultDocument, VectorEntry
from rig.estimation.statistics.coverage import PROBABILITY, coverage_factors, coverage_probability
from rig.report.certificate.dcc import digital_certificate
from rig.report.certificate.statements import StatedFacts
from rig.report.kinds.bias_drift import drift_table
from rig.report.kinds.kind_registry import history_records
from rig.report.tables.certificate import DEG, pair
from rig.report.terminal.result_table import print_result
from rig.report.words.expanded_uncertainty import expanded, factor_words
from support.documents.certified import certificate, everything, over_temperature, read, result

NAMES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
GERMAN = StatedFacts(SiteSection(country="DE"))
SCARCE = (7.0, 12.0, None)


def scarce() -> ResultDocument:
    """Of which angles, gravity's share and drifts are known with few degrees of freedom."""
    document = everything()
    sensor = document.gyroscopes["gyro"]
    assert isinstance(sensor.vector_model, VectorEntry)
    angles = {"non_orthogonality_degrees_of_freedom": SCARCE, "g_sensitivity_degrees_of_freedom": (SCARCE,) * 3}
    sensor = sensor.model_copy(update={"vector_model": sensor.vector_model.model_copy(update=angles)})
    drifts = {
        name: {quantity: each.model_copy(update={"degrees_of_freedom": SCARCE}) for quantity, each in found.items()}
        for name, found in document.bias_drift.items()
    }
    return document.model_copy(update={"gyroscopes": {"gyro": sensor}, "bias_drift": drifts})


def terminal(document: ResultDocument) -> str:
    console = Console(width=200, file=io.StringIO(), record=True)
    print_result(document, console)
    return console.export_text()


@pytest.mark.slow
def test_u_of_angles_is_the_same_in_every_outlet() -> None:
    document = scarce()
    vector = document.gyroscopes["gyro"].vector_model
    assert isinstance(vector, VectorEntry)
    factors = coverage_factors([7.0, 12.0, np.inf])
    widths = factors * vector.non_orthogonality_std_rad
    k = f"k = {factors[2]:.3g} to {factors[0]:.3g}"
    page = " ".join(read(certificate(document)).text.split())
    for angle, width in zip(vector.non_orthogonality_rad, widths.tolist(), strict=True):
        printed = pair(DEG * angle, DEG * width)
        assert f"{printed.value}° ± {printed.uncertainty}°" in page
    assert f"(± U, {k})" in page
    assert f"(± {DEG * max(widths):.2g}, {k})" in terminal(document)
    (kept,) = (each for each in history_records(document) if each.quantity == "rate")
    parameters = {parameter.name: parameter.expanded for parameter in kept.parameters}
    assert [parameters[f"nonorth_{each}"] for each in ("yz", "zx", "xy")] == pytest.approx(widths)
    assert vector.g_sensitivity_std_rad_s_per_m_s2 is not None
    assert parameters["gxx"] == pytest.approx(factors[0] * vector.g_sensitivity_std_rad_s_per_m_s2[0][0])
    xml = fromstring(digital_certificate(certificate(document, GERMAN)))
    (skew, *_) = (
        each
        for each in xml.iterfind(".//dcc:result", NAMES)
        if "less a right one" in each.findtext("dcc:name/dcc:content", "", NAMES)
    )
    listed = {
        name: [float(word) for word in skew.findtext(f".//si:{name}XMLList", "", NAMES).split()]
        for name in ("uncertainty", "coverageFactor", "coverageProbability")
    }
    np.testing.assert_allclose(listed["uncertainty"], widths, rtol=1e-12)
    np.testing.assert_allclose(listed["coverageFactor"], factors, rtol=1e-12)
    assert listed["coverageProbability"] == [round(PROBABILITY, 4)]
    assert k in skew.findtext("dcc:description/dcc:content", "", NAMES)


def test_u_of_a_drift_is_by_its_freedom_at_the_terminal_and_on_the_page() -> None:
    document = scarce()
    drift = document.bias_drift["gyro"]["rate"]
    console = Console(width=200, file=io.StringIO(), record=True)
    console.print(drift_table("gyro", RATE, drift))
    assert f"± U (k ≤ {coverage_factors(7.0):.2f})" in console.export_text()
    page = " ".join(read(certificate(document)).text.split())
    whole = np.hypot(drift.repeats[0].scale_fixed.std, drift.common_std)
    printed = pair(drift.repeats[0].scale_fixed.bias[0], float(coverage_factors(7.0) * whole[0]))
    assert f"{printed.value} ± {printed.uncertainty}" in page


def warmed() -> ResultDocument:
    """Over temperature too, where U is 2.1 to 2.6 standard uncertainties."""
    return everything().model_copy(update={"over_temperature": {"gyro": {"rate": over_temperature()}}})


@pytest.mark.slow
def test_u_over_temperature_is_k_times_u_in_the_digital_certificate() -> None:
    entry = over_temperature()
    xml = fromstring(digital_certificate(certificate(warmed(), GERMAN)))
    (bias,) = (
        result
        for result in xml.iterfind(".//dcc:result", NAMES)
        if result.findtext("dcc:name/dcc:content", "", NAMES) == "bias along y over temperature"
    )
    widths, factors = (
        [float(number) for number in bias.findtext(f".//si:{name}XMLList", "", NAMES).split()]
        for name in ("uncertainty", "coverageFactor")
    )
    assert min(factors) > 2.05
    k = "k = 2.23 to 2.49"  # of the five temperatures that are shown
    assert f"expanded uncertainty, {k}" in " ".join(read(certificate(warmed())).text.split())
    assert f"± U ({k})" in terminal(warmed())
    powers = np.array([[(row.temperature_c - entry.reference_c) ** n for n in range(4)] for row in entry.table])
    columns = [13 + 3 * n for n in range(4)]
    covariance = np.array(entry.covariance)[np.ix_(columns, columns)]
    std = np.sqrt(np.einsum("ti,ij,tj->t", powers, covariance, powers))
    np.testing.assert_allclose(np.divide(widths, factors), std, rtol=1e-12)


@pytest.mark.parametrize("document", [everything, scarce, warmed], ids=["uncounted", "scarce", "warmed"])
def test_k_of_every_uncertainty_in_the_digital_certificate_is_the_page_s(
    document: Callable[[], ResultDocument],
) -> None:
    """Of scale and bias the sentence of EA-4/02, of the rest k beside the values; each probability is Student's t's."""
    made = certificate(document(), GERMAN)
    page, xml = " ".join(read(made).text.split()), fromstring(digital_certificate(made))
    stated = 0
    for each in xml.iterfind(".//dcc:result", NAMES):
        if each.find(".//si:uncertaintyXMLList", NAMES) is None:
            continue
        stated += 1
        name, said = (
            " ".join(each.findtext(f"dcc:{of}/dcc:content", "", NAMES).split()) for of in ("name", "description")
        )
        factors, probabilities = (
            [float(number) for number in each.findtext(f".//si:{of}XMLList", "", NAMES).split()]
            for of in ("coverageFactor", "coverageProbability")
        )
        if "The reported expanded uncertainty" in said:
            assert said[said.index("The reported expanded") :] in page, name
            continue
        assert probabilities == [round(PROBABILITY, 4)], name
        low, high = f"{min(factors):.3g}", f"{max(factors):.3g}"
        words = f"k = {low}" if low == high else f"k = {low} to {high}"
        assert words in said, name
        if not name.endswith(("by repeat", "over temperature")):  # each axis for itself, on the page all three
            assert words in page, name
    assert stated >= 12


def test_where_nobody_counted_it_says_so_and_is_two_standard_deviations() -> None:
    assert expanded([1.0, 2.0], None).widths == [2.0, 4.0]
    assert factor_words(None) == "k = 2, degrees of freedom not counted"
    document = result()
    sensor = document.gyroscopes["gyro"]
    uncounted = sensor.vector_model.model_copy(update={"non_orthogonality_degrees_of_freedom": None})
    document = document.model_copy(
        update={"gyroscopes": {"gyro": sensor.model_copy(update={"vector_model": uncounted})}}
    )
    assert "degrees of freedom not counted" in read(certificate(document)).text
    assert "degrees of freedom not counted" in terminal(document)


def test_what_a_run_finds_beside_scale_and_bias_has_freedom_between_the_scarcest_line_s_and_none_to_count() -> None:
    sensor = result().gyroscopes["gyro"]
    assert isinstance(sensor.vector_model, VectorEntry) and sensor.budget is not None
    fewest = min(
        contributor.degrees_of_freedom
        for contributor in sensor.budget.contributors
        if contributor.degrees_of_freedom is not None
    )
    vector = sensor.vector_model
    for dof in (
        vector.non_orthogonality_degrees_of_freedom,
        vector.mounting_degrees_of_freedom,
        *(vector.g_sensitivity_degrees_of_freedom or ()),
    ):
        counted = [each for each in dof or () if each is not None and each >= fewest]
        assert len(counted) == 3
        factors = expanded([1.0] * 3, counted).factors
        assert coverage_probability(factors, counted) == pytest.approx([PROBABILITY] * 3)
