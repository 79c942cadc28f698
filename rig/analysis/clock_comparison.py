"""The controller's clock, compared with this computer's clock and the board's crystal.

A speed is 2π over a time of the controller's clock, so every scale factor has that clock's error. Clocks that disagree
are not left out of the estimate of this error. The difference of each pair is checked against both stated errors.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rig.data.recording.settings import Uncertainty
from rig.observation.clocks.time_base import NOMINAL_DRIFT
from rig.observation.consistency.arm_clock import compare_with_computer
from rig.observation.observed_run import ObservedRun

# Largest relative difference between a simulated controller's clock and another one. Such a controller runs as fast as
# it can: if its pace differs by more, the other clock does not count its seconds.
MAX_PACE_ERROR = 1e-2
DIFFERENCE_LIMIT = 4.0  # standard deviations of the difference's measured part
PPM = 1e-6

COMPUTER_CLOCK, CRYSTAL_CLOCK = "the computer's clock", "the board's crystal"
CLOCK_NAMES = {COMPUTER_CLOCK: "computer", CRYSTAL_CLOCK: "crystal"}


@dataclass(frozen=True, slots=True)
class ClockComparison:
    """The relative `error` of the controller's clock according to the clock called `by`.

    - `half_width`: the half-width of the stated error of the clock `by`.
    - `noise_std`: the standard uncertainty of `error` due to noise, with `dof` degrees of freedom.
    """

    by: str
    error: float
    half_width: float
    noise_std: float
    dof: float = np.inf

    @property
    def std(self) -> float:
        """The relative standard uncertainty of the comparison."""
        return float(np.hypot(self.noise_std, self.half_width / np.sqrt(3)))


@dataclass(frozen=True, slots=True)
class ClockDifference:
    """The relative difference (`size`) of two clocks, by their names, and its limit from stated errors and noise."""

    clocks: tuple[str, str]
    size: float
    limit: float

    @property
    def limit_fraction(self) -> float:
        """The difference divided by its limit; if it is above one, the clocks contradict each other."""
        return self.size / self.limit


@dataclass(frozen=True, slots=True)
class ClockCheck:
    """The relative `error` of the controller's clock (positive if it is fast) and its standard uncertainty `std`.

    They are a mean, weighted by inverse variance, of all `comparisons` and of the stated error: zero ± `half_width`.
    """

    error: float
    std: float
    comparisons: tuple[ClockComparison, ...]
    half_width: float

    def differences(self) -> Iterator[ClockDifference]:
        """Yield the difference of each pair of clocks, with its limit from both half-widths and the noise."""
        clocks = [("controller", 0.0, self.half_width, 0.0)]
        clocks += [
            (CLOCK_NAMES[comparison.by], comparison.error, comparison.half_width, comparison.noise_std)
            for comparison in self.comparisons
        ]
        for (one, error, width, noise), (other, its_error, its_width, its_noise) in combinations(clocks, 2):
            limit = width + its_width + DIFFERENCE_LIMIT * float(np.hypot(noise, its_noise))
            yield ClockDifference((one, other), abs(error - its_error), limit)

    @property
    def dof(self) -> float:
        """The degrees of freedom of `std` by Welch and Satterthwaite, infinite without readings."""
        terms = [
            (comparison.noise_std * (self.std / comparison.std) ** 2) ** 4 / comparison.dof
            for comparison in self.comparisons
        ]
        return self.std**4 / sum(terms) if any(terms) else np.inf


def check_clock(recording: ObservedRun, uncertainty: Uncertainty) -> ClockCheck:
    """Return the error of the controller's clock in one recording, from its comparison with every other clock."""
    # Imported here: it takes a tenth of the time of a plan's imports.
    from rig.data.recording.provenance import calls_itself_simulated

    compared = (_compare_to_computer(recording, uncertainty), _compare_to_crystal(recording, uncertainty))
    pace = MAX_PACE_ERROR if calls_itself_simulated(recording.run.provenance.arm_software) else np.inf
    far = {COMPUTER_CLOCK: pace, CRYSTAL_CLOCK: np.inf}
    used = [other for other in compared if other is not None and abs(other.error) < far[other.by]]
    half_width = uncertainty.controller_clock_ppm * PPM
    weights = np.array([3 / half_width**2, *(1 / other.std**2 for other in used)])
    errors = np.array([0.0, *(other.error for other in used)])
    error, std = float(weights @ errors / weights.sum()), float(weights.sum() ** -0.5)
    return ClockCheck(error, std, tuple(used), half_width)


def worst_differences(clocks: Iterable[ClockCheck]) -> list[ClockDifference]:
    """Return for each pair of clocks the difference that is largest relative to its limit, over all recordings."""
    worst: dict[tuple[str, str], ClockDifference] = {}
    for one in (difference for check in clocks for difference in check.differences()):
        worst[one.clocks] = max(worst.get(one.clocks, one), one, key=lambda difference: difference.limit_fraction)
    return list(worst.values())


def _compare_to_computer(recording: ObservedRun, uncertainty: Uncertainty) -> ClockComparison:
    """Return the comparison of the controller's clock with the computer's, from the arrival times of the states."""
    rate = compare_with_computer(recording.motion)
    return ClockComparison(COMPUTER_CLOCK, rate.error, uncertainty.computer_clock_ppm * PPM, rate.std, rate.dof)


def _compare_to_crystal(recording: ObservedRun, uncertainty: Uncertainty) -> ClockComparison | None:
    """Return the comparison of the controller's clock with the board's counter; None without a board or a crystal."""
    bases = [sensor.time_base for name, sensor in recording.sensors.items() if recording.run.sensors[name].on_board]
    if not bases or recording.run.provenance.board_follows_crystal is False:
        return None
    best = min(bases, key=lambda base: base.drift_std)
    error = (1 + best.drift) / (1 + NOMINAL_DRIFT) - 1
    return ClockComparison(CRYSTAL_CLOCK, error, uncertainty.crystal_ppm * PPM, best.drift_std)
