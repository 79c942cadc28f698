"""The digital certificate: valid by PTB's schema and by PTB's rules, and it holds what the result holds."""

from collections.abc import Callable
from typing import Any
from xml.etree.ElementTree import Element, fromstring

import numpy as np
import pytest

from rig.config.judging.judging_sections import SiteSection
from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.result_file import ResultDocument, VectorEntry, read_result
from rig.errors import Refused
from rig.estimation.statistics.coverage import coverage_factors, find_ellipsoid_factor
from rig.report.certificate.content import Certificate
from rig.report.certificate.dcc import digital_certificate
from rig.report.certificate.statements import StatedFacts
from rig.report.tables.coverage_statements import joint_factor
from rig.report.tables.xml_parts import product
from support.documents.certified import (
    LABORATORY,
    add_accelerometer,
    add_comparison,
    certificate,
    everything,
    magnetometer,
    result,
    reversal,
)
from support.documents.dcc_rules import rule_faults, schema_faults
from support.documents.results import remove_budget
from support.paths import RECORDINGS

NAMES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
HOSTILE = "a <b>&amp;\x00\x1b[31m ]]> \"'  "
SILENT = StatedFacts(SiteSection(country="DE"))
SIMULATED = StatedFacts(SiteSection(country="DE"), simulated=True)
AMENDED = StatedFacts(
    LABORATORY.site.model_copy(update={"laboratory": HOSTILE}) if LABORATORY.site else None,
    LABORATORY.certificate.model_copy(update={"replaces": "RIG-1", "customer": HOSTILE, "condition": " "}),
)
# (what stands there, what is planted): each must be refused by the schema or by the rules.
FAULTS = {
    "an outcome there is no word for": (">pass<", ">passed<"),
    "a day there is not": ("<dcc:issueDate>20", "<dcc:issueDate>20-"),
    "a number that is none": ("<si:valueXMLList>1.", "<si:valueXMLList>x1."),
    "an uncertainty below zero": ("<si:uncertaintyXMLList>0", "<si:uncertaintyXMLList>-0"),
    "a probability above one": ("XMLList>0.9545<", "XMLList>1.9545<"),
    "a schema of another version": ('schemaVersion="3.2.1"', 'schemaVersion="2.4.0"'),
    "a truth between true and false": ("traceable>false<", "traceable>perhaps<"),
    "no certificate's number": ("uniqueIdentifier>", "identifier>"),
    "nobody who signs": ("dcc:respPersons>", "dcc:persons>"),
    "a country there is not": (">DE<", ">ZZ<"),
    "software without a release": (">v0.", ">"),
    "a result of no item": ('id="gyroscope-0"', 'id="gyroscope-7"'),
}


@pytest.mark.parametrize(
    "stated", [LABORATORY, SILENT, SIMULATED, AMENDED], ids=["said", "unsaid", "simulated", "amended"]
)
def test_the_schema_finds_nothing_wrong(stated: StatedFacts) -> None:
    assert schema_faults(digital_certificate(certificate(stated=stated))) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "stated", [LABORATORY, SILENT, SIMULATED, AMENDED], ids=["said", "unsaid", "simulated", "amended"]
)
def test_ptb_s_rules_find_nothing_wrong(stated: StatedFacts) -> None:
    assert rule_faults(digital_certificate(certificate(stated=stated))) == []


@pytest.mark.slow
@pytest.mark.parametrize("stated", [LABORATORY, SILENT], ids=["said", "unsaid"])
def test_accelerometers_and_verifications_are_valid_too(stated: StatedFacts) -> None:
    verified = read_result(RECORDINGS / "verified").verification
    xml = digital_certificate(certificate(add_accelerometer().model_copy(update={"verification": verified}), stated))
    assert [len(each) for each in map(numbers, found(xml, "si:valueXMLList"))] == [3, 3, 6, 3, 9, 3, 3, 6, 3, 3, 3]
    assert rule_faults(xml) == []
    assert schema_faults(xml) == []


def test_scale_factors_and_biases_say_each_how_warm_their_item_was() -> None:
    sensor = result().gyroscopes["gyro"]
    assert sensor.scale_conditions is not None and sensor.bias_conditions is not None
    colder = sensor.bias_conditions.model_copy(update={"temperature_c": 21.25})
    changed = {"gyroscopes": {"gyro": sensor.model_copy(update={"bias_conditions": colder})}}
    xml = digital_certificate(certificate(result().model_copy(update=changed), SILENT))
    conditions = {
        str(each.findtext("dcc:name/dcc:content", namespaces=NAMES)): float(
            str(each.findtext(".//si:value", None, NAMES))
        )
        for each in found(xml, "dcc:influenceCondition")
    }
    assert conditions == {
        "temperature of the item at the scale factors, by its own thermometer": sensor.scale_conditions.temperature_c,
        "temperature of the item at the biases, by its own thermometer": 21.25,
    }


def of_everything(stated: StatedFacts = LABORATORY, *, turned: bool = True) -> bytes:
    document = everything()
    reversals = {"compass": reversal(document)} if turned else {}
    return digital_certificate(certificate(document, stated, reversals))


@pytest.mark.slow
@pytest.mark.parametrize("stated", [LABORATORY, SIMULATED], ids=["said", "simulated"])
def test_all_that_a_run_may_find_is_valid(stated: StatedFacts) -> None:
    xml = of_everything(stated)
    assert rule_faults(xml) == []
    assert schema_faults(xml) == []
    document = everything()
    none: dict[str, Any] = {"gyroscopes": {}, "accelerometers": {}, "verification": {}}
    kinds: list[dict[str, Any]] = [{"bias_drift": {}}, {"magnetometers": {}, "accelerometers": document.accelerometers}]
    for update in kinds:
        part = digital_certificate(certificate(document.model_copy(update=none | update), stated))
        assert rule_faults(part) == [] and schema_faults(part) == []


def measured(xml: bytes, name: str) -> dict[str, Element]:
    """The results under a measurement of that name, by their own."""
    (of,) = [
        each
        for each in found(xml, "dcc:measurementResult")
        if each.findtext("dcc:name/dcc:content", namespaces=NAMES) == name
    ]
    results = of.findall("dcc:results/dcc:result", NAMES)
    return {str(each.findtext("dcc:name/dcc:content", namespaces=NAMES)): each for each in results}


def read_back(result_element: Element, size: int) -> tuple[list[float], np.ndarray]:
    """Values and covariance."""
    values = result_element.find(".//si:valueXMLList", NAMES)
    assert values is not None
    entries = [float(match.text or "") for match in result_element.findall(".//si:covariance/si:value", NAMES)]
    return numbers(values), np.array(entries).reshape(size, size).T


def test_a_magnetometer_s_covariance_is_the_result_s_as_mounted_and_turned_over() -> None:
    document = everything()
    entry, turned = magnetometer(), reversal(document)
    results = measured(of_everything(), "calibration of magnetometer compass")
    values, covariance = read_back(results["scale factors and biases, as mounted with their covariance"], 6)
    assert values == [*entry.scale, *entry.bias_t]
    combined = np.array(entry.covariance_combined)
    np.testing.assert_allclose(covariance, combined, rtol=1e-9)
    assert len({*np.array(entry.covariance).ravel()}) > 4  # and not a diagonal that anything would pass for
    own = next(each for name, each in results.items() if name.startswith("own bias and the arm's field"))
    values, covariance = read_back(own, 6)
    assert values == [*turned.bias_t, *turned.arm_field_t]
    np.testing.assert_allclose(covariance, np.array(turned.covariance), rtol=1e-9)
    units = {match.text for match in own.findall(".//si:covariance/si:unit", NAMES)}
    assert units == {r"\tesla\tothe{2}"}
    widths = results["bias, as mounted"].find(".//si:uncertaintyXMLList", NAMES)
    assert widths is not None
    np.testing.assert_allclose(numbers(widths), 2 * np.sqrt(np.diag(combined))[3:], rtol=1e-9)
    mounted = of_everything(turned=False).decode()
    assert "own bias" not in mounted and "the bias includes the arm's field" in mounted


def test_the_earth_s_rate_and_gravity_s_part_are_the_result_s() -> None:
    sensor = everything().gyroscopes["gyro"]
    assert isinstance(sensor.earth_rate, EarthRateEntry) and isinstance(sensor.vector_model, VectorEntry)
    results = measured(of_everything(), "calibration of gyroscope gyro")
    found = measured(of_everything(), "the Earth's rate measured by gyroscope gyro")
    values, covariance = read_back(found["Earth's rate"], 3)
    assert values == [*sensor.earth_rate.rate_rad_s]
    np.testing.assert_allclose(covariance, np.array(sensor.earth_rate.covariance_rad2_s2), rtol=1e-9)
    felt = results["g-sensitivity"].find(".//si:valueXMLList", NAMES)
    assert felt is not None and sensor.vector_model.g_sensitivity_rad_s_per_m_s2 is not None
    np.testing.assert_array_equal(numbers(felt), -np.ravel(sensor.vector_model.g_sensitivity_rad_s_per_m_s2))


def test_biases_by_repeat_are_the_result_s() -> None:
    results = measured(of_everything(), "bias by repeat of gyro, rate")
    drift = everything().bias_drift["gyro"]["rate"]
    for i, axis in enumerate("xyz"):
        values = results[f"bias along {axis} by repeat"].find(".//si:valueXMLList", NAMES)
        assert values is not None and numbers(values) == [repeat.scale_fixed.bias[i] for repeat in drift.repeats]
    assert r"\radian\second\tothe{-1}\kelvin\tothe{-1}" in of_everything().decode()


@pytest.mark.slow
@pytest.mark.parametrize("planted", FAULTS.values(), ids=FAULTS.keys())
def test_a_planted_fault_is_refused(planted: tuple[str, str]) -> None:
    there, fault = planted
    sound = digital_certificate(certificate(stated=SIMULATED)).decode()
    assert there in sound
    spoilt = sound.replace(there, fault).encode()
    assert rule_faults(spoilt) or schema_faults(spoilt)


def found(xml: bytes, path: str) -> list[Element]:
    return fromstring(xml).findall(f".//{path}", NAMES)


def numbers(element: Element) -> list[float]:
    return [float(number) for number in (element.text or "").split()]


def test_values_uncertainties_and_covariance_are_the_result_s() -> None:
    sensor = result().gyroscopes["gyro"]
    assert sensor.budget is not None
    xml = digital_certificate(certificate())
    scale, bias, six, skew, felt = map(numbers, found(xml, "si:valueXMLList"))
    assert (scale, bias, six) == ([*sensor.scale], [*sensor.bias_rad_s], [*sensor.scale, *sensor.bias_rad_s])
    expanded = [number for each in found(xml, "si:uncertaintyXMLList") for number in numbers(each)]
    assert isinstance(sensor.vector_model, VectorEntry)
    assert skew == [*sensor.vector_model.non_orthogonality_rad]
    vector = sensor.vector_model
    assert vector.g_sensitivity_std_rad_s_per_m_s2 and vector.g_sensitivity_degrees_of_freedom
    assert vector.non_orthogonality_degrees_of_freedom
    stds = [*vector.non_orthogonality_std_rad, *np.ravel(vector.g_sensitivity_std_rad_s_per_m_s2)]
    dof = [*vector.non_orthogonality_degrees_of_freedom, *sum(vector.g_sensitivity_degrees_of_freedom, ())]
    factors = coverage_factors([np.inf if each is None else each for each in dof])
    assert len(felt) == 9 and min(factors) > 2
    np.testing.assert_allclose(expanded, [*sensor.budget.expanded, *(factors * stds)], rtol=1e-12)
    covariance = np.array([float(each.text or "") for each in found(xml, "si:covariance/si:value")]).reshape(6, 6).T
    np.testing.assert_allclose(covariance, np.array(sensor.covariance_combined), rtol=1e-9)
    units = [each.text for each in found(xml, "si:covariance/si:unit")]
    assert (units[0], units[3], units[-1]) == (
        r"\one",
        r"\radian\second\tothe{-1}",
        r"\radian\tothe{2}\second\tothe{-2}",
    )
    assert numbers(found(xml, "si:ellipsoidalRegionXMLList/si:coverageFactor")[0]) == [joint_factor(sensor.budget)]


@pytest.mark.parametrize(("values", "dof"), [(6, np.inf), (3, np.inf), (6, 5.0), (3, 9.7)])
def test_an_ellipsoid_contains_95_percent_of_all_values_at_once(values: int, dof: float) -> None:
    rng = np.random.default_rng(3)
    drawn = np.sum(rng.standard_normal((100_000, values)) ** 2, axis=1)
    if np.isfinite(dof):
        drawn *= np.floor(dof) / rng.chisquare(np.floor(dof), len(drawn))  # a standard deviation from few readings
    factor = find_ellipsoid_factor(values, [np.inf, dof])
    assert np.mean(drawn <= factor**2) == pytest.approx(0.95, abs=0.002)


@pytest.mark.parametrize(
    ("first", "second", "both"),
    [
        (r"\one", r"\one", r"\one"),
        (r"\metre", r"\one", r"\metre"),
        (r"\metre\second\tothe{-2}", r"\metre\second\tothe{-2}", r"\metre\tothe{2}\second\tothe{-4}"),
    ],
)
def test_units_multiply(first: str, second: str, both: str) -> None:
    assert product(first, second) == product(second, first) == both


def test_it_says_whether_it_is_traceable_and_that_a_simulated_one_is_not_valid() -> None:
    real = digital_certificate(certificate(add_comparison(result())))
    assert [each.text for each in found(real, "dcc:traceable")] == ["true"]
    assert found(real, "dcc:valid") == []
    both = digital_certificate(certificate(add_comparison(add_accelerometer())))
    assert [each.text for each in found(both, "dcc:traceable")] == ["true", "true"]  # time's, and gravity's
    assert [each.text for each in found(of_everything(), "dcc:traceable")] == ["true", "true", "false"]
    simulated = digital_certificate(certificate(add_comparison(result()), SIMULATED))
    assert [each.text for each in found(simulated, "dcc:traceable")] == ["false"]
    assert [each.text for each in found(simulated, "dcc:valid")] == ["false"]
    assert "Simulated laboratory" in simulated.decode()


def half_known() -> ResultDocument:
    """A result that says which parts its uncertainty has, and not what they come to."""
    document = result()
    of_all = document.gyroscopes.items()
    halves = {name: each.model_copy(update={"covariance_combined": None}) for name, each in of_all}
    return document.model_copy(update={"gyroscopes": halves})


@pytest.mark.parametrize(
    ("refused", "why"),
    [
        (
            lambda: certificate(remove_budget(read_result(RECORDINGS / "six_observation"))),
            "only the noise part of the uncertainty",
        ),
        (lambda: certificate(result().model_copy(update={"gyroscopes": {}})), "calibrated nothing"),
        (lambda: certificate(stated=StatedFacts()), "country is not stated"),
        (lambda: certificate(half_known()), "only a part of the uncertainty of lsm9ds1 LSM9DS1-001 is known"),
    ],
)
def test_what_cannot_be_certified_is_refused(refused: Callable[[], Certificate], why: str) -> None:
    with pytest.raises(Refused, match=why) as error:
        digital_certificate(refused())
    assert error.value.name == "no_digital_certificate"


def test_it_states_no_place_and_the_script_with_its_hash() -> None:
    xml = digital_certificate(certificate())
    assert [each.text for each in found(xml, "dcc:performanceLocation")] == ["other"]
    assert certificate().procedure in xml.decode()


@pytest.mark.slow
def test_the_equipment_is_the_arm_that_was_found_and_valid_with_it_or_without() -> None:
    def equipment(document: ResultDocument) -> list[str]:
        xml = digital_certificate(certificate(document))
        assert not schema_faults(xml) and not rule_faults(xml)
        (arm,) = fromstring(xml).iterfind(".//dcc:measuringEquipment", NAMES)
        return [element.text or "" for element in arm.iter() if element.text]

    found = {"arm_maker": "Universal Robots", "arm_model": "UR5e or UR7e"}
    told = result().model_copy(update={"provenance": result().provenance.model_copy(update=found)})
    assert equipment(told)[:3] == ["robot arm Universal Robots UR5e or UR7e", "Universal Robots", "UR5e or UR7e"]
    assert "model was not recorded" in equipment(result())[0]
