"""One check of the verdict: its name, a measured value and the limit. Pure functions."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from rig.config.judging.verdict_limits import Parameter
from rig.data.installed_kinds import quantities
from rig.data.meaning import Meaning
from rig.errors import Fault
from rig.estimation.statistics.coverage import COVERAGE_FACTOR, tail_probability

UNCALIBRATED_FAULTS = ("no_attitudes", "field_strength_unknown")  # of sensors that were only recorded


@dataclass(frozen=True, slots=True)
class Check:
    """One check of the verdict, which passes if its value is a number not above limit - guard.

    - name: the check's name for people, as in "gyro.bias"; programs use `means` instead.
    - value, limit: the measured value and its limit, in `unit`; None if nothing was measured, or no limit was set.
    - unit: the unit of value, limit, uncertainty and guard.
    - means: the criterion, sensor and quantity that the check is about.
    - uncertainty: U of the value, None without one.
    - guard: the distance from the limit that the decision rule requires: U for the guard band (ILAC-G8, 4.2), else 0.
    - coverage_factor: k of U.
    - dof: degrees of freedom of U.
    """

    name: str
    value: float | None
    limit: float | None
    unit: str
    means: Meaning
    uncertainty: float | None = None
    guard: float = 0.0
    coverage_factor: float = COVERAGE_FACTOR
    dof: float = math.inf

    @property
    def passed(self) -> bool:
        """Whether the check passes; without a value or a limit it does not."""
        if self.value is None or self.limit is None:
            return False
        return math.isfinite(self.value) and self.value <= self.limit - self.guard

    @property
    def false_acceptance(self) -> float | None:
        """The probability that the true value of a passed check is beyond the limit; None if it failed or has no U."""
        if self.value is None or self.limit is None or not self.uncertainty or not self.passed:
            return None
        return float(tail_probability((self.limit - self.value) * self.coverage_factor / self.uncertainty, self.dof))


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
    """Return a check of whether a measurement is fit for use: the criterion `what` with its `value` and `limit`.

    If the check is about one `sweep` or `dwell` of the plan, the name contains its index.
    """
    means, index = Meaning("fitness", sensor, quantity, parameter, sweep, what), dwell if sweep is None else sweep
    name = name_check(sensor, quantity, what)
    return Check(name if index is None else f"{name}.{index}", value, limit, unit, means)


def list_unsolved(faults: Iterable[tuple[str, str, Fault]]) -> Iterator[Check]:
    """Yield a failing check for each of `faults`: the sensor's name, the quantity, and why there is no solution.

    If the Fault is that the sensor is only recorded, such as a magnetometer in sweeps, there is no check.
    """
    for sensor, quantity, fault in faults:
        if fault.name not in UNCALIBRATED_FAULTS:
            yield fitness(sensor, quantity, "unsolved", 1.0, 0.0)


def name_check(sensor: str, quantity: str, what: str) -> str:
    """Return the name of a check of a sensor, which contains the `quantity` unless that is a gyroscope's rate."""
    described = quantities().get(quantity)
    return f"{sensor}.{f'{quantity}_' if described is None else described.prefix}{what}"
