"""Attitudes in which the arm rests, one after the other, to calibrate an accelerometer as in the paper TRIAX."""

from collections.abc import Collection, Iterator
from functools import lru_cache

import numpy as np

from rig.config.models import ArmSection
from rig.config.procedures.procedure_sections import AttitudesSection
from rig.motion.model import find_home
from rig.motion.steps import Dwell, Plan, Rest, Step, trapezoid_duration
from rig.motion.turner_state import Joints
from rig.plans.motions.shortest_tour import shortest_way
from rig.plans.motions.transfer_steps import append_steps, approach, convert_to_radians, pace_of, transfer


def plan_static_attitudes(
    arm: ArmSection,
    procedure: AttitudesSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """Return the plan that visits all attitudes in the fastest order, `repeats` times, and begins and ends at home.

    `start_q_rad` is the arm's pose (home if None); from there the plan first goes home slowly. `done`: the indices of
    finished dwells, which are left out. Limits and clearances are checked by the turner's `problems`, the rank of the
    attitudes is checked by `rig.analysis.design.attitude_information`.
    """
    before = approach(start_q_rad, find_home(arm), pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2))
    return append_steps(before, dwells(arm, procedure, procedure.repeats, done))


def dwells(
    arm: ArmSection, procedure: AttitudesSection, repeats: int, done: Collection[int] = (), first: int = 0
) -> Iterator[Step]:
    """Yield the dwells, numbered from `first`, and the transfers from home and back; nothing if all are `done`.

    A test of the field at home precedes the dwells, and another follows them, if `procedure.field_test_s` is not zero.
    """
    home = find_home(arm)
    pace = pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2)
    attitudes = enumerate(_order(arm, procedure) * repeats, first)
    remaining = [Dwell(index, q, procedure.dwell_s, procedure.settle_s) for index, q in attitudes if index not in done]
    if remaining and procedure.field_test_s > 0:
        yield Rest("field test before the attitudes", procedure.field_test_s)
    pose = home
    for dwell in remaining:
        yield from transfer(f"transfer to the {dwell.name}", pose, dwell.q_rad, pace)
        yield dwell
        pose = dwell.q_rad
    yield from transfer("transfer home", pose, home, pace)
    if remaining and procedure.field_test_s > 0:
        yield Rest("field test after the attitudes", procedure.field_test_s)


@lru_cache(maxsize=16)
def _order(arm: ArmSection, procedure: AttitudesSection) -> tuple[Joints, ...]:
    """Return the attitudes' joint angles in the order of the shortest round trip from home."""
    home = find_home(arm)
    attitudes = [(*home[:3], *convert_to_radians(wrists)) for wrists in procedure.attitudes]
    points = np.array([home, *attitudes])
    pace = pace_of(arm.transfer_speed_deg_s, procedure.acceleration_deg_s2)
    farthest = np.abs(points[:, None] - points).max(axis=-1)
    between_s = np.vectorize(trapezoid_duration)(farthest, pace.speed_rad_s, pace.acceleration_rad_s2)
    return tuple(attitudes[index - 1] for index in shortest_way(between_s))
