"""Series of calibrations: trends of a sensor over the years, and the state of its rigs. Pure."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from functools import cached_property

import numpy as np

from rig.data.absent import NO_ARM
from rig.data.installed_kinds import quantities
from rig.estimation.arrays import Array
from rig.estimation.statistics.coverage import effective_dof, joint_factors
from rig.history.statistics.charts import MIN_RESULTS, Chart, chart, merge_charts
from rig.history.statistics.random_effects import CONFIDENCE, FittedModel, fit
from rig.history.statistics.rig_effects import RigEffect, rig_effects
from rig.history.store import Past
from rig.report.findings.history_records import Parameter, is_scale, nominal

MAX_HORIZON_DAYS = 3653  # ten years: a drift cannot be extrapolated further

YEAR_DAYS = 365.25
# The probability that no change is reported for an unchanged sensor. The comparisons of a part's calibrations share
# results: at 95 %, more than 5 of the 105 among 15 are significant in a third of all cases; at 98 % in 7 of 100.
NO_CHANGE_PROBABILITY = 0.98
MIN_DRIFT_DAYS = 10.0  # from the first result to the last: in a shorter span a drift per year is only scatter
DAY_S = 86400.0

Subject = tuple[str, str, str, float, bool]


@dataclass(frozen=True)
class Trend:
    """One parameter of one sensor over time: the times of the calibrations, and the parameter in each.

    `mean`, `line` and `chart` use each result's statistical uncertainty and the additional scatter between runs, not
    errors common to all results of a rig. All three are None for fewer than five results.
    """

    name: str
    unit: str
    times: tuple[datetime, ...]
    parameters: tuple[Parameter, ...]

    @property
    def count(self) -> int:
        """The number of results."""
        return len(self.parameters)

    @property
    def last(self) -> Parameter:
        """The newest of the parameter's values."""
        return self.parameters[-1]

    @property
    def enough(self) -> bool:
        """Whether there are enough results for conclusions over time."""
        return self.count >= MIN_RESULTS

    @property
    def days(self) -> Array:
        """The times (n,) in days since the first result."""
        return np.array([(time - self.times[0]).total_seconds() / DAY_S for time in self.times])

    @property
    def values(self) -> Array:
        """The values (n,) of the parameter."""
        return np.array([parameter.value for parameter in self.parameters])

    @property
    def std(self) -> Array:
        """The statistical standard uncertainties (n,) of the values, without errors that all runs have in common."""
        return np.array([parameter.std_statistical for parameter in self.parameters])

    @cached_property
    def mean(self) -> FittedModel | None:
        """The mean of the values, with an uncertainty that includes the scatter between runs."""
        return fit(np.ones((self.count, 1)), self.values, self.std) if self.enough else None

    @cached_property
    def line(self) -> FittedModel | None:
        """The straight line over time: value at the first result and slope per day; None with few results or days."""
        if not self.enough or np.ptp(self.days) < MIN_DRIFT_DAYS:
            return None
        return fit(np.stack([np.ones(self.count), self.days], axis=1), self.values, self.std)

    @property
    def drifts(self) -> bool:
        """Whether the change over time is significant."""
        return self.line is not None and self.line.p_value(1) < 1 - CONFIDENCE

    @cached_property
    def chart(self) -> Chart | None:
        """The control charts of the values, by Shewhart and by EWMA; None for few results."""
        return chart(self.values, self.std) if self.enough else None

    @cached_property
    def recall(self) -> date | None:
        """The day on which value and uncertainty may reach the limit; None if that is over ten years away."""
        limit = self.last.max_deviation
        if self.line is None or limit is None:
            return None
        ahead = days_to_limit(self.line, float(self.days[-1]), self.last.expanded, limit, nominal(self.name))
        return None if ahead is None else (self.times[-1] + timedelta(days=ahead)).date()


@dataclass(frozen=True, slots=True)
class RigState:
    """The state of one rig: for each parameter, a control chart of the results of all its check standards.

    `standards` are their serial numbers. The deviations in a chart are in the order of time.
    """

    rig: str
    standards: tuple[str, ...]
    charts: Mapping[str, Chart]


@dataclass(frozen=True, slots=True)
class Change:
    """A parameter in this and the previous calibration; `compared` is the number of values in the comparison."""

    name: str
    unit: str
    before: Parameter
    now: Parameter
    compared: int = 1

    @property
    def normalised_error(self) -> float:
        """E_n = |y₂ − y₁| / √(U₁² + U₂²) for values y with expanded uncertainties U (ISO 13528:2022, 9.7).

        Above 1 the change of a single value is significant.
        """
        return abs(self.now.value - self.before.value) / math.hypot(self.before.expanded, self.now.expanded)

    @property
    def limit(self) -> float:
        """The limit of E_n: all unchanged values of a comparison are below it with `NO_CHANGE_PROBABILITY`.

        It follows from Student's t for the effective degrees of freedom of the difference. Bonferroni's inequality
        extends it to all values, because a history does not store correlations between parameters.
        """
        both = (self.before, self.now)
        dof = effective_dof([parameter.std**2 for parameter in both], [parameter.dof for parameter in both])
        factor = float(joint_factors(self.compared, dof, NO_CHANGE_PROBABILITY))
        return factor * math.hypot(self.before.std, self.now.std) / math.hypot(self.before.expanded, self.now.expanded)

    @property
    def has_changed(self) -> bool:
        """Whether the change is significant among all compared values."""
        return self.normalised_error > self.limit


def subjects(pasts: Iterable[Past]) -> dict[Subject, list[Past]]:
    """Return the valid calibrations by subject, without voided ones and those that failed their checks of fitness."""
    by_subject: dict[Subject, list[Past]] = {}
    for past in pasts:
        if past.fit and past.voided is None:
            by_subject.setdefault(past.subject, []).append(past)
    return by_subject


def trends(pasts: Sequence[Past]) -> dict[str, Trend]:
    """Return the trend of every parameter that the newest of these calibrations has; all are of one subject."""
    by_name = {}
    for name in pasts[-1].parameters if pasts else ():
        having = [past for past in pasts if name in past.parameters]
        parameters = tuple(past.parameters[name] for past in having)
        by_name[name] = Trend(name, parameters[-1].unit, tuple(time_of(past) for past in having), parameters)
    return by_name


Parameters = Mapping[str, Parameter]


def changes_in(pairs: Sequence[tuple[Parameters, Parameters]]) -> tuple[tuple[Change, ...], ...]:
    """Return the changes of the parameters common to each pair of calibrations, before and now.

    All pairs, for example all sensors of a run, form one comparison; every Change states its number of values.
    """
    shared = [[name for name in now if name in before] for before, now in pairs]
    compared = sum(map(len, shared))
    return tuple(
        tuple(Change(name, now[name].unit, before[name], now[name], compared) for name in names)
        for (before, now), names in zip(pairs, shared, strict=True)
    )


def changes_between(before: Sequence[Past], now: Sequence[Past]) -> dict[Subject, tuple[Change, ...]]:
    """Return the changes of all subjects common to two runs, as one comparison.

    `before` and `now` are the calibrations of one run each; if there are several of a subject, the last one is used.
    """
    earlier, later = ({past.subject: past for past in pasts} for pasts in (before, now))
    both = [subject for subject in later if subject in earlier]
    changes = changes_in([(earlier[subject].parameters, later[subject].parameters) for subject in both])
    return dict(zip(both, changes, strict=True))


def rig_states(pasts: Sequence[Past]) -> list[RigState]:
    """Return the state of every rig that calibrated a check standard: a sensor that any of its runs declared as one."""
    # Drifts and curves are not standards, and external readings have no rig.
    by_subject = subjects([past for past in pasts if past.quantity in quantities() and past.rig != NO_ARM])
    standards = {key: series for key, series in by_subject.items() if any(past.check_standard for past in series)}
    states = []
    for rig in dict.fromkeys(past.rig for series in standards.values() for past in series):
        deviations: dict[str, list[tuple[datetime, float]]] = {}
        serials = []
        for (_, serial_number, *_), series in standards.items():
            of_rig = [past for past in series if past.rig == rig]
            serials.extend([serial_number] if of_rig else [])
            for name, trend in trends(of_rig).items():
                if trend.chart is not None:
                    judged = zip(trend.times, trend.chart.deviation.tolist(), strict=True)
                    deviations.setdefault(name, []).extend(pair for pair in judged if np.isfinite(pair[1]))
        charts = {
            name: merge_charts(np.array([deviation for _, deviation in sorted(pairs)]))
            for name, pairs in deviations.items()
        }
        states.append(RigState(rig, tuple(dict.fromkeys(serials)), charts))
    return states


def effects(pasts: Sequence[Past]) -> dict[str, tuple[RigEffect, ...]]:
    """Return the differences between rigs that share gyroscopes, by parameter, as fractions for scale factors."""
    by_rigs = subjects(past for past in pasts if past.rig != NO_ARM)
    series = [
        (name, past) for pasts_of_subject in by_rigs.values() for past in pasts_of_subject for name in past.parameters
    ]
    by_name = {}
    for name in dict.fromkeys(name for name, past in series if past.quantity == "rate"):
        having = [past for parameter, past in series if parameter == name and past.quantity == "rate"]
        values = np.array([past.value(name) for past in having])
        std = np.array([past.parameters[name].std_statistical for past in having])
        if is_scale(name):
            values, std = np.log(values), std / values
        differences = rig_effects([past.rig for past in having], [str(past.subject) for past in having], values, std)
        if differences:
            by_name[name] = differences
    return by_name


def time_of(past: Past) -> datetime:
    """Return the time at which a calibration's run started."""
    return datetime.fromisoformat(past.started_utc).astimezone(UTC)


def days_to_limit(
    line: FittedModel, last_days: float, expanded: float, max_deviation: float, nominal: float
) -> int | None:
    """Return the days after the last result until |value − nominal| + U reaches `max_deviation`.

    Return None if that takes more than ten years. `line` is value = c₀ + c₁ t with t in days, as is `last_days`. U
    combines the line's uncertainty at that time, the scatter between runs, and the `expanded` uncertainty of the last
    result.
    """
    ahead = np.arange(MAX_HORIZON_DAYS + 1.0)
    value, std = line.predict(np.stack([np.ones_like(ahead), last_days + ahead], axis=-1))
    line_expanded = line.coverage_factor * np.hypot(std, line.between_std)
    reached = np.abs(value - nominal) + np.hypot(line_expanded, expanded) >= max_deviation
    return int(np.argmax(reached)) if reached.any() else None
