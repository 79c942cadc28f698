"""What the floor's page shows, made of what stations tell and of what a history has. Pure."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from datetime import date, timedelta
from typing import Any

from rig.batch.status import NEWEST, Now
from rig.data.checked import parse_json, validate
from rig.errors.quoting import shorten
from rig.history.series import rig_states, subjects, trends
from rig.history.stations import LONGEST, Told
from rig.history.stations import MOST as MOST_RIGS
from rig.history.store import Past

DEAD_S = 3.5  # without a heartbeat, which comes every second
RECALLED_AHEAD = timedelta(days=30)
MOST = 200  # rows of a table
LONGEST_DOING = 300  # characters: an error with what to do
MOST_STATES = 12  # of parts that are counted; there are six
UNITS_OF_AGE = ((86_400, "days"), (3600, "h"), (60, "min"), (1, "s"))


def rigs(told: Iterable[Told], more: int = 0) -> dict[str, Any]:
    """Each rig as it is now, in a section of its own, "rig 0" to `MOST`, and in "rigs" how many, and how many `more`.

    A section of its own: only what has changed is sent. None stands where no rig is any more. A rig is named as the
    history names it; one that is silent without a last word is dead. What a station of another version, or somebody
    else, wrote there is `unread` if it is nothing a station says here.
    """
    cards = [_card(each) for each in told]
    places = {f"rig {place}": cards[place] if place < len(cards) else None for place in range(MOST_RIGS)}
    return {"rigs": {"count": len(cards), "more": more}, **places}


def _card(told: Told) -> dict[str, Any]:
    said = _read(told.told)
    state = str(said.get("state", "unread"))
    if not said.get("over") and (told.age_s is None or told.age_s > DEAD_S):
        state = "dead"
    named = {"rig": said.get("rig") or told.rig, "at": told.rig, "computer": told.computer}
    age = _age(told.age_s) if state == "dead" else ""
    return {**said, **{key: shorten(text) for key, text in named.items()}, "state": state, "age": age}


def _age(age_s: float | None) -> str:
    """How long ago, in two digits or so: what changes every second would be sent every second."""
    if age_s is None:
        return "at a time that cannot be"
    size, unit = next((each for each in UNITS_OF_AGE if age_s >= 2 * each[0]), UNITS_OF_AGE[-1])
    return f"{age_s // size:.0f} {unit} ago"


def todays(pasts: Iterable[Past], today: date) -> list[dict[str, Any]]:
    """The calibrations of a day (UTC), the newest first."""
    day = today.isoformat()
    rows = [
        {
            "number": past.id,
            "time": past.started_utc[11:16],
            "rig": shorten(past.rig),
            "serial": shorten(past.serial_number),
            "sensor": shorten(f"{past.part}, {past.quantity}"),
            "verdict": "void" if past.voided else shorten(past.verdict),
            "simulated": past.simulated,
        }
        for past in pasts
        if past.started_utc[:10] == day
    ]
    return rows[::-1][:MOST]


def standards(pasts: Sequence[Past]) -> list[dict[str, Any]]:
    """Each rig with check standards: whether it is in control, and by which parameters it is not."""
    found = []
    for state in rig_states(pasts):
        out = [name for name, chart in state.charts.items() if chart.alarm.size and chart.out_of_control]
        known = "too few" if not state.charts else "out" if out else "in"
        standards = [shorten(each) for each in state.standards[:MOST]]
        found.append({"rig": shorten(state.rig), "standards": standards, "control": known, "out": out[:MOST]})
    return found[:MOST]


def recalls(pasts: Sequence[Past], today: date) -> list[dict[str, Any]]:
    """Sensors that are due within a month, or were: by their first parameter to reach its limit."""
    found = []
    for (part, serial, quantity, _, simulated), series in subjects(pasts).items():
        due = [(trend.recall, name) for name, trend in trends(series).items() if trend.recall is not None]
        day, name = min(due, default=(None, ""))
        if day is not None and day <= today + RECALLED_AHEAD:
            row = {"day": day.isoformat(), "overdue": day < today, "parameter": name, "simulated": simulated}
            found.append({**row, "serial": shorten(serial), "sensor": shorten(f"{part}, {quantity}")})
    return sorted(found, key=lambda row: str(row["day"]))[:MOST]


def _read(told: str) -> dict[str, Any]:
    """What a station told, shortened to what a card has room for; nothing of what is no such text."""
    try:
        if len(told) > LONGEST:
            raise ValueError(f"it is longer than {LONGEST} characters")
        now = validate(Now, parse_json(told), "told")
    except (ValueError, RecursionError):
        return {}
    counts = {shorten(state): count for state, count in [*(now.counts or {}).items()][:MOST_STATES]}
    parts = [(shorten(serial), shorten(state)) for serial, state in now.parts[-NEWEST:]]
    words = {name: shorten(getattr(now, name)) for name in ("part", "operator", "work_order", "rig")}
    return {**asdict(now), **words, "doing": now.doing[:LONGEST_DOING], "counts": counts, "parts": parts}
