"""Calibrate gyroscopes and accelerometers over temperature.

    python procedures/thermal.py configs/thermal.yaml

Before you start: as for procedures/six_observation.py. What warms or cools the board is there: the heater on its pin
A5, a heat gun, an ice pack, a chamber around the arm's wrist.

What happens: the arm makes its sweeps (and goes to its attitudes), goes home, and waits until the sensors' own
thermometers have moved on by half a gap. Then it does the same again, up through the range and down again, until no gap
is left. Without a heater the operator is asked for the next temperature. The run ends if the sensors become too hot or
change too fast. Ctrl-C stops the arm at any moment, the heater goes off, and what was measured is kept.
"""

from rig.procedure import Dwell, Procedure, Rest, Sweep, ThermalSection, Transfer, Verbs, plan_thermal, run_script


def thermal(rig: Verbs) -> None:
    """Carry out set after set of the plan (`rig plan CONFIG` prints it), until the range is covered."""
    # Refuses unless limits, clearances, payload, modes, the speed slider and the heater are right; then asks.
    rig.preflight()
    # From here on every sample and every arm state is in run.h5.
    rig.start_sampling()
    for step in rig.plan.steps:
        match step:
            case Rest(for_temperature=True):
                # At home: until the sensors have the next temperature.
                if not rig.wait_for_next_temperature(step):
                    break
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
    # The heater goes off; the run ends with a fault if a part of the range is missing.
    rig.end_temperature_range()
    # The board's own calibration, of all temperatures together, for comparison with the computer's.
    rig.solve_on_board()


PROCEDURE = Procedure(name="thermal", section=ThermalSection, plan=plan_thermal, script=thermal)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
