"""An accelerometer's errors with prior variances: nonlinearity, temperature and bias drift.

The reading r is slightly nonlinear in the specific force v along an axis; scale and bias follow the temperature:

    r = (1 + κ ΔT) v + φ v² + χ (v³ − g² v) + b + β ΔT + w(t)

g is the norm of gravity, ΔT the temperature minus its mean. φ, χ, β and κ of each axis are zero on average, w is
flicker and a random walk. So the scale refers to the difference of the readings at 1 g up and 1 g down, which φ and χ
do not change, and b is the reading at 0 g, as in data sheets (ST DS12140, sections 4.6.1 and 4.6.2). Both refer to the
readings' mean temperature; b includes the mean of w over their time.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.estimation.arrays import Array


@dataclass(frozen=True, slots=True)
class AccelerometerErrors:
    """The standard uncertainty of each error, the same for all axes, and the records of K' dwells and sweeps.

    - even_s2_m: quadratic nonlinearity φ, zero if it is estimated.
    - odd_s4_m2: cubic nonlinearity χ.
    - norm_m_s2: norm of gravity.
    - bias_m_s2_k, scale_per_k: changes of bias and scale with temperature.
    - warmer_k (K',): recorded deviation from the mean temperature.
    - unseen_k (K',): deviation of the temperature that is smaller than the thermometer's step and so not recorded.
    - windows_s (K', 2): start and end of each dwell or sweep.
    - instability_m_s2: the least Allan deviation of the bias' flicker.
    - walk_m_s2_sqrt_s: random walk of the bias, estimated from the readings.
    - louder (K',): estimated extra variance of a disturbed dwell or sweep, relative to its noise.
    - turning_m_s2: estimated difference of the bias in sweeps from that in dwells.
    """

    even_s2_m: float
    odd_s4_m2: float
    norm_m_s2: float
    bias_m_s2_k: float
    scale_per_k: float
    warmer_k: Array
    unseen_k: Array
    windows_s: Array
    instability_m_s2: float = 0.0
    walk_m_s2_sqrt_s: float = 0.0
    louder: Array | None = None
    turning_m_s2: float = 0.0

    def omit(self, segment: int) -> "AccelerometerErrors":
        """Return the errors without the records of the dwell or sweep of index `segment`."""
        remaining = np.arange(len(self.warmer_k)) != segment
        return replace(
            self,
            warmer_k=self.warmer_k[remaining],
            unseen_k=self.unseen_k[remaining],
            windows_s=self.windows_s[remaining],
            louder=None,
        )
