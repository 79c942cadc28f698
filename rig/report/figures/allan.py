"""Allan deviations, for people and for machines, and their plots."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Console
from rich.table import Table

from rig.analysis.at_rest import AtRest, SensorAtRest
from rig.data.quantity import Quantity
from rig.errors import Fault
from rig.estimation.statistics.allan import FLICKER, Read
from rig.report.figures.verification import save
from rig.station.plain_text import plain
from rig.study.style import use_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SCHEMA = "rig.allan/1"


def print_at_rest(sensors: Mapping[str, SensorAtRest], *, as_json: bool) -> None:
    """Print what was found at rest on stdout: tables for people, JSON of schema "rig.allan/1" for machines."""
    if as_json:
        print(json.dumps(document(sensors), indent=2, allow_nan=False))
        return
    console = Console(highlight=False)
    for name, each in sensors.items():
        for quantity, seen in each.quantities.results.items():
            console.print(_table(_titled(f"{name}, {quantity}", each), quantity, seen))
            for line in _lines(seen):
                console.print(plain(line))
        for quantity, fault in each.quantities.faults.items():
            console.print(plain(f"{name}, {quantity}: {fault}"))


def document(sensors: Mapping[str, SensorAtRest]) -> dict[str, Any]:
    """What was found at rest, in SI units, of schema "rig.allan/1"."""
    return {
        "schema": SCHEMA,
        "sensors": {
            name: {
                **({} if (s := each.sensor) is None else {"part": s.part, "serial_number": s.serial_number}),
                **{quantity.name: _entry(quantity, seen) for quantity, seen in each.quantities.results.items()},
                **{quantity.name: {"error": str(fault)} for quantity, fault in each.quantities.faults.items()},
            }
            for name, each in sensors.items()
        },
    }


def draw_at_rest(sensors: Mapping[str, SensorAtRest], folder: Path) -> list[Path]:
    """`allan_<sensor>`, as PNG and SVG, into `folder`, of every sensor that has a curve. Needs matplotlib."""
    from matplotlib.figure import Figure

    written = []
    for name, each in sensors.items():
        curves = each.quantities.results
        if not curves:
            continue
        with use_style():
            figure = Figure(figsize=(5.5 * len(curves), 4.6), layout="constrained")
            for axes, (quantity, seen) in zip(np.ravel(figure.subplots(1, len(curves))), curves.items(), strict=True):
                _draw(axes, quantity, seen)
            figure.suptitle(f"{_titled(name, each)} at rest; bands hold 95 %")
            save(figure, folder, f"allan_{name}")
        written += [folder / f"allan_{name}.png", folder / f"allan_{name}.svg"]
    return written


def _titled(name: str, seen: SensorAtRest) -> str:
    return name if seen.sensor is None else f"{name}: {seen.sensor.part} {seen.sensor.serial_number}"


def _table(title: str, quantity: Quantity, seen: AtRest) -> Table:
    table = Table(title=plain(title, "table.title"), title_justify="left")
    walk, bias = quantity.walk_unit, quantity.drift
    headings = ("axis", f"{quantity.walk} {walk.name}", "± U", f"bias instability {bias.name}", "± U", "at s")
    for heading in headings:
        table.add_column(heading, justify="left" if heading == "axis" else "right")
    for axis, told in zip("xyz", seen.axes, strict=True):
        floor = told.bias_instability
        at = f"{floor.tau_s:.3g}" if isinstance(floor, Read) else ""
        table.add_row(axis, *_cells(told.random_walk, walk.size), *_cells(floor, bias.size), at)
    return table


def _cells(told: Read | Fault, size: float) -> tuple[str, str]:
    if isinstance(told, Fault):
        return "–", ""  # why, stands once below
    return f"{told.value / size:.4g}", f"{2 * told.std / size:.1g}"


def _lines(seen: AtRest) -> Iterator[str]:
    felt = "" if seen.temperature_c is None else "; {:.1f} to {:.1f} °C".format(*seen.temperature_c)
    lasting = f"{seen.total_s:.4g} s in all, the longest {seen.longest_s:.4g} s"
    yield f"{seen.stretches} stretches at rest, {lasting}{felt}; U with k = 2"
    for what in ("random_walk", "bias_instability"):
        faults = [told for axis in seen.axes if isinstance(told := getattr(axis, what), Fault)]
        said = {fault.name: fault for fault in faults}  # of each name once: the axes differ by numbers alone
        yield from (f"{what.replace('_', ' ')}: {fault}" for _, fault in sorted(said.items()))


def _entry(quantity: Quantity, seen: AtRest) -> dict[str, Any]:
    return {
        "stretches": seen.stretches,
        "longest_s": seen.longest_s,
        "total_s": seen.total_s,
        "temperature_c": None if seen.temperature_c is None else list(seen.temperature_c),
        f"random_walk_{quantity.walk_suffix}": [_read(axis.random_walk) for axis in seen.axes],
        quantity.named("bias_instability"): [_read(axis.bias_instability) for axis in seen.axes],
        "tau_s": seen.curve.tau_s.tolist(),
        quantity.named("deviation"): seen.curve.deviation.tolist(),
        quantity.named("deviation_low"): seen.curve.low.tolist(),
        quantity.named("deviation_high"): seen.curve.high.tolist(),
        "degrees_of_freedom": seen.curve.freedom.tolist(),
    }


def _read(told: Read | Fault) -> dict[str, Any]:
    if isinstance(told, Fault):
        return {"error": str(told)}
    return {"value": told.value, "std": told.std, "tau_s": told.tau_s}


def _draw(axes: "Axes", quantity: Quantity, seen: AtRest) -> None:
    """The curves with their bands, and what was read off them."""
    size = quantity.drift.size
    curve = seen.curve
    for i, (axis, told) in enumerate(zip("xyz", seen.axes, strict=True)):
        axes.loglog(curve.tau_s, curve.deviation[:, i] / size, "o-", ms=3, lw=1, color=f"C{i}", label=axis)
        axes.fill_between(curve.tau_s, curve.low[:, i] / size, curve.high[:, i] / size, color=f"C{i}", alpha=0.15)
        if isinstance(told.random_walk, Read):
            line = told.random_walk.value / np.sqrt(curve.tau_s) / size
            axes.loglog(curve.tau_s, line, ":", lw=0.8, color=f"C{i}")
        if isinstance(told.bias_instability, Read):
            floor = told.bias_instability
            axes.plot(floor.tau_s, floor.value * FLICKER / size, "v", color=f"C{i}")
    axes.set(xlabel="τ s", ylabel=f"Allan deviation   {quantity.drift.name}", title=quantity.name)
    axes.plot([], [], "k:", lw=0.8, label="random walk")
    axes.legend(frameon=False, ncols=2, fontsize=8)
