"""The result as a person reads it in the terminal."""

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from rig.report.verification_table import verification_lines, verification_table


def print_result(result: Mapping[str, Any], console: Console) -> None:
    """Print a `result.json` document (schema `rig.result/1`): six parameters with uncertainties, checks, verdict."""
    for name, sensor in result["sensors"].items():
        known = " (known)" if sensor["role"] == "reference" else ""
        title = f"{name}{known}: {sensor['part']} {sensor['serial_number']}, {sensor['model']}, {sensor['estimator']}"
        console.print(estimate_table(title, sensor))
        for line in _beside(sensor):
            console.print(line)
    for name, verification in result["verification"].items():
        console.print(verification_table(name, verification))
        for line in verification_lines(verification):
            console.print(line)
    checks = Table(title="checks", title_justify="left")
    for heading in ("check", "value", "limit", "unit", ""):
        checks.add_column(heading, justify="right" if heading in ("value", "limit") else "left")
    for check in result["checks"]:
        value = "not measured" if check["value"] is None else f"{check['value']:.4g}"
        checks.add_row(
            check["name"], value, f"{check['limit']:.4g}", check["unit"], "ok" if check["passed"] else "FAILED"
        )
    console.print(checks)
    console.print(
        f"verdict: {result['verdict'].upper()}", style="bold green" if result["verdict"] == "pass" else "bold red"
    )


def estimate_table(title: str, estimate: Mapping[str, Any]) -> Table:
    """Scale and bias of each axis with their uncertainties, from an estimate as `result.json` has it."""
    table = Table(title=title, title_justify="left")
    for heading in ("axis", "scale factor", "± 1σ", "bias rad/s", "± 1σ rad/s"):
        table.add_column(heading, justify="left" if heading == "axis" else "right")
    std = [estimate["covariance"][i][i] ** 0.5 for i in range(6)]
    for i, axis in enumerate("xyz"):
        table.add_row(
            axis,
            f"{estimate['scale'][i]:.5f}",
            f"{std[i]:.5f}",
            f"{estimate['bias_rad_s'][i]:+.5f}",
            f"{std[3 + i]:.5f}",
        )
    return table


def _beside(sensor: Mapping[str, Any]) -> list[str]:
    """What the other estimators make of the same sweeps, and what the vector model says about the axes."""
    lines = []
    for name in ("vector_model", "six_observation", "algorithm_1"):
        other = sensor[name]
        if other.get("estimator") == sensor["estimator"]:
            continue
        if "error" in other:
            lines.append(f"{name}: {other['error']}")
        else:
            scale, bias = (_triple(other["scale"], ".5f"), _triple(other["bias_rad_s"], "+.5f"))
            lines.append(f"{name}: k {scale}, b {bias} rad/s")
    lines += _on_the_board(sensor["board"]) if "board" in sensor else []
    vector = sensor["vector_model"]
    if "error" not in vector:
        skew = _triple(np.degrees(vector["non_orthogonality_rad"]), "+.3f")
        std = max(np.degrees(vector["non_orthogonality_std_rad"]))
        lines.append(f"non-orthogonality yz zx xy: {skew} ° (± {std:.3f})")
        lines += [f"warning: {warning}" for warning in vector["warnings"]]
    return lines


def _on_the_board(board: Mapping[str, Any]) -> list[str]:
    """The board's solution, or why it has none."""
    found = board["solutions"].get("closed_form")
    if found is None:
        line = "nothing was solved"
    elif found["status"] == "solved":
        line = f"k {_triple(found['scale'], '.5f')}, b {_triple(found['bias_rad_s'], '+.5f')} rad/s"
    else:
        line = f"{found['status']}, from {found['observations']} sweeps"
    return [f"on the board: {line}", *(f"not observed by the board: {sweep}" for sweep in board["not_observed"])]


def _triple(values: Iterable[float], form: str) -> str:
    return " ".join(f"{value:{form}}" for value in values)
