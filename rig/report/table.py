"""The result as a person reads it in the terminal."""

from collections.abc import Mapping
from typing import Any

from rich.console import Console
from rich.table import Table


def print_result(result: Mapping[str, Any], console: Console) -> None:
    """Print a `result.json` document (schema `rig.result/1`): six parameters with uncertainties, checks, verdict."""
    for name, sensor in result["sensors"].items():
        table = Table(
            title=f"{name}: {sensor['part']} {sensor['serial_number']}, {sensor['model']}, {sensor['estimator']}",
            title_justify="left",
        )
        for heading in ("axis", "scale factor", "± 1σ", "bias rad/s", "± 1σ rad/s"):
            table.add_column(heading, justify="left" if heading == "axis" else "right")
        std = [sensor["covariance"][i][i] ** 0.5 for i in range(6)]
        for i, axis in enumerate("xyz"):
            table.add_row(
                axis,
                f"{sensor['scale'][i]:.5f}",
                f"{std[i]:.5f}",
                f"{sensor['bias_rad_s'][i]:+.5f}",
                f"{std[3 + i]:.5f}",
            )
        console.print(table)
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
