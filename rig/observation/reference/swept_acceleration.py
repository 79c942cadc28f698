"""The first harmonic of an accelerometer's readings in sweeps, over the measured joint angle."""

from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rig.data.recording.settings import RunSettings
from rig.estimation.arrays import Array
from rig.estimation.reference.sweep_harmonics import FirstHarmonic, JointTurn, estimate_acceleration, first_harmonic
from rig.motion.geometry import flange_arm, flange_attitude
from rig.motion.steps import Sweep
from rig.observation.average import Stream, slice_time
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.motion.revolution import Revolution, describe
from rig.observation.reference.dwell_acceleration import accelerations, check_acceleration, gravity_difference
from rig.observation.reference.sway import sway_acceleration
from rig.observation.statistics.vibration_noise import fit_inflation, line_columns


@dataclass(frozen=True, slots=True)
class SweptAcceleration:
    """The first harmonic of an accelerometer's readings in the sweep `sweep` of the plan, over the joint's angle.

    The angle counts from the turn's start, where `attitude` (3, 3) transforms a vector from the arm's base frame to the
    flange's. In the flange's frame, `axis_flange` (3,) is the unit vector of the joint's positive rotation, and `arm_m`
    (3,) leads from the axis to the flange's origin. `station`: the `joint`, from 0 at the base, then the other joints'
    angles, rad, rounded.
    """

    sweep: int
    joint: int
    harmonic: FirstHarmonic
    attitude: Array
    axis_flange: Array
    arm_m: Array
    station: tuple[float, ...]


def swept_acceleration(
    stream: Stream, motion: ArmMotion, sweep: Sweep, turn: Revolution, settings: RunSettings
) -> SweptAcceleration:
    """Return the first harmonic of one sweep's revolution, fitted together with its vibrations.

    In the model only the sweep's joint moves, and the other joints stand at their mean angles. In truth these sway a
    little, as the encoders show, and so tilt and accelerate the sensor. The specific force of this sway is added to the
    model. Raise Fault `saturation`, `stuck_sensor`, `incomplete_revolution` or `not_finite`.
    """
    inside = slice_time(stream, turn.start_s, turn.end_s)
    check_acceleration(stream, inside, describe(sweep), turning=True)
    time_s = stream.time_s[inside]
    covered = motion.covered(time_s)
    time_s = time_s[covered]
    pose_rad = motion.angles(time_s).mean(axis=0)
    axis = motion.axes(pose_rad)[:, sweep.joint]
    turns = np.arange(len(pose_rad)) == sweep.joint
    steady_rad = np.where(turns, motion.angles(np.append(turn.start_s, time_s)), pose_rad)
    began, steady = np.split(motion.mount @ flange_attitude(steady_rad, motion.kinematics), [1])
    angle_rad = steady_rad[1:, sweep.joint] - steady_rad[0, sweep.joint]
    attitudes = motion.attitudes(time_s)
    by_gravity = gravity_difference(attitudes, steady, stream.sensor, settings.site)
    window_s, extension_m = (turn.start_s, turn.end_s), np.array(settings.extension_m)
    swayed = sway_acceleration(motion, sweep.joint, pose_rad, time_s, window_s=window_s, extension_m=extension_m)
    arm_m = motion.mount @ flange_arm(pose_rad, sweep.joint, motion.kinematics)
    centripetal = turn.speed_rad_s**2 * (np.outer(axis, axis) - np.eye(3)) @ (arm_m + motion.mount @ extension_m)
    # The sway also tilts the sensor against the centripetal acceleration of the turn.
    swayed += (attitudes @ steady.swapaxes(1, 2) - np.eye(3)) @ centripetal
    acceleration = estimate_acceleration(partial(motion.angle, sweep), time_s, sweep.speed_rad_s)
    harmonic = first_harmonic(
        time_s,
        accelerations(stream, inside)[covered],
        JointTurn(sweep.growing * turn.speed_rad_s, angle_rad, acceleration),
        by_gravity + swayed @ np.array(stream.sensor.mounting).T,
        coloured=fit_inflation,
        swings=line_columns,
    )
    in_pose = replace(turn, attitude=began[0], axis_flange=sweep.growing * axis, arm_m=arm_m)
    return turn_harmonic(sweep, in_pose, harmonic)


def turn_harmonic(sweep: Sweep, turn: Revolution, harmonic: FirstHarmonic) -> SweptAcceleration:
    """Return the first harmonic of a sweep together with the arm's attitude, the joint's axis, and the station."""
    return SweptAcceleration(
        sweep=sweep.index,
        joint=sweep.joint,
        harmonic=harmonic,
        attitude=turn.attitude,
        axis_flange=sweep.growing * turn.axis_flange,
        arm_m=turn.arm_m,
        station=turn.station,
    )
