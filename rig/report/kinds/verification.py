"""Verifications: calibrated readings against a reference (SIX, Tables IV and V)."""

from collections.abc import Iterator

from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.quantity import RATE
from rig.data.result_file import ResultDocument, VerificationEntry
from rig.report.certificate import dcc_results
from rig.report.kinds.kind import Found, Measured, ResultKind, Without
from rig.report.verification_entry import verification_entry
from rig.report.verification_table import verification_lines, verification_table


def _entries(outcome: Outcome) -> dict[str, VerificationEntry]:
    return {name: verification_entry(found) for name, found in outcome.verifications.items()}


def _found(document: ResultDocument) -> Iterator[Found[VerificationEntry]]:
    return (Found(name, RATE, entry) for name, entry in document.verification.items())


def _printed(found: Found[VerificationEntry]) -> Iterator[Table | str]:
    yield verification_table(found.sensor, found.entry)
    yield from verification_lines(found.entry)


def _in_short(found: Found[VerificationEntry]) -> Iterator[str]:
    before, after = found.entry.before, max(found.entry.after.movement.rms_rad_s)
    until = "" if before is None else f"{max(before.movement.rms_rad_s):.4f} rad/s before, "
    yield f"{found.sensor} against {found.entry.reference}: RMS at most {until}{after:.4f} rad/s after"


def _measured(found: Found[VerificationEntry], _: object) -> Measured:
    name, results = f"verification of gyroscope {found.sensor}", dcc_results.verification(found.entry)
    return Measured("gyroscope", found.sensor, None, None, name, results)


NO_PARAMETER = Without("an error of readings is no parameter, and has no uncertainty of its own")
VERIFICATION = ResultKind(
    name="verification",
    key="verification",
    entries=_entries,
    found=_found,
    printed=_printed,
    shown=NO_PARAMETER,
    followed=NO_PARAMETER,
    header=NO_PARAMETER,
    figures="rig.report.figures:write_figures",
    block=Without("it stands in the block of its gyroscope, or alone where nothing was calibrated"),
    measured=_measured,
    in_short=_in_short,
)
