"""Calibrate a gyroscope by hand, on a table, without any machine.

    python procedures/by_hand.py configs/by_hand.yaml

Before you start: the board is fixed in a box with flat sides, or lies in a holder that has six of them. The table is
flat and does not rock. A rule or the table's edge is there to turn against. The cable reaches, and hangs loosely.

What happens: a line and a drawing say which side comes up next, or that the box makes a whole turn on the table. Each
move begins and ends at rest, for a second. A move that went wrong is asked for again. Twelve moves and three turns take
less than a minute. Ctrl-C ends it at any moment and keeps what was measured; `rig resume` goes on.
"""

from collections.abc import Sequence

from rig.procedure import (
    ByHandSection,
    HandSection,
    Outcome,
    Procedure,
    RunData,
    Verbs,
    calibrate_by_hand,
    plan_by_hand,
    run_script,
)


def by_hand(rig: Verbs) -> None:
    """Let the operator make every move."""
    rig.preflight()
    rig.start_sampling()
    rig.turn_by_hand()


def analyse(runs: Sequence[RunData], before: Outcome | None, estimator: str) -> Outcome:
    """Return scale, bias and non-orthogonality of every gyroscope, from its rests and moves."""
    return calibrate_by_hand(runs)


PROCEDURE = Procedure(
    name="by_hand", section=ByHandSection, plan=plan_by_hand, script=by_hand, analyse=analyse, turner=HandSection
)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
