"""The analyses that procedures name: from recordings to the outcome of a run.

Whoever plans a procedure reads this: so what solves is loaded when there is something to solve. Where NumPy or SciPy
gives up, each raises Fault `not_solvable`.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rig.analysis.estimators import DEFAULT_ESTIMATOR
from rig.analysis.outcome import Outcome
from rig.analysis.solvable import solvable

if TYPE_CHECKING:
    from rig.data.recording.run_file import RunData


@solvable()
def calibrate(runs: "Sequence[RunData]", estimator: str = DEFAULT_ESTIMATOR, *, drifting: bool = False) -> Outcome:
    """Solve and judge the recordings of a calibration, at least one: the same for a run that just ended and from files.

    Where biases may be `drifting`, that they do contradicts nothing. Raises Fault or Refused by name when the
    recordings do not hold what they should.
    """
    from rig.analysis import judging
    from rig.analysis.external import judging as external_judging

    if (external := runs[0].elsewhere) is not None:
        return external_judging.calibrate_external(runs, external, estimator)
    return judging.calibrated(runs, estimator, drifting=drifting)


@solvable()
def estimate_bias_drift(runs: "Sequence[RunData]", estimator: str = DEFAULT_ESTIMATOR) -> Outcome:
    """The outcome, as of `calibrate`, of attitudes gone through again and again: the bias by repeat too, and judged.

    Raises Fault as `calibrate` and `estimate_bias_drifts` do.
    """
    from rig.analysis import judging

    return judging.drifted(runs, estimator)


@solvable()
def calibrate_by_hand(runs: "Sequence[RunData]") -> Outcome:
    """Solve and judge the recordings of a session by hand, at least one.

    Raises Fault as `rig.estimation.by_hand.solve_by_hand` does, `no_crystal` where the board's clock has none.
    """
    from rig.analysis.by_hand import judging as hand_judging

    return hand_judging.calibrate_by_hand(runs)


@solvable()
def verify_calibration(outcome: Outcome, repeated: "Sequence[RunData]") -> Outcome:
    """The outcome with what `repeated`, the calibration's movement with calibrated readings, says of it.

    Without such a recording the checks of the verification fail. Raises Fault as `observe_runs` and `verify` do.
    """
    from rig.analysis import judging

    return judging.verified(outcome, repeated)


@solvable()
def verify_stored_calibrations(repeated: "Sequence[RunData]") -> Outcome:
    """What recordings of calibrated readings, at least one, say of the calibrations the board had stored before.

    Raises Fault as `verify_calibration` does.
    """
    from rig.analysis import judging

    return judging.verified_alone(repeated)
