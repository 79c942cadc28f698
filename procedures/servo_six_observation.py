"""Calibrate gyroscopes with six revolutions on the shaft of a servo, as in SIX, Section III.

    python procedures/servo_six_observation.py configs/servo.yaml

Before you start:
  1. The servo is clamped to something heavy, and `rig check CONFIG` finds it; its supply has a switch in reach.
  2. The board's cable has slack for two thirds of a turn either way.
  3. Nothing is in the way of the board when it turns, in any of the three mountings.

What happens, in each of three mountings: you screw the board on, with the servo's supply off, and switch it on; the
shaft goes home and turns by 15° and back, which shows whether the board is mounted as you were asked; then a turn and a
quarter one way, a rest, the same back, a rest. Ctrl-C stops the shaft at any moment and keeps what was measured. The
servo has no brake and no emergency stop: only the switch of its supply is sure.
"""

from rig.procedure import (
    Procedure,
    Rest,
    ServoSection,
    ServoSixObservationSection,
    Sweep,
    Transfer,
    Verbs,
    plan_servo_six_observation,
    run_script,
)


def servo_six_observation(rig: Verbs) -> None:
    """Carry out the plan's steps for one mounting in their order (`rig plan CONFIG` prints them)."""
    # Refuses unless the servo is the one that is meant, set up, cool and alone on its line; asks before anything moves.
    rig.preflight()
    # From here on every sample and every state of the shaft is in run.h5.
    rig.start_sampling()
    for step in rig.plan.steps:
        match step:
            case Transfer():
                # The trial of the mounting, or the way to where the next turn begins.
                rig.move(step)
            case Sweep():
                # Ramp up, a turn and a quarter at constant speed, ramp down; the board averages one turn of it.
                rig.sweep(step)
            case Rest():
                # Stand still: what the gyroscopes read now is their bias.
                rig.rest(step)
    # After the last mounting: the board's own calibration, for comparison with the computer's.
    rig.solve_on_board()


PROCEDURE = Procedure(
    name="servo_six_observation",
    section=ServoSixObservationSection,
    plan=plan_servo_six_observation,
    script=servo_six_observation,
    turner=ServoSection,
    # The speed of a turn is exact; its axis in the board is only as exact as the mounting.
    estimator="newton",
)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
