"""Attitudes in which the arm stands still, one after the other, as TRIAX needs them of an accelerometer."""

from collections.abc import Collection, Iterator
from functools import lru_cache

import numpy as np

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import AttitudesSection
from rig.motion.model import home_of
from rig.motion.state import Joints
from rig.motion.steps import Dwell, Plan, Rest, Step, trapezoid_duration
from rig.plans.motions.shortest_way import shortest_way
from rig.plans.motions.ways import approach, followed, in_radians, pace_of, transfer


def plan_static_attitudes(
    arm: ArmSection,
    procedure: AttitudesSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """Home, every attitude once in the order that takes the arm least time, `repeats` times, and home again.

    `start_q_rad` is where the arm stands (home when None); from there the plan goes home first, slowly.
    `done` holds the indices of dwells to leave out: those an interrupted run has finished.
    Limits and clearances are not judged here: see the turner's `problems`; nor what the attitudes tell: see
    `rig.analysis.design.attitude_account`.
    """
    before = approach(start_q_rad, home_of(arm), pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2))
    return followed(before, dwells(arm, procedure, procedure.repeats, done))


def dwells(
    arm: ArmSection, procedure: AttitudesSection, repeats: int, done: Collection[int] = (), first: int = 0
) -> Iterator[Step]:
    """The dwells with the ways to them, from home and back; none if all are `done`. They are counted from `first`.

    With field tests at home before them and after.
    """
    home = home_of(arm)
    pace = pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2)
    attitudes = enumerate(_order(arm, procedure) * repeats, first)
    left = [Dwell(index, q, procedure.dwell_s, procedure.settle_s) for index, q in attitudes if index not in done]
    if left and procedure.field_test_s > 0:
        yield Rest("field test before the attitudes", procedure.field_test_s)
    here = home
    for dwell in left:
        yield from transfer(f"transfer to the {dwell.name}", here, dwell.q_rad, pace)
        yield dwell
        here = dwell.q_rad
    yield from transfer("transfer home", here, home, pace)
    if left and procedure.field_test_s > 0:
        yield Rest("field test after the attitudes", procedure.field_test_s)


@lru_cache(maxsize=16)
def _order(arm: ArmSection, procedure: AttitudesSection) -> tuple[Joints, ...]:
    """The attitudes' joint angles, in the order of the shortest way from home through all of them and back."""
    home = home_of(arm)
    attitudes = [(*home[:3], *in_radians(wrists)) for wrists in procedure.attitudes]
    places = np.array([home, *attitudes])
    pace = pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2)
    farthest = np.abs(places[:, None] - places).max(axis=-1)
    between_s = np.vectorize(trapezoid_duration)(farthest, pace.speed_rad_s, pace.acceleration_rad_s2)
    return tuple(attitudes[place - 1] for place in shortest_way(between_s))
