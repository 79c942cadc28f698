"""The arm's true motion, which its controller does not know: its flange's motion in the world's time."""

from math import pi
from random import Random

from rig.config.world.laboratory import CalibrationSection, SimulatedArmSection
from rig.world.clock import TICK_S
from rig.world.site import SiteTruth
from rig.world.ur10e.motion.flange_motion import BodyMotion, find_base_motion, find_cosines, propagate
from rig.world.ur10e.motion.forward_kinematics import Rotation, Vector, flange_rate, frames
from rig.world.ur10e.motion.joint_errors import Errors, JointErrors
from rig.world.ur10e.motion.joint_motion import JointMotion
from rig.world.ur10e.motion.links import UR10E, ZERO6, Links, LinkSizes, links
from rig.world.ur10e.motion.trajectory import Joints

NO_MOTION: Vector = (0.0, 0.0, 0.0)
WRIST = 3  # the first joint that vibrates: those before it are mostly at rest


def build_calibrated_links(
    calibration: CalibrationSection, twist_rad: tuple[float, ...] = ZERO6, nominal: LinkSizes = UR10E
) -> Links:
    """Return the links as the maker measured them or, with errors `twist_rad` unknown to the maker, the true links."""
    return links(
        calibration.delta_theta_rad,
        [1e-3 * length for length in calibration.delta_a_mm],
        [1e-3 * length for length in calibration.delta_d_mm],
        [alpha + twist for alpha, twist in zip(calibration.delta_alpha_rad, twist_rad, strict=True)],
        nominal,
    )


class TrueArm:
    """The true positions of the joints that `motion` plays. Times are the world's; the controller's clock has an error.

    `ideal`: the arm has its nominal geometry, on ground that does not rotate, so rate alone describes its motion.
    """

    def __init__(
        self, arm: SimulatedArmSection, site: SiteTruth, motion: JointMotion, random: Random, nominal: LinkSizes = UR10E
    ) -> None:
        self._motion, self._site = motion, site
        self._speed = 1.0 + 1e-6 * arm.clock_ppm
        self._links = build_calibrated_links(arm.calibration, arm.unmodelled.twist_rad, nominal)
        errors = _errors(arm)
        self._errors = JointErrors(errors, random) if errors.any else None
        self._at_rest: BodyMotion | None = None
        # The inner joints' state and the forearm's motion.
        self._forearm: tuple[tuple[Joints, ...], BodyMotion] = ((), find_base_motion(site))
        self.ideal = (
            self._speed == 1.0
            and self._links == links(nominal=nominal)
            and self._errors is None
            and motion.vibration is None
            and not any(site.earth_rate_rad_s)
        )

    @property
    def tick_s(self) -> float:
        """The true duration of the controller's tick of 2 ms, s."""
        return TICK_S / self._speed

    def true_time_s(self, controller_s: float) -> float:
        """Return the true time at which the controller's clock reads `controller_s`."""
        return controller_s / self._speed

    def step(self, controller_s: float) -> None:
        """Update the arm after a tick of the controller."""
        if not self._motion.still:
            self._at_rest = None
            if self._errors is not None:
                self._errors.step(controller_s, self._motion.smooth_qd_rad_s, lambda: self._motion.q_rad)

    def rate_at(self, time_s: float) -> Vector:
        """Return the angular rate of an ideal arm's flange in its own frame, rad/s, at a time within the last tick."""
        return NO_MOTION if self._motion.still else flange_rate(*self._motion.joints_at(time_s), self._links)

    def motion_at(self, time_s: float) -> BodyMotion:
        """Return the motion of the flange at a time within the last tick or the motion's memory."""
        controller_s = time_s * self._speed
        is_resting = (
            self._motion.still
            and self._motion.vibration is None
            and (self._errors is None or self._errors.is_quiet(controller_s))
        )
        if is_resting and self._at_rest is not None:
            return self._at_rest
        q, qd, qdd = self._joints_at(controller_s)
        if self._speed != 1.0:  # the controller's clock differs from the world's
            speed, squared = self._speed, self._speed**2
            qd, qdd = tuple([v * speed for v in qd]), tuple([a * squared for a in qdd])
        inner = q[:WRIST], qd[:WRIST], qdd[:WRIST]
        if self._forearm[0] != inner:
            forearm = self._links[:WRIST]
            base = find_base_motion(self._site)
            self._forearm = inner, propagate(base, find_cosines(inner[0], forearm), *inner[1:], forearm)
        wrist = self._links[WRIST:]
        now = propagate(self._forearm[1], find_cosines(q[WRIST:], wrist), qd[WRIST:], qdd[WRIST:], wrist)
        self._at_rest = now if is_resting else None
        return now

    def frames_at(self, time_s: float) -> list[tuple[Rotation, Vector]]:
        """Return the frames of base and links, the flange last: rotation matrix to the base's axes, and position, m."""
        q, _, _ = self._joints_at(time_s * self._speed)
        return list(frames(q, self._links))

    def _joints_at(self, controller_s: float) -> tuple[Joints, Joints, Joints]:
        """Return angles, speeds and accelerations of the joints at the controller's time `controller_s`."""
        joints, visible = self._motion.state_at(controller_s), self._motion.vibration
        if self._errors is not None:
            joints = self._errors.true_state(controller_s, *joints)
        return joints if visible is None else visible.add(controller_s, *joints)


def _errors(section: SimulatedArmSection) -> Errors:
    unmodelled = section.unmodelled
    return Errors(
        unmodelled.zero_rad,
        unmodelled.encoder_once_rad,
        unmodelled.encoder_twice_rad,
        unmodelled.hysteresis_rad,
        [2.0 * pi * hertz for hertz in (section.vibration_hz, *section.vibration_further_hz)],
        section.vibration_rms_rad_s,
        section.settling_rad,
        2.0 * pi * section.settling_hz,
        section.settling_decay_s,
    )
