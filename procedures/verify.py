"""Verify calibrated gyroscopes by repeating the movement of the calibration, as in SIX, Section IV-B.

    python procedures/verify.py configs/lsm9ds1_adis16465.yaml

Before you start: as for procedures/six_observation.py. The board has a calibration stored for each gyroscope (`rig
board calibration read CONFIG` shows it), and a reference gyroscope with known errors sits beside them.

What happens: the board corrects its readings by what it has stored and streams rates; the arm repeats the six sweeps;
the rates are compared with the reference's. `rig run` does this by itself after a calibration when the configuration
says `verify: true`. Ctrl-C stops the arm at any moment and keeps what was measured.
"""

from collections.abc import Sequence

from procedures.six_observation import movement
from rig.procedure import (
    Outcome,
    Procedure,
    RunData,
    Verbs,
    VerifySection,
    plan_six_observation,
    run_script,
    verify_calibration,
    verify_stored_calibrations,
)


def verify(rig: Verbs) -> None:
    """Carry out the movement of the calibration, without solving anything."""
    # Refuses unless limits, payload, modes and the speed slider are right; asks before anything moves.
    rig.preflight()
    # The gyroscopes send corrected rates, the reference its raw readings.
    rig.start_sampling()
    movement(rig)


def analyse(runs: Sequence[RunData], before: Outcome | None, estimator: str) -> Outcome:
    """Compare the newest movement with the reference; add the calibration before it, if there is one."""
    newest = runs[-1:]
    return verify_stored_calibrations(newest) if before is None else verify_calibration(before, newest)


PROCEDURE = Procedure(
    name="verify",
    section=VerifySection,
    plan=plan_six_observation,
    script=verify,
    analyse=analyse,
    readings="calibrated",
)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
