"""The outcome of a session by hand: every gyroscope solved from its rests and moves, and judged."""

from collections.abc import Sequence

from rig.analysis.by_hand.gyroscope import build_hand_result
from rig.analysis.gyroscope.calibration import refuse_different_sensors
from rig.analysis.gyroscope.correction import diagonal_correction, matrix_correction
from rig.analysis.outcome import Outcome, origin_of
from rig.analysis.verdict import judge
from rig.data.recording.run_data import RunData
from rig.estimation.by_hand import solve_by_hand
from rig.observation.by_hand.rests_and_moves import collect_inputs, session_of


def calibrate_by_hand(runs: Sequence[RunData]) -> Outcome:
    """Return the outcome of a session by hand (see `rig.analysis.analyses.calibrate_by_hand`)."""
    settings = runs[0].settings
    refuse_different_sensors(runs)
    results = {}
    for name in settings.to_calibrate:
        conditions = collect_inputs(settings, runs[0].provenance, runs[0].sensors[name])
        solution = solve_by_hand(session_of(runs, name), conditions)
        uses_matrix = name in settings.matrix_corrected
        corrected_by = matrix_correction(solution.turned) if uses_matrix else diagonal_correction(solution.scale)
        results[name] = build_hand_result(runs[0].sensors[name], solution, corrected_by)
    return Outcome(
        settings=settings,
        provenance=origin_of(runs),
        results=results,
        checks=judge(
            {name: result.solution for name, result in results.items()},
            settings.limits,
            {name: result.uncertainty for name, result in results.items() if result.uncertainty is not None},
            settings.stated_uncertainty.decision_rule,
        ),
    )
