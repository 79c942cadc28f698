"""Verifications: calibrated readings compared with a reference (paper SIX, Tables IV and V)."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table

from rig.data.quantity import RATE
from rig.data.result_file import (
    ComparisonEntry,
    DeviationEntry,
    RevolutionErrorEntry,
    RotationEntry,
    VerificationEntry,
)
from rig.report.entry import entry
from rig.report.findings.finding import Finding
from rig.report.findings.result_kind import CertifiedItem, NoOutlet, ResultKind
from rig.report.tables import dcc_results
from rig.station.plain_text import build_number_table

if TYPE_CHECKING:
    from rig.analysis.gyroscope.comparison import Comparison
    from rig.analysis.gyroscope.verification import Verification


def verification_entry(verification: "Verification") -> VerificationEntry:
    """Return the statistics of the comparisons before and after calibration, without their curves."""
    before, reference = verification.before, verification.reference
    return entry(
        VerificationEntry, verification,
        reference=reference.name,
        reference_scale=reference.scale,
        reference_bias_rad_s=reference.bias_rad_s,
        rotation=entry(RotationEntry, verification.rotation),
        before=None if before is None else _comparison(before),
        after=_comparison(verification.after),
    )  # fmt: skip


def _comparison(comparison: "Comparison") -> ComparisonEntry:
    return entry(
        ComparisonEntry, comparison,
        movement=entry(DeviationEntry, comparison.movement),
        sweeps=entry(DeviationEntry, comparison.sweeps),
        revolutions=[entry(RevolutionErrorEntry, turn) for turn in comparison.revolutions],
    )  # fmt: skip


def _render(finding: Finding[VerificationEntry]) -> Iterator[Table | str]:
    yield verification_table(finding.sensor, finding.entry)
    yield from verification_lines(finding.entry)


def verification_table(name: str, entry: VerificationEntry) -> Table:
    """Return a table of the errors of each axis before and after calibration; a dash stands for an unknown value."""
    table = build_number_table(
        ("axis", "RMS before rad/s", "RMS after rad/s", "of that noise", "MSE before (rad/s)²", "MSE after"),
        f"{name} against {entry.reference}, sweeps and rests",
    )
    before, after = entry.before, entry.after
    for i, axis in enumerate("xyz"):
        table.add_row(
            axis,
            "–" if before is None else f"{before.movement.rms_rad_s[i]:.4f}",
            f"{after.movement.rms_rad_s[i]:.4f}",
            "–" if after.noise_rad_s is None else f"{after.noise_rad_s[i]:.4f}",
            "–" if before is None else f"{before.movement.mse_rad2_s2[i]:.2e}",
            f"{after.movement.mse_rad2_s2[i]:.2e}",
        )
    return table


def verification_lines(entry: VerificationEntry) -> Iterator[str]:
    """Yield the lines below the table, on mounting, reference, turns and delays, ± two standard uncertainties."""
    rotation = entry.rotation
    angles = " ".join(f"{angle:+.3f}" for angle in np.degrees(rotation.from_nominal_rad))
    expanded_deg = 2 * np.degrees(max(rotation.std_rad))
    yield f"rotation from the nominal mounting to the reference: {angles} ° (± {expanded_deg:.3f})"
    errors = [turn.error_rad_s for turn in entry.after.revolutions]
    stds = [turn.std_rad_s for turn in entry.after.revolutions]
    yield f"error of the reference itself, against the arm: at most {entry.reference_error_rad_s:.5f} rad/s"
    yield f"mean error over a revolution, after: at most {np.abs(errors).max():.5f} rad/s (± {2 * np.max(stds):.5f})"
    gravity = [turn.gravity_rad_s for turn in entry.after.revolutions]
    if None not in gravity:
        remainder = np.abs(np.array(errors) - np.array(gravity)).max()
        yield f"    without the effect of gravity, which the board cannot measure: at most {remainder:.5f}"
    for delay, std in zip(entry.after.delay_s, entry.after.delay_std_s, strict=True):
        yield f"delay behind the reference: {1e3 * delay:.2f} ms (± {2e3 * std:.2f}), corrected"


def _summarize(finding: Finding[VerificationEntry]) -> Iterator[str]:
    before, after = finding.entry.before, max(finding.entry.after.movement.rms_rad_s)
    until = "" if before is None else f"{max(before.movement.rms_rad_s):.4f} rad/s before, "
    yield f"{finding.sensor} against {finding.entry.reference}: RMS at most {until}{after:.4f} rad/s after"


def _describe_item(finding: Finding[VerificationEntry], _: object) -> CertifiedItem:
    name, results = f"verification of gyroscope {finding.sensor}", dcc_results.verification(finding.entry)
    return CertifiedItem("gyroscope", finding.sensor, None, None, name, results)


NO_PARAMETER = NoOutlet("an error of readings is not a parameter and has no uncertainty of its own")
VERIFICATION = ResultKind(
    name="verification",
    key="verification",
    entries=lambda outcome: {
        name: verification_entry(verification) for name, verification in outcome.verifications.items()
    },
    find=lambda document: (Finding(name, RATE, entry) for name, entry in document.verification.items()),
    printed=_render,
    shown=NO_PARAMETER,
    followed=NO_PARAMETER,
    header=NO_PARAMETER,
    figures="rig.report.figures.verification:write_figures",
    block=NoOutlet("it is in the block of its gyroscope, or alone if nothing was calibrated"),
    measured=_describe_item,
    standard=NoOutlet("it has the standard of its reference"),
    corrected=NoOutlet("it does not correct readings"),
    unexplained=NoOutlet("the run draws its readings together with those of the reference"),
    in_short=_summarize,
)
