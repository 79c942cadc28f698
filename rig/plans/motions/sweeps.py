"""Sweeps of any turner: their course, the transfers between them, and the stages. Pure functions."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

from rig.config.procedures.servo_procedure import ServoStageSection
from rig.config.procedures.stage_section import StageSection, mount_matrix
from rig.config.section import Direction, Vector3
from rig.motion.steps import Plan, Rest, Stage, Step, Sweep, Transfer, trapezoid_duration
from rig.motion.turner_state import Joints
from rig.plans.motions.transfer_steps import Pace, transfer

Mounted = tuple[StageSection | ServoStageSection, Sequence[Sweep]]  # a stage of the configuration, and its sweeps


@dataclass(frozen=True, slots=True)
class SweepPose:
    """A joint that is swept, and the pose in the middle of its sweeps."""

    joint: int
    joint_name: str
    pose_q_rad: Joints

    def rotate_joint(self, by_rad: float) -> Joints:
        """Return the pose with the joint turned by `by_rad`."""
        pose, joint = self.pose_q_rad, self.joint
        return (*pose[:joint], pose[joint] + by_rad, *pose[joint + 1 :])


@dataclass(frozen=True, slots=True)
class Profile:
    """A sweep's course: a ramp, then `even_rad` at constant speed with `averaged_rad` in the middle, then a ramp."""

    averaged_rad: float
    even_rad: float
    pace: Pace


def sweep_about(index: int, station: SweepPose, direction: Direction, axis_flange: Vector3, profile: Profile) -> Sweep:
    """Return a sweep of the pose's joint in `direction`, about `axis_flange` in the flange's frame."""
    speed, acceleration = profile.pace.speed_rad_s, profile.pace.acceleration_rad_s2
    half, half_travel = profile.averaged_rad / 2, profile.even_rad / 2 + speed**2 / (2 * acceleration)
    sign, centre = 1 if direction == "ccw" else -1, station.pose_q_rad[station.joint]
    return Sweep(
        index=index,
        joint=station.joint,
        joint_name=station.joint_name,
        direction=direction,
        axis_flange=axis_flange,
        start_q_rad=station.rotate_joint(-sign * half_travel),
        end_q_rad=station.rotate_joint(sign * half_travel),
        speed_rad_s=speed,
        acceleration_rad_s2=acceleration,
        duration_s=trapezoid_duration(2 * half_travel, speed, acceleration),
        revolution_rad=(centre - half, centre + half),
    )


def connect_sweeps(
    sweeps: Sequence[Sweep], home: Joints, pace: Pace, rest_s: float, is_clear: Callable[[Joints, Joints], bool]
) -> Iterator[Step]:
    """Yield a transfer to each of the sweeps, the sweep, and a rest after it; finally the transfer home.

    A transfer leads through home if the direct way is not clear.
    """
    pose = home
    for sweep in sweeps:
        if not is_clear(pose, sweep.start_q_rad):
            yield from transfer("transfer home", pose, home, pace)
            pose = home
        yield from transfer(f"transfer to the start of {sweep.name}", pose, sweep.start_q_rad, pace)
        yield sweep
        if rest_s > 0:
            yield Rest(f"rest after {sweep.name}", rest_s)
        pose = sweep.end_q_rad
    yield from transfer("transfer home", pose, home, pace)


def trial(name: str, return_name: str, station: SweepPose, by_rad: float, pace: Pace) -> Iterator[Transfer]:
    """Yield a small turn called `name` and its reverse, `return_name`; they show how the item is mounted."""
    home, tried = station.pose_q_rad, station.rotate_joint(by_rad)
    for step in transfer(name, home, tried, pace):
        yield replace(step, tries=True)
    yield from transfer(return_name, tried, home, pace)


def build_stages(
    approach: Plan,
    mounted: Iterable[Mounted],
    steps_of: Callable[[Sequence[Sweep]], Iterable[Step]],
    done: Collection[int],
) -> Plan:
    """Return the plan `approach`, followed by the steps of every stage, which `steps_of` makes from the stage's sweeps.

    Sweeps are numbered through all stages; those in `done` are left out. A stage without remaining sweeps has no steps.
    """
    steps, stages, numbers = list(approach.steps), list[Stage](), count()
    for section, sweeps in mounted:
        indexed = [replace(sweep, index=next(numbers)) for sweep in sweeps]
        first, second, third = ((x, y, z) for x, y, z in mount_matrix(section.mount).tolist())
        indices = frozenset(sweep.index for sweep in indexed)
        stages.append(Stage((first, second, third), section.instruction, indices, begins=len(steps)))
        if remaining := [sweep for sweep in indexed if sweep.index not in done]:
            steps += steps_of(remaining)
    return replace(approach, steps=tuple(steps), stages=tuple(stages))
