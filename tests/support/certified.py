"""Results with a budget, and what a reader finds on the certificates made of them."""

import functools
from collections.abc import Collection
from dataclasses import dataclass, field
from datetime import date
from html.parser import HTMLParser
from typing import Any

from rig.analysis.outcome import calibrated
from rig.arm.kinematics import NOMINAL
from rig.config.judging_sections import CertificateSection, SiteSection
from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.budget_entries import ClockComparisonEntry
from rig.data.result_file import ResultDocument
from rig.data.result_types import Matrix3, Vector3
from rig.report.certificate.content import Certificate, certificate_of
from rig.report.certificate.page import certificate_page
from rig.report.certificate.stated import Stated
from rig.report.document import document_of
from support.synthetic_run import Setup, synthetic_run

CELLS = {"td", "th", "p", "div", "dd", "dt", "li", "h1", "h2", "h3", "caption"}
VOID = {"meta", "br", "link", "img", "input", "hr", "base", "embed", "source"}
IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LABORATORY = Stated(
    SiteSection(
        laboratory="Bench Laboratory",
        address="1 Long Lane, Smallville",
        country="DE",
        place="room 2",
        latitude_deg=48.1,
        heading_deg=30,
        time_reference="NTP, ptbtime1.ptb.de",
        ambient_temperature_c=21.5,
        ambient_humidity_percent=40,
    ),
    CertificateSection(
        customer="Example & Sons",
        customer_address="2 High Street, Smallville",
        received=date(2026, 11, 19),
        condition="without visible damage",
        authorised_by="A. Person",
    ),
)


@functools.cache
def result() -> ResultDocument:
    """Of a recording in which all that a budget needs is known. No board took part: the checks of one are left out."""
    document = document_of(calibrated([synthetic_run(Setup(told=NOMINAL))]))
    checks = tuple(check for check in document.checks if not check.name.startswith("gyro.board"))
    return document.model_copy(update={"checks": checks, "verdict": "pass"})


def accelerometer(
    correction: Matrix3 = ((1.02, 0.01, 0.0), (0.0, 0.98, -0.01), (0.0, 0.0, 1.01)),
) -> AccelerometerEntry:
    """One beside the gyroscope."""
    none: Vector3 = (0.0, 0.0, 0.0)
    covariance = tuple(tuple(1e-8 * (i == j) * (1 if i < 3 else 100) for j in range(6)) for i in range(6))
    dwell = {"index": 0, "name": "x up", "attitude": IDENTITY, "mean_m_s2": none, "mean_std_m_s2": none}
    dwell |= {"noise_m_s2": (0.01, 0.02, 0.01), "residual_m_s2": none, "samples": 600, "duration_s": 3.0}
    return AccelerometerEntry.model_validate(
        {
            "part": "lsm9ds1",
            "serial_number": "LSM9DS1-001",
            "range_m_s2": 19.6,
            "role": "calibrate",
            "model": "m = F s + b",
            "estimator": "attitude_weighted",
            "gravity_m_s2": 9.81,
            "scale": (1.012345, 0.987654, 1.0),
            "bias_m_s2": (0.3, -0.2, 0.1),
            "covariance": covariance,
            "covariance_order": ("kx", "ky", "kz", "bx", "by", "bz"),
            "covariance_units": ("1", "1", "1", "m/s²", "m/s²", "m/s²"),
            "matrix": IDENTITY,
            "non_orthogonality_rad": none,
            "non_orthogonality_std_rad": none,
            "second_order_s2_m": None,
            "second_order_std_s2_m": None,
            "reference_m_s2": (0.0, 0.0, 9.81),
            "attitude_error_rad": 5e-4,
            "attitude_error_std_rad": 1e-4,
            **dict.fromkeys(("lever_arm_m", "lever_arm_std_m", "delay_s", "delay_std_s", "alignment", "held_out")),
            "dwells": ({**dwell, "temperature_c": 22.0},),
            "sweeps": 6,
            "rank": 14,
            "condition": 1.9,
            "temperature_c": 22.0,
            "correction_matrix": correction,
            "beside": {},
            "warnings": (),
        }
    )


def with_accelerometer(found: AccelerometerEntry | None = None) -> ResultDocument:
    """That result with an accelerometer."""
    return result().model_copy(update={"accelerometers": {"gyro": found or accelerometer()}})


def compared(document: ResultDocument) -> ResultDocument:
    """The same where the computer's clock was one that the controller's could be held against."""
    assert document.clock is not None
    clock = document.clock.model_copy(
        update={"comparisons": (ClockComparisonEntry(by="the computer's clock", error=1e-6, std=1e-6),)}
    )
    return document.model_copy(update={"clock": clock})


def certificate(document: ResultDocument | None = None, stated: Stated = LABORATORY) -> Certificate:
    """Of that result, by a laboratory that says all it can."""
    return certificate_of(document or result(), stated)


@dataclass
class Page(HTMLParser):
    """A parsed page: `text` as it is read, `under` by clause the text of its elements, `tags` with their attributes."""

    text: str = ""
    tags: list[tuple[str, dict[str, str | None]]] = field(default_factory=list)
    under: dict[str, str] = field(default_factory=dict)
    style: str = ""
    _open: list[tuple[str, list[str]]] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        self.tags.append((tag, attributes))
        if tag not in VOID:
            self._open.append((tag, (attributes.get("data-clause") or "").split()))

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        opened, _ = self._open.pop()
        assert opened == tag, f"<{opened}> is closed by </{tag}>"
        if tag in CELLS:
            self.text += " "

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1][0] == "style":
            self.style += data
            return
        self.text += data
        for _, clauses in self._open:
            for clause in clauses:
                self.under[clause] = self.under.get(clause, "") + data


def read(found: Certificate) -> Page:
    """Every element of the page is closed as it was opened."""
    page = Page()
    page.feed(certificate_page(found))
    page.close()
    assert not page._open
    page.text = " ".join(page.text.split())
    return page


def planted(value: Any, text: str, kept: Collection[str]) -> Any:
    """A document in which every text that somebody else could have written is `text`."""
    if isinstance(value, dict):
        return {key: each if key in kept else planted(each, text, kept) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [planted(each, text, kept) for each in value]
    return text if isinstance(value, str) else value
