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
    """The steps, in the order the plan has them (`rig plan CONFIG` prints it, and what the attitudes will tell)."""
    rig.preflight()  # refuses unless limits, clearances, payload, modes and the speed slider are right; then asks
    rig.start_sampling()  # from here on every sample and every arm state is in run.h5
    for step in rig.plan.steps:
        match step:
            case Transfer():
                rig.move(step)  # to the next attitude
            case Dwell():
                rig.dwell(step)  # let the sensors settle, then stand still
            case Rest():
                rig.rest(step)  # at home, where a field that drifts shows (procedure.field_test_s)


PROCEDURE = Procedure(
    name="static_attitudes",
    section=StaticAttitudesSection,
    plan=plan_static_attitudes,
    script=static_attitudes,
)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
