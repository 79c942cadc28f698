"""The certificate: all that ISO/IEC 17025 asks for, nothing invented, nothing loaded, noise not called uncertainty."""

import re
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.config.judging.judging_sections import CertificateSection, SiteSection
from rig.config.load import parse
from rig.data.entries.budget import BudgetEntry
from rig.data.entries.result_types import DetectionLimitEntry, ErrorEntry
from rig.data.result_file import CheckEntry, ResultDocument, read_result
from rig.errors import Refused
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.report.certificate.certificate_page import certificate_page
from rig.report.certificate.content import is_simulated
from rig.report.certificate.statements import StatedFacts, configuration_statements, folder_statements
from rig.report.entries.budget import budget_entry
from rig.report.tables.coverage_statements import coverage_sentence
from rig.report.words.printed_values import round_to_u
from rig.report.words.validity_words import list_omitted_rates
from support.documents.certified import (
    LABORATORY,
    add_accelerometer,
    add_comparison,
    certificate,
    everything,
    plant,
    read,
    result,
    reversal,
)
from support.documents.results import remove_budget
from support.paths import CONFIGS, RECORDINGS

CLAUSES = [
    *(f"7.8.2.1{letter}" for letter in "abcdefghijlmnop"),
    *(f"7.8.4.1{letter}" for letter in "abcdef"),
    "7.8.4.3",
    "7.8.6",
]
MARKUP = "<script>alert(1)</script>\"'><img src=x onerror=y>&amp;"
# What a result's model holds to a few words, and times.
FIXED = {
    *("schema", "verdict", "role", "kind", "distribution", "axis", "direction", "joint", "correction", "name", "clock"),
    *("unit", "model", "estimator", "started_utc", "solved_utc", "resumed_utc", "verified_utc", "status"),
    *("from_utc", "to_utc", "mean_utc", "quantity", "parameter"),
    *("non_orthogonality_order", "covariance_order", "covariance_units"),
}
BEYOND_ITS_LIMIT = CheckEntry(
    name="gyro.bias", value=0.2, limit=0.1, unit="rad/s", passed=False, uncertainty=0.01, kind="conformity"
)


def kinds() -> dict[str, ResultDocument]:
    """What a run may find, one kind each, and all at once."""
    whole = everything()
    none: dict[str, Any] = {
        "gyroscopes": {},
        "accelerometers": {},
        "magnetometers": {},
        "bias_drift": {},
        "verification": {},
    }
    return {
        "gyroscope": result(),
        "accelerometer": whole.model_copy(update=none | {"accelerometers": whole.accelerometers}),
        "magnetometer": whole.model_copy(update=none | {"magnetometers": whole.magnetometers}),
        "drift": whole.model_copy(
            update=none | {"bias_drift": whole.bias_drift, "accelerometers": whole.accelerometers}
        ),
        "everything": whole,
        "verification": read_result(RECORDINGS / "verified").model_copy(update={"gyroscopes": {}}),
    }


def budget_of(dof: float) -> BudgetEntry:
    """Of one contributor that tells scale factors with so much freedom, and biases with no end of it."""
    scale, bias = (np.diag([size] * 3 + [other] * 3) for size, other in ((1e-8, 0.0), (0.0, 1e-6)))
    lines = (Contributor("noise", "A", "normal", None, "", "", dof, scale),
             Contributor("offset", "B", "rectangular", 1e-3, "rad/s", "", np.inf, bias))  # fmt: skip
    return budget_entry(Budget(lines))


KINDS = ("gyroscope", "accelerometer", "magnetometer", "drift", "everything", "verification")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("stated", [LABORATORY, StatedFacts()], ids=["said", "unsaid"])
def test_every_clause_stands_there_with_words(kind: str, stated: StatedFacts) -> None:
    found = certificate(kinds()[kind], stated)
    page = read(found)
    silent = (
        {"7.8.4.1a", "7.8.4.1b"} if kind == "verification" else set()
    )  # no uncertainty was evaluated, and it says so
    assert [clause for clause in CLAUSES if not page.under.get(clause, "").strip()] == sorted(silent)
    if not silent:
        assert found.title == "Calibration certificate"


@pytest.mark.parametrize("kind", KINDS)
def test_every_uncertainty_that_is_printed_has_two_digits_and_its_value_the_same_decimals(kind: str) -> None:
    document = kinds()[kind]
    turned = {"compass": reversal(document)} if "compass" in document.magnetometers else {}
    pairs = re.findall(r"(−?[\d.]+)°? ± ([\d.]+)", read(certificate(document, reversals=turned)).text)
    for value, uncertainty in pairs:
        assert len(uncertainty.replace(".", "").strip("0")) <= 2 <= len(uncertainty.replace(".", "").lstrip("0")), pairs
        assert len(value.partition(".")[2]) == len(uncertainty.partition(".")[2])
    fewest = {"verification": 0, "gyroscope": 12, "accelerometer": 15, "magnetometer": 9, "drift": 30, "everything": 60}
    assert len(pairs) >= fewest[kind]


def test_what_replaces_what_is_said_by_an_amended_one() -> None:
    amended = StatedFacts(LABORATORY.site, LABORATORY.certificate.model_copy(update={"replaces": "RIG-1"}))
    assert "replaces RIG-1" in read(certificate(stated=amended)).under["7.8.8"]
    assert "7.8.8" not in read(certificate()).under
    assert certificate(stated=amended).number != certificate().number == certificate().number


def test_values_and_their_uncertainties_are_those_of_the_budget() -> None:
    sensor = result().gyroscopes["gyro"]
    assert sensor.budget is not None
    page = read(certificate())
    values = [*sensor.scale, *sensor.bias_rad_s]
    for value, expanded in zip(values, sensor.budget.expanded, strict=True):
        found = round_to_u(value, expanded)
        assert f"{found.value_text} ± {found.uncertainty_text}" in page.text
    noise = [sensor.covariance[i][i] ** 0.5 for i in range(6)]
    assert all(u > 2 * n for u, n in zip(sensor.budget.expanded, noise, strict=True))
    for line in sensor.budget.contributors:
        assert line.name in page.under["7.8.4.1a"]


def test_noise_is_not_called_uncertainty() -> None:
    """A result of an estimator without a budget makes no certificate."""
    found = certificate(remove_budget(read_result(RECORDINGS / "six_observation")))
    page = read(found)
    assert found.title == "Calibration record"
    assert any("uncertainty is not known" in mark for mark in found.marks)
    assert "noise alone, which is not the uncertainty" in page.text
    assert "expanded uncertainty, k = 2" not in page.text
    assert "No expanded uncertainty:" in page.under["7.8.4.1a"]


def test_what_was_not_said_reads_so_and_nobody_is_invented() -> None:
    silent = read(certificate(stated=StatedFacts()))
    for clause in ("7.8.2.1b", "7.8.2.1c", "7.8.2.1e", "7.8.2.1h", "7.8.2.1g", "7.8.2.1o"):
        assert "not stated" in silent.under[clause], clause
    said = read(certificate())
    assert "not stated" not in "".join(said.under[clause] for clause in CLAUSES)
    for words in ("Bench Laboratory", "1 Long Lane", "room 2", "Example & Sons", "2026-11-19", "A. Person", "21.5 °C"):
        assert words in said.text


def test_nobody_s_place_is_invented_from_an_address() -> None:
    assert LABORATORY.site is not None
    silent = StatedFacts(LABORATORY.site.model_copy(update={"location": None}), LABORATORY.certificate)
    assert read(certificate(stated=silent)).under["7.8.2.1c"].endswith("not stated")
    assert "room 2" in read(certificate()).under["7.8.2.1c"]


def test_the_script_that_moved_the_arm_stands_there_with_its_hash() -> None:
    document = result()
    script = {"script": "six_observation.py", "script_sha256": "ab" * 32, "script_installed": True}
    provenance = type(document.provenance).model_validate({**document.provenance.model_dump(), **script})
    said = read(certificate(document.model_copy(update={"provenance": provenance}))).under["7.8.2.1f"]
    assert f"script six_observation.py, SHA-256 {'ab' * 32}" in said
    without = type(document.provenance).model_validate(
        {key: each for key, each in document.provenance.model_dump().items() if not key.startswith("script")}
    )
    unknown = read(certificate(document.model_copy(update={"provenance": without}))).under["7.8.2.1f"]
    assert "a script of the rig's own, whose hash was not recorded" in unknown


@pytest.mark.parametrize("kind", ["gyroscope", "accelerometer", "magnetometer", "drift"])
def test_every_quantity_says_when_it_holds_and_what_its_uncertainty_leaves_out(kind: str) -> None:
    said = " ".join(read(certificate(kinds()[kind])).under["7.8.4.1b"].split())
    assert re.search(r"[Tt]ime[:,] ", said) and "as mounted and for this power-up" in said
    left_out = said.partition("Not in the uncertainty: ")[2]
    for words in ("power cycling", "remounting and its stress", "ageing and transport"):
        assert words in left_out
    if kind != "drift":
        assert "nonlinearity" in left_out and "other temperatures" in left_out


def test_what_the_budget_has_of_the_run_says_nothing_of_other_speeds_and_temperatures() -> None:
    sensor = result().gyroscopes["gyro"]
    assert sensor.budget is not None
    assert {"nonlinearity", "scale over temperature"} <= {
        contributor.name for contributor in sensor.budget.contributors
    }
    assert "nonlinearity at other speeds, other temperatures" in list_omitted_rates(sensor)


def test_the_arm_is_the_one_that_was_found_and_one_that_does_not_say_its_model_is_said_so() -> None:
    document = result()
    found = {"arm_maker": "Universal Robots", "arm_model": "UR5e or UR7e"}
    provenance = document.provenance.model_copy(update=found)
    told = read(certificate(document.model_copy(update={"provenance": provenance}))).text
    assert "Equipment: robot arm Universal Robots UR5e or UR7e, serial number 2026, software" in told
    assert "UR10e" not in told
    assert "robot arm whose model was not recorded," in read(certificate()).text


def test_a_simulated_laboratory_is_told_across_every_page() -> None:
    document = result()
    for stated, software in ((StatedFacts(simulated=True), "5.14"), (LABORATORY, "URSoftware 5.14.0.0 (simulated)")):
        provenance = document.provenance.model_copy(update={"arm_software": software})
        simulated = document.model_copy(update={"provenance": provenance})
        assert is_simulated(simulated, stated)
        page = read(certificate(simulated, stated))
        fixed = next(attributes for tag, attributes in page.tags if attributes.get("class") == "across")
        assert fixed and re.search(r"\.across \{ position: fixed", page.style)
        assert page.text.count("Simulated laboratory: no real item was calibrated") == 2  # across, and to be read out
        assert 'content: "Simulated laboratory' in page.style  # in the margin of each sheet
    assert "Simulated" not in certificate_page(certificate())


def test_what_a_gyroscopes_recording_would_have_told_stands_there() -> None:
    document = result()
    told = DetectionLimitEntry(
        fault="gain half-way", check="scale_changed", size=6e-4, unit="1", error_over_expanded=1.2
    )
    sensors = {
        name: gyroscope.model_copy(update={"detection_limits": (told,)})
        for name, gyroscope in document.gyroscopes.items()
    }
    text = read(certificate(document.model_copy(update={"gyroscopes": sensors}))).text
    assert "the checks of this measurement detect" in text and "gain half-way" in text


def test_a_measurement_that_contradicts_itself_is_not_valid() -> None:
    spoilt = CheckEntry(name="gyro.stuck_bit", value=1.0, limit=0.0, unit="1", passed=False, kind="fitness")
    found = certificate(result().model_copy(update={"checks": (*result().checks, spoilt)}))
    assert any("Not valid" in mark for mark in found.marks)
    assert "failed: gyro.stuck_bit" in read(found).text


def test_a_value_beyond_its_limit_is_a_statement_and_no_spoilt_measurement() -> None:
    found = certificate(result().model_copy(update={"checks": (*result().checks, BEYOND_ITS_LIMIT)}))
    assert not found.marks
    assert re.search(r"gyro\.bias 0\.200 0\.010 0\.1 rad/s – fail", read(found).text)


def test_a_check_of_any_name_stands_where_it_says_it_belongs() -> None:
    of_item = CheckEntry(name="gyro.offset", value=0.2, limit=0.1, unit="rad/s", passed=False, kind="conformity")
    of_measurement = CheckEntry(name="gyro.bias", value=0.2, limit=0.1, unit="rad/s", passed=False, kind="fitness")
    for failed, fit in ((of_item, True), (of_measurement, False)):
        found = certificate(result().model_copy(update={"checks": (*result().checks, failed)}))
        assert (failed in found.conformity, failed in found.fitness) == (fit, not fit)
        assert any("Not valid" in mark for mark in found.marks) is not fit
        assert ("gyro.offset 0.2 not stated 0.1 rad/s – fail" in read(found).text) is fit


@pytest.mark.parametrize(("guard", "words"), [(0.0, "simple acceptance"), (0.01, "guard band of w = U")])
def test_the_decision_rule_is_stated(guard: float, words: str) -> None:
    accepted = {"value": 0.01, "passed": True, "guard_band": guard}
    check = BEYOND_ITS_LIMIT.model_copy(update=accepted)
    assert words in read(certificate(result().model_copy(update={"checks": (check,)}))).under["7.8.6"]


def test_time_is_traceable_only_through_a_reference_that_is_named_and_was_compared() -> None:
    unnamed = StatedFacts(SiteSection(), CertificateSection())
    simulated = StatedFacts(LABORATORY.site, simulated=True)
    alone = result().model_copy(update={"clock": result().clock.model_copy(update={"comparisons": ()})})  # pyrefly: ignore[missing-attribute]  # it has a clock
    assert certificate(add_comparison(result())).traceable
    assert "traceable to the second" in read(certificate(add_comparison(result()))).under["7.8.4.1c"]
    for found in (
        certificate(add_comparison(result()), unnamed),
        certificate(alone),
        certificate(add_comparison(result()), simulated),
    ):
        assert not found.traceable
        assert "No metrological traceability" in read(found).under["7.8.4.1c"]


def test_before_and_after_of_a_verified_run_are_as_found_and_as_left() -> None:
    document = read_result(RECORDINGS / "verified")
    page = read(certificate(document))
    before, after = document.verification["gyro"].before, document.verification["gyro"].after
    assert before is not None
    for value in (*before.movement.rms_rad_s, *after.movement.rms_rad_s):
        assert f"{value:.5f}" in page.under["7.8.4.1d"]
    assert "Reference reference, serial number" in page.under["7.8.2.1p"]


def test_an_accelerometer_stands_there_with_its_uncertainty_and_its_budget() -> None:
    document = add_accelerometer()
    page = read(certificate(add_comparison(document)))
    assert "1.01235 ± 0.00022" in page.text  # 1e-4 of noise, 0.5e-4 of gravity, k = 2
    assert "0.3000 ± 0.0020" in page.text  # gravity's size leaves the bias alone
    assert "gravity B normal ±0.000981 m/s² (k = 2) ∞ 49 19.6 % 0.00 < 0.1 %" in page.text  # u(k) in 10⁻⁶
    assert "relative to the stated gravity of 9.81 m/s²" in page.text
    assert "traceable through it" in page.under["7.8.4.1c"]
    assert (
        "9.81 m/s² by the laboratory's configuration, its origin: gravimeter, certificate 17" in page.under["7.8.4.1c"]
    )
    silent = read(certificate(document, StatedFacts()))
    assert "9.81 m/s² by the laboratory's configuration, its origin: not stated" in silent.under["7.8.4.1c"]
    alone = read(certificate(document.model_copy(update={"gyroscopes": {}})))
    assert "1.01235 ± 0.00022" in alone.text


def test_without_a_budget_it_is_no_certificate_and_without_an_uncertainty_of_gravity_not_traceable() -> None:
    """Of an estimator without a budget, and of a field that nobody has said the uncertainty of."""
    page = read(certificate(remove_budget(result())))
    assert "Calibration record" in page.text and "Not a certificate: the uncertainty is not known" in page.text
    assert "No expanded uncertainty: the estimator" in page.text
    assumed = read(certificate(add_comparison(everything())))  # its field's size is taken to be good to 1 %
    field = assumed.under["7.8.4.1c"].split("The size of the magnetic field")[1]
    assert "no metrological traceability is claimed" in field


def test_a_magnetometer_is_certified_as_mounted_or_as_turned_over() -> None:
    document = everything()
    mounted = read(certificate(document))
    assert "Magnetometer LSM9DS1, serial number COMPASS-7, as mounted" in mounted.text
    assert "1.030 ± 0.012" in mounted.text and "−34.004 ± 0.010" in mounted.text  # 1 % of the field is in k
    assert "which no residual of this measurement shows" in mounted.under["7.8.4.1a"]
    assert "48 µT by the laboratory's configuration, its origin: fluxgate, certificate 18" in mounted.under["7.8.4.1c"]
    turned = certificate(document, reversals={"compass": reversal(document)})
    page = read(turned)
    assert "serial number COMPASS-7, turned over" in page.text
    assert (
        "−34.0090 ± 0.0072" in page.text
        and "0.2200 ± 0.0076" in page.text
        and "in the bias: not turned over" in page.text
    )
    assert "which no residual of this measurement shows" not in page.text
    assert turned.number != certificate(document).number


def test_a_reversal_of_other_runs_or_sensors_is_refused() -> None:
    document = everything()
    other = document.model_copy(
        update={"provenance": document.provenance.model_copy(update={"started_utc": "2020-01-01T00:00:00+00:00"})}
    )
    with pytest.raises(Refused, match=r"another_sensor: .*this run is not among them"):
        certificate(document, reversals={"compass": reversal(other)})
    with pytest.raises(Refused, match=r"another_sensor: .*did not calibrate"):
        certificate(result(), reversals={"compass": reversal(document)})


def test_what_else_a_gyroscope_tells_stands_there_with_its_uncertainty() -> None:
    page = read(certificate(everything()))
    for said in (
        "size 0.00007318 ± 0.00000088 rad/s",
        "latitude 39.12 ± 0.70 °",
        "heading 245.48 ± 0.92 °",
        "−0.0001000 ± 0.0000026",  # what a specific force adds: gravity points the other way
        "φ: x 0.0000097 ± 0.0000092 s²/m",
    ):
        assert said in page.text, said
    assert "estimated from the item's own readings and corrected for" in page.under["7.8.4.1b"]
    assert "solved for by weighted least squares" in page.under["7.8.2.1f"]
    plain = read(certificate())
    assert "Earth's rate, measured" not in plain.text


def test_biases_by_repeat_stand_there_with_what_they_share_and_without_where_they_differ() -> None:
    page = read(certificate(everything()))
    assert "Bias of gyroscope gyro by repeat" in page.text and "Bias of accelerometer gyro by repeat" in page.text
    assert "0.0000030 ± 0.0000010" in page.text  # 2 √(0.3² + 0.4²): what all repeats share is in it
    assert "0.0000080 ± 0.0000013" in page.text  # 2 √(0.4² + 0.5²): of the change it is not
    assert "0.00000200 ± 0.00000040" in page.text and "is valid from 22.0 to 26.0 °C only" in page.under["7.8.4.1b"]
    assert "It changed before repeat 3, most along x" in page.under["7.8.4.1b"]
    assert "temperature_range_too_small" in page.under["7.8.4.1b"]
    assert "These biases include the Earth's rate" in page.under["7.8.4.1b"]


def test_a_drift_beyond_its_limit_is_a_statement_and_no_spoilt_measurement() -> None:
    names = ("gyro.bias_drift", "gyro.acceleration_bias_drift")
    beyond = [BEYOND_ITS_LIMIT.model_copy(update={"name": name}) for name in names]
    found = certificate(everything().model_copy(update={"checks": tuple(beyond)}))
    assert [check.name for check in found.conformity] == list(names) and not found.marks


def test_a_clock_that_was_not_compared_has_no_measured_error() -> None:
    assert result().clock is not None
    alone = result().clock.model_copy(update={"comparisons": (), "error": 0.0, "std": 2.9e-5})  # pyrefly: ignore[missing-attribute]  # it has a clock
    said = read(certificate(result().model_copy(update={"clock": alone}))).under["7.8.4.1c"]
    assert (
        "not be compared with another clock and is assumed to be correct to ± 58 × 10⁻⁶" in said
        and "its error, (" not in said
    )


def test_a_sensor_with_a_port_of_its_own_is_on_no_board() -> None:
    sensor = result().gyroscopes["gyro"].model_copy(update={"part": "kvh1775"})
    page = read(certificate(result().model_copy(update={"gyroscopes": {"gyro": sensor}})))
    assert (
        "not on a board, with a port of its own" in page.under["7.8.2.1g"] and "firmware" not in page.under["7.8.2.1g"]
    )


def test_a_verification_alone_is_reported_as_that() -> None:
    document = read_result(RECORDINGS / "verified").model_copy(update={"gyroscopes": {}})
    found = certificate(document)
    assert found.title == "Verification report"
    assert len(found.marks) == 1 and "Simulated" in found.marks[0]  # as that run was
    page = read(found)
    assert "Stored calibration of gyro, verified" in page.text
    assert f"{document.verification['gyro'].after.movement.rms_rad_s[0]:.5f}" in page.under["7.8.2.1m"]


def test_a_vector_model_without_a_solution_omits_its_values() -> None:
    sensor = result().gyroscopes["gyro"].model_copy(update={"vector_model": ErrorEntry(error="too_few_observations")})
    bare = sensor.model_copy(update={"budget": None, "covariance_combined": None, "estimator": "newton"})
    page = read(certificate(result().model_copy(update={"gyroscopes": {"gyro": bare}})))
    assert "estimator newton" in page.text and "Angles between the axes" not in page.text
    assert "its effect on the readings was not separated from the biases" in page.text
    assert not [tag for tag, _ in page.tags if tag == "svg"]


def test_few_degrees_of_freedom_increase_u_and_are_stated() -> None:
    sensor = result().gyroscopes["gyro"]
    assert sensor.budget is not None
    assert "normal distribution" in coverage_sentence(sensor.budget)
    scarce = budget_of(dof=8.0)
    assert "scale factors k\u00a0=\u00a02.37 (ν_eff\u00a0≥\u00a08); biases k\u00a0=\u00a02.00" in coverage_sentence(
        scarce
    )
    assert "approximately 95 % (95.45 %)" in coverage_sentence(scarce)
    assert scarce.expanded[0] == pytest.approx(2.366 * scarce.std[0], rel=1e-3)
    page = read(
        certificate(result().model_copy(update={"gyroscopes": {"gyro": sensor.model_copy(update={"budget": scarce})}}))
    )
    assert "± U, expanded uncertainty, k as stated below" in page.text


def test_no_resource_is_loaded_from_anywhere() -> None:
    page = read(certificate(everything()))
    for tag, attributes in page.tags:
        assert tag not in {
            "script",
            "link",
            "img",
            "iframe",
            "object",
            "embed",
            "base",
            "image",
            "use",
            "audio",
            "video",
        }
        assert not {"src", "href", "xlink:href", "srcset", "style", "action", "data"} & attributes.keys()
        assert not any(name.startswith("on") for name in attributes)
    assert not re.search(r"url\(|@import|https?:|//", page.style)
    policy = next(a["content"] for _, a in page.tags if a.get("http-equiv") == "Content-Security-Policy")
    assert policy == "default-src 'none'; style-src 'unsafe-inline'"


def test_every_text_from_elsewhere_shows_as_text() -> None:
    document = add_comparison(everything())
    hostile = ResultDocument.model_validate(
        plant(document.model_dump(by_alias=True, exclude_unset=True), MARKUP, FIXED)
    )
    words = ("laboratory", "address", "place", "time_reference", "gravity_reference", "magnetic_field_reference")
    said = dict.fromkeys(words, MARKUP)
    order = dict.fromkeys(("customer", "customer_address", "condition", "authorised_by", "replaces"), MARKUP)
    stated = StatedFacts(SiteSection(**said), CertificateSection(**order))
    document = hostile.model_copy(
        update={
            "gyroscopes": {MARKUP: hostile.gyroscopes["gyro"]},
            "accelerometers": {f"2 {MARKUP}": hostile.accelerometers["gyro"]},
            "magnetometers": {MARKUP: hostile.magnetometers["compass"]},
            "bias_drift": {MARKUP: hostile.bias_drift["gyro"]},
        }
    )
    page = read(certificate(document, stated))
    tags = {tag for tag, _ in read(certificate(everything())).tags} | {"p"}
    assert {tag for tag, _ in page.tags} <= tags
    assert page.text.count(MARKUP) > 40
    assert not any("onerror" in attributes for _, attributes in page.tags)
    assert "script" not in page.style


def test_a_screen_reader_finds_its_way() -> None:
    page = read(certificate(everything()))
    root = next(attributes for tag, attributes in page.tags if tag == "html")
    assert root["lang"] == "en"
    tables, captions = ([tag for tag, _ in page.tags].count(name) for name in ("table", "caption"))
    assert tables == captions > 0
    assert all(attributes.get("scope") for tag, attributes in page.tags if tag == "th")
    names = {attributes["id"] for _, attributes in page.tags if attributes.get("id")}
    pictures = [attributes for tag, attributes in page.tags if tag == "svg"]
    assert len(pictures) == 6
    assert len(names) == len([tag for tag, attributes in page.tags if attributes.get("id")])
    for attributes in pictures:
        assert attributes["role"] == "img"
        assert set((attributes["aria-labelledby"] or "").split()) <= names
    assert "prefers-color-scheme: dark" in page.style


@given(
    value=st.floats(-1e12, 1e12, allow_nan=False),
    uncertainty=st.floats(1e-12, 1e12, allow_nan=False),
)
def test_two_significant_digits_the_same_decimals_and_never_below_95_percent(value: float, uncertainty: float) -> None:
    found = round_to_u(value, uncertainty)
    digits = found.uncertainty_text.replace(".", "").lstrip("0")
    assert len(digits.rstrip("0")) <= 2 <= len(digits)
    places = [len(text.partition(".")[2]) for text in (found.value_text, found.uncertainty_text)]
    assert places[0] == places[1]
    exact = Decimal(repr(uncertainty))
    assert Decimal("0.95") * exact <= found.uncertainty <= Decimal("1.05") * exact
    unit = Decimal(1).scaleb(found.uncertainty.adjusted() - 1)
    assert abs(found.value - Decimal(repr(value))) <= unit / 2


@pytest.mark.parametrize(
    ("value", "uncertainty", "texts"),
    [
        (1.17622532, 0.00171697, ("1.1762", "0.0017")),
        (-0.009761911, 0.00099612, ("−0.0098", "0.0010")),
        (-0.00001, 0.0012, ("0.0000", "0.0012")),
        (1234.5, 123.0, ("1230", "120")),
    ],
)
def test_rounding_by_example(value: float, uncertainty: float, texts: tuple[str, str]) -> None:
    found = round_to_u(value, uncertainty)
    assert (found.value_text, found.uncertainty_text) == texts


@pytest.mark.parametrize(("value", "uncertainty"), [(1.0, 0.0), (1.0, -1.0), (float("nan"), 1.0), (1.0, float("inf"))])
def test_what_cannot_be_rounded_is_not(value: float, uncertainty: float) -> None:
    with pytest.raises(ValueError, match="cannot be rounded"):
        round_to_u(value, uncertainty)


def test_what_the_configuration_says_is_stated(tmp_path: Path) -> None:
    text = (CONFIGS / "demo.yaml").read_text(encoding="utf-8")
    said = "site: {laboratory: ' Ours ', country: DE}\ncertificate: {customer: Theirs, received: 2026-11-20}\n"
    found = configuration_statements(parse(text + said))
    assert found.simulated
    assert (found.where.laboratory, found.certificate.customer, str(found.certificate.received)) == (
        "Ours",
        "Theirs",
        "2026-11-20",
    )
    (tmp_path / "config.yaml").write_text(text + said, encoding="utf-8")
    amended = folder_statements(tmp_path, ["certificate.customer=Somebody", "certificate.replaces=RIG-1"])
    assert (amended.certificate.customer, amended.certificate.replaces) == ("Somebody", "RIG-1")
    with pytest.raises(Refused, match="unknown_setting"):
        folder_statements(tmp_path, ["site.gravity_m_s2=9.81"])
