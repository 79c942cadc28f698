"""Calibrate gyroscopes and the accelerometers in one run: sweeps as in SIX, attitudes as in TRIAX.

    python procedures/imu.py configs/imu.yaml

Before you start: as for procedures/six_observation.py.

What happens: the arm goes home and makes twelve sweeps about six axes with a rest after each; then it goes to eighteen
attitudes and stands still in each. Five minutes in all. Ctrl-C stops the arm at any moment and keeps what was measured.
"""

from rig.procedure import Dwell, ImuSection, Procedure, Rest, Sweep, Transfer, Verbs, plan_imu, run_script


def imu(rig: Verbs) -> None:
    """Carry out the plan's steps in their order (`rig plan CONFIG` prints them and what the attitudes determine)."""
    # Refuses unless limits, clearances, payload, modes and the speed slider are right; then asks.
    rig.preflight()
    # From here on every sample and every arm state is in run.h5.
    rig.start_sampling()
    for step in rig.plan.steps:
        match step:
            case Transfer():
                # To where the next sweep begins, or to the next attitude.
                rig.move(step)
            case Sweep():
                # One revolution at constant speed; the board averages it while the arm rests.
                rig.sweep(step)
            case Rest():
                # Stand still: what the gyroscopes read now is their bias.
                rig.rest(step)
            case Dwell():
                # Let the sensors settle, then stand still: the accelerometers' part.
                rig.dwell(step)
    # The gyroscopes' calibration by the board, for comparison with the computer's.
    rig.solve_on_board()


PROCEDURE = Procedure(name="imu", section=ImuSection, plan=plan_imu, script=imu)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
