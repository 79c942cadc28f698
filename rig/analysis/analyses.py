"""The analyses that procedures name: from recordings to the outcome of a run.

Planning imports this module, so solvers are imported only when needed. If NumPy or SciPy has no solution, every
analysis raises Fault `not_solvable`.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rig.analysis.estimator_names import DEFAULT_ESTIMATOR
from rig.analysis.numeric_errors import solvable
from rig.analysis.outcome import Outcome

if TYPE_CHECKING:
    from rig.data.recording.run_data import RunData


@solvable()
def calibrate(runs: "Sequence[RunData]", estimator: str = DEFAULT_ESTIMATOR, *, drifting: bool = False) -> Outcome:
    """Return the outcome of a calibration, whose recordings are solved and judged.

    `runs`: at least one recording, of a run or from files. If `drifting`, a bias drift of an accelerometer or
    magnetometer does not count as a contradiction. Raise Fault or Refused if the recordings do not suffice.
    """
    if (external := runs[0].external) is not None:
        from rig.analysis.external import external_outcome as external_judging

        return external_judging.calibrate_external(runs, external, estimator)
    from rig.analysis import judging

    return judging.calibrate(runs, estimator, drifting=drifting)


@solvable()
def estimate_bias_drift(runs: "Sequence[RunData]", estimator: str = DEFAULT_ESTIMATOR) -> Outcome:
    """Return the outcome of `calibrate`, to which the bias in each repeat of the attitudes is added.

    Raise Fault as `calibrate` and `estimate_bias_drifts` do.
    """
    from rig.analysis import judging

    return judging.estimate_bias_drift(runs, estimator)


@solvable()
def calibrate_by_hand(runs: "Sequence[RunData]") -> Outcome:
    """Return the outcome of a session by hand, whose recordings (at least one) are solved and judged.

    Raise Fault and Refused as `rig.estimation.by_hand.solution.solve_by_hand` and `collect_inputs` do.
    """
    from rig.analysis.by_hand import hand_outcome as hand_judging

    return hand_judging.calibrate_by_hand(runs)


@solvable()
def verify_calibration(outcome: Outcome, repeated: "Sequence[RunData]") -> Outcome:
    """Return the outcome of a calibration, to which a verification by the recordings `repeated` is added.

    These contain the same movement, with readings that the board has calibrated. If there are none, the checks of the
    verification fail. Raise Fault as `observe_runs` and `verify` do.
    """
    from rig.analysis import judging

    return judging.verify_calibration(outcome, repeated)


@solvable()
def verify_stored_calibrations(repeated: "Sequence[RunData]") -> Outcome:
    """Return the outcome of a verification of the board's stored calibrations, by readings that the board corrected.

    Raise Fault as `verify_calibration` does.
    """
    from rig.analysis import judging

    return judging.verify_stored(repeated)
