"""The Earth's rate that a gyroscope has found, as an entry of `result.json` and as a person reads it."""

from collections.abc import Iterator

import numpy as np

from rig.data.earth_rate_entries import EarthRateEntry
from rig.data.result_types import ErrorEntry
from rig.errors import Fault
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.earth_rate import DEG_H, EarthRate
from rig.report.entry import entry
from rig.report.expanded import expanded, factor_words


def earth_rate_entry(found: EarthRate | Fault, *, counts_freedom: bool) -> EarthRateEntry | ErrorEntry:
    """The entry of the Earth's rate, or of why it was not found."""
    if isinstance(found, Fault):
        return ErrorEntry(error=str(found))
    return entry(EarthRateEntry, found, freedom=found.freedom if counts_freedom else None)


def earth_rate_lines(found: EarthRateEntry | ErrorEntry | None) -> Iterator[str]:
    """The Earth's rate in words; None says nothing: it was not looked for."""
    if found is None:
        return
    if isinstance(found, ErrorEntry):
        yield f"Earth's rate not found: {found.error}"
        return
    (k,), words = expanded([1.0], found.freedoms(1)).factors, factor_words(found.freedoms(1))
    rate = " ".join(f"{each:+.3f}" for each in np.divide(found.rate_rad_s, DEG_H))
    std = k * np.sqrt(np.diag(found.covariance_rad2_s2)).max() / DEG_H
    yield (
        f"Earth's rate found: {found.norm_rad_s / DEG_H:.3f} deg/h (± {k * found.norm_std_rad_s / DEG_H:.3f}), "
        f"{EARTH_RATE_RAD_S / DEG_H:.3f} is right; in the arm's base {rate} deg/h (± {std:.3f}), {words}"
    )
    where = [
        f"latitude {np.degrees(found.latitude_rad):.2f}° (± {k * np.degrees(found.latitude_std_rad):.2f})"
        + (", its vertical part as given" if found.vertical_held else "")
    ]
    if found.heading_rad is not None and found.heading_std_rad is not None:
        heading, off = np.degrees(found.heading_rad) % 360, k * np.degrees(found.heading_std_rad)
        where.append(f"the base's x axis points {heading:.2f}° from north over east (± {off:.2f})")
    yield "by that rate " + ", ".join(where)
