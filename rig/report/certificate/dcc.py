"""The digital calibration certificate: PTB's DCC 3.2.1 over D-SI 2.1, with the full covariance.

Numbers stand in full here; the page rounds them. What the laboratory has not stated reads so, but for the country,
which PTB's rules want to be one of ISO 3166-1.
"""

from collections.abc import Iterator
from typing import Final
from xml.etree.ElementTree import Element, tostring

from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.result_file import CheckEntry, VerificationEntry
from rig.errors import Refused
from rig.report.certificate.content import Certificate, Gyroscope
from rig.report.certificate.tables import JOINT_FACTOR, coverage_sentence
from rig.report.certificate.xml_parts import DCC as NAMESPACE
from rig.report.certificate.xml_parts import XSI, Part, dcc, real, real_list, text, words

DCC: Final = "certificate.xml"
SCHEMA_VERSION = "3.2.1"
ONE, RATE, ACCELERATION = r"\one", r"\radian\second\tothe{-1}", r"\metre\second\tothe{-2}"
# PTB's rules want a condition to each quantity.
UNKNOWN_AIR = dcc(
    "influenceConditions",
    dcc("influenceCondition", text("name", "ambient temperature"), dcc("data", text("text", None))),
)
AXES = ("x", "y", "z")
SIX = ("kx", "ky", "kz", "bx", "by", "bz")


def digital_certificate(certificate: Certificate) -> bytes:
    """XML.

    Raises Refused `no_digital_certificate` where nothing was calibrated, an uncertainty or the country is not known.
    """
    if not certificate.gyroscopes and not certificate.accelerometers:
        raise Refused("no_digital_certificate", "the run calibrated nothing", "Give a run that calibrates")
    unknown = ", ".join(each.name for each in certificate.gyroscopes if not each.has_uncertainty)
    if unknown:
        raise Refused(
            "no_digital_certificate",
            f"of the uncertainty of {unknown} only noise is known",
            "Calibrate with the vector model, `rig run` does, in a configuration of this version",
        )
    if certificate.stated.where.country is None:
        raise Refused(
            "no_digital_certificate",
            "the laboratory's country is not stated",
            "State site.country, by --set site.country=DE if need be",
        )
    root = dcc(
        "digitalCalibrationCertificate",
        _administrative(certificate),
        dcc("measurementResults", *_results(certificate)),
        schemaVersion=SCHEMA_VERSION,
    )
    place = f"{NAMESPACE} {NAMESPACE}/v{SCHEMA_VERSION}/dcc.xsd"
    root.set(f"{{{XSI}}}schemaLocation", place)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True))


def _administrative(c: Certificate) -> Element:
    return dcc(
        "administrativeData",
        dcc("dccSoftware", _software(c)),
        _core(c),
        dcc("items", *_items(c)),
        dcc("calibrationLaboratory", _contact("contact", c.stated.where.laboratory, c.stated.where.address)),
        dcc("respPersons", dcc("respPerson", dcc("person", text("name", c.stated.certificate.authorised_by)),
                               words("mainSigner", "true"))),
        _contact("customer", c.stated.certificate.customer, c.stated.certificate.customer_address),
        dcc("statements", *_statements(c)),
    )  # fmt: skip


def _software(c: Certificate) -> Element:
    return dcc("software", text("name", "calibration-rig"), words("release", f"v{c.provenance.rig_version}"))


def _core(c: Certificate) -> Element:
    order = c.stated.certificate
    begin, end = c.performed
    amended = order.replaces and dcc(
        "reportAmendedSubstituted", words("typeOfChange", "amended"), words("replacedUniqueIdentifier", order.replaces)
    )
    return dcc(
        "coreData",
        words("countryCodeISO3166_1", c.stated.where.country),
        words("usedLangCodeISO639_1", "en"),
        words("mandatoryLangCodeISO639_1", "en"),
        words("uniqueIdentifier", c.number),
        None if order.received is None else words("receiptDate", order.received),
        words("beginPerformanceDate", begin),
        words("endPerformanceDate", end),
        words("performanceLocation", "laboratory"),
        words("issueDate", c.issued),
        amended or None,
    )


def _contact(name: str, who: str | None, address: str | None) -> Element:
    return dcc(name, text("name", who), dcc("location", text("further", address)))


def _items(c: Certificate) -> Iterator[Element]:
    for i, each in enumerate(c.gyroscopes):
        yield _item(f"gyroscope-{i}", f"gyroscope {each.name}", each.sensor.part, each.sensor.serial_number, c)
    for i, (name, found) in enumerate(c.accelerometers.items()):
        yield _item(f"accelerometer-{i}", f"accelerometer {name}", found.part, found.serial_number, c)


def _item(key: str, name: str, part: str, serial: str, c: Certificate) -> Element:
    condition = f"Condition: {c.stated.certificate.condition or 'not stated'}."
    return dcc(
        "item",
        text("name", name),
        text("description", " ".join([*(f"{mark}." for mark in c.marks), condition])),
        words("model", part.upper()),
        dcc("identifications", _identified("manufacturer", serial, "serial number"),
            _identified("other", c.provenance.board_unique_id, "board it is on")),
        id=key,
    )  # fmt: skip


def _identified(issuer: str, value: str, name: str) -> Element:
    return dcc("identification", words("issuer", issuer), words("value", value), text("name", name))


def _statements(c: Certificate) -> Iterator[Element]:
    for mark in c.marks:
        yield dcc("statement", text("name", "validity"), text("declaration", f"{mark}."), words("valid", "false"))
    time = c.stated.where.time_reference
    chain = f"The unit of time hangs on {time}." if c.traceable else "No metrological traceability is claimed."
    if c.gyroscopes:
        yield _chain("gyroscopes", f"{chain} Angles are whole turns, 2π by closure of the circle.", c.traceable)
    if c.accelerometers:
        yield _chain("accelerometers", "Gravity is stated by the laboratory without a chain of its own.", False)
    relates = "The results relate only to the items calibrated. Not issued under an accreditation."
    yield dcc("statement", text("name", "scope"), text("declaration", " ".join([relates, *c.deviations])))
    rule = "guard band w = U (ILAC-G8:09/2019, 4.2.2)" if c.guarded else "simple acceptance (ILAC-G8:09/2019, 4.2.1)"
    for check in c.conformity:
        yield _conformity(check, rule)


def _chain(of: str, said: str, traceable: bool) -> Element:
    flag = words("traceable", str(traceable).lower())
    return dcc("statement", text("name", f"traceability of {of}"), flag, text("declaration", said))


def _conformity(check: CheckEntry, rule: str) -> Element:
    value = "not measured" if check.value is None else f"{check.value!r} {check.unit}"
    limit = "not set" if check.limit is None else f"{check.limit!r} {check.unit}"
    return dcc(
        "statement",
        text("name", check.name),
        text("declaration", f"Value {value}, limit {limit}; decision rule: {rule}."),
        words("conformity", "pass" if check.passed else "fail"),
    )


def _results(c: Certificate) -> Iterator[Element]:
    for i, each in enumerate(c.gyroscopes):
        yield _measured(c, f"gyroscope-{i}", f"calibration of gyroscope {each.name}", _gyroscope(each),
                        each.sensor.temperature_c)  # fmt: skip
        if each.verification is not None:
            results = _verification(each.verification)
            yield _measured(c, f"gyroscope-{i}", f"verification of gyroscope {each.name}", results, None)
    for i, (name, found) in enumerate(c.accelerometers.items()):
        yield _measured(c, f"accelerometer-{i}", f"calibration of accelerometer {name}", _accelerometer(found),
                        found.temperature_c)  # fmt: skip


def _measured(c: Certificate, item: str, name: str, results: Iterator[Element], temperature_c: float | None) -> Element:
    site = c.stated.where
    conditions = [
        _condition("temperature of the item, by its own thermometer", temperature_c, r"\degreecelsius"),
        _condition("ambient temperature", site.ambient_temperature_c, r"\degreecelsius"),
        _condition("ambient relative humidity", site.ambient_humidity_percent, r"\percent"),
    ]
    return dcc(
        "measurementResult",
        text("name", name),
        dcc("usedMethods", dcc("usedMethod", text("name", "whole turns and attitudes at rest on a robot arm"),
                               text("description", "docs/method.md and docs/uncertainty.md of calibration-rig"),
                               words("norm", "JCGM 100:2008"))),
        dcc("usedSoftware", _software(c)),
        dcc("measuringEquipments", dcc("measuringEquipment", text("name", "robot arm UR10e"), words("model", "UR10e"),
            dcc("identifications", _identified("manufacturer", c.provenance.arm_serial_number, "serial number")))),
        dcc("influenceConditions", *conditions) if any(each is not None for each in conditions) else UNKNOWN_AIR,
        dcc("results", *results),
        refId=item,
    )  # fmt: skip


def _condition(name: str, value: float | None, unit: str) -> Part:
    if value is None:
        return None
    return dcc("influenceCondition", text("name", name), dcc("data", dcc("quantity", real(value, unit))))


def _result(name: str, said: str, quantity: Element) -> Element:
    return dcc("result", text("name", name), text("description", said), dcc("data", dcc("quantity", quantity)))


def _gyroscope(each: Gyroscope) -> Iterator[Element]:
    sensor, budget = each.sensor, each.sensor.budget
    assert budget is not None and sensor.covariance_combined is not None  # or there is no digital certificate
    covered, factor = coverage_sentence(budget), budget.coverage_factor
    model = f"{sensor.model}: true rate g, reading m, K = diag(k)."
    yield _result("scale factor", f"{model} {covered}",
                  real_list(AXES, sensor.scale, [ONE], expanded=(budget.expanded[:3], factor)))  # fmt: skip
    yield _result("bias", f"{model} {covered}",
                  real_list(AXES, sensor.bias_rad_s, [RATE], expanded=(budget.expanded[3:], factor)))  # fmt: skip
    yield _joint([*sensor.scale, *sensor.bias_rad_s], sensor.covariance_combined, RATE)


def _joint(numbers: list[float], covariance: tuple[tuple[float, ...], ...], unit: str) -> Element:
    return _result(
        "scale factors and biases with their covariance",
        "The ellipsoid holds all six values at once with a probability of 95 %; the matrix is the combined covariance.",
        real_list(SIX, numbers, [ONE] * 3 + [unit] * 3, region=(covariance, JOINT_FACTOR)),
    )


def _accelerometer(found: AccelerometerEntry) -> Iterator[Element]:
    said = (
        f"a = F s + b, k = 1/‖row of F‖. The uncertainty is that of noise and of the arm's attitudes, k = 2; gravity, "
        f"{found.gravity_m_s2!r} m/s², is taken as exact, and no further contributor was evaluated."
    )
    expanded = [2 * found.covariance[i][i] ** 0.5 for i in range(6)]
    yield _result("scale factor", said, real_list(AXES, found.scale, [ONE], expanded=(expanded[:3], 2.0)))
    yield _result("bias", said, real_list(AXES, found.bias_m_s2, [ACCELERATION], expanded=(expanded[3:], 2.0)))
    yield _joint([*found.scale, *found.bias_m_s2], found.covariance, ACCELERATION)


def _verification(found: VerificationEntry) -> Iterator[Element]:
    said = f"RMS of reading less reference {found.reference}; holds the noise of both, no uncertainty was evaluated."
    if found.before is not None:
        yield _result("as found", said, real_list(AXES, found.before.movement.rms_rad_s, [RATE]))
    yield _result("as left", said, real_list(AXES, found.after.movement.rms_rad_s, [RATE]))
