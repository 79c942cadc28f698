"""What an accelerometer adds to its readings of which only the likely size is known before: bending, and drift.

Its reading r is not quite linear in the specific force v along its axis, and its scale and bias follow its temperature:

    r = (1 + κ ΔT) v + φ v² + χ (v³ − g² v) + b + β ΔT + w(t)

φ, χ, β and κ of each axis are zero on average, w is flicker and a random walk. The scale so is that of the readings at
1 g up and 1 g down, which φ and χ leave alone, and b the reading at 0 g, as makers of such parts have both (ST DS12140,
section 4.6.1 and 4.6.2); both at the mean temperature of the readings, b with the mean of w over the time that is
looked at.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.estimation.arrays import Array


@dataclass(frozen=True, slots=True)
class AccelerometerErrors:
    """One standard uncertainty of each, alike for all axes, and what was recorded in dwells and sweeps (K' of them).

    - `even_s2_m` φ, zero where it is looked for; `odd_s4_m2` χ; `norm_m_s2` g.
    - `bias_m_s2_k` β, `scale_per_k` κ; `warmer_k` (K',) is ΔT as recorded, `unseen_k` (K',) what the recorded steps may
      hide of it.
    - `windows_s` (K', 2): when each began and ended.
    - `instability_m_s2`: the least Allan deviation of the flicker in w.

    Beside these, as the readings themselves say: `walk_m_s2_sqrt_s`, what w walks in a second; `louder` (K',), the
    variance of a dwell or sweep that was disturbed for itself, in that of its noise; `turning_m_s2`, by how much the
    bias is another in all sweeps.
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

    def without(self, piece: int) -> "AccelerometerErrors":
        """The errors in all but one dwell or sweep."""
        left = np.arange(len(self.warmer_k)) != piece
        return replace(
            self,
            warmer_k=self.warmer_k[left],
            unseen_k=self.unseen_k[left],
            windows_s=self.windows_s[left],
            louder=None,
        )
