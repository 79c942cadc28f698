"""The search for the one rest without which a session is consistent: an earlier one may have spoiled the fit.

A rest in which the body crept, or did not lie flat, need not be noticed at once: while there are few moves, it changes
what they determine, and later ones seem to be wrong. Without it (leave-one-out) all of them agree.
"""

from rig.errors import Fault
from rig.estimation.by_hand.fit import GraphFit, fit_session
from rig.estimation.by_hand.session_outliers import find_contradiction
from rig.estimation.by_hand.session_parts import STATED, HandRecording, SessionConditions, drop_rests

FEWEST, MOST = 5, 24  # rests: with fewer, any is as good as another; with more, others have found it before


def find_bad_rest(session: HandRecording, conditions: SessionConditions) -> int | None:
    """Return the index of the rest without which nothing contradicts the last rest; None if there is none.

    Of several, that without which the hand's and the sensor's estimated errors are smallest. The last rest does not
    count: it is judged by itself.
    """
    count = len(session.rests)
    if not FEWEST < count <= MOST:
        return None
    fits = {row: _fit_without(session, conditions, row) for row in range(count - 1)}
    consistent = {row: _looseness(fit) for row, fit in fits.items() if fit is not None}
    return min(consistent, key=lambda row: consistent[row], default=None)


def _fit_without(session: HandRecording, conditions: SessionConditions, row: int) -> GraphFit | None:
    """Return the fit without a rest if it converges and is consistent, else None."""
    try:
        fit = fit_session(drop_rests(session, (row,)), conditions)
    except Fault:
        return None
    last = len(fit.session.rests) - 1
    return fit if find_contradiction(fit, since=last) is None and find_contradiction(fit) is None else None


def _looseness(fit: GraphFit) -> float:
    """Return the largest ratio of an estimated to a stated standard deviation."""
    return max(getattr(fit.stds, name) / getattr(STATED, name) for name in STATED.__slots__)
