"""What the page shows of a session by hand: what is to be done, what was heard, what the hand does now."""

from math import degrees
from typing import Any

from rig.data.recording.hand_events import (
    HandAsked,
    HandBegunAnew,
    HandMoveRefused,
    HandMoveTaken,
    HandRested,
    HandRestRefused,
    OfTheHand,
)
from rig.motion.by_hand import FACES
from rig.station.by_hand_words import RED_FROM, wanted_words
from rig.station.events import HandSeen

Section = dict[str, Any]


def seen(event: HandSeen) -> Section:
    """The present moment, in degrees."""
    return {
        "doing": event.doing,
        "since_s": round(event.since_s, 1),
        "turned_deg": round(degrees(event.turned_rad), 1),
        "peak_deg_s": round(degrees(event.peak_rad_s)),
        "range_deg_s": round(degrees(event.range_rad_s)),
        "red_deg_s": round(RED_FROM * degrees(event.range_rad_s)),
        "scale_u": event.expanded_scale,
        "sides": [[face, face in event.faces] for face in FACES],
        "pairs": [list(pair) for pair in event.pairs],
        "wanted": wanted_words(event),
        "turns": len(event.turns),
    }


def step(event: HandSeen) -> Section:
    """How far the list is made; how long the rest of it takes nobody can say."""
    count = event.taken + len(event.pairs) + len(event.turns)
    return {
        "number": event.taken,
        "count": count,
        "name": f"{event.taken} of {count} moves taken",
        "kind": "by_hand",
        "fraction": 1.0,
        "elapsed_s": 0.0,
        "remaining_s": 0.0,
    }


def told(before: Section, event: OfTheHand) -> Section:
    """The section after something was asked, heard, taken or refused; each but the first has a tone of its own."""
    match event:
        case HandAsked(instruction, again, why):
            asked = {"say": instruction.say, "face": instruction.face, "turns": instruction.turns}
            now = {**before, "asked": {**asked, "words": instruction.words}, "again": again, "why": why}
            reminded = again is not None and before.get("tone") != "again"
            return _sounding(now, "again") if reminded else now
        case HandRested(face=face):
            return _sounding({**before, "face": face}, "rest")
        case HandMoveTaken():
            return _sounding(before, "taken")
        case HandMoveRefused() | HandRestRefused() | HandBegunAnew():
            return _sounding(before, "again")


def _sounding(section: Section, tone: str) -> Section:
    return {**section, "tone": tone, "tones": section.get("tones", 0) + 1}
