"""A verification as a person reads it: SIX, Tables IV and V."""

from collections.abc import Iterator

import numpy as np
from rich.table import Table

from rig.data.result_file import VerificationEntry
from rig.station.plain_text import plain


def verification_table(name: str, entry: VerificationEntry) -> Table:
    """Error of each axis before and after, from a sensor's entry; a dash where there was no before."""
    table = Table(
        title=plain(f"{name} against {entry.reference}, sweeps and rests", "table.title"), title_justify="left"
    )
    for heading in ("axis", "RMS before rad/s", "RMS after rad/s", "of that noise", "MSE before (rad/s)²", "MSE after"):
        table.add_column(heading, justify="left" if heading == "axis" else "right")
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
    """What stands below the table: how the two sensors sit to each other, the reference, whole turns, the delay."""
    rotation = entry.rotation
    turned = " ".join(f"{angle:+.3f}" for angle in np.degrees(rotation.from_nominal_rad))
    yield f"mounted off nominal to the reference by: {turned} ° (± {np.degrees(max(rotation.std_rad)):.3f})"
    errors = [turn.error_rad_s for turn in entry.after.revolutions]
    stds = [turn.std_rad_s for turn in entry.after.revolutions]
    yield f"the reference itself, against the arm: at most {entry.reference_error_rad_s:.5f} rad/s off"
    yield f"mean over a revolution after: at most {np.abs(errors).max():.5f} rad/s off (± {np.max(stds):.5f})"
    held = [turn.gravity_rad_s for turn in entry.after.revolutions]
    if None not in held:
        without = np.abs(np.array(errors) - np.array(held)).max()
        yield f"    of which gravity, which the board cannot see: without it at most {without:.5f}"
    for delay, std in zip(entry.after.delay_s, entry.after.delay_std_s, strict=True):
        yield f"lags the reference by {1e3 * delay:.2f} ms (± {1e3 * std:.2f}), taken out"
