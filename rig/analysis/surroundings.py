"""What a run's recordings tell of the place they were made in: the site, and the clock everything is measured by."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

from rig.analysis.clock import ClockCheck, check_clock, state_jitter
from rig.data.settings import Site, Uncertainty
from rig.observation.observed_run import ObservedRun

# Of the jitter of one state, by that of a moment between two: √(f² + (1 − f)²), in the mean over all shares f.
BETWEEN_TWO = sqrt(2 / 3)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The site, what no recording shows of it, the controller's clock, and its states' jitter (s).

    `finds_earth_rate` says that the site is not asked for the Earth's rate, `counts_freedom` as `RunSettings` does.
    """

    site: Site
    uncertainty: Uncertainty
    clock: ClockCheck
    state_jitter_s: float
    finds_earth_rate: bool = False
    state_jitter_freedom: float = inf
    counts_freedom: bool = True


def surroundings_of(recordings: Sequence[ObservedRun]) -> Surroundings | None:
    """By the first recording's settings and its longest motion; None where those of before know no site."""
    settings = recordings[0].run.settings
    if settings.site is None or settings.uncertainty is None:
        return None
    longest = max(recordings, key=lambda each: float(each.motion.time_s[-1] - each.motion.time_s[0]))
    clock = check_clock(longest, settings.uncertainty, holds_every=settings.holds_every_clock)
    jitter = state_jitter(longest)
    return Surroundings(
        settings.site,
        settings.uncertainty,
        clock,
        jitter.std_s * (BETWEEN_TWO if settings.knows_returns else 1.0),
        settings.finds_earth_rate,
        jitter.freedom,
        settings.counts_freedom,
    )
