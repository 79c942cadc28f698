"""Results with a budget, and the content of their certificates as shown to a reader."""

import functools
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from datetime import date
from html.parser import HTMLParser
from types import MappingProxyType
from typing import Any

import numpy as np

from rig.analysis.analyses import calibrate
from rig.config.judging.judging_sections import CertificateSection, SiteSection
from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.bias_drift import DriftEntry
from rig.data.entries.budget import ClockComparisonEntry
from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.entries.magnetometer import MagnetometerEntry, ReversalEntry
from rig.data.entries.result_types import Matrix3, Vector3
from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.result_file import ResultDocument, VectorEntry
from rig.estimation.reference.attitude_error import AttitudeError
from rig.estimation.reference.reference_budget import FitUncertainty, NormUncertainty, reference_budget
from rig.motion.geometry import NOMINAL
from rig.report.certificate.certificate_page import certificate_page
from rig.report.certificate.content import Certificate, certificate_of
from rig.report.certificate.statements import StatedFacts
from rig.report.document import document_of
from rig.report.entries.budget import budget_entry
from support.recordings.synthetic_run import Setup, synthetic_run

CELLS = {"td", "th", "p", "div", "dd", "dt", "li", "h1", "h2", "h3", "caption"}
VOID = {"meta", "br", "link", "img", "input", "hr", "base", "embed", "source"}
IDENTITY: Matrix3 = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LABORATORY = StatedFacts(
    SiteSection(
        laboratory="Bench Laboratory",
        address="1 Long Lane, Smallville",
        country="DE",
        place="room 2",
        latitude_deg=48.1,
        heading_deg=30,
        time_reference="NTP, ptbtime1.ptb.de",
        gravity_reference="gravimeter, certificate 17",
        magnetic_field_reference="fluxgate, certificate 18",
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
    """Return the result of a recording whose budget is complete. It contains no checks of a board."""
    document = document_of(calibrate([synthetic_run(Setup(stated_kinematics=NOMINAL))]))
    checks = tuple(check for check in document.checks if not check.name.startswith("gyro.board"))
    return document.model_copy(update={"checks": checks, "verdict": "pass"})


def accelerometer(
    correction: Matrix3 = ((1.02, 0.01, 0.0), (0.0, 0.98, -0.01), (0.0, 0.0, 1.01)),
) -> AccelerometerEntry:
    """Return an accelerometer's entry for the gyroscope's sensor."""
    none: Vector3 = (0.0, 0.0, 0.0)
    covariance = tuple(tuple(1e-8 * (i == j) * (1 if i < 3 else 100) for j in range(6)) for i in range(6))
    dwell = {"index": 0, "name": "x up", "attitude": IDENTITY, "mean_m_s2": none, "mean_std_m_s2": none}
    dwell |= {
        "noise_m_s2": (0.01, 0.02, 0.01),
        "residual_m_s2": none,
        "residual_std_m_s2": none,
        "samples": 600,
        "duration_s": 3.0,
    }
    fields: dict[str, Any] = {
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
        "non_orthogonality_rad": (4e-3, -7e-3, 5e-3),
        "non_orthogonality_std_rad": (4e-5, 5e-5, 6e-5),
        "second_order_s2_m": None,
        "second_order_std_s2_m": None,
        "reference_m_s2": (0.0, 0.0, 9.81),
        "attitude_error_rad": 5e-4,
        "attitude_error_std_rad": 1e-4,
        **dict.fromkeys(("lever_arm_m", "lever_arm_std_m", "delay_s", "delay_std_s", "alignment", "validation")),
        "dwells": ({**dwell, "temperature_c": 22.0},),
        "sweeps": 6,
        "rank": 14,
        "condition": 1.9,
        "temperature_c": 22.0,
        "correction_matrix": correction,
        "other_methods": {},
        "warnings": (),
    }
    return AccelerometerEntry.model_validate(
        _add_budget(fields, NormUncertainty("gravity", 1e-4, True, 9.81, "m/s²", "site.gravity_uncertainty_m_s2"))
    )


def _add_budget(fields: Mapping[str, Any], size: NormUncertainty) -> dict[str, Any]:
    """Add a budget of noise and of the reference's uncertainty."""
    noise = np.linalg.cholesky(np.array(fields["covariance"]))
    exact = AttitudeError(0.0, 0.0)
    spread = FitUncertainty(
        np.array(fields["scale"]),
        np.array(fields["covariance"]),
        noise,
        np.eye(6),
        exact,
        chi_square=0.0,
        dof=0,
        noise_dof=np.full(6, np.inf),
    )
    budget = reference_budget(spread, size)
    return {**fields, "covariance_combined": budget.covariance.tolist(), "budget": budget_entry(budget)}


def add_accelerometer(entry: AccelerometerEntry | None = None) -> ResultDocument:
    """Return the result with an accelerometer."""
    return result().model_copy(update={"accelerometers": {"gyro": entry or accelerometer()}})


def magnetometer() -> MagnetometerEntry:
    """Return a magnetometer as mounted, with correlated parameters."""
    none: Vector3 = (0.0, 0.0, 0.0)
    size = np.array([2e-4, 2e-4, 2e-4, 5e-9, 5e-9, 5e-9])
    covariance = (0.9 * np.eye(6) + 0.1) * np.outer(size, size)
    dwell = {"index": 0, "name": "x up", "attitude": IDENTITY, "mean_t": none, "mean_std_t": (2e-8, 2e-8, 2e-8)}
    dwell |= {
        "noise_t": (3e-7, 3e-7, 3e-7),
        "residual_t": (1e-8, -3e-8, 0.0),
        "residual_std_t": (2e-8, 2e-8, 2e-8),
        "samples": 160,
        "duration_s": 2.0,
    }
    test = {"change_t": (1e-8, 0.0, 0.0), "std_t": (2e-8, 2e-8, 2e-8), "chi_square": 1.0, "limit": 16.0}
    alike = {"chi_square": 70.0, "degrees_of_freedom": 64, "limit": 104.0, "attitude_error_rad": 2e-4}
    fields: dict[str, Any] = {
        "part": "lsm9ds1_magnetometer",
        "serial_number": "COMPASS-7",
        "range_t": 4e-4,
        "model": "m = F B + b",
        "estimator": "attitude_weighted",
        "arm_field_in_bias": True,
        "extension_m": (0.0, 0.0, 0.3),
        "uniformity": alike,
        "drift": test,
        "field_t": 48e-6,
        "scale": (1.029923, 0.980027, 1.019991),
        "bias_t": (21.003e-6, -34.004e-6, 15.218e-6),
        "covariance": covariance.tolist(),
        "covariance_order": ("kx", "ky", "kz", "bx", "by", "bz"),
        "covariance_units": ("1", "1", "1", "T", "T", "T"),
        "matrix": IDENTITY,
        "hard_iron_t": none,
        "non_orthogonality_rad": (0.0109, -0.0086, 0.0138),
        "non_orthogonality_std_rad": (2.7e-4, 2.6e-4, 2.8e-4),
        "field_base_t": (2e-5, 0.0, -4e-5),
        "attitude_error_rad": 2e-4,
        "attitude_error_std_rad": 1e-4,
        "dwells": (dwell,),
        "rank": 14,
        "condition": 2.0,
        "correction_matrix": IDENTITY,
        "other_methods": {},
        "warnings": (),
    }
    return MagnetometerEntry.model_validate(
        _add_budget(fields, NormUncertainty("size of the field", 0.01, False, 48.0, "µT", "not given"))
    )


def reversal(document: ResultDocument) -> ReversalEntry:
    """Return the reversal of the magnetometer, from this run and a later one, without a reversal along x."""
    entry = magnetometer()
    as_mounted = {"mounting": IDENTITY, "bias_t": entry.bias_t, "bias_std_t": (5e-9,) * 3, "field_base_t": entry.bias_t}
    began = (document.provenance.started_utc, "2026-11-22T18:00:00+00:00")
    return ReversalEntry.model_validate(
        {
            "part": entry.part,
            "serial_number": entry.serial_number,
            "scale": entry.scale,
            "scale_std": (1.4e-4,) * 3,
            "bias_t": (21.003e-6, -34.009e-6, 15.002e-6),
            "bias_std_t": (3.6e-9,) * 3,
            "arm_field_in_bias": (True, False, False),
            "arm_field_t": (0.0, -5e-9, 220e-9),
            "arm_field_std_t": (0.0, 3.8e-9, 3.8e-9),
            "covariance": np.diag(np.square([3.6e-9] * 3 + [0.0, 3.8e-9, 3.8e-9])).tolist(),
            "correction_matrix": IDENTITY,
            "chi_square": 1.4,
            "degrees_of_freedom": 2,
            "limit": 10.8,
            **dict.fromkeys((f"{name}_degrees_of_freedom" for name in ("scale", "bias", "arm_field")), (None,) * 3),
            "runs": [{"run": f"run {i}", "started_utc": start, **as_mounted} for i, start in enumerate(began)],
        }
    )


def bias_drift(unit: str, *, slope: bool) -> DriftEntry:
    """Return three repeats, the last of them warmer; x falls, then rises."""
    biases = ((3e-6, 1e-6, 0.0), (1e-6, 2e-6, 0.0), (9e-6, 3e-6, 1e-6))
    stds = ((3e-7,) * 3, (4e-7,) * 3, (5e-7,) * 3)
    slope_of: dict[str, Any] = {
        "slope": (2e-6, 6e-7, 2e-7),
        "std": (2e-7,) * 3,
        "range_c": (22.0, 26.0),
        "correlation_with_time": 0.4,
    }
    slope_of["degrees_of_freedom"] = (None,) * 3
    return DriftEntry.model_validate(
        {
            "unit": unit,
            "repeats": [
                {
                    "time_s": 600.0 * i,
                    "temperature_c": 22.0 + 2 * i,
                    "scale_fixed": {"bias": bias, "std": std},
                    "scale_free": {"error": "too_few_observations: of these"},
                }
                for i, (bias, std) in enumerate(zip(biases, stds, strict=True))
            ],
            "common_std": (4e-7, 4e-7, 4e-7),
            "scatter_ratio": (1.0, 1.0, 1.0),
            "steps": [{"repeat": 3, "axis": "x", "change": biases[2], "std": stds[2]}],
            "false_alarm_probability": 0.02,
            "largest_change": (8e-6, 2e-6, 1e-6),
            "temperature_slope": slope_of if slope else {"error": "temperature_range_too_small: 1 °C"},
            "earth_rate_known": False,
            "degrees_of_freedom": (None,) * 3,
            "part": "lsm9ds1",
            "serial_number": "LSM9DS1-001",
            "full_scale": 4.276 if unit == "rad/s" else 19.6,
            "temperature_stated": False,
        }
    )


# Of kⁿ and bⁿ, n from 0 to 3: at all temperatures U is 2.1 to 2.6 times as large.
OVER_TEMPERATURE_VARIANCES = (2e-9, 1e-14, 1e-16, 1e-18, 2e-11, 1e-15, 1e-17, 1e-19)


def over_temperature() -> OverTemperatureEntry:
    """Return a gyroscope from 20 to 40 °C with linear scale factors and quadratic biases."""
    nothing, steps = (0.0, 0.0, 0.0), range(17)
    row = {"scale": (1.1, 1.2, 1.3), "bias": (0.01, 0.02, 0.03), "expanded_scale": (1e-4,) * 3}
    return OverTemperatureEntry.model_validate(
        {
            "part": "lsm9ds1",
            "serial_number": "LSM9DS1-001",
            "full_scale": 4.276,
            "unit": "rad/s",
            "reference_c": 25.0,
            "range_c": (20.0, 40.0),
            "orders": (1, 2),
            "repeats": 6,
            "scale": ((1.1, 1.2, 1.3), (1e-4, 2e-4, 3e-4), nothing, nothing),
            "bias": ((0.01, 0.02, 0.03), (1e-4, 2e-4, -1e-4), (1e-6, 0.0, -1e-6), nothing),
            "covariance": np.diag(np.repeat(OVER_TEMPERATURE_VARIANCES, 3)).tolist(),
            "contributors": [],
            "table": [
                {**row, "temperature_c": 20 + 1.25 * step, "expanded_bias": (1e-5 + step * 1e-7,) * 3} for step in steps
            ],
            "lag_s": 1.0,
            "lag_std_s": 2.0,
            "hysteresis": None,
            "hysteresis_std": None,
        }
    )


def everything() -> ResultDocument:
    """Return a result with everything, which no single run finds.

    A gyroscope with gravity's effect and the Earth's rate, an accelerometer of second order, a magnetometer, and biases
    by repeat.
    """
    document = add_accelerometer(
        accelerometer().model_copy(
            update={"second_order_s2_m": (9.72e-6, -9.478e-5, 0.0), "second_order_std_s2_m": (4.6e-6,) * 3}
        )
    )
    sensor = document.gyroscopes["gyro"]
    assert isinstance(sensor.vector_model, VectorEntry)
    gravity_terms = {
        "g_sensitivity_rad_s_per_m_s2": ((1e-4, 2e-5, 0.0), (0.0, -1e-4, 0.0), (3e-5, 0.0, 1.2e-4)),
        "g_sensitivity_std_rad_s_per_m_s2": ((1.3e-6,) * 3,) * 3,
    }
    turning = EarthRateEntry(
        rate_rad_s=(-2.356e-5, -5.165e-5, 4.618e-5),
        covariance_rad2_s2=((2.2e-13, 4e-15, 4e-16), (4e-15, 1.9e-13, -6e-16), (4e-16, -6e-16, 2.0e-13)),
        norm_rad_s=7.318e-5,
        norm_std_rad_s=4.4e-7,
        latitude_rad=0.68286,
        latitude_std_rad=0.00608,
        heading_rad=-1.9987,
        heading_std_rad=0.008,
        up=(0.0, 0.0, 1.0),
        vertical_fixed=False,
        birge_ratio=0.8,
        degrees_of_freedom=None,
    )
    updates = {"vector_model": sensor.vector_model.model_copy(update=gravity_terms), "earth_rate": turning}
    drifts = {"rate": bias_drift("rad/s", slope=True), "acceleration": bias_drift("m/s²", slope=False)}
    return document.model_copy(
        update={
            "gyroscopes": {"gyro": sensor.model_copy(update=updates)},
            "magnetometers": {"compass": magnetometer()},
            "bias_drift": {"gyro": drifts},
        }
    )


def add_comparison(document: ResultDocument) -> ResultDocument:
    """Return the result with a comparison of the controller's clock with the computer's."""
    assert document.clock is not None
    clock = document.clock.model_copy(
        update={"comparisons": (ClockComparisonEntry(clock="the computer's clock", error=1e-6, std=1e-6),)}
    )
    return document.model_copy(update={"clock": clock})


def certificate(
    document: ResultDocument | None = None,
    stated: StatedFacts = LABORATORY,
    reversals: Mapping[str, ReversalEntry] = MappingProxyType({}),
) -> Certificate:
    """Return the certificate of a result, by a laboratory that makes all possible statements."""
    return certificate_of(document or result(), stated, reversals)


@dataclass
class Page(HTMLParser):
    """A parsed page: `text` as displayed, `under`: the elements' text by clause, `tags` with their attributes."""

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


def read(certificate: Certificate) -> Page:
    """Parse the page of a certificate, and assert that every element is closed."""
    page = Page()
    page.feed(certificate_page(certificate))
    page.close()
    assert not page._open
    page.text = " ".join(page.text.split())
    return page


def plant(value: Any, text: str, kept: Collection[str]) -> Any:
    """Return a document in which every text that others may have written is replaced by `text`."""
    if isinstance(value, dict):
        return {key: part if key in kept else plant(part, text, kept) for key, part in value.items()}
    if isinstance(value, (list, tuple)):
        return [plant(part, text, kept) for part in value]
    return text if isinstance(value, str) else value
