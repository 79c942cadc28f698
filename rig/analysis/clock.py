"""The controller's clock, the only standard of size: held against this computer's and the board's crystal.

Both stand in every recording. A speed is 2π over a time of the controller's, so every scale factor errs by what that
clock errs by. No clock is left out for being far off: what two differ by is held against what is stated of both.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rig.data.recording.provenance import calls_itself_simulated
from rig.data.recording.settings import Uncertainty
from rig.observation.consistency.arm_clock import compare_with_computer
from rig.observation.observed_run import ObservedRun
from rig.observation.timebase import NOMINAL_DRIFT

# A simulated controller goes as fast as it can: a computer that is farther off counts no seconds of it.
ONE_PACE = 1e-2
CERTAIN = 4.0  # standard deviations of what is found beside what is stated
PPM = 1e-6

BY_COMPUTER, BY_CRYSTAL = "the computer's clock", "the board's crystal"
SHORT = {BY_COMPUTER: "computer", BY_CRYSTAL: "crystal"}


@dataclass(frozen=True, slots=True)
class ClockComparison:
    """How much too fast the controller's clock runs by another one, and the standard uncertainty of that: fractions.

    `half_width` is what is stated of the other clock, `noise_std` what the recording leaves uncertain, with so much
    `freedom`; `std` is both.
    """

    by: str
    error: float
    half_width: float
    noise_std: float
    freedom: float = np.inf

    @property
    def std(self) -> float:
        """Standard uncertainty of the comparison, as a fraction."""
        return float(np.hypot(self.noise_std, self.half_width / np.sqrt(3)))


@dataclass(frozen=True, slots=True)
class ClockDifference:
    """What two clocks, by name, differ by, and the most that is stated of them and found allows: fractions."""

    clocks: tuple[str, str]
    size: float
    limit: float

    @property
    def share(self) -> float:
        """Share of the limit that the difference takes; beyond one the clocks contradict each other."""
        return self.size / self.limit


@dataclass(frozen=True, slots=True)
class ClockCheck:
    """What is known of the controller's clock: `error` is how much too fast it runs, `std` its standard uncertainty.

    Made of all `comparisons` and of what such a clock may be off at all, `half_width`, weighted by their variances.
    """

    error: float
    std: float
    comparisons: tuple[ClockComparison, ...]
    half_width: float

    def differences(self) -> Iterator[ClockDifference]:
        """Every two clocks that are compared; of two half-widths the sum, for all values within are alike likely."""
        known = [("controller", 0.0, self.half_width, 0.0)]
        known += [
            (SHORT[comparison.by], comparison.error, comparison.half_width, comparison.noise_std)
            for comparison in self.comparisons
        ]
        for (one, error, width, noise), (other, its_error, its_width, its_noise) in combinations(known, 2):
            limit = width + its_width + CERTAIN * float(np.hypot(noise, its_noise))
            yield ClockDifference((one, other), abs(error - its_error), limit)

    @property
    def freedom(self) -> float:
        """Degrees of freedom of `std`, infinite where nothing was found from readings."""
        found = [
            (comparison.noise_std * (self.std / comparison.std) ** 2) ** 4 / comparison.freedom
            for comparison in self.comparisons
        ]
        return self.std**4 / sum(found) if any(found) else np.inf


def check_clock(recording: ObservedRun, known: Uncertainty) -> ClockCheck:
    """Return what is known of the clock of one recording's controller, compared with every other clock."""
    compared = (_by_computer(recording, known), _by_crystal(recording, known))
    pace = ONE_PACE if calls_itself_simulated(recording.run.provenance.arm_software) else np.inf
    far = {BY_COMPUTER: pace, BY_CRYSTAL: np.inf}
    found = [each for each in compared if each is not None and abs(each.error) < far[each.by]]
    half_width = known.controller_clock_ppm * PPM
    weights = np.array([3 / half_width**2, *(1 / each.std**2 for each in found)])
    errors = np.array([0.0, *(each.error for each in found)])
    error, std = float(weights @ errors / weights.sum()), float(weights.sum() ** -0.5)
    return ClockCheck(error, std, tuple(found), half_width)


def worst_differences(clocks: Iterable[ClockCheck]) -> list[ClockDifference]:
    """The difference of every two clocks that are compared, in the recording in which they agree least."""
    worst: dict[tuple[str, str], ClockDifference] = {}
    for found in (difference for check in clocks for difference in check.differences()):
        worst[found.clocks] = max(worst.get(found.clocks, found), found, key=lambda each: each.share)
    return list(worst.values())


def _by_computer(recording: ObservedRun, known: Uncertainty) -> ClockComparison:
    """The controller's clock by the computer's, from the times at which the states came."""
    rate = compare_with_computer(recording.motion)
    return ClockComparison(BY_COMPUTER, rate.error, known.computer_clock_ppm * PPM, rate.std, rate.freedom)


def _by_crystal(recording: ObservedRun, known: Uncertainty) -> ClockComparison | None:
    """The controller's clock by the board's counter; None where no board was, or by its word no crystal holds it."""
    bases = [sensor.time_base for name, sensor in recording.sensors.items() if recording.run.sensors[name].on_board]
    if not bases or recording.run.provenance.board_follows_crystal is False:
        return None
    best = min(bases, key=lambda base: base.drift_std)
    error = (1 + best.drift) / (1 + NOMINAL_DRIFT) - 1
    return ClockComparison(BY_CRYSTAL, error, known.crystal_ppm * PPM, best.drift_std)
