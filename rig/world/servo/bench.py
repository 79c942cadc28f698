"""A simulated servo as what turns the item: its shaft, the base it is screwed to, and its line."""

import time
from collections.abc import Sequence
from math import cos, sin

import numpy as np

from rig.config.procedures.servo_section import ServoSection
from rig.config.world.laboratory import WorldSection
from rig.world.clock import TICK_S
from rig.world.servo.bus import Bus
from rig.world.servo.servo import Servo
from rig.world.servo.truth import LineTruth, ServoTruth
from rig.world.site import site_of
from rig.world.ur10e.motion.flange_motion import Felt, base, carried
from rig.world.ur10e.motion.forward_kinematics import Rotation, Vector
from rig.world.ur10e.motion.links import Link

BEHIND_S = 60.0  # wall time that the board may be behind the servo, and catches up
AHEAD_S = 2 * TICK_S  # of the world's first tick, that nothing is asked of the shaft's future
CHANGE_S = 1e-4  # the change of the rate is the difference of two
SHAFT = Link(theta_rad=0.0, a_m=0.0, d_m=0.0, alpha_rad=0.0, cos_alpha=1.0, sin_alpha=0.0)
# As it is set up for the rig (docs/how-to/without-an-arm/servo.md): 1 Mbit/s, no return delay; the modes are the
# driver's to set.
BAUDS = {57600: 1, 115200: 2, 1_000_000: 3, 2_000_000: 4, 3_000_000: 5, 4_000_000: 6}


class ServoBench:
    """The servo on its `bus`.

    The servo lives by the clock on the wall, as does whoever talks to it. The board lives by the world's ticks, and
    may be late: what its sensors feel is then the shaft as it was.
    """

    def __init__(self, configured: ServoSection, world: WorldSection) -> None:
        section = world.servo
        self._began_s = time.monotonic()
        self._site = site_of(world.site)
        self._ticks = 0
        seed = int(np.random.SeedSequence([world.seed, 430]).generate_state(1)[0])
        truth = ServoTruth(
            model=(section.model or configured.model).upper().replace("_", "-"),
            firmware=section.firmware,
            left={"ID": configured.id, "Baud Rate": BAUDS[configured.baud], "Return Delay Time": 0},
            start_deg=section.start_deg,
            encoder_once_deg=section.encoder_once_deg,
            encoder_twice_deg=section.encoder_twice_deg,
            encoder_once_phase_deg=float(seed % 360),
            encoder_twice_phase_deg=float(seed // 360 % 360),
            encoder_noise_deg=section.encoder_noise_deg,
            backlash_deg=section.backlash_deg,
            ripple_fraction=section.ripple_fraction,
            ripple_per_turn=section.ripple_per_turn,
            lag_s=1e-3 * section.lag_ms,
            tick_ppm=section.tick_ppm,
            fall_deg_s=section.fall_deg_s,
            seed=seed,
        )
        self.servo = Servo(truth, 0.0)
        self.bus = Bus([self.servo], LineTruth(latency_ms=section.latency_ms), self.now_s, seed=seed)

    def now_s(self) -> float:
        """The servo's time: that on the wall, since the world began. No tick is ahead of it."""
        return time.monotonic() - self._began_s + AHEAD_S

    @property
    def time_s(self) -> float:
        """The end of the last tick."""
        return self._ticks * TICK_S

    @property
    def tick_s(self) -> float:
        """How long a tick lasts."""
        return TICK_S

    @property
    def waiting(self) -> bool:
        """Whether nothing but a client can let it move: never sure, its watchdog may too."""
        return False

    @property
    def ideal(self) -> bool:
        """Whether its rate alone is what a body on it feels."""
        return not any(self._site.earth_rate_rad_s)

    def step(self) -> None:
        """One tick of the world's, and the servo lives until now."""
        self._ticks += 1
        self.bus.advance()

    def rate_at(self, time_s: float) -> Vector:
        """The shaft's rate, about its own axis, rad/s."""
        return (0.0, 0.0, self.servo.rate_at(time_s))

    def felt_at(self, time_s: float) -> Felt:
        """All that a body on the shaft feels."""
        angle, rate = self.servo.angle_at(time_s), self.servo.rate_at(time_s)
        change = (self.servo.rate_at(time_s + CHANGE_S) - rate) / CHANGE_S
        return carried(base(self._site), [(cos(angle), sin(angle))], (rate,), (change,), (SHAFT,))

    def frames_at(self, time_s: float) -> Sequence[tuple[Rotation, Vector]]:
        """Rotation and place of the base and of the shaft."""
        angle, nowhere = self.servo.angle_at(time_s), (0.0, 0.0, 0.0)
        still = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        c, s = cos(angle), sin(angle)
        return [(still, nowhere), (((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)), nowhere)]
