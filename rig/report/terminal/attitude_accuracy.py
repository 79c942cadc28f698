"""The expected accuracy of a plan's attitudes for each accelerometer, for people and for machines."""

import math
from dataclasses import asdict
from typing import Any

from rich.box import SIMPLE
from rich.console import Console

from rig.analysis.design.attitude_information import AttitudeAccount
from rig.estimation.earth import MICRO_G_M_S2
from rig.station.plain_text import build_number_table, plain


def account_document(account: AttitudeAccount) -> dict[str, Any]:
    """Return the expected accuracy in SI units.

    `condition_second_order` is null if the attitudes do not determine the terms of second order.
    """
    return {
        "count": account.count,
        "order": account.order,
        "rank": account.chosen.rank,
        "needed": account.chosen.needed,
        "condition": account.first.condition,
        "condition_second_order": account.second.condition if math.isfinite(account.second.condition) else None,
        "g_efficiency": account.g_efficiency,
        "attitude_std_rad": account.attitude_std_rad,
        "sensors": {name: asdict(expected) for name, expected in account.sensors.items()},
    }


def print_account(console: Console, account: AttitudeAccount) -> None:
    """Print a line on the attitudes and a table of the accuracy of each sensor."""
    second = f"{account.second.condition:.2f}" if math.isfinite(account.second.condition) else "not determined"
    console.print(
        f"{account.count} attitudes: rank {account.chosen.rank} of {account.chosen.needed}, condition "
        f"{account.first.condition:.2f} (second order {second}), G-efficiency {account.g_efficiency:.3f}",
        soft_wrap=True,
    )
    arm_mrad = 1e3 * account.attitude_std_rad
    console.print(f"Expected standard deviations of accelerometers, if the attitudes' is {arm_mrad:.2g} mrad:")
    second_order = ["φ 1e-6 s²/m"] if account.order == 2 else []
    headings = ("sensor", "scale ppm", "non-orthogonality mrad", "bias µg", *second_order)
    table = build_number_table(headings, texts=("sensor",), box=SIMPLE)
    for name, expected in account.sensors.items():
        values = [
            1e6 * expected.scale_std,
            1e3 * expected.non_orthogonality_std_rad,
            expected.bias_std_m_s2 / MICRO_G_M_S2,
        ]
        if expected.second_order_std_s2_m is not None:
            values.append(1e6 * expected.second_order_std_s2_m)
        table.add_row(plain(name), *(f"{value:.3g}" for value in values))
    console.print(table)
