"""The bias drift of a triad: flicker noise and a random walk, functions of time that begin at zero.

Flicker noise is a sum of Gauss-Markov processes with correlation times a decade apart (IEEE Std 952-1997, annexes B and
C): a variance of σ² for each gives a floor of the Allan deviation of √(2 ln 2 / ln 10) σ.
"""

from math import exp, log, sqrt

import numpy as np

STEP_S = 0.1  # between knots, with linear interpolation
_BLOCK = 256
_CORRELATION_TIMES = (0.01, 0.1, 1.0, 10.0)  # relative to the time at the middle of the floor
_SIGMA_PER_FLOOR = sqrt(log(10.0) / (2.0 * log(2.0)))


class Drift:
    """The drift of three axes, in the units of their readings. Its methods take times since the world began.

    `instability` is the floor of the Allan deviation, flat around an averaging time of `instability_time_s`.
    `random_walk_per_sqrt_s` is the standard deviation of the change in a second, which grows with the root of time.
    """

    def __init__(
        self, instability: float, instability_time_s: float, random_walk_per_sqrt_s: float, seed: np.random.SeedSequence
    ) -> None:
        self._random = np.random.default_rng(seed)
        times_s = instability_time_s * np.array(_CORRELATION_TIMES)
        self._keep = np.array([[exp(-STEP_S / time_s)] for time_s in times_s])
        self._fresh = instability * _SIGMA_PER_FLOOR * np.sqrt(1.0 - self._keep**2)
        self._step = random_walk_per_sqrt_s * sqrt(STEP_S)
        self._flicker = np.zeros((len(times_s), 3))
        self._walk = np.zeros(3)
        self._knots = [[0.0, 0.0, 0.0]]

    def evaluate(self, time_s: float) -> list[float]:
        """Return the drift (3,) at one time."""
        position, fraction = divmod(time_s / STEP_S, 1.0)
        knot = max(int(position), 0)
        self._extend(knot)
        return [a + fraction * (b - a) for a, b in zip(self._knots[knot], self._knots[knot + 1], strict=True)]

    def evaluate_all(self, time_s: np.ndarray) -> np.ndarray:
        """Return the drift (n, 3) at times (n,)."""
        self._extend(int(np.max(time_s, initial=0.0) / STEP_S))
        knots = np.array(self._knots)
        knot_times_s = np.arange(len(knots)) * STEP_S
        return np.column_stack([np.interp(time_s, knot_times_s, knots[:, axis]) for axis in range(3)])

    def _extend(self, knot: int) -> None:
        """Add knots until the last one is later than `knot`."""
        while len(self._knots) < knot + 2:
            fresh = self._random.standard_normal((_BLOCK, len(self._flicker) + 1, 3))
            flickers, steps = self._fresh * fresh[:, 1:], self._step * fresh[:, 0]
            for number, new in enumerate(flickers):
                self._flicker = flickers[number] = self._keep * self._flicker + new
            walks = np.add.accumulate([self._walk, *steps])[1:]
            self._walk = walks[-1]
            self._knots += (flickers.sum(axis=1) + walks).tolist()
