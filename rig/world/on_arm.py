"""The simulated arm as what turns the sensors: its controller, and how its flange really moves."""

from functools import partial
from math import pi, radians
from random import Random

from rig.config.models import RigConfig
from rig.config.world.laboratory import SimulatedArmSection, WorldSection
from rig.world.magnetic_field import Frames
from rig.world.site import site_of
from rig.world.ur10e.motion.flange_motion import Components, Felt
from rig.world.ur10e.motion.joint_motion import Motion
from rig.world.ur10e.motion.models import simulated_model
from rig.world.ur10e.motion.ripple import ripple
from rig.world.ur10e.motion.true_arm import TrueArm, known_links
from rig.world.ur10e.motion.vibration import WRISTS, Vibration
from rig.world.ur10e.robot import Identity, Robot

JOINTS = 6


class OnArm:
    """A `Turning`: the `robot` that clients speak with, and the `arm` as it is."""

    def __init__(self, config: RigConfig, world: WorldSection) -> None:
        arm = world.arm
        random = Random(world.seed)
        model = simulated_model(arm, config.arm.model)
        ripples = [ripple(arm.vibration_fraction, arm.vibration_cycles_per_turn, random) for _ in range(JOINTS)]
        motion = Motion(
            [radians(angle) for angle in config.arm.home_deg or model.home_deg],
            ripples,
            arm.encoder_step_rad,
            memory_s=1e-3 * max(max(each.delay_ms, each.accelerometer.delay_ms) for each in world.sensors.values()),
            lateness_s=partial(Random(f"jitter {world.seed}").gauss, 0.0, arm.state_jitter_s)
            if arm.state_jitter_s
            else None,
            vibration=_seen_vibration(arm, world.seed),
            speed_limit_rad_s=model.speed_rad_s,
        )
        self.arm = TrueArm(arm, site_of(world.site), motion, random, model.drawing)
        about_x, about_y, about_z = arm.tcp_rotation_deg
        self.robot = Robot(
            Identity(arm.serial_number, model.polyscope),
            motion,
            arm.remote_control,
            arm.speed_slider,
            known_links(arm.calibration, drawing=model.drawing),
            model=model,
            tool_turn_rad=(radians(about_x), radians(about_y), radians(about_z)),
        )

    @property
    def time_s(self) -> float:
        """The world's time at the end of the last tick."""
        return self.arm.true_s(self.robot.time_s)

    @property
    def tick_s(self) -> float:
        """How long a tick lasts, which is 2 ms by the controller's clock."""
        return self.arm.tick_s

    @property
    def waiting(self) -> bool:
        """Whether nothing but a client can let the arm move."""
        return self.robot.waiting

    @property
    def ideal(self) -> bool:
        """Whether the rate is all that anybody can feel of it."""
        return self.arm.ideal

    def step(self) -> None:
        """One tick of it."""
        self.robot.step()
        self.arm.step(self.robot.time_s)

    def rate_at(self, time_s: float) -> Components:
        """Angular rate of the flange, rad/s, as `Turning` says."""
        return self.arm.rate_at(time_s)

    def felt_at(self, time_s: float) -> Felt:
        """All that a body on the flange feels, as `Turning` says."""
        return self.arm.felt_at(time_s)

    def frames_at(self, time_s: float) -> Frames:
        """Rotations and places of the arm's bodies, as `Turning` says."""
        return self.arm.frames_at(time_s)


def _seen_vibration(arm: SimulatedArmSection, seed: int) -> Vibration | None:
    if not arm.vibration_measured_rms_rad_s:
        return None
    random = Random(f"vibration {seed}")
    phases_rad = [random.uniform(0.0, 2.0 * pi) for _ in WRISTS]
    return Vibration(arm.vibration_measured_rms_rad_s, [(2.0 * pi * arm.vibration_measured_hz, phases_rad)])
