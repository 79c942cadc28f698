"""The laboratory's memory from a notebook: all calibrations of a sensor, and what changed from one run to another."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.errors import Refused
from rig.history.documents import COLUMNS, change_entry
from rig.history.series import Change, changes_in, time_of
from rig.history.storage.address import own_place, place
from rig.history.store import Past, Selection, open_history
from rig.history.terminal.tables import title_of, value_text
from rig.notebook.frames import frame
from rig.notebook.html import table
from rig.notebook.results import Result, solve
from rig.notebook.runs import Run
from rig.report.findings.followed import Followed, Parameter
from rig.report.kinds.registry import followed

if TYPE_CHECKING:
    from pandas import DataFrame

ABOUT = tuple(name for name in COLUMNS[: COLUMNS.index("parameter")] if name != "calibration")
HEADINGS = ("parameter", "before ± U", "now ± U", "E_n")


@dataclass(frozen=True, eq=False)
class Calibrations(Sequence[Past]):
    """Calibrations out of a history, in the order of time."""

    pasts: tuple[Past, ...]

    def to_frame(self) -> "DataFrame":
        """One row for each calibration, its number as index, as a pandas table.

        `started_utc` are times; every parameter has two columns, `kx` and its expanded uncertainty `kx_expanded`, in SI
        units, NaN where a calibration does not have it. Raises Refused `missing_extra`.
        """
        names = dict.fromkeys(name for past in self.pasts for name in past.parameters)
        columns: dict[str, Any] = {name: [_about(past, name) for past in self.pasts] for name in ABOUT}
        for name in names:
            found = [past.parameters.get(name) for past in self.pasts]
            columns[name] = [float("nan") if each is None else each.value for each in found]
            columns[f"{name}_expanded"] = [float("nan") if each is None else each.expanded for each in found]
        return frame(columns, [past.id for past in self.pasts], "calibration")

    def __getitem__(self, place: Any) -> Any:
        return self.pasts[place]

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
    """The changes of one sensor's parameters with their normalised errors E_n, and which chance does not explain."""

    title: str
    changes: tuple[Change, ...]

    @property
    def changed(self) -> tuple[Change, ...]:
        """Return the values that have changed by more than chance explains, among all values of the two runs."""
        return tuple(each for each in self.changes if each.has_changed)

    def to_frame(self) -> "DataFrame":
        """One row for each parameter, SI units, as a pandas table. Raises Refused `missing_extra`."""
        columns = {
            "unit": [each.unit for each in self.changes],
            "before": [each.before.value for each in self.changes],
            "before_expanded": [each.before.expanded for each in self.changes],
            "now": [each.now.value for each in self.changes],
            "now_expanded": [each.now.expanded for each in self.changes],
            "normalised_error": [each.normalised_error for each in self.changes],
            "normalised_error_limit": [each.limit for each in self.changes],
            "changed": [each.has_changed for each in self.changes],
        }
        return frame(columns, [each.name for each in self.changes], "parameter")

    def to_dict(self) -> dict[str, Any]:
        """What `rig history compare --json` says of the parameters."""
        return {each.name: change_entry(each) for each in self.changes}

    def __repr__(self) -> str:
        told = ", ".join(f"{each.name} (E_n {each.normalised_error:.1f})" for each in self.changed)
        return f"<{self.title}: {f'changed: {told}' if told else f'none of {len(self.changes)} values changed'}>"

    def _repr_html_(self) -> str:
        return table(self.title, HEADINGS, map(_row, self.changes))


@dataclass(frozen=True, eq=False)
class Changes(Mapping[str, SensorChanges]):
    """What changed from one run to another, by sensor: "gyro", and "gyro, acceleration" of what else it measures."""

    of: Mapping[str, SensorChanges]

    def __getitem__(self, name: str) -> SensorChanges:
        return self.of[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.of)

    def __len__(self) -> int:
        return len(self.of)

    def __repr__(self) -> str:
        return f"<changes: {', '.join(map(repr, self.values()))}>"

    def _repr_html_(self) -> str:
        return "".join(each._repr_html_() for each in self.values())


def calibrations(
    serial_number: str | None = None, *, part: str | None = None, history: str | Path | None = None
) -> Calibrations:
    """All calibrations of a serial number, or of a part, or all there are, as `rig history` lists them.

    `history` is a file or a URL, by default what RIG_HISTORY names, else the user's own. Raises Refused
    `not_in_history` where there is none of that serial number, and as `open_history`.
    """
    said = None if history is None else str(history)
    with open_history(own_place(said) or place(None)) as opened:
        found = opened.calibrations(Selection(serial_number=serial_number, part=part))
    if not found and serial_number is not None:
        raise Refused(
            "not_in_history",
            f"no calibration of {serial_number} in the history fits",
            "Look with `rig history`, or enter runs with `rig history import`",
        )
    return Calibrations(tuple(found))


def changes(before: Run | Result, now: Run | Result) -> Changes:
    """What changed from a run to a later one, sensor by sensor, as `rig history compare` prints it.

    Sensors are the same by part, serial number, quantity and range. A run is solved by its usual estimator; give
    results to compare what other estimators say. Raises Refused `not_comparable` where the two share no sensor.
    """
    first, second = ({_same(each): each for each in _followed(of)} for of in (before, now))
    found = {}
    both = [subject for subject in second if subject in first]
    pairs = [(_by_name(first[subject]), _by_name(second[subject])) for subject in both]
    for subject, changed in zip(both, changes_in(pairs), strict=True):
        new = second[subject]
        name = new.sensor if new.quantity == "rate" else f"{new.sensor}, {new.quantity}"
        found[name] = SensorChanges(title_of((*subject, False)), changed)
    if not found:
        raise Refused(
            "not_comparable",
            f"the first is of {_named(first)}, the second of {_named(second)}",
            "Give two calibrations of one sensor at one range",
        )
    return Changes(found)


Subject = tuple[str, str, str, float]


def _same(of: Followed) -> Subject:
    return of.part, of.serial_number, of.quantity, of.full_scale


def _followed(of: Run | Result) -> tuple[Followed, ...]:
    return followed((solve(of) if isinstance(of, Run) else of).document)


def _by_name(sensor: Followed) -> dict[str, Parameter]:
    return {parameter.name: parameter for parameter in sensor.parameters}


def _named(sensors: Mapping[Subject, Followed]) -> str:
    return "; ".join(title_of((*each, False)) for each in sensors) or "no sensor"


def _about(past: Past, name: str) -> Any:
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
