"""Accelerometers: scale, bias and axes from attitudes to gravity, and from sweeps (TRIAX, section III-B)."""

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from rig.analysis.accelerometer_errors import NONLINEARITY
from rig.analysis.outcome import Outcome
from rig.analysis.when import of_accelerometer
from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.quantity import ACCELERATION
from rig.data.result_file import ResultDocument
from rig.data.result_types import ErrorEntry
from rig.report.accelerometer_entry import accelerometer_entry
from rig.report.axes import skew_known, triple
from rig.report.budget_table import assumed_lines
from rig.report.c_functions import accelerometer_lines
from rig.report.certificate import dcc_results
from rig.report.expanded import expanded, factor_words
from rig.report.kinds.followed import Followed
from rig.report.kinds.kind import Found, Measured, ResultKind, Shown
from rig.report.kinds.triad import beside, followed_of, shown_of, tables
from rig.report.told_words import told_from, told_lines
from rig.report.validity_words import when_words
from rig.report.when_entry import when_entry


def _entries(outcome: Outcome) -> dict[str, AccelerometerEntry]:
    return {
        name: accelerometer_entry(
            result,
            found_at=when_entry(of_accelerometer(outcome.recordings, name, (dwell.index for dwell in result.dwells))),
            **told_from(outcome.told_from_in_reference.get(name, ())),
        )
        for name, result in outcome.accelerometers.items()
    }


def _found(document: ResultDocument) -> Iterator[Found[AccelerometerEntry]]:
    return (Found(name, ACCELERATION, entry) for name, entry in document.accelerometers.items())


def _printed(found: Found[AccelerometerEntry]) -> Iterator[Table | str]:
    entry = found.entry
    model = "a = F s + b" if entry.second_order_s2_m is None else "a = F (s + φ s²) + b"
    name = beside(found.sensor, ACCELERATION)
    yield from tables(f"{name}: {entry.part} {entry.serial_number}, {model}, {entry.estimator}", ACCELERATION, entry)
    yield from _lines(entry)


def _shown(found: Found[AccelerometerEntry]) -> Shown:
    return shown_of(beside(found.sensor, ACCELERATION), ACCELERATION, found.entry)


def _followed(found: Found[AccelerometerEntry], document: ResultDocument) -> Followed:
    return followed_of(found.sensor, ACCELERATION, found.entry, document, found.entry.temperature_c)


def _measured(found: Found[AccelerometerEntry], _: object) -> Measured:
    entry = found.entry
    warm = {"": entry.temperature_c if entry.found_at is None else entry.found_at.temperature_c}
    name, results = f"calibration of accelerometer {found.sensor}", dcc_results.accelerometer(entry)
    return Measured("accelerometer", found.sensor, entry.part, entry.serial_number, name, results, warm)


def _lines(found: AccelerometerEntry) -> Iterator[str]:
    """What stands below the table."""
    yield f"relative to gravity, {found.gravity_m_s2:.6g} m/s²; {len(found.dwells)} attitudes, {found.sweeps} sweeps"
    if found.found_at is not None:
        yield f"scale and bias: {when_words(found.found_at)}"
    if found.budget is not None and any(line.name == NONLINEARITY for line in found.budget.contributors):
        yield "k by the readings at 1 g up and down, b at 0 g"
    yield from assumed_lines(found.budget)
    yield from told_lines(found.told_from)
    skew = triple(np.degrees(found.non_orthogonality_rad), "+.4f")
    yield f"non-orthogonality yz zx xy: {skew} ° (± {skew_known(found)})"
    off, known = 1e3 * found.attitude_error_rad, 2e3 * found.attitude_error_std_rad
    yield f"attitude error found: {off:.2f} mrad about each axis (± {known:.2f})"
    if found.second_order_s2_m is not None and found.second_order_std_s2_m is not None:
        terms = triple(found.second_order_s2_m, "+.2e")
        widths = expanded(found.second_order_std_s2_m, found.second_order_freedom).widths
        words = factor_words(found.second_order_freedom)
        yield f"second order: {terms} s²/m (± {max(widths):.1e}, {words})"
    if found.lever_arm_m is not None and found.lever_arm_std_m is not None:
        lever = triple(np.multiply(1e3, found.lever_arm_m), "+.1f")
        yield f"sits at {lever} mm from the wrists' axes (± {2e3 * max(found.lever_arm_std_m):.1f})"
    if found.delay_s is not None and found.delay_std_s is not None:
        yield f"lags its gyroscope by {1e3 * found.delay_s:+.2f} ms (± {2e3 * found.delay_std_s:.2f})"
    if found.alignment is not None:
        turned = triple(np.degrees(found.alignment.rotation_rad), "+.4f")
        std_deg = 2 * np.degrees(max(found.alignment.std_rad))
        yield f"turned against its gyroscope by: {turned} ° (± {std_deg:.4f})"
    for method, other in found.beside.items():
        if isinstance(other, ErrorEntry):
            yield f"{method}, attitudes alone: {other.error}"
        else:
            scale, bias = triple(other.scale, ".6f"), triple(other.bias_m_s2, "+.5f")
            yield f"{method}, attitudes alone: k {scale}, b {bias} m/s²"
    if found.held_out is not None:
        held = found.held_out
        yield (
            f"gravity's size in {held.dwells} attitudes held out: RMS {held.rms_m_s2:.5f} m/s², "
            f"at most {held.max_m_s2:.5f} off"
        )
    yield from (f"warning: {warning}" for warning in found.warnings)


ACCELEROMETER = ResultKind(
    name="accelerometer",
    key="accelerometers",
    entries=_entries,
    found=_found,
    unsolved=lambda _: iter(()),
    printed=_printed,
    shown=_shown,
    followed=_followed,
    header=accelerometer_lines,
    figures="rig.report.attitude_figures:write_attitude_figures",
    block="at_rest.html.j2:accelerometer",
    measured=_measured,
)
