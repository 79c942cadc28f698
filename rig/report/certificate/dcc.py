"""The digital calibration certificate: PTB's DCC 3.2.1 over D-SI 2.1, with the full covariance.

Numbers have all digits here, and are rounded in the printed certificate. Missing statements of the laboratory read "not
stated", except the country, for which PTB's rules require a code of ISO 3166-1.
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
from rig.report.findings.result_kind import CertifiedItem
from rig.report.kinds.kind_registry import outlets
from rig.report.tables.certificate import kind as kind_of_part
from rig.report.tables.dcc_results import further_results
from rig.report.tables.xml_parts import DCC as NAMESPACE
from rig.report.tables.xml_parts import NOT_STATED, XSI, Part, dcc, real, text, words
from rig.report.words.validity_words import label_source

DCC: Final = "certificate.xml"
SCHEMA_VERSION = "3.2.1"
DESCRIPTION = "docs/method.md and docs/uncertainty.md of calibration-rig"
NO_TRACEABILITY = "No metrological traceability is claimed."
# PTB's rules require a condition for each quantity.
UNKNOWN_AIR = dcc(
    "influenceConditions",
    dcc("influenceCondition", text("name", "ambient temperature"), dcc("data", text("text", None))),
)


def digital_certificate(certificate: Certificate) -> bytes:
    """Return the digital calibration certificate as XML.

    Raise Refused `no_digital_certificate` if nothing was calibrated, or if an uncertainty or the country is unknown.
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
    items = list(_iterate_items(certificate))
    root = dcc(
        "digitalCalibrationCertificate",
        _administrative(certificate, items),
        dcc("measurementResults", *_results(certificate, items)),
        schemaVersion=SCHEMA_VERSION,
    )
    location = f"{NAMESPACE} {NAMESPACE}/v{SCHEMA_VERSION}/dcc.xsd"
    root.set(f"{{{XSI}}}schemaLocation", location)
    return bytes(tostring(root, encoding="utf-8", xml_declaration=True))


def _administrative(c: Certificate, items: Sequence[CertifiedItem]) -> Element:
    return dcc(
        "administrativeData",
        dcc("dccSoftware", _software(c)),
        _core(c),
        dcc("items", *_items(c, items)),
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
        words("performanceLocation", "other"),  # the schema's value for an unstated place
        words("issueDate", c.issued),
        amended or None,
    )


def _contact(name: str, who: str | None, address: str | None) -> Element:
    return dcc(name, text("name", who), dcc("location", text("further", address)))


def _iterate_items(c: Certificate) -> Iterator[CertifiedItem]:
    """Yield all measured items, kind by kind, with their further characteristics."""
    for kind, measure, finding in outlets(c.result, lambda kind: kind.measured):
        if (item := measure(finding, c.reversals)) is not None:
            more = further_results(terms(kind.characteristics, finding, "digital certificate"))
            yield replace(item, results=[*item.results, *more])


def _keys(items: Iterable[CertifiedItem]) -> dict[tuple[str, str], str]:
    """Return a key for each item, such as `gyroscope-0`, by kind and sensor name."""
    keys: dict[tuple[str, str], str] = {}
    for certified in items:
        kind_and_name = certified.item, certified.sensor
        keys.setdefault(kind_and_name, f"{certified.item}-{sum(item == certified.item for item, _ in keys)}")
    return keys


def _items(c: Certificate, certified_items: Sequence[CertifiedItem]) -> Iterator[Element]:
    for (item, sensor), key in _keys(certified_items).items():
        entries = (entry for entry in certified_items if entry.sensor == sensor)
        own_first = sorted(entries, key=lambda entry: entry.item != item)
        part = next((entry.part for entry in own_first if entry.part), NOT_STATED)
        serial = next((entry.serial_number for entry in own_first if entry.serial_number), None)
        serial = serial or c.provenance.sensor_serial_numbers.get(sensor, NOT_STATED)
        yield _item(key, f"{item} {sensor}", part, serial, c)


def _item(key: str, name: str, part: str, serial: str, c: Certificate) -> Element:
    condition = f"Condition: {c.stated.certificate.condition or 'not stated'}."
    return dcc(
        "item",
        text("name", name),
        text("description", " ".join([*(f"{mark}." for mark in c.marks), condition])),
        words("model", kind_of_part(part)),
        dcc("identifications", _identification("manufacturer", serial, "serial number"),
            None if c.external or has_own_port(part)
            else _identification("other", c.provenance.board_unique_id, "board it is on")),
        id=key,
    )  # fmt: skip


def _identification(issuer: str, value: str, name: str) -> Element:
    return dcc("identification", words("issuer", issuer), words("value", value), text("name", name))


def _statements(c: Certificate) -> Iterator[Element]:
    """Yield the elements that declare validity, traceability, scope and each limit of conformity."""
    for mark in c.marks:
        yield dcc("statement", text("name", "validity"), text("declaration", f"{mark}."), words("valid", "false"))
    time = c.stated.where.time_reference
    chain = f"The unit of time is traceable to {time}." if c.traceable else NO_TRACEABILITY
    if c.gyroscopes:
        angles = "as a file states them" if c.external else _angles(c)
        yield _chain("gyroscopes", f"{chain} Angles are {angles}.", c.traceable)
    for sensors in c.calibrated_at_rest:
        origin = f"{sensors.standard.size} is stated by the laboratory, its origin: {sensors.origin or NOT_STATED}."
        claim = "Its uncertainty was stated too." if sensors.traceable else NO_TRACEABILITY
        yield _chain(f"{sensors.kind}s", f"{origin} {claim}", sensors.traceable)
    relates = "The results relate only to the items calibrated. Not issued under an accreditation."
    yield dcc("statement", text("name", "scope"), text("declaration", " ".join([relates, *c.deviations])))
    rule = "guard band w = U (ILAC-G8:09/2019, 4.2.2)" if c.guarded else "simple acceptance (ILAC-G8:09/2019, 4.2.1)"
    for check in c.conformity:
        yield _conformity(check, rule)


def _angles(c: Certificate) -> str:
    if c.arcs:
        return f"{' and '.join(c.arcs)} by the turner's encoders, whose error is in the uncertainty budget"
    return "whole turns, 2π by closure of the circle"


def _chain(sensors: str, statement: str, traceable: bool) -> Element:
    flag = words("traceable", str(traceable).lower())
    return dcc("statement", text("name", f"traceability of {sensors}"), flag, text("declaration", statement))


def _conformity(check: CheckEntry, rule: str) -> Element:
    value = "not measured" if check.value is None else f"{check.value!r} {check.unit}"
    limit = "not set" if check.limit is None else f"{check.limit!r} {check.unit}"
    return dcc(
        "statement",
        text("name", check.name),
        text("declaration", f"Value {value}, limit {limit}; decision rule: {rule}."),
        words("conformity", "pass" if check.passed else "fail"),
    )


def _results(c: Certificate, items: Sequence[CertifiedItem]) -> Iterator[Element]:
    keys = _keys(items)
    return (_result(c, keys[item.item, item.sensor], item) for item in items)


def _result(c: Certificate, item: str, measured: CertifiedItem) -> Element:
    site = c.stated.where
    conditions = [
        *(
            _condition(f"temperature of the item{label_source(use)}", temperature_c, r"\degreecelsius")
            for use, temperature_c in measured.temperatures_c.items()
        ),
        _condition("ambient temperature", site.ambient_temperature_c, r"\degreecelsius"),
        _condition("ambient relative humidity", site.ambient_humidity_percent, r"\percent"),
    ]
    return dcc(
        "measurementResult",
        text("name", measured.name),
        dcc("usedMethods", dcc("usedMethod", text("name", method_in_short(c)),
                               text("description", "; ".join([DESCRIPTION, c.procedure, *c.mounted])),
                               words("norm", "JCGM 100:2008"))),
        dcc("usedSoftware", _software(c)),
        dcc("measuringEquipments", _arm(c)),
        dcc("influenceConditions", *conditions) if any(part is not None for part in conditions) else UNKNOWN_AIR,
        dcc("results", *measured.results),
        refId=item,
    )  # fmt: skip


def _arm(c: Certificate) -> Element:
    """Return the element of the machine that turned the items, according to its recorded model."""
    provenance = c.provenance
    identified = provenance.arm_maker is not None and provenance.arm_model is not None
    return dcc(
        "measuringEquipment",
        text("name", c.arm),
        dcc("manufacturer", text("name", provenance.arm_maker)) if identified else None,
        words("model", provenance.arm_model) if identified else None,
        dcc("identifications", _identity(provenance)),
    )


def _identity(entry: ProvenanceEntry) -> Element:
    if entry.motion_file is not None:
        return _identification("other", entry.motion_file.sha256, "SHA-256 of the file")
    return _identification("manufacturer", entry.arm_serial_number, "serial number")


def _condition(name: str, value: float | None, unit: str) -> Part:
    if value is None:
        return None
    return dcc("influenceCondition", text("name", name), dcc("data", dcc("quantity", real(value, unit))))
