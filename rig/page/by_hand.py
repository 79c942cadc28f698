"""A session by hand on the page: the instruction, the rig's response to the last move, the present movement."""

from math import degrees
from typing import Any

from rig.data.recording.hand_events import (
    HandAsked,
    HandBegunAnew,
    HandEvent,
    HandMoveAccepted,
    HandMoveRefused,
    HandRested,
    HandRestRefused,
)
from rig.motion.by_hand import FACES
from rig.station.by_hand_words import RED_FRACTION, open_moves_words
from rig.station.events import HandSeen

Section = dict[str, Any]


def live_section(event: HandSeen) -> Section:
    """Return the page section of the present movement, in degrees."""
    return {
        "doing": event.doing,
        "since_s": round(event.since_s, 1),
        "turned_deg": round(degrees(event.turned_rad), 1),
        "peak_deg_s": round(degrees(event.peak_rad_s)),
        "range_deg_s": round(degrees(event.range_rad_s)),
        "red_deg_s": round(RED_FRACTION * degrees(event.range_rad_s)),
        "scale_u": event.expanded_scale,
        "sides": [[face, face in event.faces] for face in FACES],
        "pairs": [list(pair) for pair in event.pairs],
        "wanted": open_moves_words(event),
        "turns": len(event.turns),
    }


def step(event: HandSeen) -> Section:
    """Return the progress of the session's moves; the remaining time is unknown."""
    count = event.accepted + len(event.pairs) + len(event.turns)
    # Step `number` is the last accepted move, which is complete. A hand's moves have no planned duration.
    return {
        "number": event.accepted,
        "count": count,
        "name": f"{event.accepted} of {count} moves accepted",
        "kind": "by_hand",
        "fraction": 1.0,
        "elapsed_s": 0.0,
        "remaining_s": 0.0,
    }


def update(before: Section, event: HandEvent) -> Section:
    """Return the page section after an event of a session by hand; rests, moves and reminders play a tone."""
    match event:
        case HandAsked(instruction, again, why):
            instruction_fields = {"say": instruction.say, "face": instruction.face, "turns": instruction.turns}
            now = {**before, "asked": {**instruction_fields, "words": instruction.words}, "again": again, "why": why}
            is_reminder = again is not None and before.get("tone") != "again"
            return _add_tone(now, "again") if is_reminder else now
        case HandRested(face=face):
            return _add_tone({**before, "face": face}, "rest")
        case HandMoveAccepted():
            return _add_tone(before, "accepted")
        case HandMoveRefused() | HandRestRefused() | HandBegunAnew():
            return _add_tone(before, "again")


def _add_tone(section: Section, tone: str) -> Section:
    return {**section, "tone": tone, "tones": section.get("tones", 0) + 1}
