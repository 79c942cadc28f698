"""The result as a person reads it in the terminal."""

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Protocol

import numpy as np
from rich.console import Console
from rich.table import Table

from rig.data.budget_entries import BudgetEntry, expanded_uncertainties
from rig.data.result_file import BoardEntry, CheckEntry, ResultDocument, SensorEntry
from rig.data.result_types import ErrorEntry
from rig.report.accelerometer_table import accelerometer_lines, accelerometer_table
from rig.report.axes import skew_known, triple
from rig.report.budget_table import budget_table, expanded_heading
from rig.report.drift_table import print_drifts
from rig.report.earth_rate import earth_rate_lines
from rig.report.magnetometer_table import MICROTESLA, magnetometer_lines, magnetometer_table
from rig.report.told_words import told_lines
from rig.report.validity_words import load_words, speed_words, when_words
from rig.report.verification_table import verification_lines, verification_table
from rig.station.plain_text import plain

FEWEST_DECIMALS = 5  # a MEMS gyroscope's uncertainty


class Estimated(Protocol):
    """Scale [3], bias [3] and covariance [6][6] of an estimate in `result.json`."""

    @property
    def scale(self) -> Sequence[float]: ...
    @property
    def bias_rad_s(self) -> Sequence[float]: ...
    @property
    def covariance(self) -> Sequence[Sequence[float]]: ...


def print_outcome(document: ResultDocument, *, as_json: bool) -> None:
    """The document on stdout: tables for people, JSON for machines."""
    if as_json:
        print(document.text())
    else:
        print_result(document, Console(highlight=False))


def print_result(result: ResultDocument, console: Console) -> None:
    """Print six parameters with uncertainties for each sensor, then verifications, checks, verdict."""
    for name, sensor in result.sensors.items():
        known = " (known)" if sensor.role == "reference" else ""
        title = f"{name}{known}: {sensor.part} {sensor.serial_number}, {sensor.model}, {sensor.estimator}"
        console.print(estimate_table(title, sensor, sensor.budget))
        if sensor.budget is not None:
            console.print(budget_table(sensor.budget, sensor.scale))
        for line in _beside(sensor):
            console.print(plain(line))
    for name, accelerometer in result.accelerometers.items():
        console.print(accelerometer_table(name, accelerometer))
        if accelerometer.budget is not None:
            console.print(budget_table(accelerometer.budget, accelerometer.scale, "m/s²"))
        for line in accelerometer_lines(accelerometer):
            console.print(plain(line))
    for name, magnetometer in result.magnetometers.items():
        if isinstance(magnetometer, ErrorEntry):
            console.print(plain(f"{name}, magnetometer, not calibrated: {magnetometer.error}"))
            continue
        console.print(magnetometer_table(name, magnetometer))
        if magnetometer.budget is not None:
            console.print(budget_table(magnetometer.budget, magnetometer.scale, "µT", MICROTESLA))
        for line in magnetometer_lines(magnetometer):
            console.print(plain(line))
    print_drifts(result.bias_drift, console)
    for name, verification in result.verification.items():
        console.print(verification_table(name, verification))
        for line in verification_lines(verification):
            console.print(plain(line))
    console.print(_checks(result.checks))
    console.print(f"verdict: {result.verdict.upper()}", style="bold green" if result.verdict == "pass" else "bold red")


def estimate_table(title: str, estimate: Estimated, budget: BudgetEntry | None = None) -> Table:
    """Scale and bias of each axis ± U: that of the `budget` where all of it is known, else twice the solution's std."""
    table = Table(title=plain(title, "table.title"), title_justify="left")
    for heading in ("axis", "scale factor", expanded_heading(budget), "bias rad/s", "± U rad/s"):
        table.add_column(heading, justify="left" if heading == "axis" else "right")
    shown = expanded_uncertainties(budget, estimate.covariance)
    scale, bias = decimals(shown[:3]), decimals(shown[3:])
    for i, axis in enumerate("xyz"):
        table.add_row(
            axis,
            f"{estimate.scale[i]:.{scale}f}",
            f"{shown[i]:.{scale}f}",
            f"{estimate.bias_rad_s[i]:+.{bias}f}",
            f"{shown[3 + i]:.{bias}f}",
        )
    return table


def decimals(uncertainties: Sequence[float]) -> int:
    """How many the smallest of them warrants, which is printed with two digits; five at least."""
    smallest = min(uncertainties)
    return max(FEWEST_DECIMALS, 1 - math.floor(math.log10(smallest))) if smallest > 0 else FEWEST_DECIMALS


def _checks(checks: Iterable[CheckEntry]) -> Table:
    table = Table(title="checks", title_justify="left")
    for heading in ("check", "value", "limit", "unit", ""):
        table.add_column(heading, justify="right" if heading in ("value", "limit") else "left")
    for check in checks:
        value = "not measured" if check.value is None else f"{check.value:.4g}"
        limit = "not set" if check.limit is None else f"{check.limit:.4g}"
        table.add_row(plain(check.name), value, limit, plain(check.unit), "ok" if check.passed else "FAILED")
    return table


def _beside(sensor: SensorEntry) -> Iterator[str]:
    """At what speeds it holds, what the other estimators make of it, and what the vector model says about the axes."""
    yield from _speeds(sensor)
    if sensor.scale_at is not None and sensor.bias_at is not None:
        yield f"scale: {when_words(sensor.scale_at)}"
        yield f"bias: {when_words(sensor.bias_at)}"
    yield from told_lines(sensor.told_from)
    yield from earth_rate_lines(sensor.earth_rate)
    vector = sensor.vector_model
    std = [sensor.covariance[i][i] ** 0.5 for i in range(6)]
    scale, bias = f".{decimals(std[:3])}f", f"+.{decimals(std[3:])}f"
    others = {"vector_model": vector, "six_observation": sensor.six_observation, "algorithm_1": sensor.algorithm_1}
    for name, other in others.items():
        if isinstance(other, ErrorEntry):
            yield f"{name}: {other.error}"
        elif other.estimator != sensor.estimator:
            yield f"{name}: k {triple(other.scale, scale)}, b {triple(other.bias_rad_s, bias)} rad/s"
    if sensor.board is not None:
        yield from _on_the_board(sensor.board)
    if not isinstance(vector, ErrorEntry):
        skew = triple(np.degrees(vector.non_orthogonality_rad), "+.3f")
        yield f"non-orthogonality yz zx xy: {skew} ° (± {skew_known(vector)})"
        yield from (f"warning: {warning}" for warning in vector.warnings)


def _speeds(sensor: SensorEntry) -> Iterator[str]:
    """Where it is valid: one speed does not tell how far the sensor is from linear."""
    speeds, loads, found = speed_words(sensor), load_words(sensor), sensor.nonlinearity
    if loads is not None:
        yield f"along its own axes the sweeps turned it by {loads} °/s"
    if found is None:
        yield from [f"the scale factors are those at {speeds} °/s"] if speeds else []
        return
    for name, values, std in (
        ("odd", found.odd_per_rad_s, found.odd_std_per_rad_s),
        ("even", found.even_per_rad_s, found.even_std_per_rad_s),
    ):
        percent = triple(np.multiply(100, values), "+.4f")
        yield f"nonlinearity, {name}: {percent} % per rad/s (± {200 * max(std):.4f}, k = 2), from {speeds} °/s"


def _on_the_board(board: BoardEntry) -> Iterator[str]:
    """The board's solution, or why it has none."""
    found = board.solutions.get("closed_form")
    if found is None:
        yield "on the board: nothing was solved"
    elif found.status == "solved":
        yield f"on the board: k {triple(found.scale, '.5f')}, b {triple(found.bias_rad_s, '+.5f')} rad/s"
    else:
        yield f"on the board: {found.status}, from {found.observations} sweeps"
    yield from (f"not observed by the board: {sweep}" for sweep in board.not_observed)
