"""The Earth's rate as a gyroscope measured it: its entry of `result.json` and its words."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.entries.result_types import ErrorEntry
from rig.estimation.earth import DEG_H, EARTH_RATE_RAD_S
from rig.report.entry import entry, finite_or_none
from rig.report.words.expanded_uncertainty import expanded, factor_words

if TYPE_CHECKING:
    from rig.estimation.gyroscope.earth_rate import EarthRate


def earth_rate_entry(earth_rate: "EarthRate") -> EarthRateEntry:
    """Return the entry of the Earth's rate; infinite degrees of freedom are null."""
    return entry(EarthRateEntry, earth_rate, degrees_of_freedom=finite_or_none(earth_rate.dof))


def earth_rate_lines(earth: EarthRateEntry | ErrorEntry | None) -> Iterator[str]:
    """Yield the Earth's rate in words; nothing if it was not estimated."""
    if earth is None:
        return
    if isinstance(earth, ErrorEntry):
        yield f"Earth's rate not found: {earth.error}"
        return
    (k,), words = expanded([1.0], earth.dofs(1)).factors, factor_words(earth.dofs(1))
    rate = " ".join(f"{component:+.3f}" for component in np.divide(earth.rate_rad_s, DEG_H))
    std = k * np.sqrt(np.diag(earth.covariance_rad2_s2)).max() / DEG_H
    yield (
        f"Earth's rate found: {earth.norm_rad_s / DEG_H:.3f} deg/h (± {k * earth.norm_std_rad_s / DEG_H:.3f}; "
        f"expected {EARTH_RATE_RAD_S / DEG_H:.3f}); in the arm's base {rate} deg/h (± {std:.3f}), {words}"
    )
    bearings = [
        f"latitude {np.degrees(earth.latitude_rad):.2f}° (± {k * np.degrees(earth.latitude_std_rad):.2f})"
        + (", its vertical part as given" if earth.vertical_fixed else "")
    ]
    if earth.heading_rad is not None and earth.heading_std_rad is not None:
        heading, expanded_heading = np.degrees(earth.heading_rad) % 360, k * np.degrees(earth.heading_std_rad)
        bearings.append(f"the base's x axis points {heading:.2f}° from north over east (± {expanded_heading:.2f})")
    yield "by that rate " + ", ".join(bearings)
