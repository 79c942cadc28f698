"""Results of turning a magnetometer over, for people and for machines."""

from collections.abc import Iterator, Mapping

import numpy as np
from rich.console import Console

from rig.analysis.effective_dof import reversal_dof
from rig.analysis.reversal import MagnetometerReversal, ReversalRun
from rig.data.entries.magnetometer import AsMountedEntry, ReversalDocument, ReversalEntry
from rig.data.quantity import FIELD
from rig.report.entry import dof_or_none, entry
from rig.report.tables.axis_tables import scale_and_bias_table, triple
from rig.report.tables.budget import heading_of
from rig.report.words.expanded_uncertainty import expanded
from rig.station.plain_text import plain


def reversal_document(reversals: Mapping[str, MagnetometerReversal]) -> ReversalDocument:
    """Return the results of turning magnetometers over, in SI units."""
    entries = {name: _entry(reversal) for name, reversal in reversals.items()}
    return ReversalDocument.model_validate({"schema": "rig.reversal/1", "magnetometers": entries})


def print_reversal(document: ReversalDocument, *, as_json: bool) -> None:
    """Print the reversals on stdout: tables for people, JSON of schema "rig.reversal/1" for machines."""
    if as_json:
        print(document.text())
        return
    console = Console(highlight=False)
    for name, reversal in document.magnetometers.items():
        title = f"{name}, magnetometer turned over: {reversal.part} {reversal.serial_number}, {len(reversal.runs)} runs"
        scale = expanded(reversal.scale_std, reversal.scale_degrees_of_freedom)
        bias = expanded(reversal.bias_std_t, reversal.bias_degrees_of_freedom)
        heading, widths = heading_of([*scale.factors, *bias.factors]), [*scale.widths, *bias.widths]
        console.print(scale_and_bias_table(title, FIELD, reversal.scale, reversal.bias_t, widths, heading=heading))
        for line in _lines(reversal):
            console.print(plain(line))


def _lines(reversal: ReversalEntry) -> Iterator[str]:
    mixed = [axis for axis, is_mixed in zip("xyz", reversal.arm_field_in_bias, strict=True) if is_mixed]
    if mixed:
        yield f"{' '.join(mixed)}: not turned over, so the bias there includes the arm's field, as mounted"
    else:
        yield "the sensor's own bias on all axes, separated from the arm's field"
    arm_field = triple(np.divide(reversal.arm_field_t, FIELD.bias.size), "+.3f")
    width = max(expanded(reversal.arm_field_std_t, reversal.arm_field_degrees_of_freedom).widths) / FIELD.bias.size
    yield f"arm's field in its axes in the first run: {arm_field} µT (± {width:.3f})"
    yield f"the runs agree: χ² {reversal.chi_square:.1f}, at most {reversal.limit:.1f}"
    for run in reversal.runs:
        yield f"as mounted in {run.run}: b {triple(np.divide(run.bias_t, FIELD.bias.size), '+.3f')} µT"


def _entry(reversal: MagnetometerReversal) -> ReversalEntry:
    std = np.sqrt(np.diag(reversal.separation.covariance))
    scale, both = reversal_dof(reversal)
    return entry(
        ReversalEntry, reversal.separation, reversal, reversal.runs[0].result.sensor,
        bias_std_t=std[:3],
        arm_field_std_t=std[3:],
        scale_degrees_of_freedom=dof_or_none(scale),
        bias_degrees_of_freedom=dof_or_none(both[:3]),
        arm_field_degrees_of_freedom=dof_or_none(both[3:]),
        runs=tuple(map(_run_entry, reversal.runs)),
    )  # fmt: skip


def _run_entry(run: ReversalRun) -> AsMountedEntry:
    solution = run.result.solution
    return entry(
        AsMountedEntry, run, run.result.sensor,
        started_utc=run.outcome.provenance.recorded.started_utc,
        bias_std_t=np.sqrt(np.diag(solution.covariance))[12:],
        bias_t=solution.bias,
        field_base_t=solution.reference,
    )  # fmt: skip
