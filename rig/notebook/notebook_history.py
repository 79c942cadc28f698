"""The history in a notebook: all calibrations of a sensor, and changes between runs."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.errors import Refused
from rig.history.documents import COLUMNS, change_entry
from rig.history.series import Change, changes_in, time_of
from rig.history.storage.address import default_history_address, resolve_address
from rig.history.store import Past, Selection, open_history
from rig.history.terminal.history_tables import title_of, value_text
from rig.notebook.frames import frame
from rig.notebook.html import table
from rig.notebook.results import Result, solve
from rig.notebook.runs import Run
from rig.report.findings.history_records import HistoryRecord, Parameter
from rig.report.kinds.kind_registry import history_records

if TYPE_CHECKING:
    from pandas import DataFrame

DESCRIPTION = tuple(name for name in COLUMNS[: COLUMNS.index("parameter")] if name != "calibration")
HEADINGS = ("parameter", "before ± U", "now ± U", "E_n")


@dataclass(frozen=True, eq=False)
class Calibrations(Sequence[Past]):
    """Calibrations of a history, in the order of time."""

    pasts: tuple[Past, ...]

    def to_frame(self) -> "DataFrame":
        """Return one row for each calibration, indexed by its number, as a pandas table.

        `started_utc` are times. Every parameter has two columns in SI units, for example `kx` and, for its expanded
        uncertainty, `kx_expanded`; both are NaN if a calibration lacks it. Raise Refused `missing_extra`.
        """
        names = dict.fromkeys(name for past in self.pasts for name in past.parameters)
        columns: dict[str, Any] = {name: [_property_of(past, name) for past in self.pasts] for name in DESCRIPTION}
        for name in names:
            parameters = [past.parameters.get(name) for past in self.pasts]
            columns[name] = [float("nan") if p is None else p.value for p in parameters]
            columns[f"{name}_expanded"] = [float("nan") if p is None else p.expanded for p in parameters]
        return frame(columns, [past.id for past in self.pasts], "calibration")

    def __getitem__(self, index: Any) -> Any:
        return self.pasts[index]

    def __len__(self) -> int:
        return len(self.pasts)

    def __repr__(self) -> str:
        titles = dict.fromkeys(title_of(past.subject) for past in self.pasts)
        return f"<{len(self)} calibrations: {'; '.join(titles)}>"

    def _repr_html_(self) -> str:
        headings = ("number", "started (UTC)", "sensor", "rig", "verdict")
        rows = [(str(past.id), past.started_utc, title_of(past.subject), past.rig, past.verdict) for past in self.pasts]
        return table("calibrations", headings, rows)


@dataclass(frozen=True, eq=False)
class SensorChanges:
    """The changes of one sensor's parameters with their normalised errors E_n and significance."""

    title: str
    changes: tuple[Change, ...]

    @property
    def changed(self) -> tuple[Change, ...]:
        """The changes that are significant among all values of the two runs."""
        return tuple(change for change in self.changes if change.has_changed)

    def to_frame(self) -> "DataFrame":
        """Return one row for each parameter, SI units, as a pandas table. Raise Refused `missing_extra`."""
        columns = {
            "unit": [change.unit for change in self.changes],
            "before": [change.before.value for change in self.changes],
            "before_expanded": [change.before.expanded for change in self.changes],
            "now": [change.now.value for change in self.changes],
            "now_expanded": [change.now.expanded for change in self.changes],
            "normalised_error": [change.normalised_error for change in self.changes],
            "normalised_error_limit": [change.limit for change in self.changes],
            "changed": [change.has_changed for change in self.changes],
        }
        return frame(columns, [change.name for change in self.changes], "parameter")

    def to_dict(self) -> dict[str, Any]:
        """Return the parameters as `rig history compare --json` prints them."""
        return {change.name: change_entry(change) for change in self.changes}

    def __repr__(self) -> str:
        names = ", ".join(f"{change.name} (E_n {change.normalised_error:.1f})" for change in self.changed)
        return f"<{self.title}: {f'changed: {names}' if names else f'none of {len(self.changes)} values changed'}>"

    def _repr_html_(self) -> str:
        return table(self.title, HEADINGS, map(_row, self.changes))


@dataclass(frozen=True, eq=False)
class Changes(Mapping[str, SensorChanges]):
    """The changes from one run to another, by sensor: "gyro", and "gyro, acceleration" for its other quantities."""

    by_sensor: Mapping[str, SensorChanges]

    def __getitem__(self, name: str) -> SensorChanges:
        return self.by_sensor[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.by_sensor)

    def __len__(self) -> int:
        return len(self.by_sensor)

    def __repr__(self) -> str:
        return f"<changes: {', '.join(map(repr, self.values()))}>"

    def _repr_html_(self) -> str:
        return "".join(changes._repr_html_() for changes in self.values())


def calibrations(
    serial_number: str | None = None, *, part: str | None = None, history: str | Path | None = None
) -> Calibrations:
    """Return all calibrations of a serial number, of a part, or of all sensors, as `rig history` lists them.

    `history` is a file or a URL, by default RIG_HISTORY or, if not set, the user's own. Raise Refused `not_in_history`
    if the history has no calibration of this serial number, and what `open_history` raises.
    """
    address = None if history is None else str(history)
    with open_history(default_history_address(address) or resolve_address(None)) as opened:
        pasts = opened.calibrations(Selection(serial_number=serial_number, part=part))
    if not pasts and serial_number is not None:
        raise Refused(
            "not_in_history",
            f"no calibration of {serial_number} in the history matches",
            "Look with `rig history`, or enter runs with `rig history import`",
        )
    return Calibrations(tuple(pasts))


def changes(before: Run | Result, now: Run | Result) -> Changes:
    """Return the changes from a run to a later one, sensor by sensor, as `rig history compare` prints them.

    Sensors are the same if part, serial number, quantity and range are equal. A run is solved by its usual estimator;
    for another estimator, pass a result instead of the run. Raise Refused `not_comparable` without a common sensor.
    """
    first, second = ({_subject(record): record for record in _records(source)} for source in (before, now))
    by_sensor = {}
    both = [subject for subject in second if subject in first]
    pairs = [(_parameters(first[subject]), _parameters(second[subject])) for subject in both]
    for subject, sensor_changes in zip(both, changes_in(pairs), strict=True):
        new = second[subject]
        name = new.sensor if new.quantity == "rate" else f"{new.sensor}, {new.quantity}"
        by_sensor[name] = SensorChanges(title_of((*subject, False)), sensor_changes)
    if not by_sensor:
        raise Refused(
            "not_comparable",
            f"the first is of {_titles(first)}, the second of {_titles(second)}",
            "Give two calibrations of one sensor at one range",
        )
    return Changes(by_sensor)


Subject = tuple[str, str, str, float]


def _subject(record: HistoryRecord) -> Subject:
    return record.part, record.serial_number, record.quantity, record.full_scale


def _records(source: Run | Result) -> tuple[HistoryRecord, ...]:
    return history_records((solve(source) if isinstance(source, Run) else source).document)


def _parameters(sensor: HistoryRecord) -> dict[str, Parameter]:
    return {parameter.name: parameter for parameter in sensor.parameters}


def _titles(sensors: Mapping[Subject, HistoryRecord]) -> str:
    return "; ".join(title_of((*subject, False)) for subject in sensors) or "no sensor"


def _property_of(past: Past, name: str) -> Any:
    match name:
        case "run":
            return past.run_id
        case "started_utc":
            return time_of(past)
        case "temperature_c":
            return float("nan") if past.temperature_c is None else past.temperature_c
    return getattr(past, name)


def _row(change: Change) -> tuple[str, ...]:
    name = change.name if change.unit == "1" else f"{change.name} {change.unit}"
    changed = "changed " if change.has_changed else ""
    return name, value_text(change.before), value_text(change.now), f"{changed}{change.normalised_error:.2f}"
