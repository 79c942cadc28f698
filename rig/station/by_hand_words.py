"""A session by hand in words: the instruction for the operator, and the outcome of each move."""

from math import degrees

from rig.data.recording.hand_events import (
    HandAsked,
    HandBegunAnew,
    HandMoveAccepted,
    HandMoveRefused,
    HandRested,
    HandRestRefused,
)
from rig.station.events import HandSeen, RunEvent

RED_FRACTION = 0.8  # fraction of the range, above which a reading may be saturated


def hand_event_line(event: RunEvent) -> str | None:
    """Return an event of a session by hand in one line; None for other events, and for messages between devices."""
    text: str | None
    match event:
        case HandAsked(instruction, again, why):
            text = (
                f"your turn: {instruction.words}" if again is None else f"again: {why} Your turn: {instruction.words}"
            )
        case HandRested(face=face):
            text = f"detected: it rests with the side {face} up"
        case HandMoveAccepted(kind="flip", from_face=before, to_face=after):
            text = f"accepted: from {before} to {after}"
        case HandMoveAccepted(turns=turns, from_face=face):
            again_laid = f"accepted: laid down again with the side {face} up"
            whole = "whole turn" if abs(turns) == 1 else "whole turns"
            text = f"accepted: {turns:+d} {whole} with the side {face} up" if turns else again_laid
        case HandMoveRefused(again=again):
            text = f"not accepted: {again}"
        case HandRestRefused(again=again):
            text = f"no rest: {again}"
        case HandBegunAnew(again=again):
            text = f"started again: {again}; earlier moves do not count"
        case _:
            text = None
    return text


def live_rows(state: HandSeen) -> tuple[tuple[str, str], ...]:
    """Return name and text of each row in which a panel shows the present state of a session."""
    peak, range_deg_s = degrees(state.peak_rad_s), degrees(state.range_rad_s)
    fast = "  TOO FAST" if range_deg_s and peak > RED_FRACTION * range_deg_s else ""
    of_range = f" of {range_deg_s:.0f}" if range_deg_s else ""
    rows = [
        ("now", f"{state.doing} for {state.since_s:.1f} s"),
        ("turned", f"{degrees(state.turned_rad):6.1f} °"),
        ("fastest", f"{peak:6.0f}{of_range} °/s{fast}"),
        ("sides done", " ".join(state.faces) or "none"),
        ("still open", open_moves_words(state)),
    ]
    if state.expanded_scale is not None:
        rows.append(("U of the scale", f"{state.expanded_scale:.1e}"))
    return tuple(rows)


def open_moves_words(state: HandSeen) -> str:
    """Return the numbers of moves that remain to be made, in words."""
    flips = f"{len(state.pairs)} moves from side to side" if len(state.pairs) != 1 else "1 move from side to side"
    turns = f", {len(state.turns)} whole turn{'' if len(state.turns) == 1 else 's'}" if state.turns else ""
    return flips + turns
