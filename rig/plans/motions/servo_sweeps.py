"""The turns of the six observations with one shaft: both directions in each mounting, with rests between."""

import math
from collections.abc import Collection, Iterator, Sequence

from rig.config.procedures.servo_procedure import ServoSixObservationSection
from rig.config.procedures.servo_section import ServoSection
from rig.motion.steps import TURN_RAD, Plan, Rest, Step, Sweep
from rig.motion.turner_state import Joints
from rig.plans.motions.sweeps import Profile, SweepPose, build_stages, connect_sweeps, sweep_about, trial
from rig.plans.motions.transfer_steps import approach, pace_of

MARGIN_RAD = math.radians(3)  # angle of constant speed at either end, because the shaft lags
# Trial of the mounting: large enough to exceed any gyroscope's noise and a gear's play.
TRIAL_RAD, TRIAL_PACE = math.radians(15), pace_of(20, 80)


def plan_servo_six_observation(
    servo: ServoSection,
    procedure: ServoSixObservationSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """Return a plan with a small trial turn, a turn, a turn back, and rests in each of three or more mountings.

    Each turn is a revolution and `overtravel_deg` more at constant speed, centred on `servo.home_deg`, so that a cable
    winds by slightly more than half a turn in either direction. `start_q_rad` is the shaft's angle (home if None); from
    there the plan first goes home slowly, and each stage begins and ends at home. `done`: the indices of finished
    turns, which are left out; a stage without remaining turns has no steps.
    """
    home = (math.radians(servo.home_deg),)
    shaft, pace = SweepPose(0, "shaft", home), pace_of(servo.transfer_speed_deg_s, procedure.acceleration_deg_s2)
    even_rad = TURN_RAD + math.radians(procedure.overtravel_deg) + 2 * MARGIN_RAD
    profile = Profile(TURN_RAD, even_rad, pace_of(procedure.speed_deg_s, procedure.acceleration_deg_s2))
    turns = [
        sweep_about(index, shaft, direction, (0.0, 0.0, 1.0 if direction == "ccw" else -1.0), profile)
        for index, direction in enumerate(procedure.directions * procedure.repeats)
    ]

    def steps_of(sweeps: Sequence[Sweep]) -> Iterator[Step]:
        yield from trial("trial of the shaft", "back from the trial", shaft, TRIAL_RAD, TRIAL_PACE)
        for step in connect_sweeps(sweeps, home, pace, procedure.rest_s, lambda *_: True):
            if step is sweeps[0]:
                yield Rest(f"rest before {step.name}", procedure.rest_s)
            yield step

    stages = ((section, turns) for section in procedure.stages)
    return build_stages(approach(start_q_rad, home, pace), stages, steps_of, done)
