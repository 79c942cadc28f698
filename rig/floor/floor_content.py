"""The content of the floor's page, from the states of stations and the calibrations of a history. Pure."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from datetime import date, timedelta
from typing import Any

from rig.batch.status import MAX_PARTS, Now
from rig.data.validation import parse_json, validate
from rig.errors.quoting import shorten
from rig.history.series import rig_states, subjects, trends
from rig.history.stations import MAX_STATE, StationState
from rig.history.stations import MAX_STATIONS as MOST_RIGS
from rig.history.store import Past

MAX_SILENCE_S = 3.5  # of a rig's heartbeat, which comes every second
RECALL_NOTICE = timedelta(days=30)
MAX_ROWS = 200  # of a table
MAX_DOING = 300  # characters: an error with its remedy
MAX_STATES = 12  # counted states of parts; there are six
UNITS_OF_AGE = ((86_400, "days"), (3600, "h"), (60, "min"), (1, "s"))


def rigs(stations: Iterable[StationState], more: int = 0) -> dict[str, Any]:
    """Return the rigs' present states in sections "rig 0", "rig 1" …; "rigs" has their number, and `more`.

    The states have separate sections because only changed sections are sent. A section without a rig is None. A rig
    that has become silent without a last state is dead. A state that this version cannot read is `unread`. `more`: the
    number of rigs that are not shown.
    """
    cards = [_card(station) for station in stations]
    sections = {f"rig {i}": cards[i] if i < len(cards) else None for i in range(MOST_RIGS)}
    return {"rigs": {"count": len(cards), "more": more}, **sections}


def _card(station: StationState) -> dict[str, Any]:
    fields = _read(station.state)
    state = str(fields.get("state", "unread"))
    if not fields.get("over") and (station.age_s is None or station.age_s > MAX_SILENCE_S):
        state = "dead"
    names = {"rig": fields.get("rig") or station.rig, "at": station.rig, "computer": station.computer}
    age = _age(station.age_s) if state == "dead" else ""
    return {**fields, **{key: shorten(text) for key, text in names.items()}, "state": state, "age": age}


def _age(age_s: float | None) -> str:
    """Return the age in about two digits, so that the text rarely changes and is rarely sent."""
    if age_s is None:
        return "at an implausible time"
    size, unit = next((unit for unit in UNITS_OF_AGE if age_s >= 2 * unit[0]), UNITS_OF_AGE[-1])
    return f"{age_s // size:.0f} {unit} ago"


def todays(pasts: Iterable[Past], today: date) -> list[dict[str, Any]]:
    """Return the calibrations of a day (UTC), the newest first."""
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
    return rows[::-1][:MAX_ROWS]


def standards(pasts: Sequence[Past]) -> list[dict[str, Any]]:
    """Return each rig with check standards, whether it is in control, and the parameters out of control."""
    rows = []
    for state in rig_states(pasts):
        out = [name for name, chart in state.charts.items() if chart.alarm.size and chart.out_of_control]
        control = "too few" if not state.charts else "out" if out else "in"
        standards = [shorten(standard) for standard in state.standards[:MAX_ROWS]]
        rows.append({"rig": shorten(state.rig), "standards": standards, "control": control, "out": out[:MAX_ROWS]})
    return rows[:MAX_ROWS]


def recalls(pasts: Sequence[Past], today: date) -> list[dict[str, Any]]:
    """Return sensors due for calibration within a month, or overdue, by the parameter that reaches its limit first."""
    rows = []
    for (part, serial, quantity, _, simulated), series in subjects(pasts).items():
        due = [(trend.recall, name) for name, trend in trends(series).items() if trend.recall is not None]
        day, name = min(due, default=(None, ""))
        if day is not None and day <= today + RECALL_NOTICE:
            row = {"day": day.isoformat(), "overdue": day < today, "parameter": name, "simulated": simulated}
            rows.append({**row, "serial": shorten(serial), "sensor": shorten(f"{part}, {quantity}")})
    return sorted(rows, key=lambda row: str(row["day"]))[:MAX_ROWS]


def _read(text: str) -> dict[str, Any]:
    """Return a station's state, shortened for the station's card on the page; empty for an invalid text."""
    try:
        if len(text) > MAX_STATE:
            raise ValueError(f"it is longer than {MAX_STATE} characters")
        now = validate(Now, parse_json(text), "state")
    except (ValueError, RecursionError):
        return {}
    counts = {shorten(state): count for state, count in [*(now.counts or {}).items()][:MAX_STATES]}
    parts = [(shorten(serial), shorten(state)) for serial, state in now.parts[-MAX_PARTS:]]
    words = {name: shorten(getattr(now, name)) for name in ("part", "operator", "work_order", "rig")}
    own_page = {"verdict": None, "why": "", "truth": "", "sensors": ()}  # only the station's own page shows them
    return {**asdict(now), **words, **own_page, "doing": now.doing[:MAX_DOING], "counts": counts, "parts": parts}
