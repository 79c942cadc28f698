"""Temperature corrections of PX4 and ArduPilot: offsets of gyroscopes and accelerometers as cubic polynomials.

PX4 (temperature_compensation, sensor_calibration): data − (X0 + X1 d + X2 d² + X3 d³) − offset, d = T − TREF, T limited
to TMIN … TMAX. The parameters CAL_… contain the offset at TREF, so X0 is 0.

ArduPilot (AP_InertialSensor_tempcal, AP_InertialSensor_Backend): data − P(T − 35 °C) + P(CALTEMP − 35 °C) − offset,
P(u) = 10⁻⁶ (c₁ u + c₂ u² + c₃ u³), both temperatures limited to TMIN … TMAX. Its 35 °C are fixed.

A gyroscope's bias b is added, g = K (m + b), so an offset is −b. Neither autopilot has a scale factor over temperature.
"""

from collections.abc import Iterator, Mapping
from math import comb

from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.installed_kinds import quantities

ARDUPILOT_REFERENCE_C, ARDUPILOT_SIZE = 35.0, 1e6
AXES = "XYZ"
LETTERS: Mapping[str, tuple[str, str]] = {"rate": ("G", "GYR"), "acceleration": ("A", "ACC")}
Parameters = Iterator[tuple[str, float | int]]
Polynomials = Mapping[str, Mapping[str, OverTemperatureEntry]]  # by sensor and quantity


def offset_of(quantity: str, entry: OverTemperatureEntry, order: int) -> tuple[float, ...]:
    """Return, for each axis, the coefficient of (T − reference)^`order` in the offset, which readings contain."""
    return tuple(quantities()[quantity].offset * bias for bias in entry.bias[order])


def px4_parameters(polynomials: Polynomials, numbers: Mapping[str, int]) -> Parameters:
    """Yield the parameters TC_… of all sensors that were calibrated over temperature."""
    enabled = set()
    for name, number in numbers.items():
        for quantity, entry in polynomials.get(name, {}).items():
            letter = LETTERS[quantity][0]
            enabled.add(letter)
            yield f"TC_{letter}{number}_TREF", entry.reference_c
            yield f"TC_{letter}{number}_TMIN", entry.range_c[0]
            yield f"TC_{letter}{number}_TMAX", entry.range_c[1]
            for order in range(4):
                offsets = (0.0,) * 3 if order == 0 else offset_of(quantity, entry, order)
                yield from ((f"TC_{letter}{number}_X{order}_{i}", offset) for i, offset in enumerate(offsets))
    for letter in sorted(enabled):
        yield f"TC_{letter}_ENABLE", 1


def ardupilot_parameters(polynomials: Polynomials, numbers: Mapping[str, int]) -> Parameters:
    """Yield the parameters INS_TCAL… of IMUs with a polynomial; a sensor without a polynomial gets zeros."""
    for name, number in numbers.items():
        entries = polynomials.get(name, {})
        if not entries:
            continue
        prefix = f"INS_TCAL{number + 1}"
        yield f"{prefix}_ENABLE", 1
        yield f"{prefix}_TMIN", max(entry.range_c[0] for entry in entries.values())
        yield f"{prefix}_TMAX", min(entry.range_c[1] for entry in entries.values())
        for quantity, (_, letters) in LETTERS.items():
            orders = _about_35(quantity, entries[quantity]) if quantity in entries else ((0.0,) * 3,) * 3
            for order, biases in enumerate(orders, start=1):
                yield from (
                    (f"{prefix}_{letters}{order}_{axis}", value) for axis, value in zip(AXES, biases, strict=True)
                )
        if (accelerometer := entries.get("acceleration")) is not None:
            yield f"INS_ACC{number + 1}_CALTEMP", accelerometer.reference_c


def _about_35(quantity: str, entry: OverTemperatureEntry) -> tuple[tuple[float, ...], ...]:
    """Return a tuple for each power 1 to 3 of T − 35 °C, with the coefficients of x, y, z in ArduPilot's unit."""
    shift_k = ARDUPILOT_REFERENCE_C - entry.reference_c
    orders = [offset_of(quantity, entry, order) for order in range(4)]
    return tuple(
        tuple(
            ARDUPILOT_SIZE * sum(comb(m, n) * shift_k ** (m - n) * orders[m][axis] for m in range(n, 4))
            for axis in range(3)
        )
        for n in range(1, 4)
    )
