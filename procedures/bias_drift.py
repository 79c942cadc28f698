"""Watch how biases drift, as in TRIAX, sections III-A and III-B.

    python procedures/bias_drift.py configs/bias_drift.yaml

Before you start: as for procedures/six_observation.py. It takes hours, ten as it is set.

What happens: the arm goes through its attitudes again and again and stands still in each, for minutes. All repeats but
the last calibrate the accelerometers, and each gives the biases. After a power cut `rig resume` goes on with the dwell
that was interrupted. Ctrl-C stops the arm at any moment and keeps what was measured.
"""

from collections.abc import Sequence

from procedures.static_attitudes import static_attitudes
from rig.procedure import (
    BiasDriftSection,
    Outcome,
    Procedure,
    RunData,
    Verbs,
    estimate_bias_drift,
    plan_static_attitudes,
    run_script,
)


def bias_drift(rig: Verbs) -> None:
    """Carry out the steps of the static attitudes, `repeats` times."""
    static_attitudes(rig)


def analyse(runs: Sequence[RunData], before: Outcome | None, estimator: str) -> Outcome:
    """Return the calibration of the accelerometers, and every sensor's bias by repeat."""
    return estimate_bias_drift(runs, estimator)


PROCEDURE = Procedure(
    name="bias_drift",
    section=BiasDriftSection,
    plan=plan_static_attitudes,
    script=bias_drift,
    analyse=analyse,
)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
