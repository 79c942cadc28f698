"""What turning a magnetometer over tells, for people and for machines."""

from collections.abc import Iterator, Mapping

import numpy as np
from rich.console import Console

from rig.analysis.freedom_beside import of_reversal
from rig.analysis.reversal import AsMounted, MagnetometerReversal
from rig.data.entries.magnetometer import AsMountedEntry, ReversalDocument, ReversalEntry
from rig.data.quantity import FIELD
from rig.report.entry import counted, entry
from rig.report.tables.axes import scale_and_bias_table, triple
from rig.report.tables.budget import heading_of
from rig.report.words.expanded import expanded
from rig.station.plain_text import plain


def reversal_document(reversals: Mapping[str, MagnetometerReversal]) -> ReversalDocument:
    """What turning magnetometers over has told, in SI units."""
    entries = {name: _entry(each) for name, each in reversals.items()}
    return ReversalDocument.model_validate({"schema": "rig.reversal/1", "magnetometers": entries})


def print_reversal(document: ReversalDocument, *, as_json: bool) -> None:
    """Print the reversals on stdout: tables for people, JSON of schema "rig.reversal/1" for machines."""
    if as_json:
        print(document.text())
        return
    console = Console(highlight=False)
    for name, found in document.magnetometers.items():
        title = f"{name}, magnetometer turned over: {found.part} {found.serial_number}, {len(found.runs)} runs"
        scale = expanded(found.scale_std, found.scale_degrees_of_freedom)
        own = expanded(found.bias_std_t, found.bias_degrees_of_freedom)
        heading, widths = heading_of([*scale.factors, *own.factors]), [*scale.widths, *own.widths]
        console.print(scale_and_bias_table(title, FIELD, found.scale, found.bias_t, widths, heading=heading))
        for line in _lines(found):
            console.print(plain(line))


def _lines(reversal: ReversalEntry) -> Iterator[str]:
    mixed = [axis for axis, held in zip("xyz", reversal.arm_field_in_bias, strict=True) if held]
    if mixed:
        yield f"{' '.join(mixed)}: never turned over, so the arm's field is in the bias there, as mounted"
    else:
        yield "the sensor's own on all axes: it is separated from the arm's field"
    felt = triple(np.divide(reversal.arm_field_t, FIELD.bias.size), "+.3f")
    field = max(expanded(reversal.arm_field_std_t, reversal.arm_field_degrees_of_freedom).widths) / FIELD.bias.size
    yield f"arm's field in its axes in the first run: {felt} µT (± {field:.3f})"
    yield f"the runs agree: χ² {reversal.chi_square:.1f}, at most {reversal.limit:.1f}"
    for run in reversal.runs:
        yield f"as mounted in {run.run}: b {triple(np.divide(run.bias_t, FIELD.bias.size), '+.3f')} µT"


def _entry(reversal: MagnetometerReversal) -> ReversalEntry:
    std = np.sqrt(np.diag(reversal.found.covariance))
    scale, both = of_reversal(reversal)
    return entry(
        ReversalEntry, reversal.found, reversal, reversal.runs[0].result.sensor,
        bias_std_t=std[:3],
        arm_field_std_t=std[3:],
        scale_degrees_of_freedom=counted(scale),
        bias_degrees_of_freedom=counted(both[:3]),
        arm_field_degrees_of_freedom=counted(both[3:]),
        runs=tuple(map(_as_mounted, reversal.runs)),
    )  # fmt: skip


def _as_mounted(run: AsMounted) -> AsMountedEntry:
    solution = run.result.solution
    return entry(
        AsMountedEntry, run, run.result.sensor,
        started_utc=run.outcome.provenance.recorded.started_utc,
        bias_std_t=np.sqrt(np.diag(solution.covariance))[12:],
        bias_t=solution.bias,
        field_base_t=solution.reference,
    )  # fmt: skip
