"""What PX4 and ArduPilot correct by temperature: offsets of gyroscopes and accelerometers, up to the third power.

PX4 (temperature_compensation, sensor_calibration): data − (X0 + X1 d + X2 d² + X3 d³) − offset, d = T − TREF, T held
between TMIN and TMAX. The offset at TREF is that of CAL_…, so X0 is 0.

ArduPilot (AP_InertialSensor_tempcal, AP_InertialSensor_Backend): data − P(T − 35 °C) + P(CALTEMP − 35 °C) − offset,
P(u) = 10⁻⁶ (c₁ u + c₂ u² + c₃ u³), both temperatures held between TMIN and TMAX. Its 35 °C are fixed.

A gyroscope's bias b is added, g = K (m + b), so an offset is −b. Neither has a scale factor over temperature.
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
    """(3,) what an autopilot subtracts for each Kⁿ of that order."""
    return tuple(quantities()[quantity].offset * each for each in entry.bias[order])


def px4_parameters(polynomials: Polynomials, places: Mapping[str, int]) -> Parameters:
    """The parameters TC_… of every sensor that was calibrated over temperature; nothing where none was."""
    enabled = set()
    for name, number in places.items():
        for quantity, found in polynomials.get(name, {}).items():
            letter = LETTERS[quantity][0]
            enabled.add(letter)
            yield f"TC_{letter}{number}_TREF", found.reference_c
            yield f"TC_{letter}{number}_TMIN", found.range_c[0]
            yield f"TC_{letter}{number}_TMAX", found.range_c[1]
            for order in range(4):
                offsets = (0.0,) * 3 if order == 0 else offset_of(quantity, found, order)
                yield from ((f"TC_{letter}{number}_X{order}_{i}", each) for i, each in enumerate(offsets))
    for letter in sorted(enabled):
        yield f"TC_{letter}_ENABLE", 1


def ardupilot_parameters(polynomials: Polynomials, places: Mapping[str, int]) -> Parameters:
    """The parameters INS_TCAL… of every IMU of which a sensor was calibrated over temperature, of the other zeros."""
    for name, number in places.items():
        found = polynomials.get(name, {})
        if not found:
            continue
        of = f"INS_TCAL{number + 1}"
        yield f"{of}_ENABLE", 1
        yield f"{of}_TMIN", max(each.range_c[0] for each in found.values())
        yield f"{of}_TMAX", min(each.range_c[1] for each in found.values())
        for quantity, (_, letters) in LETTERS.items():
            about = _about_35(quantity, found[quantity]) if quantity in found else ((0.0,) * 3,) * 3
            for order, each in enumerate(about, start=1):
                yield from ((f"{of}_{letters}{order}_{axis}", value) for axis, value in zip(AXES, each, strict=True))
        if (accelerometer := found.get("acceleration")) is not None:
            yield f"INS_ACC{number + 1}_CALTEMP", accelerometer.reference_c


def _about_35(quantity: str, entry: OverTemperatureEntry) -> tuple[tuple[float, ...], ...]:
    """Coefficients of orders 1 to 3 about ArduPilot's own reference, in its size."""
    away = ARDUPILOT_REFERENCE_C - entry.reference_c
    orders = [offset_of(quantity, entry, order) for order in range(4)]
    return tuple(
        tuple(
            ARDUPILOT_SIZE * sum(comb(m, n) * away ** (m - n) * orders[m][axis] for m in range(n, 4))
            for axis in range(3)
        )
        for n in range(1, 4)
    )
