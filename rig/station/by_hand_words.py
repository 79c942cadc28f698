"""What is said of a session by hand: the line for the operator, and what became of each move."""

from math import degrees

from rig.data.recording.hand_events import (
    HandAsked,
    HandBegunAnew,
    HandMoveRefused,
    HandMoveTaken,
    HandRested,
    HandRestRefused,
)
from rig.station.events import HandSeen, RunEvent

RED_FROM = 0.8  # of the range: from there on a reading may clip


def by_hand_line(event: RunEvent) -> str | None:
    """An event of a session by hand in one line; None for what only an instrument shows, and for other events."""
    text: str | None
    match event:
        case HandAsked(instruction, again, why):
            text = f"to do: {instruction.words}" if again is None else f"again: {why} To do: {instruction.words}"
        case HandRested(face=face):
            text = f"heard: it rests with the side {face} up"
        case HandMoveTaken(kind="flip", from_face=before, to_face=after):
            text = f"taken: from {before} to {after}"
        case HandMoveTaken(turns=turns, from_face=face):
            again_laid = f"taken: laid down again with the side {face} up"
            text = f"taken: {turns:+d} whole turns with the side {face} up" if turns else again_laid
        case HandMoveRefused(again=again):
            text = f"not taken: {again}"
        case HandRestRefused(again=again):
            text = f"no rest: {again}"
        case HandBegunAnew(again=again):
            text = f"begun anew: {again}; what was before does not count"
        case _:
            text = None
    return text


def live_rows(seen: HandSeen) -> tuple[tuple[str, str], ...]:
    """What a session shows of this moment, by the names of its rows."""
    peak, whole = degrees(seen.peak_rad_s), degrees(seen.range_rad_s)
    fast = "  TOO FAST" if whole and peak > RED_FROM * whole else ""
    of_range = f" of {whole:.0f}" if whole else ""
    rows = [
        ("now", f"{seen.doing} for {seen.since_s:.1f} s"),
        ("turned", f"{degrees(seen.turned_rad):6.1f} °"),
        ("fastest", f"{peak:6.0f}{of_range} °/s{fast}"),
        ("sides seen", " ".join(seen.faces) or "none"),
        ("still wanted", wanted_words(seen)),
    ]
    if seen.expanded_scale is not None:
        rows.append(("U of the scale", f"{seen.expanded_scale:.1e}"))
    return tuple(rows)


def wanted_words(seen: HandSeen) -> str:
    """How many moves are still open."""
    flips = f"{len(seen.pairs)} moves from side to side" if len(seen.pairs) != 1 else "1 move from side to side"
    turns = f", {len(seen.turns)} whole turn{'' if len(seen.turns) == 1 else 's'}" if seen.turns else ""
    return flips + turns
