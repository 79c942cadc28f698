"""The joints' encoders: steps, white noise, a delay that jitters. Only the controller's clients see these errors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rig.world.clock import TICK_S, TICKS_PER_SECOND
from rig.world.ur10e.motion.trajectory import Joints

MIN_NOISY_SPEED_RAD_S = 1e-3  # the speeds of slower joints have no noise
NOISES_PER_TICK = 12  # six random numbers for angles, six for speeds


@dataclass(slots=True)
class Encoders:
    """The encoders of six joints.

    - `step_rad`: resolution of the angles, 0 for none.
    - `noise_rad`: white noise of each angle.
    - `speed_noise_rad_s`: noise of the speed of each joint that turns.
    - `lateness_s`: draws the delay of a reading, once a tick.
    - `seed`: seed of the noise, which is the same for every client that asks in the same tick.
    """

    step_rad: float = 0.0
    noise_rad: float = 0.0
    speed_noise_rad_s: float = 0.0
    lateness_s: Callable[[], float] | None = None
    seed: int = 0
    _late_s: float = field(default=0.0, init=False)
    _block: tuple[int, list[list[float]]] = field(default=(-1, list[list[float]]()), init=False)

    def step(self) -> None:
        """Begin a tick."""
        if self.lateness_s is not None:
            self._late_s = self.lateness_s()

    def read_angles(self, time_s: float, q_rad: Joints, qd_rad_s: Joints) -> Joints:
        """Return the angles that the encoders report at the end of the tick at `time_s`, rad."""
        if self._late_s:
            q_rad = tuple(q + v * self._late_s for q, v in zip(q_rad, qd_rad_s, strict=True))
        if self.noise_rad:
            q_rad = tuple(q + self.noise_rad * n for q, n in zip(q_rad, self._draw(time_s)[:6], strict=True))
        return tuple(round(q / self.step_rad) * self.step_rad for q in q_rad) if self.step_rad else q_rad

    def read_speeds(self, time_s: float, qd_rad_s: Joints) -> Joints:
        """Return the speeds that the encoders report at the end of the tick at `time_s`, rad/s."""
        if not self.speed_noise_rad_s or max(map(abs, qd_rad_s)) < MIN_NOISY_SPEED_RAD_S:
            return qd_rad_s
        return tuple(
            v + self.speed_noise_rad_s * n if abs(v) >= MIN_NOISY_SPEED_RAD_S else v
            for v, n in zip(qd_rad_s, self._draw(time_s)[6:], strict=True)
        )

    def _draw(self, time_s: float) -> Sequence[float]:
        """Return the standard normal numbers of a tick, which do not depend on the ticks requested before."""
        block, index = divmod(round(time_s / TICK_S), TICKS_PER_SECOND)
        if block != self._block[0]:
            rng = np.random.default_rng([self.seed, block])
            self._block = block, rng.standard_normal((TICKS_PER_SECOND, NOISES_PER_TICK)).tolist()
        return self._block[1][index]
