"""Series of calibrations: what they say of a sensor over the years, and of the rigs it was calibrated on. Pure."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from functools import cached_property

import numpy as np

from rig.data.absent import NO_ARM
from rig.data.installed_kinds import quantities
from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import effective_freedom, joint_factors
from rig.history.statistics.charts import FEWEST, Chart, chart, merged
from rig.history.statistics.random_effects import CONFIDENCE, Fitted, fit
from rig.history.statistics.recall import days_to_limit
from rig.history.statistics.rig_effects import RigEffect, rig_effects
from rig.history.store import Past
from rig.report.findings.followed import Parameter, is_scale, nominal

YEAR_DAYS = 365.25
# How often nothing has changed of a sensor that has not. The comparisons of a part's calibrations share results: with
# 95 %, more than 5 of the 105 among 15 have changed in a third of all cases; with 98 % in 7 of 100.
UNCHANGED = 0.98
DRIFT_DAYS = 10.0  # from the first result to the last: what less says of a year is its scatter
DAY_S = 86400.0

Subject = tuple[str, str, str, float, bool]


@dataclass(frozen=True)
class Trend:
    """One parameter of one sensor over time: `times` of the calibrations, the parameter in each of them.

    Lines, spreads and charts go by the statistical uncertainty of each result and by the spread that is seen beyond it;
    what all results of a rig have in common moves none of them. They are None below five results.
    """

    name: str
    unit: str
    times: tuple[datetime, ...]
    parameters: tuple[Parameter, ...]

    @property
    def count(self) -> int:
        """How many results there are."""
        return len(self.parameters)

    @property
    def last(self) -> Parameter:
        """The newest of the parameter's values."""
        return self.parameters[-1]

    @property
    def enough(self) -> bool:
        """Whether there are as many as a statement over time needs."""
        return self.count >= FEWEST

    @property
    def days(self) -> Array:
        """(n,) days since the first."""
        return np.array([(time - self.times[0]).total_seconds() / DAY_S for time in self.times])

    @property
    def values(self) -> Array:
        """(n,) values of the parameter."""
        return np.array([each.value for each in self.parameters])

    @property
    def std(self) -> Array:
        """(n,) what differs by chance from run to run."""
        return np.array([each.std_statistical for each in self.parameters])

    @cached_property
    def mean(self) -> Fitted | None:
        """The mean, and the spread between runs."""
        return fit(np.ones((self.count, 1)), self.values, self.std) if self.enough else None

    @cached_property
    def line(self) -> Fitted | None:
        """Value at the first result, and change per day; None too where they are of less than `DRIFT_DAYS`."""
        if not self.enough or np.ptp(self.days) < DRIFT_DAYS:
            return None
        return fit(np.stack([np.ones(self.count), self.days], axis=1), self.values, self.std)

    @property
    def drifts(self) -> bool:
        """Whether the change over time is more than chance."""
        return self.line is not None and self.line.p_value(1) < 1 - CONFIDENCE

    @cached_property
    def chart(self) -> Chart | None:
        """Shewhart and EWMA."""
        return chart(self.values, self.std) if self.enough else None

    @cached_property
    def recall(self) -> date | None:
        """The day on which value and uncertainty may have reached the limit; None without one within ten years."""
        limit = self.last.max_deviation
        if self.line is None or limit is None:
            return None
        ahead = days_to_limit(self.line, float(self.days[-1]), self.last.expanded, limit, nominal(self.name))
        return None if ahead is None else (self.times[-1] + timedelta(days=ahead)).date()


@dataclass(frozen=True, slots=True)
class RigState:
    """What all check standards of one rig say of it together: a chart of each parameter, in the order of time."""

    rig: str
    standards: tuple[str, ...]
    charts: Mapping[str, Chart]


@dataclass(frozen=True, slots=True)
class Change:
    """A parameter beside the one of the calibration before; `compared` is how many values are compared at once."""

    name: str
    unit: str
    before: Parameter
    now: Parameter
    compared: int = 1

    @property
    def normalised_error(self) -> float:
        """E_n = |y₂ − y₁| / √(U₁² + U₂²) (ISO 13528:2022, 9.7); above 1 the change of a single value is significant."""
        return abs(self.now.value - self.before.value) / math.hypot(self.before.expanded, self.now.expanded)

    @property
    def limit(self) -> float:
        """The E_n that of all values compared none exceeds by chance in `UNCHANGED` of comparisons.

        By Student's t for the effective degrees of freedom of the difference, and Bonferroni's inequality: parameters
        of one calibration are correlated in ways that no history keeps.
        """
        both = (self.before, self.now)
        freedom = effective_freedom([each.std**2 for each in both], [each.freedom for each in both])
        factor = float(joint_factors(self.compared, freedom, UNCHANGED))
        return factor * math.hypot(self.before.std, self.now.std) / math.hypot(self.before.expanded, self.now.expanded)

    @property
    def has_changed(self) -> bool:
        """Whether it is more than chance explains, among so many values."""
        return self.normalised_error > self.limit


def subjects(pasts: Iterable[Past]) -> dict[Subject, list[Past]]:
    """Calibrations that count, by what was calibrated: neither voided nor unfit by their own checks."""
    found: dict[Subject, list[Past]] = {}
    for each in pasts:
        if each.fit and each.voided is None:
            found.setdefault(each.subject, []).append(each)
    return found


def trends(pasts: Sequence[Past]) -> dict[str, Trend]:
    """The trend of every parameter that the newest of one subject's calibrations has."""
    found = {}
    for name in pasts[-1].parameters if pasts else ():
        with_it = [each for each in pasts if name in each.parameters]
        parameters = tuple(each.parameters[name] for each in with_it)
        found[name] = Trend(name, parameters[-1].unit, tuple(time_of(each) for each in with_it), parameters)
    return found


Parameters = Mapping[str, Parameter]


def changes_in(pairs: Sequence[tuple[Parameters, Parameters]]) -> tuple[tuple[Change, ...], ...]:
    """Return the changes within each pair, before and now, of the parameters by their names that both have.

    All pairs are those of one comparison, as of all sensors of a run: the values of all count.
    """
    shared = [[name for name in now if name in before] for before, now in pairs]
    compared = sum(map(len, shared))
    return tuple(
        tuple(Change(name, now[name].unit, before[name], now[name], compared) for name in names)
        for (before, now), names in zip(pairs, shared, strict=True)
    )


def changes_between(before: Sequence[Past], now: Sequence[Past]) -> dict[Subject, tuple[Change, ...]]:
    """Return the changes of everything that both have, by what it is; they are one comparison.

    Each are the calibrations of one run; of two of the same thing the last counts.
    """
    earlier, later = ({past.subject: past for past in pasts} for pasts in (before, now))
    both = [subject for subject in later if subject in earlier]
    found = changes_in([(earlier[subject].parameters, later[subject].parameters) for subject in both])
    return dict(zip(both, found, strict=True))


def rig_states(pasts: Sequence[Past]) -> list[RigState]:
    """Every rig that has check standards; a sensor is one if it was ever called one."""
    # What drifts or turns is no standard, and readings from files tell of no rig.
    found = subjects([past for past in pasts if past.quantity in quantities() and past.rig != NO_ARM])
    standards = {subject: each for subject, each in found.items() if any(past.check_standard for past in each)}
    states = []
    for rig in dict.fromkeys(past.rig for each in standards.values() for past in each):
        deviations: dict[str, list[tuple[datetime, float]]] = {}
        serials = []
        for (_, serial_number, *_), each in standards.items():
            of_rig = [past for past in each if past.rig == rig]
            serials += [serial_number] if of_rig else []
            for name, trend in trends(of_rig).items():
                if trend.chart is not None:
                    judged = zip(trend.times, trend.chart.deviation.tolist(), strict=True)
                    deviations.setdefault(name, []).extend(pair for pair in judged if np.isfinite(pair[1]))
        charts = {name: merged(np.array([each for _, each in sorted(pairs)])) for name, pairs in deviations.items()}
        states.append(RigState(rig, tuple(dict.fromkeys(serials)), charts))
    return states


def effects(pasts: Sequence[Past]) -> dict[str, tuple[RigEffect, ...]]:
    """What rigs differ in, by parameter of gyroscopes, from the sensors they share. Of scale factors as a fraction."""
    by_rigs = subjects(past for past in pasts if past.rig != NO_ARM)
    series = [(name, past) for each in by_rigs.values() for past in each for name in past.parameters]
    found = {}
    for name in dict.fromkeys(name for name, past in series if past.quantity == "rate"):
        having = [past for of, past in series if of == name and past.quantity == "rate"]
        values = np.array([past.value(name) for past in having])
        std = np.array([past.parameters[name].std_statistical for past in having])
        if is_scale(name):
            values, std = np.log(values), std / values
        told = rig_effects([past.rig for past in having], [str(past.subject) for past in having], values, std)
        if told:
            found[name] = told
    return found


def time_of(past: Past) -> datetime:
    """When the run of a calibration began."""
    return datetime.fromisoformat(past.started_utc).astimezone(UTC)
