"""A gyroscope calibrated by hand: a body that is turned on a table and lies still in between, as a graph."""

from rig.estimation.by_hand.progress import Progress, progress
from rig.estimation.by_hand.session import Handled, Move, Rest, Told
from rig.estimation.by_hand.solution import HandSolution, solve_by_hand

__all__ = ["HandSolution", "Handled", "Move", "Progress", "Rest", "Told", "progress", "solve_by_hand"]
