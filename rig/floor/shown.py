"""What the floor's page shows, made of what stations tell and of what a history has. Pure."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from datetime import date, datetime, timedelta
from typing import Any

from rig.batch.status import Now
from rig.data.checked import checked
from rig.history.series import rig_states, subjects, trends
from rig.history.stations import Told
from rig.history.store import Past

DEAD_S = 3.5  # without a heartbeat, which comes every second
RECALLED_AHEAD = timedelta(days=30)
MOST = 200  # rows of a table


def rigs(told: Iterable[Told]) -> list[dict[str, Any]]:
    """Each rig as it is now, named as the history names it; one that is silent without a last word is dead.

    What a station of another version, or somebody else, wrote there is `unread` if it is nothing a station says here.
    """
    shown = []
    for each in told:
        said = _read(each.told)
        state = str(said.get("state", "unread"))
        if not said.get("over") and each.age_s > DEAD_S:
            state = "dead"
        named = {"rig": said.get("rig") or each.rig, "at": each.rig, "computer": each.computer}
        shown.append({**said, **named, "state": state, "age_s": round(each.age_s)})
    return shown


def todays(pasts: Iterable[Past], today: date) -> list[dict[str, Any]]:
    """The calibrations of a day (UTC), the newest first."""
    day = today.isoformat()
    rows = [
        {
            "number": past.id,
            "time": datetime.fromisoformat(past.started_utc).strftime("%H:%M"),
            "rig": past.rig,
            "serial": past.serial_number,
            "sensor": f"{past.part}, {past.quantity}",
            "verdict": "void" if past.voided else past.verdict,
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
        found.append({"rig": state.rig, "standards": list(state.standards), "control": known, "out": out})
    return found


def recalls(pasts: Sequence[Past], today: date) -> list[dict[str, Any]]:
    """Sensors that are due within a month, or were: by their first parameter to reach its limit."""
    found = []
    for (part, serial, quantity, _, simulated), series in subjects(pasts).items():
        due = [(trend.recall, name) for name, trend in trends(series).items() if trend.recall is not None]
        day, name = min(due, default=(None, ""))
        if day is not None and day <= today + RECALLED_AHEAD:
            row = {"day": day.isoformat(), "overdue": day < today, "serial": serial, "sensor": f"{part}, {quantity}"}
            found.append({**row, "parameter": name, "simulated": simulated})
    return sorted(found, key=lambda row: str(row["day"]))[:MOST]


def _read(told: str) -> dict[str, Any]:
    """What a station told; nothing of what is no such text."""
    try:
        return asdict(checked(Now, json.loads(told), "told"))
    except (ValueError, RecursionError):
        return {}
