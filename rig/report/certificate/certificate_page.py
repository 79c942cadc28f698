"""The certificate as one HTML page: self-contained, for screens light and dark, for paper and for screen readers."""

from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.analysis.outcome import Outcome
from rig.config.files.safe_writing import write_new
from rig.config.sensors.sensor_catalogue import has_own_port
from rig.data.absent import NO_BOARD
from rig.data.installed_kinds import quantities
from rig.data.result_file import ResultDocument
from rig.data.run_folder import CERTIFICATE
from rig.report.certificate import at_rest_tables, method_words, svg_plots, temperature_curves
from rig.report.certificate.content import Certificate, certificate_of
from rig.report.certificate.statements import folder_statements
from rig.report.findings import characteristics
from rig.report.findings.result_kind import OWN_TEMPLATES
from rig.report.kinds.kind_registry import kinds
from rig.report.tables import certificate as tables
from rig.report.tables import coverage_statements as coverage_words
from rig.report.tables.certificate import DEG
from rig.report.words import (
    detection_limit_words,
    expanded_uncertainty,
    printed_budget,
    printed_values,
    temperature_words,
    validity_words,
)
from rig.station.events import DocumentWritten, RunEvent

if TYPE_CHECKING:
    from jinja2 import Template

MODULES = (
    printed_values, expanded_uncertainty, validity_words, detection_limit_words, printed_budget, tables, coverage_words,
    at_rest_tables, svg_plots, temperature_curves, temperature_words, method_words,
)  # fmt: skip
TEMPLATE = "certificate.html.j2"
FOOTING = "Relates only to the items calibrated. Not issued under an accreditation."


def certificate_page(certificate: Certificate) -> str:
    """Return the certificate as HTML that loads nothing from outside, with all texts of other sources escaped."""
    return _template().render(certificate=certificate, deg=DEG, footing=FOOTING)


@cache
def _template() -> "Template":
    """Return the certificate's template, with the functions and constants that it calls."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(list(dict.fromkeys([OWN_TEMPLATES, *(kind.templates for kind in kinds())])))
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    constants: dict[str, Any] = {
        "has_own_port": has_own_port,
        "no_board": NO_BOARD,
        "quantities": quantities(),
        "characteristics": characteristics,
    }
    environment.globals |= constants
    for module in MODULES:
        environment.globals |= {name: value for name, value in vars(module).items() if callable(value)}
    return environment.get_template(TEMPLATE)


def write_certificate(outcome: Outcome, document: ResultDocument, folder: Path) -> tuple[RunEvent, ...]:
    """Write the certificate, whatever the verdict, and return the event of its file.

    If the measurement is unfit, every page names the failed checks.
    """
    path = folder / CERTIFICATE
    write_new(path, certificate_page(certificate_of(document, folder_statements(folder))))
    return (DocumentWritten(path),)
