"""The sweeps of SIX, Section III, around the home pose, with the ways between them and the rests after them."""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import permutations, product

import numpy as np

from rig.config.models import ArmSection
from rig.config.procedure_sections import SixSweepsSection
from rig.config.section import Direction
from rig.config.servo_procedure import AXES_SPAN
from rig.config.stage_section import Wrist, mount_matrix
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.motion.carried import carried_by
from rig.motion.geometry import flange_axes
from rig.motion.keep_out import keeps_clear
from rig.motion.model import home_of, model_of
from rig.motion.state import JOINT_NAMES, Joints
from rig.motion.steps import Plan, Rest, Stage, Step, Sweep, Transfer, trapezoid_duration
from rig.plans.drift import drift_effect
from rig.plans.ways import approach, transfer

USUAL_ORDER: tuple[Wrist, ...] = ("wrist_3", "wrist_1", "wrist_2")  # that of the paper
BOTH_WAYS: tuple[Direction, Direction] = ("cw", "ccw")
WORTHWHILE = 2 / 3  # an order that is not better by a third is not worth leaving the paper's
# Of a stage's mounting: far enough to stand out from any gyroscope's noise, and a hand gets out of the way.
TRIAL_RAD, TRIAL_SPEED_RAD_S, TRIAL_RAD_S2 = math.radians(10), math.radians(15), math.radians(60)
DIGITS = 9  # equally good but for rounding: the first of them is chosen, on every machine
WRIST_1, WRIST_2, WRIST_3 = (JOINT_NAMES.index(name) for name in ("wrist_1", "wrist_2", "wrist_3"))


@dataclass(frozen=True, slots=True)
class Station:
    """A wrist that is swept, and the pose around which it turns."""

    joint: int
    pose_q_rad: Joints


@dataclass(frozen=True, slots=True)
class Order:
    """`stations` one after the other, each in its `ways`; these are reversed every other time where `turning`."""

    stations: tuple[Station, ...]
    ways: tuple[tuple[Direction, ...], ...]
    turning: bool


def plan_six_observation(
    arm: ArmSection,
    procedure: SixSweepsSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """The movement of SIX, Section III: each wrist in its order turns one way, rests, turns back, rests.

    With `axes: 6` wrist 1 turns about three axes more, with wrists 2 and 3 turned; with several speeds all of it is
    made at each. A sweep turns by `arc_deg` about the home pose, once round if nothing else is said. What the file
    leaves open of order and directions is chosen so that a steady drift of the bias does least harm (`drift_effect`).
    The whole series repeats `procedure.repeats` times.
    `start_q_rad` is where the arm stands (home when None); from there the plan goes home first, slowly, and it ends
    at home.
    `done` holds the indices of sweeps to leave out: those an interrupted run has finished. Where the item is mounted in
    several stages, all of it is done in each, of the wrists that are swept there.
    Limits are not judged here: see the turner's `problems`.
    Raises Refused `axes_do_not_span`.
    """
    home = home_of(arm)
    start = home if start_q_rad is None else start_q_rad
    swept = _ordered_sweeps(arm, procedure)
    if procedure.mountings:
        return _in_stages(swept, start, arm, procedure, done)
    _check_span(flange_axes(home)[:, [WRIST_1, WRIST_2, WRIST_3]])
    sweeps = [sweep for sweep in swept if sweep.index not in done]
    steps = tuple(_connected(sweeps, start, home, arm, procedure))
    return Plan(steps, start_q_rad=start, home_q_rad=home)


def sets_of_sweeps(arm: ArmSection, procedure: SixSweepsSection) -> Iterator[list[Step]]:
    """The steps of each repeat: its sweeps with the ways between them and the rests, from home and back there.

    Raises Refused `axes_do_not_span`.
    """
    home = home_of(arm)
    _check_span(flange_axes(home)[:, [WRIST_1, WRIST_2, WRIST_3]])
    swept = _ordered_sweeps(arm, procedure)
    in_each = len(swept) // procedure.repeats
    for first in range(0, len(swept), in_each):
        yield list(_connected(swept[first : first + in_each], home, home, arm, procedure))


def approach_home(arm: ArmSection, procedure: SixSweepsSection, start: Joints) -> Iterable[Step]:
    """The way home from where the arm stands, slowly."""
    return _connected((), start, home_of(arm), arm, procedure)


def _check_span(axes: Array) -> None:
    """Six parameters can be told only from turns about three independent axes (3, n)."""
    if axes.shape[1] < 3 or np.linalg.svd(axes, compute_uv=False)[2] < AXES_SPAN:
        raise Refused(
            "axes_do_not_span",
            "the swept wrists do not turn the sensors about three independent axes",
            "Set wrist 2 in arm.home_deg near 90 or -90, and sweep all three wrists or mount the item in more ways",
        )


def _in_stages(
    swept: Sequence[Sweep], start: Joints, arm: ArmSection, procedure: SixSweepsSection, done: Collection[int]
) -> Plan:
    """The sweeps of every stage after a trial of its mounting; each stage begins and ends at home.

    A stage of which nothing is left to do has no steps. Raises Refused `axes_do_not_span`.
    """
    home = home_of(arm)
    steps: list[Step] = list(_connected((), start, home, arm, procedure))
    stages: list[Stage] = []
    axes: list[Array] = []
    index = 0
    for section in procedure.mountings:
        mount = mount_matrix(section.mount)
        wrists = section.sweeps or USUAL_ORDER
        own = [
            replace(sweep, index=index + place)
            for place, sweep in enumerate(each for each in swept if each.joint_name in wrists)
        ]
        index += len(own)
        axes += [mount @ axis for axis in dict.fromkeys(sweep.axis_flange for sweep in own if sweep.direction == "ccw")]
        first, second, third = ((x, y, z) for x, y, z in mount.tolist())
        indices = frozenset(sweep.index for sweep in own)
        stages.append(Stage((first, second, third), section.instruction, indices, begins=len(steps)))
        if left := [sweep for sweep in own if sweep.index not in done]:
            steps += [*_trials(left, home), *_connected(left, home, home, arm, procedure)]
    _check_span(np.array(axes).T)
    return Plan(tuple(steps), start_q_rad=start, home_q_rad=home, stages=tuple(stages))


def _trials(sweeps: Sequence[Sweep], home: Joints) -> Iterator[Transfer]:
    """A small turn of each joint that is to be swept, and back: it shows how the item is mounted."""
    for joint in dict.fromkeys(sweep.joint for sweep in sweeps):
        there = _with_joint(home, joint, home[joint] + TRIAL_RAD)
        for name, here, target in (("trial", home, there), ("back from the trial", there, home)):
            for way in transfer(f"{name} of {JOINT_NAMES[joint]}", here, target, TRIAL_SPEED_RAD_S, TRIAL_RAD_S2):
                yield replace(way, tries=target is there)


@lru_cache(maxsize=16)
def _ordered_sweeps(arm: ArmSection, procedure: SixSweepsSection) -> tuple[Sweep, ...]:
    """All sweeps in the order the file names, or else the best one: the ways first, then the order of the wrists."""
    home = home_of(arm)

    def harm(order: Order) -> float:
        trial = procedure.model_copy(update={"repeats": min(procedure.repeats, 2)})  # more of them repeat these
        return round(drift_effect(tuple(_connected(_sweeps(order, trial), home, home, arm, trial))), DIGITS)

    def best(orders: Sequence[Order]) -> Order:
        first, *others = ((harm(order), order) for order in orders) if len(orders) > 1 else [(0.0, orders[0])]
        least = min(others, key=lambda each: each[0], default=first)
        return least[1] if least[0] < WORTHWHILE * first[0] else first[1]

    chosen = best(list(_ways(_stations(home, procedure, procedure.order or USUAL_ORDER), procedure)))
    if procedure.order is None:
        ways = dict(zip(chosen.stations, chosen.ways, strict=True))
        others = [_stations(home, procedure, each) for each in permutations(USUAL_ORDER)]
        chosen = best([Order(each, tuple(ways[station] for station in each), chosen.turning) for each in others])
    return tuple(_sweeps(chosen, procedure))


def _stations(home: Joints, procedure: SixSweepsSection, order: Sequence[str]) -> tuple[Station, ...]:
    """What is swept, in the order of the wrists; what wrist 1 does with the others turned follows its own sweep.

    Wrist 2 is turned by 45° so that the flange comes away from the forearm, never towards it.
    """
    away = math.radians(-45 if math.sin(home[WRIST_2]) > 0 else 45)
    turned = ((away, 0.0), (away, math.pi / 2), (0.0, math.pi / 4)) if procedure.axes == 6 else ()
    stations = []
    for joint in map(JOINT_NAMES.index, order):
        stations.append(Station(joint, home))
        if joint == WRIST_1:
            stations += [
                Station(joint, (*home[:WRIST_2], home[WRIST_2] + second, home[WRIST_3] + third))
                for second, third in turned
            ]
    return tuple(stations)


def _ways(stations: tuple[Station, ...], procedure: SixSweepsSection) -> Iterator[Order]:
    """Every permissible choice of directions, the paper's first."""
    if procedure.directions is not None:
        yield Order(stations, (procedure.directions,) * len(stations), turning=False)
        return
    several = procedure.repeats * len(procedure.speeds) > 1
    for turning in (False, True) if several else (False,):
        for ways in product((BOTH_WAYS, BOTH_WAYS[::-1]), repeat=len(stations)):
            yield Order(stations, ways, turning)


def _sweeps(order: Order, procedure: SixSweepsSection) -> list[Sweep]:
    """The sweeps one after the other: repeat by repeat, speed by speed, station by station."""
    sweeps: list[Sweep] = []
    for turn, speed_deg_s in enumerate(procedure.speeds * procedure.repeats):
        for station, ways in zip(order.stations, order.ways, strict=True):
            for direction in ways[::-1] if order.turning and turn % 2 else ways:
                sweeps.append(_sweep(len(sweeps), station, direction, speed_deg_s, procedure))
    return sweeps


def _sweep(
    index: int, station: Station, direction: Direction, speed_deg_s: float, procedure: SixSweepsSection
) -> Sweep:
    joint, pose = station.joint, station.pose_q_rad
    speed, acceleration = math.radians(speed_deg_s), math.radians(procedure.acceleration_deg_s2)
    half = math.radians(procedure.arc_deg) / 2
    half_travel = half + math.radians(procedure.margin_deg) + speed**2 / (2 * acceleration)
    sign = 1 if direction == "ccw" else -1
    x, y, z = (sign * axis for axis in _axis(station))
    return Sweep(
        index=index,
        joint=joint,
        joint_name=JOINT_NAMES[joint],
        direction=direction,
        axis_flange=(x, y, z),
        start_q_rad=_with_joint(pose, joint, pose[joint] - sign * half_travel),
        end_q_rad=_with_joint(pose, joint, pose[joint] + sign * half_travel),
        speed_rad_s=speed,
        acceleration_rad_s2=acceleration,
        duration_s=trapezoid_duration(2 * half_travel, speed, acceleration),
        revolution_rad=(pose[joint] - half, pose[joint] + half),
    )


@lru_cache(maxsize=64)
def _axis(station: Station) -> tuple[float, float, float]:
    """The joint's axis in the flange's frame, of a growing angle."""
    x, y, z = flange_axes(station.pose_q_rad)[:, station.joint].tolist()
    return x, y, z


def _connected(
    sweeps: Sequence[Sweep], start: Joints, home: Joints, arm: ArmSection, procedure: SixSweepsSection
) -> Iterable[Step]:
    """Sweeps with the rests after them and a transfer wherever the arm is not yet where the next one begins.

    It leads through home where the straight way takes the flange or its payload to the forearm, as wrists 1 and 2 may
    when they turn together.
    """
    speed, acceleration = math.radians(arm.transfer_speed_deg_s), math.radians(procedure.acceleration_deg_s2)
    yield from approach(start, home, speed, acceleration)
    here, carried, model = home, carried_by(arm), model_of(arm)
    for sweep in sweeps:
        if not _clear(here, sweep.start_q_rad, carried, model):
            yield from transfer("transfer home", here, home, speed, acceleration)
            here = home
        yield from transfer(f"transfer to the start of {sweep.name}", here, sweep.start_q_rad, speed, acceleration)
        yield sweep
        if procedure.rest_s > 0:
            yield Rest(f"rest after {sweep.name}", procedure.rest_s)
        here = sweep.end_q_rad
    yield from transfer("transfer home", here, home, speed, acceleration)


_clear = lru_cache(maxsize=1024)(keeps_clear)  # the search for the best order asks for the same ways again and again


def _with_joint(q_rad: Joints, joint: int, angle_rad: float) -> Joints:
    return (*q_rad[:joint], angle_rad, *q_rad[joint + 1 :])
