"""A verification's entry in `result.json`: SIX, Tables IV and V."""

from rig.analysis.comparison import Comparison
from rig.analysis.verification import Verification
from rig.data.result_file import (
    ComparisonEntry,
    DeviationEntry,
    RevolutionErrorEntry,
    RotationEntry,
    VerificationEntry,
)
from rig.report.entry import entry


def verification_entry(verification: Verification) -> VerificationEntry:
    """The statistics of both comparisons, without their curves."""
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


def _comparison(comparison: Comparison) -> ComparisonEntry:
    return entry(
        ComparisonEntry, comparison,
        movement=entry(DeviationEntry, comparison.movement),
        sweeps=entry(DeviationEntry, comparison.sweeps),
        revolutions=[entry(RevolutionErrorEntry, turn, joint=turn.joint_name) for turn in comparison.revolutions],
    )  # fmt: skip
