"""A verification's entry in `result.json`: SIX, Tables IV and V."""

from rig.analysis.alignment import RelativeRotation
from rig.analysis.comparison import Comparison, Deviation
from rig.analysis.verification import Verification
from rig.data.result_file import (
    ComparisonEntry,
    DeviationEntry,
    RevolutionErrorEntry,
    RotationEntry,
    VerificationEntry,
)


def verification_entry(verification: Verification) -> VerificationEntry:
    """The statistics of both comparisons, without their curves."""
    before, reference = verification.before, verification.reference
    return VerificationEntry(
        reference=reference.name,
        reference_scale=reference.scale.tolist(),
        reference_bias_rad_s=reference.bias_rad_s.tolist(),
        reference_error_rad_s=verification.reference_error_rad_s,
        rotation=_rotation(verification.rotation),
        before=None if before is None else _comparison(before),
        after=_comparison(verification.after),
    )


def _rotation(rotation: RelativeRotation) -> RotationEntry:
    return RotationEntry(
        matrix=rotation.matrix.tolist(),
        vector_rad=rotation.vector_rad.tolist(),
        from_nominal_rad=rotation.from_nominal_rad.tolist(),
        std_rad=rotation.std_rad.tolist(),
        residuals_rad_s=rotation.residuals_rad_s.tolist(),
    )


def _comparison(comparison: Comparison) -> ComparisonEntry:
    return ComparisonEntry(
        movement=_deviation(comparison.movement),
        sweeps=_deviation(comparison.sweeps),
        noise_rad_s=None if comparison.noise_rad_s is None else comparison.noise_rad_s.tolist(),
        revolutions=tuple(
            RevolutionErrorEntry(
                sweep=turn.sweep,
                joint=turn.joint_name,
                direction=turn.direction,
                error_rad_s=turn.error_rad_s.tolist(),
                std_rad_s=turn.std_rad_s.tolist(),
            )
            for turn in comparison.revolutions
        ),
        delay_s=comparison.delay_s,
        delay_std_s=comparison.delay_std_s,
    )


def _deviation(deviation: Deviation) -> DeviationEntry:
    return DeviationEntry(
        samples=deviation.samples,
        mean_rad_s=deviation.mean_rad_s.tolist(),
        rms_rad_s=deviation.rms_rad_s.tolist(),
        mse_rad2_s2=deviation.mse_rad2_s2.tolist(),
        max_rad_s=deviation.max_rad_s.tolist(),
    )
