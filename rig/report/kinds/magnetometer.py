"""Magnetometers: scale, bias and axes from attitudes to a field of known size, as mounted (paper TRIAX, Eq. (7))."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.outcome import Outcome
from rig.data.entries.magnetometer import FieldDriftEntry, MagnetometerEntry, UniformityEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.quantity import FIELD
from rig.report.c_code.c_functions import magnetometer_lines
from rig.report.entry import dof_or_none, entry, error_entry
from rig.report.findings.characteristics import MAGNETOMETERS
from rig.report.findings.finding import Finding
from rig.report.findings.result_kind import Standard
from rig.report.kinds.triad import Words, attitude_lines, method_lines, triad_kind
from rig.report.tables import dcc_results
from rig.report.tables.axis_tables import triple
from rig.report.tables.budget import list_assumptions
from rig.report.words.detection_limit_words import detection_limit_field, detection_limit_lines
from rig.report.words.validity_words import when_words

if TYPE_CHECKING:
    from rig.analysis.reference.magnetometer import MagnetometerResult

MIN_FLANGE_DISTANCE_M = 0.3  # a housing of 0.2 A m² makes 0.4 to 1.2 µT at 20 to 40 cm


def _entries(outcome: Outcome) -> dict[str, MagnetometerEntry | ErrorEntry]:
    on_arm: dict[str, MagnetometerEntry | ErrorEntry] = {
        **{name: _entry(outcome, name, result) for name, result in outcome.magnetometers.results.items()},
        **{name: error_entry(fault) for name, fault in outcome.magnetometers.faults.items()},
    }
    if not outcome.external:
        return on_arm
    from rig.report.entries.external import list_external_magnetometers

    return {**list_external_magnetometers(outcome), **on_arm}


def _entry(outcome: Outcome, name: str, result: "MagnetometerResult") -> MagnetometerEntry:
    from rig.analysis.effective_dof import field_angle_dof
    from rig.analysis.measurement_conditions import magnetometer_conditions
    from rig.estimation.reference.magnetometer import MODEL, hard_iron
    from rig.report.entries.triad import MAGNETOMETER_MODELS, attitudes_entry
    from rig.report.entry import when_entry

    return attitudes_entry(
        MAGNETOMETER_MODELS, result, result.sensor,
        model=MODEL,
        range_t=result.sensor.channel(FIELD).range,
        arm_field_in_bias=True,
        uniformity=entry(UniformityEntry, result.uniformity),
        drift=None if result.drift is None else entry(FieldDriftEntry, result.drift),
        hard_iron_t=hard_iron(result.solution),
        field_base_t=result.solution.reference,
        non_orthogonality_degrees_of_freedom=dof_or_none(field_angle_dof(result)),
        conditions=when_entry(
            magnetometer_conditions(outcome.recordings, name, [dwell.index for dwell in result.dwells])
        ),
        **detection_limit_field(outcome.reference_detection_limits.get(name, ())),
    )  # fmt: skip


def _lines(finding: Finding[MagnetometerEntry]) -> Iterator[str]:
    """Yield the lines below the table of scale and bias."""
    entry = finding.entry
    field_ut = entry.field_t / FIELD.bias.size
    yield f"relative to a field of {field_ut:g} µT; {len(entry.dwells)} attitudes; it has no limits"
    if entry.conditions is not None:
        yield f"scale and bias: {when_words(entry.conditions)}"
    yield from list_assumptions(entry.budget)
    yield from detection_limit_lines(entry.detection_limits)
    yield "the field of iron and currents that turn with it is part of the result"
    base = "table's axes"
    if entry.arm_field_in_bias:
        base = "arm's base"
        yield "the bias includes the arm's own field; runs with the sensor turned over separate it: rig reversal"
        yield from _field_test_lines(entry)
    yield f"field in the {base}: {triple(np.divide(entry.field_base_t, FIELD.bias.size), '+.3f')} µT"
    yield from attitude_lines(finding)
    yield from method_lines(entry, FIELD)
    yield from (f"warning: {warning}" for warning in entry.warnings)


def _field_test_lines(entry: MagnetometerEntry) -> Iterator[str]:
    """Yield lines on the tests of whether the field was uniform and constant."""
    if (uniformity := entry.uniformity) is not None:
        yield f"uniform field: χ² of the residuals {uniformity.chi_square:.1f}, at most {uniformity.limit:.1f}"
    if (drift := entry.drift) is not None:
        change, std = (np.linalg.norm(vector) / FIELD.bias.size for vector in (drift.change_t, drift.std_t))
        yield f"at home before and after: changed by {change:.3f} µT (± {2 * std:.3f})"
    else:
        yield "no field test at home before and after: a drift of the field is not detected (procedure.field_test_s)"
    distance_m = float(np.linalg.norm(entry.extension_m))
    if distance_m < MIN_FLANGE_DISTANCE_M:
        advised = f"{1e3 * MIN_FLANGE_DISTANCE_M:.0f} mm are advised (arm.extension_mm)"
        yield f"{1e3 * distance_m:.0f} mm from the flange; {advised}"


MAGNETOMETER = triad_kind(
    FIELD,
    "magnetometers",
    _entries,
    Words(" as mounted", lambda entry: str(entry.model), _lines, dcc_results.magnetometer, lambda _: {}),
    header=magnetometer_lines,
    block="at_rest.html.j2:magnetometer",
    standard=Standard(
        size="The size of the magnetic field",
        value=lambda entry: f"{entry.field_t / FIELD.bias.size:.6g} {FIELD.bias.name}",
        origin=lambda site: site.magnetic_field_reference,
        quantity="a field of stated size",
        method=lambda _: "Magnetometers are measured in known attitudes to a field of stated size.",
    ),
    characteristics=MAGNETOMETERS,
)
