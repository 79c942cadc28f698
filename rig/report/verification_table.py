"""A verification's entry in `result.json`, and the same as a person reads it: SIX, Tables IV and V."""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from rich.table import Table

from rig.analysis.alignment import RelativeRotation
from rig.analysis.comparison import Comparison, Deviation
from rig.analysis.verification import Verification


def verification_document(verification: Verification) -> dict[str, Any]:
    """Plain numbers and lists in SI units; vectors in the frame of the sensor under test.

    `before` is null where only the calibrated readings were recorded.
    """
    before, reference = verification.before, verification.reference
    return {
        "reference": reference.name,
        "reference_scale": reference.scale.tolist(),
        "reference_bias_rad_s": reference.bias_rad_s.tolist(),
        "reference_error_rad_s": verification.reference_error_rad_s,
        "rotation": _rotation(verification.rotation),
        "before": None if before is None else _comparison(before),
        "after": _comparison(verification.after),
    }


def verification_table(name: str, document: Mapping[str, Any]) -> Table:
    """Error of each axis before and after, from a sensor's entry; a dash where there was no before."""
    table = Table(title=f"{name} against {document['reference']}, sweeps and rests", title_justify="left")
    for heading in ("axis", "RMS before rad/s", "RMS after rad/s", "of that noise", "MSE before (rad/s)²", "MSE after"):
        table.add_column(heading, justify="left" if heading == "axis" else "right")
    before, after = document["before"], document["after"]
    for i, axis in enumerate("xyz"):
        table.add_row(
            axis,
            "–" if before is None else f"{before['movement']['rms_rad_s'][i]:.4f}",
            f"{after['movement']['rms_rad_s'][i]:.4f}",
            "–" if after["noise_rad_s"] is None else f"{after['noise_rad_s'][i]:.4f}",
            "–" if before is None else f"{before['movement']['mse_rad2_s2'][i]:.2e}",
            f"{after['movement']['mse_rad2_s2'][i]:.2e}",
        )
    return table


def verification_lines(document: Mapping[str, Any]) -> Iterator[str]:
    """What stands below the table: how the two sensors sit to each other, the reference, whole turns, the delay."""
    rotation = document["rotation"]
    turned = " ".join(f"{angle:+.3f}" for angle in np.degrees(rotation["from_nominal_rad"]))
    yield f"mounted off nominal to the reference by: {turned} ° (± {np.degrees(max(rotation['std_rad'])):.3f})"
    errors = [turn["error_rad_s"] for turn in document["after"]["revolutions"]]
    stds = [turn["std_rad_s"] for turn in document["after"]["revolutions"]]
    yield f"the reference itself, against the arm: at most {document['reference_error_rad_s']:.5f} rad/s off"
    yield f"mean over a revolution after: at most {np.abs(errors).max():.5f} rad/s off (± {np.max(stds):.5f})"
    for delay, std in zip(document["after"]["delay_s"], document["after"]["delay_std_s"], strict=True):
        yield f"lags the reference by {1e3 * delay:.2f} ms (± {1e3 * std:.2f}), taken out"


def _rotation(rotation: RelativeRotation) -> dict[str, Any]:
    return {
        "matrix": rotation.matrix.tolist(),
        "vector_rad": rotation.vector_rad.tolist(),
        "from_nominal_rad": rotation.from_nominal_rad.tolist(),
        "std_rad": rotation.std_rad.tolist(),
        "residuals_rad_s": rotation.residuals_rad_s.tolist(),
    }


def _comparison(comparison: Comparison) -> dict[str, Any]:
    return {
        "movement": _deviation(comparison.movement),
        "sweeps": _deviation(comparison.sweeps),
        "noise_rad_s": None if comparison.noise_rad_s is None else comparison.noise_rad_s.tolist(),
        "revolutions": [
            {
                "sweep": turn.sweep,
                "joint": turn.joint_name,
                "direction": turn.direction,
                "error_rad_s": turn.error_rad_s.tolist(),
                "std_rad_s": turn.std_rad_s.tolist(),
            }
            for turn in comparison.revolutions
        ],
        "delay_s": list(comparison.delay_s),
        "delay_std_s": list(comparison.delay_std_s),
    }


def _deviation(deviation: Deviation) -> dict[str, Any]:
    return {
        "samples": deviation.samples,
        "mean_rad_s": deviation.mean_rad_s.tolist(),
        "rms_rad_s": deviation.rms_rad_s.tolist(),
        "mse_rad2_s2": deviation.mse_rad2_s2.tolist(),
        "max_rad_s": deviation.max_rad_s.tolist(),
    }
