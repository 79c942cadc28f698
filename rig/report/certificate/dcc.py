"""The digital calibration certificate: PTB's DCC 3.2.1 over D-SI 2.1, with the full covariance.

Numbers stand in full here; the page rounds them. What the laboratory has not stated reads so, but for the country,
which PTB's rules want to be one of ISO 3166-1.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Final
from xml.etree.ElementTree import Element, tostring

from rig.config.sensors.sensor_catalogue import has_own_port
from rig.data.result_file import CheckEntry, ProvenanceEntry
from rig.errors import Refused
from rig.report.certificate.content import Certificate
from rig.report.certificate.method_words import method_in_short
from rig.report.findings.characteristic import terms
from rig.report.findings.kind import Measured
from rig.report.kinds.registry import outlets
from rig.report.tables.certificate import kind as kind_of_part
from rig.report.tables.dcc_results import beside
from rig.report.tables.xml_parts import DCC as NAMESPACE
from rig.report.tables.xml_parts import UNSAID, XSI, Part, dcc, real, text, words
from rig.report.words.validity_words import told_by

DCC: Final = "certificate.xml"
SCHEMA_VERSION = "3.2.1"
DESCRIBED = "docs/method.md and docs/uncertainty.md of calibration-rig"
# PTB's rules want a condition to each quantity.
UNKNOWN_AIR = dcc(
    "influenceConditions",
    dcc("influenceCondition", text("name", "ambient temperature"), dcc("data", text("text", None))),
)


def digital_certificate(certificate: Certificate) -> bytes:
    """The digital calibration certificate as XML.

    Raises Refused `no_digital_certificate` where nothing was calibrated, an uncertainty or the country is not known.
    """
    if not certificate.calibrates:
        raise Refused("no_digital_certificate", "the run calibrated nothing", "Give a run that calibrates")
    unknown = ", ".join(certificate.without_uncertainty)
    if unknown:
        raise Refused(
            "no_digital_certificate",
            f"only the noise part of the uncertainty of {unknown} is known",
            "Calibrate with the vector model, as `rig run` does, and a configuration of this version",
        )
    if certificate.stated.where.country is None:
        raise Refused(
            "no_digital_certificate",
            "the laboratory's country is not stated",
            "State site.country, for example with --set site.country=DE",
        )
    measured = list(_measured(certificate))
    root = dcc(
        "digitalCalibrationCertificate",
        _administrative(certificate, measured),
        dcc("measurementResults", *_results(certificate, measured)),
        schemaVersion=SCHEMA_VERSION,
    )
    place = f"{NAMESPACE} {NAMESPACE}/v{SCHEMA_VERSION}/dcc.xsd"
    root.set(f"{{{XSI}}}schemaLocation", place)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True))


def _administrative(c: Certificate, measured: Sequence[Measured]) -> Element:
    return dcc(
        "administrativeData",
        dcc("dccSoftware", _software(c)),
        _core(c),
        dcc("items", *_items(c, measured)),
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
        words("performanceLocation", "other"),  # of the schema's words the one that states nothing
        words("issueDate", c.issued),
        amended or None,
    )


def _contact(name: str, who: str | None, address: str | None) -> Element:
    return dcc(name, text("name", who), dcc("location", text("further", address)))


def _measured(c: Certificate) -> Iterator[Measured]:
    """Everything that was measured, kind by kind, and what was found beside."""
    for kind, measure, finding in outlets(c.result, lambda kind: kind.measured):
        if (each := measure(finding, c.reversals)) is not None:
            more = beside(terms(kind.characteristics, finding, "digital certificate"))
            yield replace(each, results=[*each.results, *more])


def _keys(items: Iterable[Measured]) -> dict[tuple[str, str], str]:
    """The key of every item, by what it is and its name: items of a kind are numbered."""
    keys: dict[tuple[str, str], str] = {}
    for each in items:
        of = each.item, each.sensor
        keys.setdefault(of, f"{each.item}-{sum(item == each.item for item, _ in keys)}")
    return keys


def _items(c: Certificate, measured: Sequence[Measured]) -> Iterator[Element]:
    for (item, sensor), key in _keys(measured).items():
        of_it = sorted((each for each in measured if each.sensor == sensor), key=lambda each: each.item != item)
        part = next((each.part for each in of_it if each.part), UNSAID)
        serial = next((each.serial_number for each in of_it if each.serial_number), None)
        serial = serial or c.provenance.sensor_serial_numbers.get(sensor, UNSAID)
        yield _item(key, f"{item} {sensor}", part, serial, c)


def _item(key: str, name: str, part: str, serial: str, c: Certificate) -> Element:
    condition = f"Condition: {c.stated.certificate.condition or 'not stated'}."
    return dcc(
        "item",
        text("name", name),
        text("description", " ".join([*(f"{mark}." for mark in c.marks), condition])),
        words("model", kind_of_part(part)),
        dcc("identifications", _identified("manufacturer", serial, "serial number"),
            None if c.elsewhere or has_own_port(part)
            else _identified("other", c.provenance.board_unique_id, "board it is on")),
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
        angles = "as a file states them" if c.elsewhere else _angles(c)
        yield _chain("gyroscopes", f"{chain} Angles are {angles}.", c.traceable)
    for each in c.held_still:
        said = f"{each.standard.size} is stated by the laboratory, its origin: {each.origin or UNSAID}."
        yield _chain(f"{each.kind}s", f"{said} {_claimed(each.traceable)}", each.traceable)
    relates = "The results relate only to the items calibrated. Not issued under an accreditation."
    yield dcc("statement", text("name", "scope"), text("declaration", " ".join([relates, *c.deviations])))
    rule = "guard band w = U (ILAC-G8:09/2019, 4.2.2)" if c.guarded else "simple acceptance (ILAC-G8:09/2019, 4.2.1)"
    for check in c.conformity:
        yield _conformity(check, rule)


def _angles(c: Certificate) -> str:
    if c.arcs:
        return f"{' and '.join(c.arcs)} by the turner's encoders, whose error is a contributor of the uncertainty"
    return "whole turns, 2π by closure of the circle"


def _claimed(traceable: bool) -> str:
    return "Its uncertainty was stated too." if traceable else "No metrological traceability is claimed."


def _chain(of: str, statement: str, traceable: bool) -> Element:
    flag = words("traceable", str(traceable).lower())
    return dcc("statement", text("name", f"traceability of {of}"), flag, text("declaration", statement))


def _conformity(check: CheckEntry, rule: str) -> Element:
    value = "not measured" if check.value is None else f"{check.value!r} {check.unit}"
    limit = "not set" if check.limit is None else f"{check.limit!r} {check.unit}"
    return dcc(
        "statement",
        text("name", check.name),
        text("declaration", f"Value {value}, limit {limit}; decision rule: {rule}."),
        words("conformity", "pass" if check.passed else "fail"),
    )


def _results(c: Certificate, measured: Sequence[Measured]) -> Iterator[Element]:
    keys = _keys(measured)
    return (_result(c, keys[each.item, each.sensor], each) for each in measured)


def _result(c: Certificate, item: str, measured: Measured) -> Element:
    site = c.stated.where
    conditions = [
        *(
            _condition(f"temperature of the item{told_by(of)}", each, r"\degreecelsius")
            for of, each in measured.temperatures_c.items()
        ),
        _condition("ambient temperature", site.ambient_temperature_c, r"\degreecelsius"),
        _condition("ambient relative humidity", site.ambient_humidity_percent, r"\percent"),
    ]
    return dcc(
        "measurementResult",
        text("name", measured.name),
        dcc("usedMethods", dcc("usedMethod", text("name", method_in_short(c)),
                               text("description", "; ".join([DESCRIBED, c.procedure, *c.mounted])),
                               words("norm", "JCGM 100:2008"))),
        dcc("usedSoftware", _software(c)),
        dcc("measuringEquipments", _arm(c)),
        dcc("influenceConditions", *conditions) if any(each is not None for each in conditions) else UNKNOWN_AIR,
        dcc("results", *measured.results),
        refId=item,
    )  # fmt: skip


def _arm(c: Certificate) -> Element:
    """What turned the items, by the model that was found."""
    found = c.provenance
    known = found.arm_maker is not None and found.arm_model is not None
    return dcc(
        "measuringEquipment",
        text("name", c.arm),
        dcc("manufacturer", text("name", found.arm_maker)) if known else None,
        words("model", found.arm_model) if known else None,
        dcc("identifications", _identity(found)),
    )


def _identity(entry: ProvenanceEntry) -> Element:
    if entry.motion_file is not None:
        return _identified("other", entry.motion_file.sha256, "SHA-256 of the file")
    return _identified("manufacturer", entry.arm_serial_number, "serial number")


def _condition(name: str, value: float | None, unit: str) -> Part:
    if value is None:
        return None
    return dcc("influenceCondition", text("name", name), dcc("data", dcc("quantity", real(value, unit))))
