"""A calibration over temperature in `result.json`."""

import numpy as np

from rig.data.entries.temperature import AtTemperatureEntry, OverTemperatureEntry, TemperatureContributorEntry
from rig.data.quantity import Quantity
from rig.data.recording.motion_file import Item
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.temperature.temperature_polynomials import COEFFICIENT_COUNT, OverTemperature, powers_at
from rig.report.entry import entry, finite_or_none

ROWS = 17  # rows of the table; a certificate shows every fourth


def temperature_entry(
    quantity: Quantity, polynomials: OverTemperature, sensor: RecordedSensor | Item
) -> OverTemperatureEntry:
    """Return a sensor's polynomials of temperature in SI units.

    A gyroscope's bias b has the sign of g = K (m + b); the polynomials contain the reading's offset, which is −b.
    """
    signs = np.array(quantity.parameter_signs)
    of_coefficients = np.repeat(signs, COEFFICIENT_COUNT // len(signs))
    powers = powers_at(0.0)
    return entry(
        OverTemperatureEntry, polynomials,
        part=sensor.part,
        serial_number=sensor.serial_number,
        full_scale=None if isinstance(sensor, Item) else sensor.channel(quantity).range,
        unit=quantity.unit,
        bias=quantity.offset * polynomials.bias,
        covariance=np.outer(of_coefficients, of_coefficients) * polynomials.covariance,
        contributors=[
            entry(TemperatureContributorEntry, line,
                  degrees_of_freedom=finite_or_none(line.dof),
                  std=np.sqrt(np.diag(powers @ line.covariance @ powers.T).clip(min=0.0)))
            for line in polynomials.lines
        ],
        table=[_row(quantity, polynomials, warm_c) for warm_c in np.linspace(*polynomials.range_c, ROWS).tolist()],
        hysteresis=None if polynomials.hysteresis is None else polynomials.hysteresis[0] * signs,
        hysteresis_std=None if polynomials.hysteresis is None else polynomials.hysteresis[1],
    )  # fmt: skip


def _row(quantity: Quantity, polynomials: OverTemperature, temperature_c: float) -> AtTemperatureEntry:
    values_at = polynomials.evaluate(temperature_c)
    return entry(
        AtTemperatureEntry,
        temperature_c=temperature_c,
        scale=values_at.values[:3],
        bias=quantity.offset * values_at.values[3:],
        expanded_scale=values_at.expanded[:3],
        expanded_bias=values_at.expanded[3:],
    )
