"""Calibration of a gyroscope by hand: a body is turned on a table and lies still in between, as a factor graph."""

from rig.estimation.by_hand.progress import SessionProgress, assess_progress
from rig.estimation.by_hand.session_parts import HandRecording, HandRest, Move, SessionConditions
from rig.estimation.by_hand.solution import HandSolution, solve_by_hand

__all__ = [
    "HandRecording",
    "HandRest",
    "HandSolution",
    "Move",
    "SessionConditions",
    "SessionProgress",
    "assess_progress",
    "solve_by_hand",
]
