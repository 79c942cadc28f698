"""Accelerometers: scale, bias and axes from attitudes to gravity, and from sweeps (paper TRIAX, section III-B)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.outcome import Outcome
from rig.data.entries.accelerometer import AccelerometerEntry, AlignmentEntry, ValidationEntry
from rig.data.quantity import ACCELERATION
from rig.report.c_code.c_functions import accelerometer_lines
from rig.report.entry import dof_or_none, entry
from rig.report.findings.characteristics import ACCELEROMETERS, SECOND_ORDER
from rig.report.findings.finding import Finding
from rig.report.findings.result_kind import Standard
from rig.report.kinds.triad import Words, attitude_lines, method_lines, triad_kind
from rig.report.tables import dcc_results
from rig.report.tables.axis_tables import line_of, triple
from rig.report.tables.budget import list_assumptions
from rig.report.words.detection_limit_words import detection_limit_field, detection_limit_lines
from rig.report.words.validity_words import warmth, when_words

if TYPE_CHECKING:
    from rig.analysis.reference.accelerometer import AccelerometerResult, ValidationRepeat
    from rig.estimation.triads import Alignment


def _entries(outcome: Outcome) -> dict[str, AccelerometerEntry]:
    on_arm = {name: _entry(outcome, name, result) for name, result in outcome.accelerometers.items()}
    if not outcome.external:
        return on_arm
    from rig.report.entries.external import list_external_accelerometers

    return list_external_accelerometers(outcome) | on_arm


def _entry(outcome: Outcome, name: str, result: "AccelerometerResult") -> AccelerometerEntry:
    """Return the entry of an accelerometer's calibration in `result.json`."""
    from rig.analysis.effective_dof import acceleration_angle_dof, second_order_dof
    from rig.analysis.measurement_conditions import accelerometer_conditions
    from rig.estimation.reference.accelerometer_model import DELAY, SECOND
    from rig.estimation.reference.imu import MODEL
    from rig.estimation.residuals import dwell_residual_std_m_s2
    from rig.report.entries.triad import ACCELEROMETER_MODELS, triad_entry
    from rig.report.entry import when_entry

    solution = result.solution
    std = np.sqrt(np.diag(solution.covariance))
    return triad_entry(
        ACCELEROMETER_MODELS, result, result.sensor,
        (solution.dwell_residuals_m_s2, dwell_residual_std_m_s2(solution, result.movement)),
        role="calibrate",
        range_m_s2=result.sensor.channel(ACCELERATION).range,
        model=MODEL,
        estimator="attitude_weighted",
        second_order_std_s2_m=None if solution.second_order_s2_m is None else std[SECOND],
        delay_std_s=None if solution.delay_s is None else float(std[DELAY]),
        alignment=None if result.alignment is None else _alignment(result.alignment),
        non_orthogonality_degrees_of_freedom=dof_or_none(acceleration_angle_dof(result)),
        second_order_degrees_of_freedom=dof_or_none(second_order_dof(result)),
        validation=None if result.validation is None else _validation(result.validation),
        conditions=when_entry(
            accelerometer_conditions(outcome.recordings, name, [dwell.index for dwell in result.dwells])
        ),
        **detection_limit_field(outcome.reference_detection_limits.get(name, ())),
    )  # fmt: skip


def _alignment(alignment: "Alignment") -> AlignmentEntry:
    return entry(
        AlignmentEntry, alignment,
        std_rad=np.sqrt(np.diag(alignment.covariance_rad2)),
    )  # fmt: skip


def _validation(validation: "ValidationRepeat") -> ValidationEntry:
    return ValidationEntry(
        dwells=len(validation.dwells),
        rms_m_s2=validation.rms_m_s2,
        max_m_s2=float(np.abs(validation.error_m_s2).max()),
    )


def _lines(finding: Finding[AccelerometerEntry]) -> Iterator[str]:
    """Yield the lines below the table of scale and bias."""
    from rig.estimation.gyroscope.own_errors import NONLINEARITY

    entry = finding.entry
    sweeps = "" if entry.placement is not None else f", {entry.sweeps} sweeps"
    yield f"relative to gravity, {entry.gravity_m_s2:.6g} m/s²; {len(entry.dwells)} attitudes{sweeps}"
    if entry.conditions is not None:
        yield f"scale and bias: {when_words(entry.conditions)}"
    if entry.budget is not None and any(line.name == NONLINEARITY for line in entry.budget.contributors):
        yield "k by the readings at 1 g up and down, b at 0 g"
    yield from list_assumptions(entry.budget)
    yield from detection_limit_lines(entry.detection_limits)
    yield from attitude_lines(finding)
    if entry.second_order_s2_m is not None and entry.second_order_std_s2_m is not None:
        yield line_of(SECOND_ORDER.term_of(finding), "second order", "+.2e", ".1e")
    if entry.lever_arm_m is not None and entry.lever_arm_std_m is not None:
        lever = triple(np.multiply(1e3, entry.lever_arm_m), "+.1f")
        yield f"lever arm from the wrists' axes: {lever} mm (± {2e3 * max(entry.lever_arm_std_m):.1f})"
    if entry.delay_s is not None and entry.delay_std_s is not None:
        yield f"delay behind its gyroscope: {1e3 * entry.delay_s:+.2f} ms (± {2e3 * entry.delay_std_s:.2f})"
    if entry.alignment is not None:
        rotation = triple(np.degrees(entry.alignment.rotation_rad), "+.4f")
        std_deg = 2 * np.degrees(max(entry.alignment.std_rad))
        yield f"rotation against its gyroscope: {rotation} ° (± {std_deg:.4f})"
    yield from method_lines(entry, ACCELERATION, ", attitudes alone")
    if entry.validation is not None:
        validation = entry.validation
        yield (
            f"magnitude of gravity in {validation.dwells} validation attitudes: RMS {validation.rms_m_s2:.5f} m/s², "
            f"largest error {validation.max_m_s2:.5f}"
        )
    yield from (f"warning: {warning}" for warning in entry.warnings)


def _model(entry: AccelerometerEntry) -> str:
    return "a = F s + b" if entry.second_order_s2_m is None else "a = F (s + φ s²) + b"


def _temperatures_c(entry: AccelerometerEntry) -> dict[str, float | None]:
    return {"": entry.temperature_c} if entry.conditions is None else warmth(entry.conditions)


def _method(swept: bool) -> str:
    sweeps = " and in the sweeps" if swept else ""
    measured = f"Accelerometers are measured at rest in known attitudes to gravity{sweeps}"
    return f"{measured}, and are solved for together with the arm's attitude error."


ACCELEROMETER = triad_kind(
    ACCELERATION,
    "accelerometers",
    _entries,
    Words("", _model, _lines, lambda entry, _: dcc_results.accelerometer(entry), _temperatures_c),
    header=accelerometer_lines,
    block="at_rest.html.j2:accelerometer",
    standard=Standard(
        size="Gravity",
        value=lambda entry: f"{entry.gravity_m_s2:.6g} m/s²",
        origin=lambda site: site.gravity_reference,
        quantity="gravity",
        method=_method,
    ),
    characteristics=ACCELEROMETERS,
)
