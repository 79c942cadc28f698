"""The requirements of a part's data sheet on its register model."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from firmware_host.emulator.parts.gyroscope import GyroTruth
from support.board.spi_master import NO_ERRORS, Driver, Rate, still


@dataclass(frozen=True)
class DataSheet:
    """A part's data sheet. `per_count_deg_s`, `per_count_g`: sensitivity by range; `forbidden`: accesses."""

    name: str
    new: Callable[..., Driver]
    identity: int
    other_identity: int
    rates_hz: Sequence[float]
    per_count_deg_s: dict[float, float]
    per_count_g: dict[float, float]
    temperature_counts: Callable[[float], float]
    forbidden: Sequence[tuple[str, bytes]]

    def driver(
        self,
        rate_at: Rate = still,
        truth: GyroTruth = NO_ERRORS,
        *,
        rate_hz: float | None = None,
        range_deg_s: float = 500.0,
        range_g: float = 8.0,
        **others: Any,
    ) -> Driver:
        """Return the driver of a running part, by default at its fastest rate here and in the ranges of all parts."""
        driver = self.new(rate_at, truth, range_deg_s=range_deg_s, **others)
        driver.start(rate_hz or self.rates_hz[-1], range_deg_s, range_g)
        return driver

    def per_count_rad_s(self, range_deg_s: float = 500.0) -> float:
        return math.radians(self.per_count_deg_s[range_deg_s])
