"""The Earth's rate that a gyroscope has found, as an entry of `result.json` and as a person reads it."""

from collections.abc import Iterator

import numpy as np

from rig.data.earth_rate_entries import EarthRateEntry
from rig.data.result_types import ErrorEntry
from rig.errors import Fault
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.earth_rate import DEG_H, EarthRate
from rig.report.entry import entry


def earth_rate_entry(found: EarthRate | Fault) -> EarthRateEntry | ErrorEntry:
    """Or why it was not found."""
    if isinstance(found, Fault):
        return ErrorEntry(error=str(found))
    return entry(EarthRateEntry, found)


def earth_rate_lines(found: EarthRateEntry | ErrorEntry | None) -> Iterator[str]:
    """None says nothing: it was not looked for."""
    if found is None:
        return
    if isinstance(found, ErrorEntry):
        yield f"Earth's rate not found: {found.error}"
        return
    rate = " ".join(f"{each:+.3f}" for each in np.divide(found.rate_rad_s, DEG_H))
    std = 2 * np.sqrt(np.diag(found.covariance_rad2_s2)).max() / DEG_H
    yield (
        f"Earth's rate found: {found.norm_rad_s / DEG_H:.3f} deg/h (± {2 * found.norm_std_rad_s / DEG_H:.3f}), "
        f"{EARTH_RATE_RAD_S / DEG_H:.3f} is right; in the arm's base {rate} deg/h (± {std:.3f})"
    )
    where = [
        f"latitude {np.degrees(found.latitude_rad):.2f}° (± {2 * np.degrees(found.latitude_std_rad):.2f})"
        + (", its vertical part as given" if found.vertical_held else "")
    ]
    if found.heading_rad is not None and found.heading_std_rad is not None:
        heading, off = np.degrees(found.heading_rad) % 360, 2 * np.degrees(found.heading_std_rad)
        where.append(f"the base's x axis points {heading:.2f}° from north over east (± {off:.2f})")
    yield "by that rate " + ", ".join(where)
