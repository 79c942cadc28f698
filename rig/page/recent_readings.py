"""The readings of the last minute, for the page's plots."""

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

SPAN_S = 60.0
STEP_S = 0.1  # interval of the points, in the controller's time
MIN_STEP_S = 0.95 * STEP_S  # shorter, so that a rounded time does not look too early
POINTS = round(SPAN_S / STEP_S)

Values = Mapping[str, tuple[float, ...]]  # by the name of a curve, such as "gyro.rate"


@dataclass(slots=True)
class PageHistory:
    """The stored points, in order. They are numbered, so that a browser can request only the new points."""

    first: int = 0
    _points: deque[tuple[float, Values]] = field(default_factory=lambda: deque(maxlen=POINTS))

    @property
    def end(self) -> int:
        """The number of the next point."""
        return self.first + len(self._points)

    def due(self, time_s: float) -> bool:
        """Return whether to store a point of this time: enough time has passed, or time has run backwards."""
        return not self._points or not 0 <= time_s - self._points[-1][0] < MIN_STEP_S

    def add(self, time_s: float, values: Values) -> None:
        """Add a point if one is due; if time has run backwards, start again."""
        if not self.due(time_s):
            return
        if self._points and time_s < self._points[-1][0]:
            self.clear()
        if len(self._points) == POINTS:
            self.first += 1
        self._points.append((time_s, values))

    def clear(self) -> None:
        """Remove all points, because another movement begins."""
        self.first = self.end
        self._points.clear()

    def since(self, number: int) -> dict[str, Any]:
        """Return the points from `number` on as JSON values: times, and the values of each curve (null if missing)."""
        start = max(number, self.first)
        points = list(self._points)[start - self.first :]
        lines = sorted({line for _, values in points for line in values})
        return {
            "from": start,
            "first": self.first,
            "time_s": [round(time_s, 2) for time_s, _ in points],
            "lines": {line: [round_digits(values.get(line)) for _, values in points] for line in lines},
        }


def round_digits(vector: tuple[float, ...] | None) -> list[float] | None:
    """Return the vector to six digits, more than a screen shows; None for None."""
    return None if vector is None else [float(f"{component:.6g}") for component in vector]
