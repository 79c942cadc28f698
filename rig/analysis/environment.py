"""The environment of a run: the site, and the clock that measures all speeds."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, sqrt

from rig.analysis.clock_comparison import ClockCheck, check_clock
from rig.data.recording.settings import RunSettings, Site, Uncertainty
from rig.observation.consistency.arm_clock import find_encoder_noise_rad, state_jitter
from rig.observation.observed_run import ObservedRun

# Jitter of a time between two states, relative to that of one state: √(f² + (1 − f)²), averaged over the fractions f.
INTERPOLATION_JITTER_RATIO = sqrt(2 / 3)
SPLINE_NOISE_RATIO = 0.935  # the same for an angle between two readings, by the cubic spline through all readings


@dataclass(frozen=True, slots=True)
class MeasurementEnvironment:
    """The site, the stated uncertainties, and what the recordings show of clocks and states.

    - clock: the comparison of clocks that corrects the speeds.
    - state_jitter_s: standard deviation of the times of the arm's states, with `state_jitter_dof` degrees of freedom.
    - extension_m (3,): the sensors' position relative to the flange, in the flange's frame.
    - finds_earth_rate: whether the Earth's rate is estimated, not taken from the site.
    - clocks: the comparisons in all recordings, for the checks.
    - reading_noise_rad: noise of a joint's angle at any time, due to the noise of its encoder.
    """

    site: Site
    uncertainty: Uncertainty
    clock: ClockCheck
    state_jitter_s: float
    extension_m: tuple[float, float, float]
    finds_earth_rate: bool = False
    state_jitter_dof: float = inf
    clocks: tuple[ClockCheck, ...] = ()
    reading_noise_rad: float = 0.0


def find_environment(recordings: Sequence[ObservedRun], settings: RunSettings) -> MeasurementEnvironment:
    """Return the environment of a run, from all its recordings and its settings.

    The recording with the longest motion determines the clock, because all recordings share the controller's quartz.
    The comparisons of all recordings are included for the checks: they differ if the quartz or the computer's time was
    changed.
    """
    uncertainty = settings.stated_uncertainty
    longest = max(recordings, key=lambda run: float(run.motion.time_s[-1] - run.motion.time_s[0]))
    clocks = tuple(check_clock(recording, uncertainty) for recording in recordings)
    clock = next(check for recording, check in zip(recordings, clocks, strict=True) if recording is longest)
    jitter = state_jitter(recordings)
    return MeasurementEnvironment(
        settings.site,
        uncertainty,
        clock,
        jitter.std_s * INTERPOLATION_JITTER_RATIO,
        settings.extension_m,
        settings.finds_earth_rate,
        jitter.dof,
        clocks,
        find_encoder_noise_rad(recordings) * SPLINE_NOISE_RATIO,
    )
