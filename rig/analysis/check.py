"""One check of the verdict: what was measured beside its limit, and how it is called. Pure."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from rig.config.judging.limits import Parameter
from rig.data.installed_kinds import quantities
from rig.data.meaning import Meaning
from rig.errors import Fault
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, beyond

ONLY_RECORDED = ("no_attitudes", "field_strength_unknown")  # why a sensor was not to be calibrated


@dataclass(frozen=True, slots=True)
class Check:
    """One limit: it passes when `value` is a number not above `limit` less `guard`. `unit` belongs to all of them.

    What it `means` is said by whoever makes it: `name` is for people, and nothing is read out of how it is spelt.
    `value` is None where nothing was measured, `limit` where none was set, `uncertainty` where the value has none. It
    is the expanded one, by `coverage_factor` and so many degrees of `freedom`. The `guard` is that uncertainty where
    the decision rule is the guard band (ILAC-G8, 4.2).
    """

    name: str
    value: float | None
    limit: float | None
    unit: str
    means: Meaning
    uncertainty: float | None = None
    guard: float = 0.0
    coverage_factor: float = COVERAGE_FACTOR
    freedom: float = math.inf

    @property
    def passed(self) -> bool:
        """False for a measurement that is missing or not a number, and without a limit."""
        if self.value is None or self.limit is None:
            return False
        return math.isfinite(self.value) and self.value <= self.limit - self.guard

    @property
    def false_acceptance(self) -> float | None:
        """The probability that what passed is beyond the limit all the same; None where nothing passed."""
        if self.value is None or self.limit is None or not self.uncertainty or not self.passed:
            return None
        return float(beyond((self.limit - self.value) * self.coverage_factor / self.uncertainty, self.freedom))


def fitness(
    sensor: str,
    quantity: str,
    what: str,
    value: float | None,
    limit: float | None,
    *,
    unit: str = "1",
    parameter: Parameter | None = None,
    sweep: int | None = None,
    dwell: int | None = None,
) -> Check:
    """A check whether the measurement of a sensor's quantity is fit for use, by a `limit` without a row of its own.

    The `sweep` or `dwell` of the plan that it is told of, by index, is part of its name.
    """
    means, piece = Meaning("fitness", sensor, quantity, parameter, sweep, what), dwell if sweep is None else sweep
    name = check_name(sensor, quantity, what)
    return Check(name if piece is None else f"{name}.{piece}", value, limit, unit, means)


def unsolved_checks(faults: Iterable[tuple[str, str, Fault]]) -> Iterator[Check]:
    """Yield the checks that fail: of a sensor, its quantity and the Fault for which this has no solution.

    Of what was only recorded there is none: sweeps do not calibrate a magnetometer, and the size of the field is what
    asks for that.
    """
    for sensor, quantity, fault in faults:
        if fault.name not in ONLY_RECORDED:
            yield fitness(sensor, quantity, "unsolved", 1.0, 0.0)


def check_name(sensor: str, quantity: str, what: str) -> str:
    """What a check of a sensor is called: that a gyroscope reads rates goes without saying."""
    known = quantities().get(quantity)
    return f"{sensor}.{f'{quantity}_' if known is None else known.prefix}{what}"
