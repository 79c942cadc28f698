"""A history as somebody reads it in a terminal that is not wide."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from io import StringIO, TextIOWrapper
from pathlib import Path

import pytest
from rich.console import Console

from rig.data.absent import NO_ARM
from rig.history.series import Trend, changes_between, rig_states, subjects, trends
from rig.history.store import History, Past, open_history
from rig.history.terminal.fitting_table import FittingTable, TableColumn
from rig.history.terminal.history_tables import (
    calibrations_table,
    changes_table,
    parameters_table,
    trend_lines,
    trends_table,
)
from support.history.past_runs import FIRST, SCALE, STD, finish_run

ANGLE = "nonorth_yz rad"


@pytest.fixture
def history(tmp_path: Path) -> Iterator[History]:
    with open_history(str(tmp_path / "history.sqlite")) as opened:
        yield opened


def printed(table: FittingTable, width: int) -> str:
    out = StringIO()
    Console(file=out, width=width, highlight=False).print(table)
    assert max(map(len, out.getvalue().splitlines())) <= width
    return out.getvalue()


def headings(text: str) -> list[str]:
    row = next(line for line in text.splitlines() if line.startswith("┃"))
    return [word.strip() for word in row.strip("┃").split("┃")]


def a_year(history: History, runs: int = 12, step_days: float = 30.0) -> list[Past]:
    for i in range(runs):
        scatter = ((5 * i) % 7 - 3) * 1e-5
        history.enter(finish_run(step_days * i, (1.01 + 1e-4 * i + scatter, 0.99 - scatter, 1 + 2 * scatter)))
    return history.calibrations()


def trends_of(pasts: Sequence[Past]) -> tuple[FittingTable, dict[str, Trend]]:
    ((subject, series),) = subjects(pasts).items()
    found = trends(series)
    return trends_table(subject, list(found.values())), found


@pytest.mark.slow
@pytest.mark.parametrize("width", [60, 80])
def test_names_and_headings_are_whole_in_a_narrow_terminal(history: History, width: int) -> None:
    pasts = a_year(history)
    tables = (
        calibrations_table(pasts),
        trends_of(pasts)[0],
        changes_table("1 and 12", changes_between(pasts[:1], pasts[-1:])[pasts[-1].subject]),
        parameters_table(pasts[-1]),
    )
    for table in tables:
        text = printed(table, width)
        assert "…" not in text
        shorter = [column.shorter.heading for column in table.columns if column.shorter is not None]
        assert set(headings(text)) <= {*shorter, *(column.heading for column in table.columns)}
        assert "" not in headings(text)
        rows = [line for line in text.splitlines() if line.startswith("│")]
        assert len(rows) == len(table.columns[0].cells)  # no row takes two lines
    for table in tables[1:]:
        assert all(name in printed(table, width) for name in (ANGLE, "nonorth_zx rad", "nonorth_xy rad"))


@pytest.mark.slow
def test_a_wider_terminal_shows_more_columns(history: History) -> None:
    table = trends_of(a_year(history))[0]
    narrow, usual, wide = (headings(printed(table, width)) for width in (60, 80, 140))
    assert {"parameter", "last ± U", "trend"} <= set(narrow) < set(usual) < set(wide)
    assert "drift a year ± U" in usual and wide == [*(column.heading for column in table.columns if any(column.cells))]


@pytest.mark.slow
def test_a_column_that_holds_nothing_is_left_out(history: History) -> None:
    assert headings(printed(trends_of(a_year(history, runs=2))[0], 140)) == ["parameter", "trend", "last ± U", "runs"]


def test_what_fits_nowhere_is_folded_and_not_cut() -> None:
    name = "a-serial-number-that-is-longer-than-the-line-it-is-to-stand-on"
    text = printed(FittingTable("", (TableColumn("sensor", [name]), TableColumn("value", ["1.0"]))), 30)
    assert name in re.sub(r"[^a-z-]", "", "".join(row[:22] for row in text.splitlines()[3:]))


@pytest.mark.slow
def test_a_picture_shows_what_has_changed_beyond_its_u(history: History) -> None:
    for day in range(4):
        history.enter(finish_run(day, (SCALE[0] + day * 40 * float(STD[0]), *SCALE[1:])))
    table = trends_of(history.calibrations())[0]
    pictures = dict(zip(table.columns[0].cells, table.columns[1].cells, strict=True))
    assert pictures["kx"] == "▁▃▆█" and len(set(pictures["ky"])) == 1


@pytest.mark.slow
def test_a_terminal_without_blocks_gets_letters(history: History, tmp_path: Path) -> None:
    table = trends_of(a_year(history))[0]
    with TextIOWrapper((tmp_path / "out").open("wb"), encoding="ascii", errors="replace") as out:
        Console(file=out, width=80).print(table)
    kx = next(line for line in (tmp_path / "out").read_text("ascii").splitlines() if "kx" in line)
    assert re.search(r"__+\.+-+'+", kx)


@pytest.mark.slow
@pytest.mark.parametrize(("step_days", "stated"), [(0.5, False), (2.0, False), (2.6, True)])
def test_no_drift_a_year_is_stated_of_a_few_days(history: History, step_days: float, *, stated: bool) -> None:
    table, found = trends_of(a_year(history, runs=5, step_days=step_days))
    assert ("drift a year ± U" in headings(printed(table, 140))) == stated
    assert any("need 10 days" in line for line in trend_lines(found)) != stated


@pytest.mark.slow
def test_the_mean_scale_factor_is_explained_where_it_is_printed(history: History) -> None:
    _, found = trends_of(a_year(history, runs=2))
    assert any(line.startswith("k: the mean of the scale factors") for line in trend_lines(found))


@pytest.mark.slow
def test_readings_from_files_are_of_no_rig_that_is_called_none(history: History) -> None:
    for day in range(6):
        run = finish_run(day, check_standard=True)
        provenance = run.document.provenance.model_copy(update={"arm_serial_number": NO_ARM})
        document = run.document.model_copy(update={"provenance": provenance})
        history.enter(replace(run, rig=NO_ARM, document=document))
    pasts = history.calibrations()
    assert pasts[0].rig == NO_ARM
    text = printed(calibrations_table(pasts), 140)
    assert "readings from files" in text and "none" not in text
    assert rig_states(pasts) == []


@pytest.mark.thorough
@pytest.mark.slow
def test_one_alarm_is_one(history: History) -> None:
    for day in range(40):
        history.enter(finish_run(day * 10, (SCALE[0] + (3e-4 if day == 20 else day % 3 * 1e-5), *SCALE[1:])))
    table, found = trends_of(history.calibrations())
    chart = found["kx"].chart
    assert chart is not None and chart.alarm.sum() == 1
    assert "in control; 1 alarm before" in printed(table, 140)


@pytest.mark.slow
def test_a_void_calibration_and_one_by_its_day_are_still_told_at_sixty_columns(history: History) -> None:
    a_year(history, runs=2)
    history.void(2, "another sensor was mounted")
    text = printed(calibrations_table(history.calibrations()), 60)
    assert "pass, void" in text and FIRST.date().isoformat() in text
