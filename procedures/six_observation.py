"""Calibrate gyroscopes with six revolutions, as in SIX, Section IV-A.

    python procedures/six_observation.py configs/demo.yaml

Before you start:
  1. The sensor board is fixed to the flange, its cable has slack for a whole turn either way.
  2. Nobody and nothing is within the arm's reach.
  3. The pendant shows Remote Control, the speed slider stands at 100 %, no program runs.

What happens: the arm goes home; wrist 3 turns 360° clockwise, rests, turns back, rests; then wrist 1; then wrist 2.
Ctrl-C stops the arm at any moment and keeps what was measured.
"""

from rig.procedure import (
    Procedure,
    Rest,
    SixObservationSection,
    Sweep,
    Transfer,
    Verbs,
    plan_six_observation,
    run_script,
)


def six_observation(rig: Verbs) -> None:
    """Carry out the plan's steps in their order (`rig plan CONFIG` prints them)."""
    # Refuses unless limits, payload, modes and the speed slider are right; asks before anything moves.
    rig.preflight()
    # From here on every sample and every arm state is in run.h5.
    rig.start_sampling()
    movement(rig)
    # The board's own calibration, for comparison with the computer's.
    rig.solve_on_board()


def movement(rig: Verbs) -> None:
    """Move home, then make every sweep with the rest after it."""
    for step in rig.plan.steps:
        match step:
            case Transfer():
                # To where the next sweep begins.
                rig.move(step)
            case Sweep():
                # Ramp up, one revolution at constant speed, ramp down; the board averages it while the arm rests.
                rig.sweep(step)
            case Rest():
                # Stand still: what the gyroscopes read now is their bias.
                rig.rest(step)


PROCEDURE = Procedure(
    name="six_observation",
    section=SixObservationSection,
    plan=plan_six_observation,
    script=six_observation,
    # If the configuration says `verify: true` and the calibration passes.
    then="verify",
)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
