"""What a run's recordings tell of the place they were made in: the site, and the clock everything is measured by."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

from rig.analysis.clock import ClockCheck, check_clock
from rig.data.recording.settings import RunSettings, Site, Uncertainty
from rig.observation.consistency.arm_clock import state_jitter
from rig.observation.observed_run import ObservedRun

# Of the jitter of one state, by that of a moment between two: √(f² + (1 − f)²), in the mean over all shares f.
BETWEEN_TWO = sqrt(2 / 3)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """The site, what no recording shows of it, the controller's clock, and its states' jitter (s).

    `extension_m` (3,) is where the sensors sit, from the flange, in its frame.
    `clock` is the one that speeds are corrected by, `clocks` what every recording that is held against others says.
    `finds_earth_rate` says that the site is not asked for the Earth's rate.
    """

    site: Site
    uncertainty: Uncertainty
    clock: ClockCheck
    state_jitter_s: float
    extension_m: tuple[float, float, float]
    finds_earth_rate: bool = False
    state_jitter_freedom: float = inf
    clocks: tuple[ClockCheck, ...] = ()


def surroundings_of(recordings: Sequence[ObservedRun], settings: RunSettings) -> Surroundings:
    """Return what surrounded the sensors by a run's settings.

    The clock is that of the longest motion, which tells it best: the controller's is one quartz in all recordings, and
    where it was another, or its computer's time was, the others tell.
    """
    known = settings.stated_uncertainty
    longest = max(recordings, key=lambda each: float(each.motion.time_s[-1] - each.motion.time_s[0]))
    clocks = tuple(check_clock(recording, known) for recording in recordings)
    clock = next(check for recording, check in zip(recordings, clocks, strict=True) if recording is longest)
    jitter = state_jitter(recordings)
    return Surroundings(
        settings.site,
        known,
        clock,
        jitter.std_s * BETWEEN_TWO,
        settings.extension_m,
        settings.finds_earth_rate,
        jitter.freedom,
        clocks,
    )
