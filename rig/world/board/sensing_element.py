"""The sensing element of a part: it senses the flange's motion, is stuck, or is driven far beyond its range."""

from collections.abc import Callable, Sequence
from enum import StrEnum

MotionAt = Callable[[float], Sequence[float]]

UNLIMITED_RANGE = 1e3  # rad/s and g: no part has such a range


class ElementFault(StrEnum):
    """Faults of a sensing element, which change neither its noise nor its electronics."""

    STUCK = "stuck"  # forever the motion at which the fault began
    SATURATED = "saturated"  # a motion far beyond its range, on every axis


class SensingElement:
    """The motion that a part senses, over time: the true motion `motion_at`, or a motion falsified by a fault."""

    def __init__(self, motion_at: MotionAt) -> None:
        self._motion_at = motion_at
        self._fault: ElementFault | None = None
        self._faulty_motion: Sequence[float] | None = None

    def set_fault(self, fault: ElementFault | None) -> None:
        self._fault, self._faulty_motion = fault, None

    def __call__(self, time_s: float) -> Sequence[float]:
        if self._fault is None:
            return self._motion_at(time_s)
        if self._faulty_motion is None:
            motion = self._motion_at(time_s)
            self._faulty_motion = motion if self._fault is ElementFault.STUCK else (UNLIMITED_RANGE,) * len(motion)
        return self._faulty_motion
