"""Allan deviations and their plots, for people and for machines."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.table import Table

from rig.analysis.rest_noise import QuantityNoise, SensorAtRest
from rig.data.quantity import Quantity
from rig.errors import Fault
from rig.estimation.statistics.allan import FLICKER_RATIO, AllanReading
from rig.report.figures.verification import save
from rig.station.plain_text import build_number_table, plain
from rig.study.style import use_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SCHEMA = "rig.allan/1"


def print_at_rest(sensors: Mapping[str, SensorAtRest], *, as_json: bool) -> None:
    """Print results at rest on stdout: tables for people, JSON of schema "rig.allan/1" for machines."""
    if as_json:
        print(json.dumps(document(sensors), indent=2, allow_nan=False))
        return
    console = Console(highlight=False)
    for name, sensor in sensors.items():
        for quantity, result in sensor.quantities.results.items():
            console.print(_table(_title(f"{name}, {quantity}", sensor), quantity, result))
            for line in _lines(result):
                console.print(plain(line))
        for quantity, fault in sensor.quantities.faults.items():
            console.print(plain(f"{name}, {quantity}: {fault}"))
        for note in sensor.notes:
            console.print(plain(note))


def document(sensors: Mapping[str, SensorAtRest]) -> dict[str, Any]:
    """Return the results at rest in SI units, in the schema "rig.allan/1"."""
    return {
        "schema": SCHEMA,
        "sensors": {
            name: {
                **({} if (s := at_rest.sensor) is None else {"part": s.part, "serial_number": s.serial_number}),
                **{quantity.name: _entry(quantity, result) for quantity, result in at_rest.quantities.results.items()},
                **{quantity.name: {"error": str(fault)} for quantity, fault in at_rest.quantities.faults.items()},
                **({"notes": list(at_rest.notes)} if at_rest.notes else {}),
            }
            for name, at_rest in sensors.items()
        },
    }


def draw_at_rest(sensors: Mapping[str, SensorAtRest], folder: Path) -> list[Path]:
    """Draw `allan_<sensor>` by matplotlib, as PNG and SVG, for each sensor with a curve; return the paths."""
    from matplotlib.figure import Figure

    written = list[Path]()
    for name, sensor in sensors.items():
        curves = sensor.quantities.results
        if not curves:
            continue
        with use_style():
            figure = Figure(figsize=(5.5 * len(curves), 4.6), layout="constrained")
            for axes, (quantity, result) in zip(np.ravel(figure.subplots(1, len(curves))), curves.items(), strict=True):
                _draw(axes, quantity, result)
            figure.suptitle(f"{_title(name, sensor)} at rest; bands hold 95 %")
            written += save(figure, folder, f"allan_{name}")
    return written


def _title(name: str, at_rest: SensorAtRest) -> str:
    return name if at_rest.sensor is None else f"{name}: {at_rest.sensor.part} {at_rest.sensor.serial_number}"


def _table(title: str, quantity: Quantity, result: QuantityNoise) -> Table:
    walk, bias = quantity.walk_unit, quantity.drift
    headings = ("axis", f"{quantity.walk} {walk.name}", "± U", f"bias instability {bias.name}", "± U", "at s")
    table = build_number_table(headings, title)
    for axis, figures in zip("xyz", result.axes, strict=True):
        floor = figures.bias_instability
        tau_s = f"{floor.tau_s:.3g}" if isinstance(floor, AllanReading) else ""
        table.add_row(axis, *_cells(figures.random_walk, walk.size), *_cells(floor, bias.size), tau_s)
    return table


def _cells(figure: AllanReading | Fault, size: float) -> tuple[str, str]:
    if isinstance(figure, Fault):
        return "–", ""  # the reason is below the table
    return f"{figure.value / size:.4g}", f"{2 * figure.std / size:.1g}"


def _lines(result: QuantityNoise) -> Iterator[str]:
    temperatures = "" if result.temperature_c is None else "; {:.1f} to {:.1f} °C".format(*result.temperature_c)
    durations = f"{result.total_s:.4g} s in all, the longest {result.longest_s:.4g} s"
    yield f"{result.intervals} intervals at rest, {durations}{temperatures}; U with k = 2"
    for what in ("random_walk", "bias_instability"):
        faults = [figure for axis in result.axes if isinstance(figure := getattr(axis, what), Fault)]
        by_name = {fault.name: fault for fault in faults}  # one for each name: the axes differ in their numbers only
        yield from (f"{what.replace('_', ' ')}: {fault}" for _, fault in sorted(by_name.items()))


def _entry(quantity: Quantity, result: QuantityNoise) -> dict[str, Any]:
    return {
        "stretches": result.intervals,
        "longest_s": result.longest_s,
        "total_s": result.total_s,
        "temperature_c": None if result.temperature_c is None else list(result.temperature_c),
        f"random_walk_{quantity.walk_suffix}": [_read(axis.random_walk) for axis in result.axes],
        quantity.file_key("bias_instability"): [_read(axis.bias_instability) for axis in result.axes],
        "tau_s": result.curve.tau_s.tolist(),
        quantity.file_key("deviation"): result.curve.deviation.tolist(),
        quantity.file_key("deviation_low"): result.curve.low.tolist(),
        quantity.file_key("deviation_high"): result.curve.high.tolist(),
        "degrees_of_freedom": result.curve.dof.tolist(),
    }


def _read(figure: AllanReading | Fault) -> dict[str, Any]:
    if isinstance(figure, Fault):
        return {"error": str(figure)}
    return {"value": figure.value, "std": figure.std, "tau_s": figure.tau_s}


def _draw(axes: "Axes", quantity: Quantity, result: QuantityNoise) -> None:
    """Draw the curves with their bands, and mark the values read from them."""
    size = quantity.drift.size
    curve = result.curve
    for i, (axis, figures) in enumerate(zip("xyz", result.axes, strict=True)):
        axes.loglog(curve.tau_s, curve.deviation[:, i] / size, "o-", ms=3, lw=1, color=f"C{i}", label=axis)
        axes.fill_between(curve.tau_s, curve.low[:, i] / size, curve.high[:, i] / size, color=f"C{i}", alpha=0.15)
        if isinstance(figures.random_walk, AllanReading):
            line = figures.random_walk.value / np.sqrt(curve.tau_s) / size
            axes.loglog(curve.tau_s, line, ":", lw=0.8, color=f"C{i}")
        if isinstance(figures.bias_instability, AllanReading):
            floor = figures.bias_instability
            axes.plot(floor.tau_s, floor.value * FLICKER_RATIO / size, "v", color=f"C{i}")
    axes.set(xlabel="τ s", ylabel=f"Allan deviation   {quantity.drift.name}", title=quantity.name)
    axes.plot([], [], "k:", lw=0.8, label="random walk")
    axes.legend(frameon=False, ncols=2, fontsize=8)
