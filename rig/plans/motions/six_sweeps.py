"""The sweeps of the paper SIX, Section III, around the home pose, with transfers between them and rests after them."""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations, product

import numpy as np

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixSweepsSection
from rig.config.procedures.servo_procedure import MIN_AXES_SPAN
from rig.config.procedures.stage_section import Wrist, mount_matrix
from rig.config.section import Direction, Vector3
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.motion.carried import read_load
from rig.motion.geometry import flange_axes
from rig.motion.keep_out import keeps_clear
from rig.motion.model import find_home, model_of
from rig.motion.steps import Plan, Step, Sweep
from rig.motion.turner_state import JOINT_NAMES, Joints
from rig.plans.motions.steady_drift import drift_effect
from rig.plans.motions.sweeps import Mounted, Profile, SweepPose, build_stages, connect_sweeps, sweep_about, trial
from rig.plans.motions.transfer_steps import append_steps, approach, pace_of

USUAL_ORDER: tuple[Wrist, ...] = ("wrist_3", "wrist_1", "wrist_2")  # the order in the paper
BOTH_WAYS: tuple[Direction, Direction] = ("cw", "ccw")
MAX_WORTHWHILE_RATIO = 2 / 3  # an order must be better by a third to replace the paper's
# Trial of a stage's mounting: large enough to exceed any gyroscope's noise, and slow enough to take a hand away.
TRIAL_RAD, TRIAL_PACE = math.radians(10), pace_of(15, 60)
COMPARED_DIGITS = 9  # orders that differ only by rounding are equal: the first of them is chosen, on every machine
WRIST_1, WRIST_2, WRIST_3 = (JOINT_NAMES.index(name) for name in ("wrist_1", "wrist_2", "wrist_3"))


@dataclass(frozen=True, slots=True)
class Order:
    """An order of sweeps: passes through the poses `stations`, in each of which the joint turns in its `directions`.

    There is a pass for every speed of every repeat. `alternates`: whether every second pass reverses the directions.
    """

    stations: tuple[SweepPose, ...]
    directions: tuple[tuple[Direction, ...], ...]
    alternates: bool


def plan_six_observation(
    arm: ArmSection, procedure: SixSweepsSection, start_q_rad: Joints | None = None, done: Collection[int] = ()
) -> Plan:
    """Return the plan of the paper SIX, Section III: each wrist in turn rotates, rests, rotates back, rests.

    With `axes: 6` wrist 1 turns about three more axes, with wrists 2 and 3 turned. With several speeds, all sweeps are
    made at each speed. A sweep turns by `arc_deg` about the home pose, one revolution by default. An order and
    directions that the file leaves open are chosen for the least effect of a steady drift of the bias (`drift_effect`).
    The whole series repeats `procedure.repeats` times, and does so in each stage, with the wrists of that stage.
    `start_q_rad` is the arm's pose (home if None); from there the plan first goes home slowly, and it ends at home.
    `done`: the indices of finished sweeps, which are left out. The turner's `problems` checks limits. Raise Refused
    `axes_do_not_span`.
    """
    home = find_home(arm)
    swept = _order_sweeps(arm, procedure)
    before = approach(start_q_rad, home, pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2))
    if not procedure.mountings:
        _check_span(flange_axes(home)[:, [WRIST_1, WRIST_2, WRIST_3]])
        remaining = [sweep for sweep in swept if sweep.index not in done]
        return append_steps(before, _connect(remaining, arm, procedure))
    mounted = [
        (section, [sweep for sweep in swept if sweep.joint_name in (section.sweeps or USUAL_ORDER)])
        for section in procedure.mountings
    ]
    _check_span(np.array(list(_axes_of_items(mounted))).T)
    return build_stages(
        before, mounted, lambda remaining: (*_trials(remaining, home), *_connect(remaining, arm, procedure)), done
    )


def _check_span(axes: Array) -> None:
    """Raise Refused `axes_do_not_span` unless the axes (3, n) of the turns span all directions."""
    if axes.shape[1] < 3 or np.linalg.svd(axes, compute_uv=False)[2] < MIN_AXES_SPAN:
        raise Refused(
            "axes_do_not_span",
            "the swept wrists do not turn the sensors about three independent axes",
            "Set wrist 2 in arm.home_deg near 90 or -90, and sweep all three wrists or use more mountings",
        )


def _axes_of_items(mounted: Iterable[Mounted]) -> Iterator[Array]:
    """Yield the axes (3,) of the sweeps of each stage, in the item's frame."""
    for section, sweeps in mounted:
        for axis in dict.fromkeys(sweep.axis_flange for sweep in sweeps if sweep.direction == "ccw"):
            yield mount_matrix(section.mount) @ axis


def _trials(sweeps: Sequence[Sweep], home: Joints) -> Iterator[Step]:
    """Yield a small turn of each swept joint and back, by which the sensors show how the item is mounted."""
    for joint, name in dict.fromkeys((sweep.joint, sweep.joint_name) for sweep in sweeps):
        station = SweepPose(joint, name, home)
        yield from trial(f"trial of {name}", f"back from the trial of {name}", station, TRIAL_RAD, TRIAL_PACE)


@lru_cache(maxsize=16)
def _order_sweeps(arm: ArmSection, procedure: SixSweepsSection) -> tuple[Sweep, ...]:
    """Return all sweeps in the order that the file states, or else in the order with the least effect of a drift."""
    home = find_home(arm)

    def harm(order: Order) -> float:
        sweeps = _sweeps(order, procedure, min(procedure.repeats, 2))  # further repeats are the same
        return round(drift_effect(tuple(_connect(sweeps, arm, procedure))), COMPARED_DIGITS)

    def best(orders: Sequence[Order]) -> Order:
        first, *others = ((harm(order), order) for order in orders) if len(orders) > 1 else [(0.0, orders[0])]
        least = min(others, key=lambda candidate: candidate[0], default=first)
        return least[1] if least[0] < MAX_WORTHWHILE_RATIO * first[0] else first[1]

    chosen = best(list(_list_orders(_stations(home, procedure, procedure.order or USUAL_ORDER), procedure)))
    if procedure.order is None:
        directions = dict(zip(chosen.stations, chosen.directions, strict=True))
        others = [_stations(home, procedure, candidate) for candidate in permutations(USUAL_ORDER)]
        chosen = best(
            [
                Order(candidate, tuple(directions[station] for station in candidate), chosen.alternates)
                for candidate in others
            ]
        )
    return tuple(_sweeps(chosen, procedure, procedure.repeats))


def _stations(home: Joints, procedure: SixSweepsSection, order: Sequence[str]) -> tuple[SweepPose, ...]:
    """Return the sweep poses in the order of the wrists.

    Wrist 1 has further poses, in which the other wrists are turned. Wrist 2 is then turned by 45°, to move the flange
    away from the forearm.
    """
    tilt_rad = math.radians(-45 if math.sin(home[WRIST_2]) > 0 else 45)
    offsets = ((tilt_rad, 0.0), (tilt_rad, math.pi / 2), (0.0, math.pi / 4)) if procedure.axes == 6 else ()
    stations = []
    for name in order:
        joint = JOINT_NAMES.index(name)
        stations.append(SweepPose(joint, name, home))
        if joint == WRIST_1:
            stations.extend(
                SweepPose(joint, name, (*home[:WRIST_2], home[WRIST_2] + second, home[WRIST_3] + third))
                for second, third in offsets
            )
    return tuple(stations)


def _list_orders(stations: tuple[SweepPose, ...], procedure: SixSweepsSection) -> Iterator[Order]:
    """Yield every permissible order of directions, beginning with the paper's order."""
    if procedure.directions is not None:
        yield Order(stations, (procedure.directions,) * len(stations), alternates=False)
        return
    several = procedure.repeats * len(procedure.speeds) > 1
    for alternates in (False, True) if several else (False,):
        for directions in product((BOTH_WAYS, BOTH_WAYS[::-1]), repeat=len(stations)):
            yield Order(stations, directions, alternates)


def _sweeps(order: Order, procedure: SixSweepsSection, repeats: int) -> list[Sweep]:
    """Return all sweeps: repeat by repeat, speed by speed, pose by pose."""
    sweeps: list[Sweep] = []
    averaged_rad = math.radians(procedure.arc_deg)
    even_rad = averaged_rad + 2 * math.radians(procedure.margin_deg)
    for turn, speed_deg_s in enumerate(procedure.speeds * repeats):
        profile = Profile(averaged_rad, even_rad, pace_of(speed_deg_s, procedure.acceleration_deg_s2))
        for station, directions in zip(order.stations, order.directions, strict=True):
            for direction in directions[::-1] if order.alternates and turn % 2 else directions:
                axis = _flange_axis(station, 1 if direction == "ccw" else -1)
                sweeps.append(sweep_about(len(sweeps), station, direction, axis, profile))
    return sweeps


@lru_cache(maxsize=64)
def _flange_axis(station: SweepPose, sign: int) -> Vector3:
    """Return the joint's axis in the flange's frame, reversed if the sign is -1."""
    x, y, z = (sign * axis for axis in flange_axes(station.pose_q_rad)[:, station.joint].tolist())
    return x, y, z


def _connect(sweeps: Sequence[Sweep], arm: ArmSection, procedure: SixSweepsSection) -> Iterator[Step]:
    """Yield sweeps with the rests after them and the transfers between, from home and back.

    A transfer leads through home if the straight path brings the flange or its payload too near to the forearm.
    """
    carried, model = read_load(arm), model_of(arm)
    pace = pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2)
    return connect_sweeps(
        sweeps, find_home(arm), pace, procedure.rest_s, lambda start, target: _clear(start, target, carried, model)
    )


_clear = lru_cache(maxsize=1024)(keeps_clear)  # the search for the best order repeats the same transfers
