"""PTB's rules for a digital certificate: its schemas, if available, and its Schematron.

The schemas (DCC 3.2.1, D-SI 2.1.0, LGPL-3, and the W3C's for signatures) are no part of this project. They are searched
in the folder named by RIG_DCC_SCHEMAS, in tests/fixtures/dcc, and in shared/dcc next to the repository.
"""

import functools
import os
from pathlib import Path
from typing import Any

import pytest
from lxml import etree

from support.paths import ROOT

FILES = {
    "https://ptb.de/si/v2.1.0/SI_Format.xsd": "SI-2.1.0.xsd",
    "https://www.ptb.de/dcc/d-sig/xmldsig-core-schema.xsd": "xmldsig-core-schema.xsd",
}
REMARKS = {"warning", "information"}
MAIN = "dcc-3.2.1.xsd"
PLACES = [
    Path(os.environ.get("RIG_DCC_SCHEMAS", "")),
    ROOT / "tests" / "fixtures" / "dcc",
    ROOT.parent / "shared" / "dcc",
]


def schema_faults(xml: bytes) -> list[str]:
    """Return the errors by the schema; skip the test, with a reason, if there is no schema."""
    folder = next((candidate for candidate in PLACES if (candidate / MAIN).is_file()), None)
    if folder is None:
        pytest.skip("PTB's schemas are not here: set RIG_DCC_SCHEMAS to their folder")
    schema = _schema(folder)
    schema.validate(etree.fromstring(xml))
    return [str(error.message) for error in schema.error_log]


@functools.cache
def _schema(folder: Path) -> etree.XMLSchema:
    class Local(etree.Resolver):  # pyrefly: ignore[unknown-base-class]  # lxml has no types
        def resolve(self, url: str, public_id: str, context: Any) -> Any:
            return self.resolve_filename(str(folder / FILES[url]), context) if url in FILES else None

    parser = etree.XMLParser(no_network=True)
    parser.resolvers.add(Local())
    return etree.XMLSchema(etree.parse(str(folder / MAIN), parser))


def rule_faults(xml: bytes) -> list[str]:
    """Return the errors by PTB's Schematron, without its warnings and remarks."""
    report = _rules().validate_str(xml.decode())
    return [
        failed_assertion.text
        for failed_assertion in [*report.failed_assertions, *report.successful_reports]
        if failed_assertion.role not in REMARKS
    ]


@functools.cache
def _rules() -> Any:
    from dcclib.validation.schematron import SchematronValidator

    return SchematronValidator.for_dcc()
