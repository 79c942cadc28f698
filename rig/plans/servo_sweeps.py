"""The turns of the six observations with one shaft: in each mounting of the item once each way, with rests between."""

import math
from collections.abc import Collection, Iterator, Sequence

from rig.config.section import Direction
from rig.config.servo_procedure import ServoSixObservationSection
from rig.config.servo_section import ServoSection
from rig.config.stage_section import mount_matrix
from rig.motion.state import Joints
from rig.motion.steps import TURN_RAD, Plan, Rest, Stage, Step, Sweep, Transfer, trapezoid_duration
from rig.plans.ways import approach, transfer

MARGIN_RAD = math.radians(3)  # of constant speed at either end, for a shaft that follows late
# Of the mounting: far enough to stand out from any gyroscope's noise and a gear's play.
TRIAL_RAD, TRIAL_SPEED_RAD_S, TRIAL_RAD_S2 = math.radians(15), math.radians(20), math.radians(80)


def plan_servo_six_observation(
    servo: ServoSection,
    procedure: ServoSixObservationSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """Three mountings or more, a small trial of each, then rest, turn, rest, turn back, rest.

    Each turn is a revolution and `beyond_deg` more at constant speed, centred on `servo.home_deg`, so that a cable
    winds by a turn's half and a little either way. `start_q_rad` is where the shaft stands (home when None); from
    there the plan goes home first, slowly, and each stage begins and ends at home. `done` holds the indices of turns
    to leave out; a stage of which nothing is left has no steps.
    """
    home = (math.radians(servo.home_deg),)
    start = home if start_q_rad is None else start_q_rad
    speed, acceleration = math.radians(servo.transfer_speed_deg_s), math.radians(procedure.acceleration_deg_s2)
    steps: list[Step] = list(approach(start, home, speed, acceleration))
    stages: list[Stage] = []
    index = 0
    for section in procedure.stages:
        ways = procedure.directions * procedure.repeats
        own = [_sweep(index + place, way, home[0], procedure) for place, way in enumerate(ways)]
        index += len(own)
        first, second, third = ((x, y, z) for x, y, z in mount_matrix(section.mount).tolist())
        indices = frozenset(sweep.index for sweep in own)
        stages.append(Stage((first, second, third), section.instruction, indices, begins=len(steps)))
        if left := [sweep for sweep in own if sweep.index not in done]:
            steps += [*_trial(home), *_swept(left, home, procedure.rest_s, (speed, acceleration))]
    return Plan(tuple(steps), start_q_rad=start, home_q_rad=home, stages=tuple(stages))


def _trial(home: Joints) -> Iterator[Transfer]:
    """A small turn and back: it shows how the item is mounted."""
    there = (home[0] + TRIAL_RAD,)
    for out in transfer("trial of the shaft", home, there, TRIAL_SPEED_RAD_S, TRIAL_RAD_S2):
        yield Transfer(out.name, out.start_q_rad, out.target_q_rad, *_timing(out), tries=True)
    yield from transfer("back from the trial", there, home, TRIAL_SPEED_RAD_S, TRIAL_RAD_S2)


def _timing(way: Transfer) -> tuple[float, float, float]:
    return way.speed_rad_s, way.acceleration_rad_s2, way.duration_s


def _swept(sweeps: Sequence[Sweep], home: Joints, rest_s: float, rates: tuple[float, float]) -> Iterator[Step]:
    """The turns, with a rest before the first and after each, and the ways to them and home."""
    here = home
    for sweep in sweeps:
        yield from transfer(f"transfer to the start of {sweep.name}", here, sweep.start_q_rad, *rates)
        if sweep is sweeps[0]:
            yield Rest(f"rest before {sweep.name}", rest_s)
        yield sweep
        yield Rest(f"rest after {sweep.name}", rest_s)
        here = sweep.end_q_rad
    yield from transfer("transfer home", here, home, *rates)


def _sweep(index: int, direction: Direction, home_rad: float, procedure: ServoSixObservationSection) -> Sweep:
    speed, acceleration = math.radians(procedure.speed_deg_s), math.radians(procedure.acceleration_deg_s2)
    even = TURN_RAD + math.radians(procedure.beyond_deg) + 2 * MARGIN_RAD
    half = even / 2 + speed**2 / (2 * acceleration)
    sign = 1 if direction == "ccw" else -1
    return Sweep(
        index=index,
        joint=0,
        joint_name="shaft",
        direction=direction,
        axis_flange=(0.0, 0.0, float(sign)),
        start_q_rad=(home_rad - sign * half,),
        end_q_rad=(home_rad + sign * half,),
        speed_rad_s=speed,
        acceleration_rad_s2=acceleration,
        duration_s=trapezoid_duration(2 * half, speed, acceleration),
        revolution_rad=(home_rad - TURN_RAD / 2, home_rad + TURN_RAD / 2),
    )
