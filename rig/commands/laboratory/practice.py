"""Incidents (faults, remedies, moves by hand) that a person causes by typed words in a simulated laboratory."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from rig.commands.laboratory.laboratory_process import send_request
from rig.errors import Fault

SLIDER = re.compile(r"slider (\d{1,3}) ?%?")
Request = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Incident:
    """An incident in the simulated laboratory: the request to the control channel, and a description of its effect."""

    request: Request
    text: str


def _incident(text: str, do: str, **arguments: Any) -> Incident:
    return Incident(MappingProxyType({"do": do, **arguments}), text)


def _slider(percent: int) -> Incident:
    return _incident(f"the speed slider on the pendant is at {percent} %", "speed_slider", fraction=percent / 100)


def _lay(side: str) -> Incident:
    return _incident(f"the hand lays it down with the side {side} up", "instruct", say="lay", face=side)


INCIDENTS: Mapping[str, Incident] = MappingProxyType(
    {
        "unplug": _incident("the board's cable is pulled out", "unplug_board"),
        "plug in": _incident("the board's cable is plugged in again", "plug_in_board"),
        "power dip": _incident("the board loses its power for a moment, and starts again", "power_dip"),
        "slider 50": _slider(50),
        "slider 100": _slider(100),
        "protective stop": _incident("the arm has touched something, and stops", "protective_stop"),
        "unlock": _incident("the protective stop is unlocked on the pendant", "unlock"),
        "local control": _incident("the pendant is switched to local control", "remote_control", on=False),
        "remote control": _incident("the pendant is switched to remote control", "remote_control", on=True),
        "other client": _incident(
            "a gripper's program takes the input registers", "registers_in_use", first=0, last=47
        ),
        "other client gone": _incident("the gripper's program gives the input registers back", "registers_free"),
        **{f"lay {side}": _lay(side) for side in ("+x", "-x", "+y", "-y", "+z", "-z")},
        "turn": _incident(
            "the hand turns it once round on the table, counterclockwise", "instruct", say="turn", face="+z", turns=1
        ),
    }
)


def opening_text(control: str) -> str:
    """Return the greeting of a simulated laboratory for a person who practises in it. Raise Fault `world_ended`."""
    return (
        f"The laboratory is ready. {_help_text(control)}\nAn empty line shows this again; Ctrl-D ends the laboratory."
    )


def find_incident(words: str) -> Incident | None:
    """Return the incident that `words` name, None if they name none; after `slider` comes a percentage up to 100."""
    words = " ".join(words.lower().split())
    if (slider := SLIDER.fullmatch(words)) is not None and int(slider[1]) <= 100:
        return _slider(int(slider[1]))
    return INCIDENTS.get(words)


def practise(control: str, words: str) -> str:
    """Cause the incident that `words` name in the laboratory; return its effect, or why it cannot happen, in words.

    For words that name no incident, return the list of incidents. Raise Fault `world_ended`.
    """
    incident = find_incident(words)
    if incident is None:
        unknown = "" if words.strip() in ("", "help", "?") else f"{words.strip()!r} is unknown. "
        return unknown + _help_text(control)
    reply = _send(control, incident.request)
    if "known" in reply:  # the requests that it knows
        return "this cannot happen in this laboratory"
    if not reply["ok"]:
        reason = str(reply["error"]).removeprefix(f"{incident.request['do']}: ")
        return f"not now: {reason}"
    return incident.text


def _help_text(control: str) -> str:
    """Return the list of the incidents that the laboratory's control channel can cause. Raise Fault `world_ended`."""
    requests = _send(control, {"do": "help"})["known"]
    possible = ((words, item) for words, item in INCIDENTS.items() if item.request["do"] in requests)
    return "\n".join(["What can happen here:", *(f"  {words:18}{item.text}" for words, item in possible)])


def _send(control: str, request: Request) -> Request:
    """Send a request to the laboratory, and return the reply. Raise Fault `world_ended` if none comes."""
    try:
        return send_request(control, request)
    except (OSError, ValueError) as error:
        raise Fault("world_ended", f"the simulated laboratory has ended ({error})", "Start it again") from error
