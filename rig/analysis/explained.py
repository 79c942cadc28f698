"""The vector model with all that a recording tells beside the sweeps: gravity, the Earth's rate, a bias that wanders.

Gravity stands still in the room and turns in the flange's frame, so attitudes tell what of a reading is sensitivity
to it; at rest the sensor reads bias, Earth and gravity alone. None of this is assumed: what the attitudes do not tell
apart stays out of the model and belongs into the uncertainty.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from rig.analysis.surroundings import Surroundings
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.bias_process import BiasProcess, estimate_bias_process
from rig.estimation.vector_model import VectorSolution, design_matrix, solve_vector_model
from rig.observation.observed_run import ObservedRun

UNTOLD = ("rank_deficient", "ill_conditioned", "too_few_observations")  # what more columns than sweeps bear ends in


@dataclass(frozen=True, slots=True)
class Seen:
    """What the vector model is made of: sweeps first, then rests, N in all.

    `means_rad_s`, `variances_rad2_s2` (N, 3) of the noise alone; `turns_rad_s` (N, 3) rates of the flange in the room,
    `earth_rad_s` (N, 3) that of the room, as far as it is known; `speed_std_rad_s` (N,); `attitudes` (N, 3, 3) from the
    base into the flange; `gravity_m_s2` (N, 3) downwards, in the flange's frame; `windows_s` (N, 2) on the clock of the
    first recording; `joints` (N) which of the arm's joints turned, None for a rest.
    """

    means_rad_s: Array
    variances_rad2_s2: Array
    turns_rad_s: Array
    earth_rad_s: Array
    speed_std_rad_s: Array
    attitudes: Array
    gravity_m_s2: Array
    windows_s: Array
    joints: tuple[str | None, ...]

    @property
    def rates_rad_s(self) -> Array:
        """(N, 3) of the flange against the stars."""
        rates: Array = self.turns_rad_s + self.earth_rad_s
        return rates

    def centripetal_m_s2(self, offset_m: Array) -> Array:
        """(N, 3) acceleration at `offset_m` (3,) from the flange while it turns, in the flange's frame."""
        outwards: Array = np.cross(self.turns_rad_s, np.cross(self.turns_rad_s, offset_m))
        return outwards


@dataclass(frozen=True, slots=True)
class Explained:
    """The vector model's solution, how the bias wandered, and what both were found from."""

    solution: VectorSolution
    bias: BiasProcess
    seen: Seen


def see(recordings: Sequence[ObservedRun], sensor: str, surroundings: Surroundings) -> Seen:
    """Put together what the arm knows of each average of a sensor, in all recordings of a run.

    Speeds by a controller's clock that runs too fast are too small by that.
    """
    site, parts = surroundings.site, [recording.sensors[sensor] for recording in recordings]
    turns = [
        (turn, since_s) for part, since_s in zip(parts, _since_s(recordings), strict=True) for turn in part.revolutions
    ]
    rests = [(rest, since_s) for part, since_s in zip(parts, _since_s(recordings), strict=True) for rest in part.rests]
    placed = [*((turn.average, since_s) for turn, since_s in turns), *rests]
    averages = [average for average, _ in placed]
    attitudes = np.array([average.attitude for average in averages], dtype=np.float64)
    turned = np.array([turn.speed_rad_s * turn.axis_flange for turn, _ in turns])
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)
    return Seen(
        means_rad_s=np.array([average.mean_rad_s for average in averages]),
        variances_rad2_s2=np.array([average.variance_rad2_s2 - average.drift_rad2_s2 for average in averages]),
        turns_rad_s=np.concatenate([turned * (1 + surroundings.clock.error), np.zeros((len(rests), 3))]),
        earth_rad_s=attitudes @ earth,
        speed_std_rad_s=np.array([*(turn.speed_std_rad_s for turn, _ in turns), *np.zeros(len(rests))]),
        attitudes=attitudes,
        gravity_m_s2=attitudes @ (-site.gravity_m_s2 * np.array(site.up)),
        windows_s=np.array([(average.start_s + since_s, average.end_s + since_s) for average, since_s in placed]),
        joints=(*(turn.joint_name for turn, _ in turns), *[None] * len(rests)),
    )


def _since_s(recordings: Sequence[ObservedRun]) -> list[float]:
    """What takes the controller's times of each recording to the clock of the first: it may have been switched off."""
    first = recordings[0]
    return [
        (_started(each) - _started(first)).total_seconds() + float(first.motion.time_s[0] - each.motion.time_s[0])
        for each in recordings
    ]


def _started(recording: ObservedRun) -> datetime:
    return datetime.fromisoformat(recording.run.provenance.started_utc)


def explain(seen: Seen, nominal_mounting: Array) -> Explained:
    """Scale, bias and mounting, with gravity's share where the attitudes tell it.

    Raises Fault as the vector model does.
    """
    try:
        return _explain(seen, nominal_mounting, seen.gravity_m_s2)
    except Fault as fault:
        if fault.name not in UNTOLD:
            raise
    return _explain(seen, nominal_mounting, None)


def _explain(seen: Seen, nominal_mounting: Array, gravity_m_s2: Array | None) -> Explained:
    def solve(shared: Array | None) -> VectorSolution:
        return solve_vector_model(
            seen.means_rad_s,
            seen.rates_rad_s,
            seen.variances_rad2_s2,
            speed_std_rad_s=seen.speed_std_rad_s,
            gravity_m_s2=gravity_m_s2,
            nominal_mounting=nominal_mounting,
            shared_covariance_rad2_s2=shared,
        )

    steady = solve(None)
    of_the_speed = (seen.speed_std_rad_s[:, None] * np.linalg.norm(steady.matrix, axis=1)) ** 2
    bias = estimate_bias_process(
        design_matrix(seen.rates_rad_s, gravity_m_s2),
        seen.means_rad_s,
        seen.variances_rad2_s2 + of_the_speed,
        seen.windows_s,
    )
    return Explained(steady if bias.steady else solve(bias.covariance(seen.windows_s)), bias, seen)
