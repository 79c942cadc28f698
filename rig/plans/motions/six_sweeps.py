"""The sweeps of SIX, Section III, around the home pose, with the ways between them and the rests after them."""

import math
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import permutations, product

import numpy as np

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import SixSweepsSection
from rig.config.procedures.servo_procedure import AXES_SPAN
from rig.config.procedures.stage_section import Wrist, mount_matrix
from rig.config.section import Direction, Vector3
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.motion.carried import read_load
from rig.motion.geometry import flange_axes
from rig.motion.keep_out import keeps_clear
from rig.motion.model import home_of, model_of
from rig.motion.state import JOINT_NAMES, Joints
from rig.motion.steps import Plan, Step, Sweep
from rig.plans.motions.drift import drift_effect
from rig.plans.motions.sweeps import Mounted, Profile, Station, connected, in_stages, sweep_about, trial
from rig.plans.motions.ways import approach, followed, pace_of

USUAL_ORDER: tuple[Wrist, ...] = ("wrist_3", "wrist_1", "wrist_2")  # that of the paper
BOTH_WAYS: tuple[Direction, Direction] = ("cw", "ccw")
WORTHWHILE = 2 / 3  # an order that is not better by a third is not worth leaving the paper's
# Of a stage's mounting: far enough to stand out from any gyroscope's noise, and a hand gets out of the way.
TRIAL_RAD, TRIAL_PACE = math.radians(10), pace_of(15, 60)
DIGITS = 9  # equally good but for rounding: the first of them is chosen, on every machine
WRIST_1, WRIST_2, WRIST_3 = (JOINT_NAMES.index(name) for name in ("wrist_1", "wrist_2", "wrist_3"))


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
    swept = _ordered_sweeps(arm, procedure)
    before = approach(start_q_rad, home, pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2))
    if not procedure.mountings:
        _check_span(flange_axes(home)[:, [WRIST_1, WRIST_2, WRIST_3]])
        left = [sweep for sweep in swept if sweep.index not in done]
        return followed(before, _connected(left, arm, procedure))
    mounted = [
        (each, [sweep for sweep in swept if sweep.joint_name in (each.sweeps or USUAL_ORDER)])
        for each in procedure.mountings
    ]
    _check_span(np.array(list(_axes_of_items(mounted))).T)
    return in_stages(before, mounted, lambda left: (*_trials(left, home), *_connected(left, arm, procedure)), done)


def _check_span(axes: Array) -> None:
    """Six parameters can be told only from turns about three independent axes (3, n)."""
    if axes.shape[1] < 3 or np.linalg.svd(axes, compute_uv=False)[2] < AXES_SPAN:
        raise Refused(
            "axes_do_not_span",
            "the swept wrists do not turn the sensors about three independent axes",
            "Set wrist 2 in arm.home_deg near 90 or -90, and sweep all three wrists or mount the item in more ways",
        )


def _axes_of_items(mounted: Iterable[Mounted]) -> Iterator[Array]:
    """The axes (3,) that are swept in each stage, in the item's frame."""
    for section, sweeps in mounted:
        for axis in dict.fromkeys(sweep.axis_flange for sweep in sweeps if sweep.direction == "ccw"):
            yield mount_matrix(section.mount) @ axis


def _trials(sweeps: Sequence[Sweep], home: Joints) -> Iterator[Step]:
    """A small turn of each joint that is to be swept, and back: it shows how the item is mounted."""
    for joint, name in dict.fromkeys((sweep.joint, sweep.joint_name) for sweep in sweeps):
        station = Station(joint, name, home)
        yield from trial(f"trial of {name}", f"back from the trial of {name}", station, TRIAL_RAD, TRIAL_PACE)


@lru_cache(maxsize=16)
def _ordered_sweeps(arm: ArmSection, procedure: SixSweepsSection) -> tuple[Sweep, ...]:
    """All sweeps in the order the file names, or else the best one: the ways first, then the order of the wrists."""
    home = home_of(arm)

    def harm(order: Order) -> float:
        sweeps = _sweeps(order, procedure, min(procedure.repeats, 2))  # more of them repeat these
        return round(drift_effect(tuple(_connected(sweeps, arm, procedure))), DIGITS)

    def best(orders: Sequence[Order]) -> Order:
        first, *others = ((harm(order), order) for order in orders) if len(orders) > 1 else [(0.0, orders[0])]
        least = min(others, key=lambda each: each[0], default=first)
        return least[1] if least[0] < WORTHWHILE * first[0] else first[1]

    chosen = best(list(_ways(_stations(home, procedure, procedure.order or USUAL_ORDER), procedure)))
    if procedure.order is None:
        ways = dict(zip(chosen.stations, chosen.ways, strict=True))
        others = [_stations(home, procedure, each) for each in permutations(USUAL_ORDER)]
        chosen = best([Order(each, tuple(ways[station] for station in each), chosen.turning) for each in others])
    return tuple(_sweeps(chosen, procedure, procedure.repeats))


def _stations(home: Joints, procedure: SixSweepsSection, order: Sequence[str]) -> tuple[Station, ...]:
    """What is swept, in the order of the wrists; what wrist 1 does with the others turned follows its own sweep.

    Wrist 2 is turned by 45° so that the flange comes away from the forearm, never towards it.
    """
    away = math.radians(-45 if math.sin(home[WRIST_2]) > 0 else 45)
    turned = ((away, 0.0), (away, math.pi / 2), (0.0, math.pi / 4)) if procedure.axes == 6 else ()
    stations = []
    for name in order:
        joint = JOINT_NAMES.index(name)
        stations.append(Station(joint, name, home))
        if joint == WRIST_1:
            stations += [
                Station(joint, name, (*home[:WRIST_2], home[WRIST_2] + second, home[WRIST_3] + third))
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


def _sweeps(order: Order, procedure: SixSweepsSection, repeats: int) -> list[Sweep]:
    """The sweeps one after the other: repeat by repeat, speed by speed, station by station."""
    sweeps: list[Sweep] = []
    averaged_rad = math.radians(procedure.arc_deg)
    even_rad = averaged_rad + 2 * math.radians(procedure.margin_deg)
    for turn, speed_deg_s in enumerate(procedure.speeds * repeats):
        profile = Profile(averaged_rad, even_rad, pace_of(speed_deg_s, procedure.acceleration_deg_s2))
        for station, ways in zip(order.stations, order.ways, strict=True):
            for direction in ways[::-1] if order.turning and turn % 2 else ways:
                axis = _axis(station, 1 if direction == "ccw" else -1)
                sweeps.append(sweep_about(len(sweeps), station, direction, axis, profile))
    return sweeps


@lru_cache(maxsize=64)
def _axis(station: Station, sign: int) -> Vector3:
    """The joint's axis in the flange's frame: of a growing angle, or of a falling one with the sign -1."""
    x, y, z = (sign * axis for axis in flange_axes(station.pose_q_rad)[:, station.joint].tolist())
    return x, y, z


def _connected(sweeps: Sequence[Sweep], arm: ArmSection, procedure: SixSweepsSection) -> Iterator[Step]:
    """Sweeps with the rests after them and the ways between, from home and back.

    These lead through home where the straight way takes the flange or its payload to the forearm, as wrists 1 and 2
    may when they turn together.
    """
    carried, model = read_load(arm), model_of(arm)
    pace = pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2)
    return connected(
        sweeps, home_of(arm), pace, procedure.rest_s, lambda here, there: _clear(here, there, carried, model)
    )


_clear = lru_cache(maxsize=1024)(keeps_clear)  # the search for the best order asks for the same ways again and again
