"""C source that corrects readings for temperature."""

from collections.abc import Iterator, Mapping

import numpy as np

from rig.data.entries.temperature import OverTemperatureEntry
from rig.estimation.arrays import Array
from rig.report.c_code.c_functions import c_rows, prefix_of
from rig.report.findings.finding import Finding


def temperature_lines(finding: Finding[OverTemperatureEntry], _: Mapping[str, Array]) -> Iterator[str]:
    """Yield C source that corrects a sensor at any temperature, using the source for the reference temperature."""
    entry, quantity = finding.entry, finding.quantity
    sensor, unit = prefix_of(finding.sensor), quantity.suffix
    name = "_".join([sensor, *([quantity.name] if quantity.prefix else [])])
    function = name.replace(sensor, f"{sensor}_calibrate", 1)
    sign, low, high = ("+" if quantity.offset < 0 else "-"), *entry.range_c
    change = np.array(entry.scale[1:]) / np.array(entry.scale[0])
    yield from (
        "",
        f"/* The same over temperature, by the part's thermometer, in degrees Celsius from {entry.reference_c:.9g}:",
        " * relative changes of scale factors, absolute ones of biases, coefficients of the first to the third power.",
        f" * Valid from {low:.1f} to {high:.1f}; outside it corrects as at the nearer end and returns 0. */",
        f"static const float {name}_scale_share_per_k[3][3] = {c_rows(change)};",
        f"static const float {name}_bias_{unit}_per_k[3][3] = {c_rows(entry.bias[1:])};",
        "",
        f"static inline int {function}_at(const float reading_{unit}[3], float temperature_c, float true_{unit}[3])",
        "{",
        f"    const float low_c = {low:.9e}f, high_c = {high:.9e}f;",
        "    const float within_c = temperature_c < low_c ? low_c : temperature_c > high_c ? high_c : temperature_c;",
        f"    const float d = within_c - {entry.reference_c:.9e}f;",
        "    float part[3];",
        "    for (int j = 0; j < 3; j++) {",
        f"        const float (*s)[3] = {name}_scale_share_per_k, (*b)[3] = {name}_bias_{unit}_per_k;",
        f"        const float bias = {name}_bias_{unit}[j] + d * (b[0][j] + d * (b[1][j] + d * b[2][j]));",
        f"        part[j] = (1.0f + d * (s[0][j] + d * (s[1][j] + d * s[2][j]))) * (reading_{unit}[j] {sign} bias);",
        "    }",
        "    for (int i = 0; i < 3; i++) {",
        f"        true_{unit}[i] = 0.0f;",
        "        for (int j = 0; j < 3; j++)",
        f"            true_{unit}[i] += {name}_matrix[i][j] * part[j];",
        "    }",
        "    return temperature_c >= low_c && temperature_c <= high_c;",
        "}",
    )
