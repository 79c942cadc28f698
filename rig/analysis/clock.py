"""The controller's clock, the only standard of size: held against this computer's and the board's crystal.

Both stand in every recording. A speed is 2π over a time of the controller's, so every scale factor errs by what that
clock errs by.
"""

from dataclasses import dataclass
from math import comb

import numpy as np

from rig.data.settings import Uncertainty
from rig.observation.colour import widening
from rig.observation.observed_run import ObservedRun
from rig.observation.windows import swept

# The board's counter runs from its 32768 Hz crystal by way of a PLL, 576 ppm below the nominal rate (docs/board.md).
NOMINAL_DRIFT = 4e6 / (122 * 32768) - 1
LOCKED = 150e-6  # an oscillator farther from that is not held by the crystal
REAL_TIME = 1e-3  # a controller's clock is that close to a computer's; a simulated one may run at any pace
PPM = 1e-6
ORDER = 6
EVEN_S = 1e-4  # states whose steps in time differ by less follow each other evenly


@dataclass(frozen=True, slots=True)
class ClockComparison:
    """How much too fast the controller's clock runs by another one, and the standard uncertainty of that: fractions.

    `scatter` is the part of it that was found from readings, with so much `freedom`; the rest is stated.
    """

    by: str
    error: float
    std: float
    scatter: float = 0.0
    freedom: float = np.inf


@dataclass(frozen=True, slots=True)
class ClockCheck:
    """What is known of the controller's clock: `error` is how much too fast it runs, `std` its standard uncertainty.

    Made of all `comparisons` and of what such a clock may be off at all, weighted by their variances.
    """

    error: float
    std: float
    comparisons: tuple[ClockComparison, ...]

    @property
    def freedom(self) -> float:
        """Degrees of freedom of `std`, infinite where nothing was found from readings."""
        found = [(each.scatter * (self.std / each.std) ** 2) ** 4 / each.freedom for each in self.comparisons]
        return self.std**4 / sum(found) if any(found) else np.inf


@dataclass(frozen=True, slots=True)
class Jitter:
    """Of the times the arm's states are of: standard deviation in s, and its degrees of freedom."""

    std_s: float
    freedom: float


def check_clock(recording: ObservedRun, known: Uncertainty) -> ClockCheck:
    """The clock of one recording's controller."""
    found = [each for each in (_by_computer(recording, known), _by_crystal(recording, known)) if each is not None]
    prior = known.controller_clock_ppm * PPM / np.sqrt(3)
    weights = np.array([1 / prior**2, *(1 / each.std**2 for each in found)])
    errors = np.array([0.0, *(each.error for each in found)])
    return ClockCheck(float(weights @ errors / weights.sum()), float(weights.sum() ** -0.5), tuple(found))


def state_jitter(recording: ObservedRun) -> Jitter:
    """Of the times the arm's states are of, from how the joint angles of the sweeps scatter.

    Differences of the sixth order: of what the servo does, slow beside the states, nothing is left in them. What is
    left are the times, and the encoder's steps. Neighbouring differences share states: n of them have the freedom of
    n / Σ ρ², where Σ ρ² over all lags is C(24, 12) / C(12, 6)².
    """
    scatter, count = [], 0
    for finished in swept(recording.run):
        inside = slice(*np.searchsorted(recording.motion.time_s, [finished.window.start_s, finished.window.end_s]))
        states = recording.motion.states[inside]
        steps = np.diff(states["q_rad"][:, finished.sweep.joint], n=ORDER)
        even = np.ptp(np.lib.stride_tricks.sliding_window_view(np.diff(states["time_s"]), ORDER), axis=1)
        steps = steps[even < EVEN_S]
        if len(steps):
            scatter.append(np.mean(steps**2) / comb(2 * ORDER, ORDER) / finished.sweep.speed_rad_s**2)
            count += len(steps)
    if not scatter:
        return Jitter(0.0, np.inf)
    return Jitter(float(np.sqrt(np.mean(scatter))), count * comb(2 * ORDER, ORDER) ** 2 / comb(4 * ORDER, 2 * ORDER))


def _by_computer(recording: ObservedRun, known: Uncertainty) -> ClockComparison | None:
    """By the times at which the states came; None where the two clocks do not go at one pace."""
    states = recording.motion.states
    host_s, arm_s = states["host_time_s"] - states["host_time_s"][0], states["time_s"] - states["time_s"][0]
    design = np.column_stack([np.ones_like(host_s), host_s])
    (offset, slope), *_ = np.linalg.lstsq(design, arm_s, rcond=None)
    if not abs(slope - 1) < REAL_TIME:
        return None
    late = arm_s - design @ (offset, slope)
    alone = len(late) / widening(late)  # states come late in bursts
    of_the_line = float(late.std() / host_s.std() / np.sqrt(alone))
    std = float(np.hypot(of_the_line, known.computer_clock_ppm * PPM / np.sqrt(3)))
    return ClockComparison("the computer's clock", float(slope - 1), std, of_the_line, max(alone - 2, 1.0))


def _by_crystal(recording: ObservedRun, known: Uncertainty) -> ClockComparison | None:
    """By the board's counter; None where no crystal holds it, or no board was there."""
    bases = [each.time_base for name, each in recording.sensors.items() if recording.run.sensors[name].on_board]
    if not bases:
        return None
    best = min(bases, key=lambda base: base.drift_std)
    error = (1 + best.drift) / (1 + NOMINAL_DRIFT) - 1
    if not abs(error) < LOCKED:
        return None
    return ClockComparison(
        "the board's crystal", error, float(np.hypot(best.drift_std, known.crystal_ppm * PPM / np.sqrt(3)))
    )
