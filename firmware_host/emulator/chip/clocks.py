"""The clock frequencies that the firmware has set."""

from dataclasses import dataclass

from firmware_host.emulator.timeline import TICK_HZ


@dataclass(slots=True)
class Clocks:
    """Frequencies of the core and the two peripheral buses. RCC sets them; after a reset the MSI gives 4 MHz."""

    core_hz: int = 4_000_000
    pclk1_hz: int = 4_000_000
    pclk2_hz: int = 4_000_000

    @property
    def ticks_per_core_cycle(self) -> int:
        return max(1, round(TICK_HZ / self.core_hz))
