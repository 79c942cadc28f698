"""What moves inside a sensor: it feels the flange's motion, or is stuck, or driven far beyond its range."""

from collections.abc import Callable, Sequence
from enum import StrEnum

MotionAt = Callable[[float], Sequence[float]]

FAR_BEYOND = 1e3  # rad/s and g: no part has such a range


class ElementFault(StrEnum):
    """What can be wrong with it. Its noise and its electronics are as before."""

    STUCK = "stuck"  # it feels for ever what it felt at first
    SATURATED = "saturated"  # it feels far more than its range, on every axis


class SensingElement:
    """A part's `motion_at`, made of what it `felt` while nothing was wrong."""

    def __init__(self, felt: MotionAt) -> None:
        self._felt = felt
        self._fault: ElementFault | None = None
        self._held: Sequence[float] | None = None

    def set_fault(self, fault: ElementFault | None) -> None:
        self._fault, self._held = fault, None

    def __call__(self, time_s: float) -> Sequence[float]:
        if self._fault is None:
            return self._felt(time_s)
        if self._held is None:
            felt = self._felt(time_s)
            self._held = felt if self._fault is ElementFault.STUCK else (FAR_BEYOND,) * len(felt)
        return self._held
