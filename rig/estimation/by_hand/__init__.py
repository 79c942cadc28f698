"""Calibration of a gyroscope that a hand turns on a table and lays down in between. The model is a factor graph."""

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
