"""What sweeps have alike, whatever turns: how one goes, the ways between them, and the stages. Pure."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

from rig.config.procedures.servo_procedure import ServoStageSection
from rig.config.procedures.stage_section import StageSection, mount_matrix
from rig.config.section import Direction, Vector3
from rig.motion.state import Joints
from rig.motion.steps import Plan, Rest, Stage, Step, Sweep, Transfer, trapezoid_duration
from rig.plans.motions.ways import Pace, transfer

Mounted = tuple[StageSection | ServoStageSection, Sequence[Sweep]]  # a stage of the file, and its sweeps


@dataclass(frozen=True, slots=True)
class Station:
    """A joint that is swept, and the pose around which it turns."""

    joint: int
    joint_name: str
    pose_q_rad: Joints

    def turned(self, by_rad: float) -> Joints:
        """The pose with the joint turned from it."""
        pose, joint = self.pose_q_rad, self.joint
        return (*pose[:joint], pose[joint] + by_rad, *pose[joint + 1 :])


@dataclass(frozen=True, slots=True)
class Profile:
    """The course of a sweep: a ramp, `even_rad` at constant speed with `averaged_rad` in the middle, a ramp."""

    averaged_rad: float
    even_rad: float
    pace: Pace


def sweep_about(index: int, station: Station, direction: Direction, axis_flange: Vector3, profile: Profile) -> Sweep:
    """The sweep in that direction, in which the flange turns about that axis."""
    speed, acceleration = profile.pace.speed_rad_s, profile.pace.acceleration_rad_s2
    half, half_travel = profile.averaged_rad / 2, profile.even_rad / 2 + speed**2 / (2 * acceleration)
    sign, centre = 1 if direction == "ccw" else -1, station.pose_q_rad[station.joint]
    return Sweep(
        index=index,
        joint=station.joint,
        joint_name=station.joint_name,
        direction=direction,
        axis_flange=axis_flange,
        start_q_rad=station.turned(-sign * half_travel),
        end_q_rad=station.turned(sign * half_travel),
        speed_rad_s=speed,
        acceleration_rad_s2=acceleration,
        duration_s=trapezoid_duration(2 * half_travel, speed, acceleration),
        revolution_rad=(centre - half, centre + half),
    )


def connected(
    sweeps: Sequence[Sweep], home: Joints, pace: Pace, rest_s: float, is_clear: Callable[[Joints, Joints], bool]
) -> Iterator[Step]:
    """Sweeps with the rests after them and the ways between, from home and back; through home where none is clear."""
    here = home
    for sweep in sweeps:
        if not is_clear(here, sweep.start_q_rad):
            yield from transfer("transfer home", here, home, pace)
            here = home
        yield from transfer(f"transfer to the start of {sweep.name}", here, sweep.start_q_rad, pace)
        yield sweep
        if rest_s > 0:
            yield Rest(f"rest after {sweep.name}", rest_s)
        here = sweep.end_q_rad
    yield from transfer("transfer home", here, home, pace)


def trial(there: str, back: str, station: Station, by_rad: float, pace: Pace) -> Iterator[Transfer]:
    """A small turn and back, called so: it shows how the item is mounted."""
    home, tried = station.pose_q_rad, station.turned(by_rad)
    for way in transfer(there, home, tried, pace):
        yield replace(way, tries=True)
    yield from transfer(back, tried, home, pace)


def in_stages(
    approach: Plan,
    mounted: Iterable[Mounted],
    steps_of: Callable[[Sequence[Sweep]], Iterable[Step]],
    done: Collection[int],
) -> Plan:
    """The approach, then every stage: the steps of those of its sweeps that are not `done`, from home and back.

    The sweeps are counted through all stages. A stage of which nothing is left to do has no steps.
    """
    steps, stages, places = list(approach.steps), list[Stage](), count()
    for section, sweeps in mounted:
        own = [replace(sweep, index=next(places)) for sweep in sweeps]
        first, second, third = ((x, y, z) for x, y, z in mount_matrix(section.mount).tolist())
        indices = frozenset(sweep.index for sweep in own)
        stages.append(Stage((first, second, third), section.instruction, indices, begins=len(steps)))
        if left := [sweep for sweep in own if sweep.index not in done]:
            steps += steps_of(left)
    return replace(approach, steps=tuple(steps), stages=tuple(stages))
