"""The digital certificate: valid by PTB's schema and by PTB's rules, and it holds what the result holds."""

import time
from xml.etree.ElementTree import Element, fromstring

import numpy as np
import pytest

from rig.config.judging_sections import CertificateSection, SiteSection
from rig.data.result_file import VectorEntry, read_result
from rig.errors import Refused
from rig.report.certificate.dcc import digital_certificate
from rig.report.certificate.stated import Stated
from rig.report.certificate.tables import JOINT_FACTOR
from rig.report.certificate.xml_parts import product
from support.certified import LABORATORY, certificate, compared, result, with_accelerometer
from support.dcc_rules import rule_faults, schema_faults
from support.paths import FIXTURES

NAMES = {"dcc": "https://ptb.de/dcc", "si": "https://ptb.de/si"}
HOSTILE = "a <b>&amp;\x00\x1b[31m ]]> \"'  "
SILENT = Stated(SiteSection(country="DE"))
SIMULATED = Stated(SiteSection(country="DE"), simulated=True)
AMENDED = Stated(
    LABORATORY.site.model_copy(update={"laboratory": HOSTILE}) if LABORATORY.site else None,
    CertificateSection.model_construct(
        **{**LABORATORY.certificate.model_dump(), "replaces": "RIG-1", "customer": HOSTILE, "condition": " "}
    ),
)
# (what stands there, what is planted): each must be refused by the schema or by the rules.
FAULTS = {
    "an outcome there is no word for": (">pass<", ">passed<"),
    "a day there is not": ("<dcc:issueDate>2026-11-", "<dcc:issueDate>2026-13-"),
    "a number that is none": ("<si:valueXMLList>1.", "<si:valueXMLList>x1."),
    "an uncertainty below zero": ("<si:uncertaintyXMLList>0", "<si:uncertaintyXMLList>-0"),
    "a probability above one": ("XMLList>0.95<", "XMLList>1.95<"),
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
def test_the_schema_finds_nothing_wrong(stated: Stated) -> None:
    assert schema_faults(digital_certificate(certificate(stated=stated))) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "stated", [LABORATORY, SILENT, SIMULATED, AMENDED], ids=["said", "unsaid", "simulated", "amended"]
)
def test_ptb_s_rules_find_nothing_wrong(stated: Stated) -> None:
    assert rule_faults(digital_certificate(certificate(stated=stated))) == []


@pytest.mark.slow
@pytest.mark.parametrize("stated", [LABORATORY, SILENT], ids=["said", "unsaid"])
def test_accelerometers_and_verifications_are_valid_too(stated: Stated) -> None:
    verified = read_result(FIXTURES / "verified").verification
    xml = digital_certificate(certificate(with_accelerometer().model_copy(update={"verification": verified}), stated))
    assert [len(each) for each in map(numbers, found(xml, "si:valueXMLList"))] == [3, 3, 6, 3, 3, 3, 3, 6]
    assert rule_faults(xml) == []
    assert schema_faults(xml) == []


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
    sensor = result().sensors["gyro"]
    assert sensor.budget is not None
    xml = digital_certificate(certificate())
    scale, bias, six, skew = map(numbers, found(xml, "si:valueXMLList"))
    assert (scale, bias, six) == ([*sensor.scale], [*sensor.bias_rad_s], [*sensor.scale, *sensor.bias_rad_s])
    expanded = [number for each in found(xml, "si:uncertaintyXMLList") for number in numbers(each)]
    assert isinstance(sensor.vector_model, VectorEntry)
    assert skew == [*sensor.vector_model.non_orthogonality_rad]
    stds = sensor.vector_model.non_orthogonality_std_rad
    assert expanded == [*sensor.budget.expanded, *(2 * std for std in stds)]
    covariance = np.array([float(each.text or "") for each in found(xml, "si:covariance/si:value")]).reshape(6, 6).T
    np.testing.assert_allclose(covariance, np.array(sensor.covariance_combined), rtol=1e-9)
    units = [each.text for each in found(xml, "si:covariance/si:unit")]
    assert (units[0], units[3], units[-1]) == (
        r"\one",
        r"\radian\second\tothe{-1}",
        r"\radian\tothe{2}\second\tothe{-2}",
    )
    assert numbers(found(xml, "si:ellipsoidalRegionXMLList/si:coverageFactor")[0]) == [JOINT_FACTOR]


def test_the_joint_factor_holds_95_percent_of_six_values() -> None:
    from scipy.stats import chi2

    assert pytest.approx(np.sqrt(chi2(6).ppf(0.95)), abs=5e-4) == JOINT_FACTOR


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
    real = digital_certificate(certificate(compared(result())))
    assert [each.text for each in found(real, "dcc:traceable")] == ["true"]
    assert found(real, "dcc:valid") == []
    both = digital_certificate(certificate(compared(with_accelerometer())))
    assert [each.text for each in found(both, "dcc:traceable")] == ["true", "false"]  # gravity has no chain
    simulated = digital_certificate(certificate(compared(result()), SIMULATED))
    assert [each.text for each in found(simulated, "dcc:traceable")] == ["false"]
    assert [each.text for each in found(simulated, "dcc:valid")] == ["false"]
    assert "Simulated laboratory" in simulated.decode()


@pytest.mark.parametrize(
    ("refused", "why"),
    [
        (lambda: certificate(read_result(FIXTURES / "calibration")), "only noise is known"),
        (lambda: certificate(result().model_copy(update={"sensors": {}})), "calibrated nothing"),
        (lambda: certificate(stated=Stated()), "country is not stated"),
    ],
)
def test_what_cannot_be_certified_is_refused(refused, why: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(Refused, match=why) as error:
        digital_certificate(refused())
    assert error.value.name == "no_digital_certificate"


def test_it_takes_no_time() -> None:
    made = certificate()
    started_s = time.perf_counter()
    digital_certificate(made)
    assert time.perf_counter() - started_s < 0.5
