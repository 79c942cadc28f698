"""A magnetometer's calibration as a person reads it: TRIAX, Eq. (7)."""

from collections.abc import Iterable, Iterator

import numpy as np
from rich.table import Table

from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.result_types import ErrorEntry
from rig.station.plain_text import plain

MICROTESLA = 1e6


def magnetometer_table(name: str, found: MagnetometerEntry) -> Table:
    """Scale and bias of each axis, ± 2σ."""
    title = f"{name}, magnetometer as mounted: {found.part} {found.serial_number}, {found.model}, {found.estimator}"
    table = Table(title=plain(title, "table.title"), title_justify="left")
    for heading in ("axis", "scale factor", "± 2σ", "bias µT", "± 2σ µT"):
        table.add_column(heading, justify="left" if heading == "axis" else "right")
    for i, axis in enumerate("xyz"):
        table.add_row(
            axis,
            f"{found.scale[i]:.6f}",
            f"{2 * found.covariance[i][i] ** 0.5:.6f}",
            f"{MICROTESLA * found.bias_t[i]:+.3f}",
            f"{2 * MICROTESLA * found.covariance[3 + i][3 + i] ** 0.5:.3f}",
        )
    return table


def magnetometer_lines(found: MagnetometerEntry) -> Iterator[str]:
    """What stands below the table."""
    yield f"relative to a field of {MICROTESLA * found.field_t:g} µT; {len(found.dwells)} attitudes; no limit judges it"
    yield "iron and currents that turn with it are part of what is found"
    yield f"field in the arm's base: {_triple(np.multiply(MICROTESLA, found.field_base_t), '+.3f')} µT"
    skew, std = np.degrees(found.non_orthogonality_rad), np.degrees(found.non_orthogonality_std_rad)
    yield f"non-orthogonality yz zx xy: {_triple(skew, '+.4f')} ° (± {2 * std.max():.4f})"
    known = "" if found.attitude_error_std_rad is None else f" (± {2e3 * found.attitude_error_std_rad:.2f})"
    yield f"attitude error found: {1e3 * found.attitude_error_rad:.2f} mrad about each axis{known}"
    for method, other in found.beside.items():
        if isinstance(other, ErrorEntry):
            yield f"{method}: {other.error}"
        else:
            bias = _triple(np.multiply(MICROTESLA, other.bias_t), "+.3f")
            yield f"{method}: k {_triple(other.scale, '.6f')}, b {bias} µT"
    yield from (f"warning: {warning}" for warning in found.warnings)


def _triple(values: Iterable[float], form: str) -> str:
    return " ".join(f"{value:{form}}" for value in values)
