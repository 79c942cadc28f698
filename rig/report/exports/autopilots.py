"""Parameter files of PX4 and ArduPilot: what each of them corrects of gyroscopes, accelerometers and magnetometers.

PX4 (src/lib/sensor_calibration): gyroscopes data − offset, accelerometers (data − offset) scale, magnetometers
S (data − offset), S symmetric, in gauss. ArduPilot (AP_InertialSensor_Backend, AP_Compass): the same, but that offsets
of a compass are added and in milligauss. Offsets of gyroscopes, INS_GYROFFS_X, …, are replaced at each boot unless
INS_GYR_CAL is 0. Neither has a scale factor of a gyroscope.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.result_file import ResultDocument, SensorEntry
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.estimation.arrays import Array
from rig.report.exports.over_temperature import ardupilot_parameters, px4_parameters
from rig.report.exports.parameters import origin

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
Parameters = Iterator[tuple[str, float]]


@dataclass(frozen=True, slots=True)
class Autopilot:
    """How one calls the parameters of its sensor of that number, the first of which is 0."""

    gyroscope: Callable[[int, SensorEntry], Parameters]
    accelerometer: Callable[[int, AccelerometerEntry], Parameters]
    magnetometer: Callable[[int, MagnetometerEntry], Parameters]

    def lines(self, result: ResultDocument, form: Callable[[str, float], str]) -> Iterator[str]:
        """A line for each parameter, and comments whose it is. Raises Refused `nothing_to_export`.

        Sensors keep the number that their place in the configuration gives them, and an accelerometer its gyroscope's.
        """
        gyroscopes, places = _gyroscopes(result), _places(result)
        fields = [(i, *each) for i, each in enumerate(result.magnetometers.items())]
        found = [(i, name, each) for i, name, each in fields if isinstance(each, MagnetometerEntry)]
        if not (places or found):
            raise Refused("nothing_to_export", "the run calibrated no sensor", "Give a run that calibrates one")
        sensors = {name: result.sensors[name] for name in gyroscopes}
        sections: list[tuple[Iterator[str], Parameters]] = [
            *((origin(result, name, each, each.temperature_c), self.gyroscope(places[name], each))
              for name, each in sensors.items()),
            *((origin(result, name, each, each.temperature_c), self.accelerometer(places[name], each))
              for name, each in result.accelerometers.items()),
            *((origin(result, name, each, None), self.magnetometer(i, each)) for i, name, each in found),
        ]  # fmt: skip
        for said, parameters in sections:
            yield from (f"# {line}" for line in said)
            yield from (form(name, value) for name, value in parameters)
        left_out = [name for _, name, each in fields if not isinstance(each, MagnetometerEntry)]
        yield from (f"# not calibrated: magnetometer {printable(name)}" for name in left_out)


def px4_files(result: ResultDocument) -> Mapping[str, str]:
    """`px4.params`, as QGroundControl loads it: vehicle, component, name, value, type, between tabs."""
    lines = [
        *HEADING,
        "# Lost too: CAL_GYROn_ID, CAL_ACCn_ID, CAL_MAGn_ID, which only the vehicle knows; PX4 heeds what has its",
        "# sensor's ID. Magnetic fields are in gauss.",
        *PX4.lines(result, lambda name, value: f"1\t1\t{name}\t{value!r}\t{PX4_FLOAT}"),
    ]
    if result.over_temperature:
        lines += [
            "# Over temperature: reading - (X1 d + X2 d^2 + X3 d^3) - offset, d = T - TREF, T within TMIN and TMAX.",
            "# Lost: scale factors over temperature; TC_Gn_ID, TC_An_ID, which only the vehicle knows.",
        ]
    for name, value in px4_parameters(result, _places(result)):
        lines.append(f"1\t1\t{name}\t{value!r}\t{PX4_INT if isinstance(value, int) else PX4_FLOAT}")
    return {"px4.params": "\n".join(lines) + "\n"}


def ardupilot_files(result: ResultDocument) -> Mapping[str, str]:
    """`ardupilot.param`: name, value."""
    lines = [*HEADING, *OF_ARDUPILOT, *ARDUPILOT.lines(result, lambda name, value: f"{name},{value!r}")]
    if result.over_temperature:
        lines += [
            "# Over temperature: reading - P(T - 35) + P(CALTEMP - 35) - offset, P(u) = 1e-6 (c1 u + c2 u^2 + c3 u^3),",
            "# temperatures within TMIN and TMAX. Lost: scale factors over temperature.",
            *(f"{name},{value!r}" for name, value in ardupilot_parameters(result, _places(result))),
        ]
    if any(line.startswith("INS_GYR") for line in lines):
        lines += ["# Without this ArduPilot finds offsets of gyroscopes of its own at each boot.", "INS_GYR_CAL,0"]
    return {"ardupilot.param": "\n".join(lines) + "\n"}


def _gyroscopes(result: ResultDocument) -> list[str]:
    return [name for name, each in result.sensors.items() if each.role == "calibrate"]


def _places(result: ResultDocument) -> dict[str, int]:
    """The number of each IMU: the first is 0."""
    return {name: i for i, name in enumerate(dict.fromkeys([*_gyroscopes(result), *result.accelerometers]))}


def symmetric(matrix: Array) -> Array:
    """(3, 3) symmetric P of matrix = R P with a rotation R: it brings a reading to the same size as the matrix does."""
    squared, vectors = np.linalg.eigh(matrix.T @ matrix)
    found: Array = vectors @ np.diag(np.sqrt(squared)) @ vectors.T
    return found


def _each(form: str, values: Iterable[float]) -> Parameters:
    """A parameter for each axis, whose letter stands at `{}`."""
    for axis, value in zip(AXES, values, strict=True):
        yield form.format(axis), float(value)


def _ellipsoid(magnetometer: MagnetometerEntry) -> tuple[Array, Array]:
    """(3,) the diagonal and (3,) what is beside it: xy, xz, yz."""
    matrix = symmetric(np.array(magnetometer.correction_matrix))
    return np.diag(matrix), matrix[[0, 0, 1], [1, 2, 2]]


def _px4_gyroscope(number: int, gyroscope: SensorEntry) -> Parameters:
    yield from _each(f"CAL_GYRO{number}_{{}}OFF", np.negative(gyroscope.bias_rad_s))


def _px4_accelerometer(number: int, accelerometer: AccelerometerEntry) -> Parameters:
    yield from _each(f"CAL_ACC{number}_{{}}OFF", accelerometer.bias_m_s2)
    yield from _each(f"CAL_ACC{number}_{{}}SCALE", accelerometer.scale)


def _px4_magnetometer(number: int, magnetometer: MagnetometerEntry) -> Parameters:
    diagonal, beside = _ellipsoid(magnetometer)
    yield from _each(f"CAL_MAG{number}_{{}}OFF", np.divide(magnetometer.bias_t, GAUSS_T))
    yield from _each(f"CAL_MAG{number}_{{}}SCALE", diagonal)
    yield from _each(f"CAL_MAG{number}_{{}}ODIAG", beside)


def _ardupilot_gyroscope(number: int, gyroscope: SensorEntry) -> Parameters:
    name = f"INS_GYR{number + 1}OFFS" if number else "INS_GYROFFS"
    yield from _each(f"{name}_{{}}", np.negative(gyroscope.bias_rad_s))
    if gyroscope.temperature_c is not None:
        yield f"INS_GYR{number + 1}_CALTEMP", gyroscope.temperature_c


def _ardupilot_accelerometer(number: int, accelerometer: AccelerometerEntry) -> Parameters:
    yield from _each(f"INS_ACC{_nth(number)}OFFS_{{}}", accelerometer.bias_m_s2)
    yield from _each(f"INS_ACC{_nth(number)}SCAL_{{}}", accelerometer.scale)


def _ardupilot_magnetometer(number: int, magnetometer: MagnetometerEntry) -> Parameters:
    diagonal, beside = _ellipsoid(magnetometer)
    yield from _each(f"COMPASS_OFS{_nth(number)}_{{}}", np.divide(magnetometer.bias_t, -MILLIGAUSS_T))
    yield from _each(f"COMPASS_DIA{_nth(number)}_{{}}", diagonal)
    yield from _each(f"COMPASS_ODI{_nth(number)}_{{}}", beside)


def _nth(number: int) -> str:
    """The first has no number."""
    return str(number + 1) if number else ""


PX4 = Autopilot(_px4_gyroscope, _px4_accelerometer, _px4_magnetometer)
ARDUPILOT = Autopilot(_ardupilot_gyroscope, _ardupilot_accelerometer, _ardupilot_magnetometer)
