"""Parameter files of PX4 and ArduPilot: what each of them corrects of gyroscopes, accelerometers and magnetometers.

PX4 (src/lib/sensor_calibration): gyroscopes data − offset, accelerometers (data − offset) scale, magnetometers
S (data − offset), S symmetric, in gauss. ArduPilot (AP_InertialSensor_Backend, AP_Compass): the same, but that offsets
of a compass are added and in milligauss. Offsets of gyroscopes, INS_GYROFFS_X, …, are replaced at each boot unless
INS_GYR_CAL is 0. Neither has a scale factor of a gyroscope.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np

from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.estimation.arrays import Array
from rig.report.exports.calibrations import Calibrations
from rig.report.exports.over_temperature import ardupilot_parameters, px4_parameters
from rig.report.findings.corrected import Corrected
from rig.report.kinds.registry import kinds

GAUSS_T, MILLIGAUSS_T = 1e-4, 1e-7
PX4_FLOAT, PX4_INT = 9, 6  # MAV_PARAM_TYPE_REAL32, _INT32
HEADING = (
    "# Offsets in each sensor's own axes. Gyroscopes, rad/s: rate = reading - offset, offset = -b at zero gravity.",
    "# Accelerometers, m/s^2: (reading - offset) * scale. Magnetometers: a symmetric matrix times what is left,",
    "# in the right-angled axes in which it is symmetric.",
    "# Lost: scale factors and axes of gyroscopes, axes of accelerometers, g-sensitivity, second order, uncertainties;",
    "# there is no parameter for them.",
)
OF_ARDUPILOT = (
    "# Magnetic fields are in milligauss, and a compass' offset is added.",
    "# ArduPilot corrects what it has turned by the compass's and the board's orientation, and by its driver: these",
    "# hold where nothing is turned. COMPASS_SCALE, where there is one, must be 0 or 1.",
)
AXES = "XYZ"
IMU = (RATE, ACCELERATION)
Parameters = Iterator[tuple[str, float]]


# How an autopilot calls the parameters of its sensor of that number, the first of which is 0.
Autopilot = Mapping[Quantity, Callable[[int, Corrected], Parameters]]


def px4_files(calibrations: Calibrations) -> Mapping[str, str]:
    """`px4.params`, as QGroundControl loads it: vehicle, component, name, value, type, between tabs."""
    lines = [
        *HEADING,
        "# Lost too: CAL_GYROn_ID, CAL_ACCn_ID, CAL_MAGn_ID, which only the vehicle knows; PX4 heeds what has its",
        "# sensor's ID. Magnetic fields are in gauss.",
        *_lines(calibrations, PX4, lambda name, value: f"1\t1\t{name}\t{value!r}\t{PX4_FLOAT}"),
    ]
    if calibrations.over_temperature:
        lines += [
            "# Over temperature: reading - (X1 d + X2 d^2 + X3 d^3) - offset, d = T - TREF, T within TMIN and TMAX.",
            "# Lost: scale factors over temperature; TC_Gn_ID, TC_An_ID, which only the vehicle knows.",
        ]
    for name, value in px4_parameters(calibrations.over_temperature, _places(calibrations)):
        lines.append(f"1\t1\t{name}\t{value!r}\t{PX4_INT if isinstance(value, int) else PX4_FLOAT}")
    return {"px4.params": "\n".join(lines) + "\n"}


def ardupilot_files(calibrations: Calibrations) -> Mapping[str, str]:
    """`ardupilot.param`: name, value."""
    lines = [*HEADING, *OF_ARDUPILOT, *_lines(calibrations, ARDUPILOT, lambda name, value: f"{name},{value!r}")]
    if polynomials := calibrations.over_temperature:
        lines += [
            "# Over temperature: reading - P(T - 35) + P(CALTEMP - 35) - offset, P(u) = 1e-6 (c1 u + c2 u^2 + c3 u^3),",
            "# temperatures within TMIN and TMAX. Lost: scale factors over temperature.",
            *(f"{name},{value!r}" for name, value in ardupilot_parameters(polynomials, _places(calibrations))),
        ]
    if any(line.startswith("INS_GYR") for line in lines):
        lines += ["# Without this ArduPilot finds offsets of gyroscopes of its own at each boot.", "INS_GYR_CAL,0"]
    return {"ardupilot.param": "\n".join(lines) + "\n"}


def _lines(calibrations: Calibrations, autopilot: Autopilot, form: Callable[[str, float], str]) -> Iterator[str]:
    """A line for each parameter, and comments whose it is. Raises Refused `nothing_to_export`.

    Sensors keep the number that their place in the configuration gives them, and an accelerometer its gyroscope's.
    """
    places, fields = _places(calibrations), list(calibrations.result.magnetometers)
    if not any(each.quantity in autopilot for each in calibrations.sensors):
        raise Refused("nothing_to_export", "the run calibrated no sensor", "Give a run that calibrates one")
    for each in calibrations.sensors:
        if (named := autopilot.get(each.quantity)) is None:
            yield f"# Lost: {printable(each.name)}: there is no parameter for it"
            continue
        yield from (f"# {line}" for line in calibrations.origin(each))
        number = fields.index(each.sensor) if each.quantity == FIELD else places[each.sensor]
        yield from (form(name, value) for name, value in named(number, each))
    yield from (f"# Lost: {name}: there is no parameter for it" for name in calibrations.beside)
    yield from (f"# {printable(line)}" for kind in kinds() for line in kind.unsolved(calibrations.result))


def _places(calibrations: Calibrations) -> dict[str, int]:
    """The number of each IMU: the first is 0."""
    names = dict.fromkeys(each.sensor for each in calibrations.sensors if each.quantity in IMU)
    return {name: i for i, name in enumerate(names)}


def symmetric(matrix: Array) -> Array:
    """(3, 3) symmetric P of matrix = R P with a rotation R: it brings a reading to the same size as the matrix does."""
    squared, vectors = np.linalg.eigh(matrix.T @ matrix)
    found: Array = vectors @ np.diag(np.sqrt(squared)) @ vectors.T
    return found


def _each(form: str, values: Iterable[float]) -> Parameters:
    """A parameter for each axis, whose letter stands at `{}`."""
    for axis, value in zip(AXES, values, strict=True):
        yield form.format(axis), float(value)


def _ellipsoid(magnetometer: Corrected) -> tuple[Array, Array]:
    """(3,) the diagonal and (3,) what is beside it: xy, xz, yz."""
    matrix = symmetric(np.asarray(np.linalg.inv(magnetometer.matrix), dtype=np.float64))
    return np.diag(matrix), matrix[[0, 0, 1], [1, 2, 2]]


def _px4_gyroscope(number: int, gyroscope: Corrected) -> Parameters:
    yield from _each(f"CAL_GYRO{number}_{{}}OFF", gyroscope.offset)


def _px4_accelerometer(number: int, accelerometer: Corrected) -> Parameters:
    yield from _each(f"CAL_ACC{number}_{{}}OFF", accelerometer.offset)
    yield from _each(f"CAL_ACC{number}_{{}}SCALE", accelerometer.scale)


def _px4_magnetometer(number: int, magnetometer: Corrected) -> Parameters:
    diagonal, beside = _ellipsoid(magnetometer)
    yield from _each(f"CAL_MAG{number}_{{}}OFF", magnetometer.offset / GAUSS_T)
    yield from _each(f"CAL_MAG{number}_{{}}SCALE", diagonal)
    yield from _each(f"CAL_MAG{number}_{{}}ODIAG", beside)


def _ardupilot_gyroscope(number: int, gyroscope: Corrected) -> Parameters:
    name = f"INS_GYR{number + 1}OFFS" if number else "INS_GYROFFS"
    yield from _each(f"{name}_{{}}", gyroscope.offset)
    if gyroscope.temperature_c is not None:
        yield f"INS_GYR{number + 1}_CALTEMP", gyroscope.temperature_c


def _ardupilot_accelerometer(number: int, accelerometer: Corrected) -> Parameters:
    yield from _each(f"INS_ACC{_nth(number)}OFFS_{{}}", accelerometer.offset)
    yield from _each(f"INS_ACC{_nth(number)}SCAL_{{}}", accelerometer.scale)


def _ardupilot_magnetometer(number: int, magnetometer: Corrected) -> Parameters:
    diagonal, beside = _ellipsoid(magnetometer)
    yield from _each(f"COMPASS_OFS{_nth(number)}_{{}}", -magnetometer.offset / MILLIGAUSS_T)
    yield from _each(f"COMPASS_DIA{_nth(number)}_{{}}", diagonal)
    yield from _each(f"COMPASS_ODI{_nth(number)}_{{}}", beside)


def _nth(number: int) -> str:
    """The first has no number."""
    return str(number + 1) if number else ""


PX4: Autopilot = {RATE: _px4_gyroscope, ACCELERATION: _px4_accelerometer, FIELD: _px4_magnetometer}
ARDUPILOT: Autopilot = {
    RATE: _ardupilot_gyroscope, ACCELERATION: _ardupilot_accelerometer, FIELD: _ardupilot_magnetometer,
}  # fmt: skip
