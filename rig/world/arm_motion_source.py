"""The simulated arm as the source of motion: its controller, and the true motion of its flange."""

from functools import partial
from math import pi, radians
from random import Random

from rig.config.models import RigConfig
from rig.config.world.laboratory import SimulatedArmSection, WorldSection
from rig.world.magnetic_field import Frames
from rig.world.site import build_site
from rig.world.ur10e.faults import AtProgramStart
from rig.world.ur10e.motion.arm_models import select_model
from rig.world.ur10e.motion.encoders import Encoders
from rig.world.ur10e.motion.flange_motion import BodyMotion, Components
from rig.world.ur10e.motion.joint_drive import build_drive
from rig.world.ur10e.motion.joint_motion import JointMotion
from rig.world.ur10e.motion.ripple import draw_ripple
from rig.world.ur10e.motion.true_arm import TrueArm, build_calibrated_links
from rig.world.ur10e.motion.vibration import WRISTS, Vibration
from rig.world.ur10e.pose_log import PoseLog
from rig.world.ur10e.robot import Robot, RobotIdentity

JOINTS = 6


class ArmMotionSource:
    """A `MotionSource`: the `robot` to which clients talk, and the `arm` as it really moves."""

    def __init__(self, config: RigConfig, world: WorldSection) -> None:
        """Build the controller and the true arm from their sections, with errors drawn by the world's seed."""
        arm = world.arm
        random = Random(world.seed)
        model = select_model(arm, config.arm.model)
        ripples = [draw_ripple(arm.vibration_fraction, arm.vibration_cycles_per_turn, random) for _ in range(JOINTS)]
        motion = JointMotion(
            [radians(angle) for angle in arm.start_deg or config.arm.home_deg or model.home_deg],
            ripples,
            Encoders(
                model.encoder_step_rad if arm.encoder_step_rad is None else arm.encoder_step_rad,
                arm.encoder_noise_rad,
                arm.encoder_speed_noise_rad_s,
                partial(Random(f"jitter {world.seed}").gauss, 0.0, arm.state_jitter_s) if arm.state_jitter_s else None,
                world.seed,
            ),
            memory_s=1e-3 * max(max(s.delay_ms, s.accelerometer.delay_ms) for s in world.sensors.values()),
            drive=build_drive(arm.drive, world.seed),
            vibration=_build_vibration(arm, world.seed),
            speed_limit_rad_s=model.speed_rad_s,
        )
        self.arm = TrueArm(arm, build_site(world.site), motion, random, model.nominal)
        about_x, about_y, about_z = arm.tcp_rotation_deg
        self.robot = Robot(
            RobotIdentity(arm.serial_number, model.polyscope),
            motion,
            arm.remote_control,
            arm.speed_slider,
            build_calibrated_links(arm.calibration, nominal=model.nominal),
            model=model,
            tool_rotation_rad=(radians(about_x), radians(about_y), radians(about_z)),
        )

        self._log = None if arm.log is None else PoseLog(arm.log, world.seed)
        if arm.fieldbus is not None:
            stop = self.robot.protective_stop
            if arm.fieldbus.stop == "program":
                stop = partial(self.robot.stop_program, "stopped by the fieldbus")
            self.robot.faults.at_program_start = AtProgramStart(stop, arm.fieldbus.after_s)

    @property
    def time_s(self) -> float:
        """The world's time at the end of the last tick, s."""
        return self.arm.true_time_s(self.robot.time_s)

    @property
    def tick_s(self) -> float:
        """The duration of a tick, s. It is 2 ms on the controller's clock, which has an error."""
        return self.arm.tick_s

    @property
    def waiting(self) -> bool:
        """Whether the arm stays at rest until a client acts."""
        return self.robot.waiting

    @property
    def ideal(self) -> bool:
        """Whether the arm has no errors and the ground is still: `rate_at` then gives all that gyroscopes sense."""
        return self.arm.ideal

    def step(self) -> None:
        """Simulate one tick."""
        self.robot.step()
        self.arm.step(self.robot.time_s)
        if self._log is not None and self._log.is_due(self.time_s):
            self._log.write(self.time_s, self.robot.tcp_pose(self.robot.motion.actual_q_rad))

    def rate_at(self, time_s: float) -> Components:
        """Return the flange's angular rate in its own frame, rad/s, if `ideal`."""
        return self.arm.rate_at(time_s)

    def motion_at(self, time_s: float) -> BodyMotion:
        """Return the motion of the flange."""
        return self.arm.motion_at(time_s)

    def frames_at(self, time_s: float) -> Frames:
        """Return the frames of base and links, the flange last: rotation matrix to the base's axes, and position, m."""
        return self.arm.frames_at(time_s)


def _build_vibration(arm: SimulatedArmSection, seed: int) -> Vibration | None:
    if not arm.vibration_measured_rms_rad_s:
        return None
    random = Random(f"vibration {seed}")
    phases_rad = [random.uniform(0.0, 2.0 * pi) for _ in WRISTS]
    return Vibration(arm.vibration_measured_rms_rad_s, [(2.0 * pi * arm.vibration_measured_hz, phases_rad)])
