"""A simulated servo that turns the item: its shaft, the base it is screwed to, and its line."""

import time
from collections.abc import Sequence
from math import cos, sin

import numpy as np

from rig.config.procedures.servo_section import ServoSection
from rig.config.world.laboratory import WorldSection
from rig.world.clock import TICK_S
from rig.world.servo.bus import SimulatedBus
from rig.world.servo.servo import SimulatedServo
from rig.world.servo.truth import LineTruth, ServoTruth
from rig.world.site import build_site
from rig.world.ur10e.motion.flange_motion import BodyMotion, find_base_motion, propagate
from rig.world.ur10e.motion.forward_kinematics import Rotation, Vector
from rig.world.ur10e.motion.links import ArmLink

MAX_LAG_S = 60.0  # wall time by which the board may lag the servo and still catch up
LEAD_S = 2 * TICK_S  # of the servo over the first tick: no sensor requests a later angle of the shaft
DERIVATIVE_STEP_S = 1e-4  # of the numerical derivative of the rate
SHAFT = ArmLink(theta_rad=0.0, a_m=0.0, d_m=0.0, alpha_rad=0.0, cos_alpha=1.0, sin_alpha=0.0)
# Its setup for the rig (docs/how-to/without-an-arm/servo.md): 1 Mbit/s, no return delay. The driver sets the modes.
BAUDS = {57600: 1, 115200: 2, 1_000_000: 3, 2_000_000: 4, 3_000_000: 5, 4_000_000: 6}


class ServoBench:
    """A `MotionSource`: the shaft of the servo on the `bus`.

    The servo runs in wall time, as its client does. The board runs in the world's ticks and may lag behind the servo:
    its sensors then sense the shaft's past motion.
    """

    def __init__(self, configured: ServoSection, world: WorldSection) -> None:
        """Build the servo from its sections; the world's seed determines the phases of its encoder's errors."""
        section = world.servo
        self._began_s = time.monotonic()
        self._site = build_site(world.site)
        self._ticks = 0
        seed = int(np.random.SeedSequence([world.seed, 430]).generate_state(1)[0])
        truth = ServoTruth(
            model=(section.model or configured.model).upper().replace("_", "-"),
            firmware=section.firmware,
            settings={"ID": configured.id, "Baud Rate": BAUDS[configured.baud], "Return Delay Time": 0},
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
        self.servo = SimulatedServo(truth, 0.0)
        self.bus = SimulatedBus([self.servo], LineTruth(latency_ms=section.latency_ms), self.now_s, seed=seed)

    def now_s(self) -> float:
        """Return the servo's time: wall time since the world began, s. No tick is ahead of this time."""
        return time.monotonic() - self._began_s + LEAD_S

    @property
    def time_s(self) -> float:
        """The end of the last tick, s."""
        return self._ticks * TICK_S

    @property
    def tick_s(self) -> float:
        """The duration of a tick, s."""
        return TICK_S

    @property
    def waiting(self) -> bool:
        """Whether the servo stays at rest until a client acts: always False, because its watchdog can also move it."""
        return False

    @property
    def ideal(self) -> bool:
        """Whether `rate_at` gives all that a gyroscope senses, which is so if the ground does not rotate."""
        return not any(self._site.earth_rate_rad_s)

    def step(self) -> None:
        """Simulate one tick of the world, and the servo until the time `now_s()`."""
        self._ticks += 1
        self.bus.advance()

    def rate_at(self, time_s: float) -> Vector:
        """Return the shaft's angular rate about its own axis, (3,) rad/s."""
        return (0.0, 0.0, self.servo.rate_at(time_s))

    def motion_at(self, time_s: float) -> BodyMotion:
        """Return the motion of a body on the shaft."""
        angle, rate = self.servo.angle_at(time_s), self.servo.rate_at(time_s)
        change = (self.servo.rate_at(time_s + DERIVATIVE_STEP_S) - rate) / DERIVATIVE_STEP_S
        return propagate(find_base_motion(self._site), [(cos(angle), sin(angle))], (rate,), (change,), (SHAFT,))

    def frames_at(self, time_s: float) -> Sequence[tuple[Rotation, Vector]]:
        """Return the frames of the servo's base and of its shaft."""
        angle, origin = self.servo.angle_at(time_s), (0.0, 0.0, 0.0)
        identity = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        c, s = cos(angle), sin(angle)
        return [(identity, origin), (((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)), origin)]
