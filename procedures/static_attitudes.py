"""Calibrate accelerometers in static attitudes, as in TRIAX, Section II-B.

    python procedures/static_attitudes.py configs/attitudes.yaml

Before you start: as for procedures/six_observation.py.

What happens: the arm goes home, then to eighteen attitudes, one after the other, in the order that takes least time. In
each it waits until the sensors have settled and stands still for three seconds. Ctrl-C stops the arm at any moment and
keeps what was measured.
"""

from rig.procedure import (
    Dwell,
    Procedure,
    Rest,
    StaticAttitudesSection,
    Transfer,
    Verbs,
    plan_static_attitudes,
    run_script,
)


def static_attitudes(rig: Verbs) -> None:
    """Carry out the plan's steps in their order (`rig plan CONFIG` prints them and what the attitudes determine)."""
    # Refuses unless limits, clearances, payload, modes and the speed slider are right; then asks.
    rig.preflight()
    # From here on every sample and every arm state is in run.h5.
    rig.start_sampling()
    for step in rig.plan.steps:
        match step:
            case Transfer():
                # To the next attitude.
                rig.move(step)
            case Dwell():
                # Let the sensors settle, then stand still.
                rig.dwell(step)
            case Rest():
                # At home, where a field that drifts shows (procedure.field_test_s).
                rig.rest(step)


PROCEDURE = Procedure(
    name="static_attitudes",
    section=StaticAttitudesSection,
    plan=plan_static_attitudes,
    script=static_attitudes,
)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
