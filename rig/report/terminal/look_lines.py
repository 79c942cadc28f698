"""The contents of another program's file, and its possible solutions, as lines for a terminal of 80 columns."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rig.analysis.external.convention import Convention
from rig.analysis.log_contents import LookedFile
from rig.analysis.log_trials import Trial
from rig.data.quantity import ACCELERATION, RATE
from rig.errors import RigError
from rig.errors.quoting import shorten
from rig.observation.formats.table_layout import TableLayout
from rig.observation.log_survey import LogSurvey
from rig.sensors.lines.column_units import UNSTATED
from rig.sensors.lines.log_columns import LogColumns

WIDTH = 14
COLUMNS = (
    ("time", "time_s"),
    ("gyroscope", "x_rad_s", "y_rad_s", "z_rad_s"),
    ("accelerometer", "x_m_s2", "y_m_s2", "z_m_s2"),
    ("magnetometer", "x_t", "y_t", "z_t"),
    ("temperature", "temperature_c"),
    ("quaternion", "qw", "qx", "qy", "qz"),
)
MAX_NAME_CHARACTERS = 46
PLACEHOLDER = "ATTITUDES.csv"
MIN_LAG_S = 0.004
MAX_LISTED_TURNS = 24


def describe_file(looked: LookedFile) -> Iterator[str]:
    """Yield lines on the file's format, its columns, and its content."""
    if looked.layout is not None and looked.guess is not None:
        yield from _describe_table(looked.path, looked.layout, looked.guess)
    else:
        yield f"{looked.path}:"
    if looked.others:
        yield _row("other rows", f"{looked.others}, with readings of other sensors alone")
    if looked.note:
        yield _row("note", looked.note)
    if looked.survey is not None:
        yield from _describe_readings(looked, looked.survey)
    if looked.attitudes is not None:
        yield from _describe_attitudes(looked.attitudes)
        yield from (_row("left out", str(omitted)) for omitted in looked.omitted_attitudes)
    for refusal in looked.refusals:
        yield _row("refused", str(refusal))


def _describe_table(path: Path, layout: TableLayout, guess: LogColumns) -> Iterator[str]:
    """Yield lines on the table's columns, on unknown properties and on missing values."""
    heading = f"heading in line {layout.skip_lines + 1}" if layout.has_heading else "no heading"
    yield f"{path}: {layout.rows} rows, {len(layout.headings)} columns, {heading}"
    if layout.has_groups:
        yield _row("note", "the heading has two lines: columns are named by number")
    if layout.is_shifted:
        yield _row("note", "the rows have one cell more than the heading: columns are named by number")
    entries = {**guess.motion, **guess.samples}
    for name, *columns in COLUMNS:
        if columns[0] in entries and entries[columns[0]].get("unit") != UNSTATED:
            yield _row(name, _spell(*(entries[column] for column in columns)))
    if guess.others:
        yield _row("not read", shorten(" ".join(guess.others)))
    yield from (_row("", reason) for reason in guess.reasons)
    for gap in guess.gaps:
        yield _row("UNKNOWN", gap)
    if layout.missing:
        yield _row("missing", f"values are written as {' '.join(layout.missing)}")


def describe_convention(convention: Convention | None, *, is_order_named: bool) -> Iterator[str]:
    """Yield lines on the quaternions' direction, reference and clock, found by comparison with the gyroscope.

    The order of the four numbers is included unless the log names it (`is_order_named`).
    """
    if convention is None or convention.inverse is None:
        what = "the gyroscope does not show the direction of the quaternions"
        why = "the body turned slowly, briefly or about one axis at a time, or they are of another body or clock"
        yield _row("direction", f"{what}: {why}")
        return
    order = "" if is_order_named else f", read as {'x y z w' if convention.scalar_last else 'w x y z'}"
    direction = "room to body (motion_inverse)" if convention.inverse else "body to room"
    yield _row("direction", f"{direction}{order}: {100 * convention.explained:.2f} % of the motion agrees")
    if convention.up:
        yield _row("up", f"{convention.up} of the room, by the accelerometer")
    if abs(convention.lag_s) >= MIN_LAG_S:
        later = "readings" if convention.lag_s > 0 else "attitudes"
        yield _row("clock", f"the {later} come {1e3 * abs(convention.lag_s):.0f} ms later; the solution finds this")


@dataclass(frozen=True, slots=True)
class TriedSolutions:
    """The solutions that were tried for a log.

    - `columns`: the file of the log's column map, if any.
    - `at_rest`: why the log was not recorded at rest; None if it was.
    - `up`: the axis that points upwards; `finds_clock`: whether the reference has a clock of its own.
    - `turns`, `attitudes`: the trials, None if none was made.
    """

    columns: Path | None
    at_rest: RigError | None
    up: str
    finds_clock: bool
    turns: Trial | None
    attitudes: Trial | None


def describe_solutions(looked: LookedFile | None, reference: LookedFile | None, tried: TriedSolutions) -> Iterator[str]:
    """Yield the solutions that the files allow, with the command of each."""
    option = "" if tried.columns is None else f" --columns {tried.columns}"
    if looked is None or looked.survey is None:
        if reference is not None:
            yield "with the log of a sensor that was turned with it:"
            yield f"  rig look LOG {reference.path}"
        return
    log = looked.path
    yield "what it allows:"
    why = None if tried.at_rest is None else tried.at_rest.what
    yield _row("at rest", f"rig allan {log}{option}" if why is None else f"no: {why}")
    if tried.turns is not None:
        command = f"rig solve {log} --turns --clock-ppm 50{option}"
        why = tried.turns.obstacle
        yield _row("by hand", command if why is None else f"no: {why}")
    if RATE in looked.quantities:
        yield from _describe_sweeps(looked, f"rig solve {log} --sweeps SWEEPS.csv{option}", listed=reference is None)
    if reference is None:
        yield _row("attitudes", f"rig solve {log} --attitudes {PLACEHOLDER}{option}")
        yield _row("", f"{PLACEHOLDER} gives the attitudes of the body: time_s qw qx qy qz")
    elif tried.attitudes is not None:
        options = " --any-mounting" + (f" --up={tried.up}" if tried.up not in ("", "+z") else "")
        options += " --estimate-clock-offset" if tried.finds_clock else ""
        options += "".join(f" --only {sensor}" for sensor in tried.attitudes.only)
        why = tried.attitudes.obstacle
        command = f"rig solve {log} --attitudes {reference.path}{option}{options}"
        yield _row("attitudes", command if why is None else f"no: {why}")


def _describe_sweeps(looked: LookedFile, command: str, *, listed: bool) -> Iterator[str]:
    """Yield the command for sweeps, and, if `listed`, the turns with their times as `SWEEPS.csv` has them."""
    turns = () if looked.survey is None else looked.survey.turns
    if not turns:
        yield _row("sweeps", "no turn from rest to rest; steady turns need a file that states them")
        return
    yield _row("sweeps", command)
    number = "1 turn" if len(turns) == 1 else f"{len(turns)} turns"
    yield _row("", f"SWEEPS.csv states the {number}: start_s end_s axis_x axis_y axis_z angle_rad")
    if not listed:
        return
    yield _row("", "start_s, end_s, axis, angle by the readings (state the true one):")
    for turn in turns[:MAX_LISTED_TURNS]:
        start_s, end_s = (looked.origin_s + time_s for time_s in (turn.window.start_s, turn.window.end_s))
        yield _row("", f"{start_s:10.2f} {end_s:10.2f}  {turn.axis:<5} {np.degrees(turn.angle_rad):7.1f}°")
    if len(turns) > MAX_LISTED_TURNS:
        yield _row("", f"and {len(turns) - MAX_LISTED_TURNS} more")


def _row(name: str, text: str) -> str:
    return f"  {name:<{WIDTH}}{text}"


def _spell(*entries: Mapping[str, Any]) -> str:
    """Return a text on the columns (`entries`) of one quantity: their names, then their unit."""
    names = " ".join(str(entry["column"]) for entry in entries)
    entry = entries[0]
    unit = str(entry.get("unit", "date and time" if len(entries) == 1 else ""))
    if "lsb_per_unit" in entry:
        unit = f"{entry['lsb_per_unit']} steps a {unit}"
    if "factor" in entry:
        unit = f"{entry['factor']:g} {unit} a step"
    wraps = f", begins again at {entry['wraps_at']}" if "wraps_at" in entry else ""
    unit = "" if unit == "1" else unit
    return f"{shorten(names)[:MAX_NAME_CHARACTERS]:<24} {unit}{wraps}".rstrip()


def _describe_readings(looked: LookedFile, survey: LogSurvey) -> Iterator[str]:
    """Yield lines on the sampling, the largest readings, the rests and the turns of a log."""
    sampling = survey.sampling
    rate = f"{1 / sampling.interval_s:.5g} Hz over {survey.span_s:.1f} s"
    uncounted = f", about {100 * sampling.scattered:.1f} % missing at unknown times" if sampling.scattered else ""
    yield _row("sampling", rate + uncounted)
    assert looked.samples is not None, "there is a survey of them"
    yield from (_row("", note) for note in looked.samples.notes)
    yield from (_row("left out", str(omitted)) for omitted in looked.samples.omitted)
    for quantity, largest in survey.largest.items():
        rest = f", {survey.at_rest[quantity]:.4g} at rest" if quantity in survey.at_rest else ""
        more = f" ({np.degrees(largest):.4g} °/s)" if quantity == RATE else ""
        yield _row(quantity.sensor, f"up to {largest:.4g} {quantity.unit}{more}{rest}")
    if survey.rests:
        lengths = [rest.end_s - rest.start_s for rest in survey.rests]
        faces = f"; gravity in {survey.faces} directions" if ACCELERATION in looked.quantities else ""
        yield _row("rests", f"{len(lengths)}, of {min(lengths):.3g} to {max(lengths):.3g} s, "
                   f"{sum(lengths):.4g} s in all{faces}")  # fmt: skip
    else:
        yield _row("rests", "none")
    if survey.turns:
        counts = Counter(turn.axis for turn in sorted(survey.turns, key=lambda turn: (turn.axis[-1], turn.axis)))
        turns = ", ".join(f"{axis} {count}" for axis, count in counts.items())
        yield _row("turns", f"from rest to rest, by axis: {turns}")


def _describe_attitudes(attitudes: Mapping[str, Any]) -> Iterator[str]:
    """Yield lines on the number, rate and longest gap of a file's attitudes."""
    middles_s = np.sort((attitudes["start_s"] + attitudes["end_s"]) / 2)
    steps_s = np.diff(middles_s)
    usual_s = float(np.median(steps_s)) if len(steps_s) else 0.0
    rate = f"{1 / usual_s:.4g} Hz" if usual_s > 0 else "one time"
    yield _row("attitudes", f"{len(middles_s)} rows at {rate}, from {middles_s[0]:.10g} to {middles_s[-1]:.10g} s")
    if usual_s > 0 and (longest := float(steps_s.max())) > 3 * usual_s:
        at_s = float(middles_s[int(steps_s.argmax())])
        yield _row("", f"the longest step lasts {longest:.3g} s, after {at_s:.10g} s")
