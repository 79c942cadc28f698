"""Parameter files of PX4 and ArduPilot: their corrections of gyroscopes, accelerometers and magnetometers.

PX4 (src/lib/sensor_calibration) corrects gyroscopes as data − offset, accelerometers as (data − offset) scale, and
magnetometers, in gauss, as S (data − offset) with a symmetric S. ArduPilot (AP_InertialSensor_Backend, AP_Compass)
corrects likewise, except that it adds the offsets of a compass, which are in milligauss. ArduPilot replaces the offsets
of gyroscopes, INS_GYROFFS_X, …, at each boot unless INS_GYR_CAL is 0. Neither autopilot has a scale factor of a
gyroscope.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

import numpy as np

from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.estimation.arrays import Array
from rig.report.exports.exported_corrections import ExportedCalibrations
from rig.report.exports.over_temperature import ardupilot_parameters, px4_parameters
from rig.report.findings.linear_corrections import SensorCorrection
from rig.report.kinds.kind_registry import kinds

GAUSS_T, MILLIGAUSS_T = 1e-4, 1e-7
PX4_FLOAT, PX4_INT = 9, 6  # MAV_PARAM_TYPE_REAL32, _INT32
HEADING = (
    "# Offsets in each sensor's own axes. Gyroscopes, rad/s: rate = reading - offset, offset = -b at zero gravity.",
    "# Accelerometers, m/s^2: (reading - offset) * scale. Magnetometers: a symmetric matrix times the",
    "# difference, in the right-angled axes in which it is symmetric.",
    "# Lost: scale factors and axes of gyroscopes, axes of accelerometers, g-sensitivity, second order, uncertainties;",
    "# there is no parameter for them.",
)
ARDUPILOT_NOTES = (
    "# Magnetic fields are in milligauss, and the offset of a compass is added.",
    "# ArduPilot corrects readings after their rotation by the compass's and the board's orientation and the driver:",
    "# these values apply if none of these rotates them. COMPASS_SCALE, where there is one, must be 0 or 1.",
)
AXES = "XYZ"
IMU = (RATE, ACCELERATION)
# For each quantity the names of the parameters, and the values of the axes, or a single value.
Autopilot = Mapping[Quantity, Mapping[str, Callable[[SensorCorrection], Iterable[float]]]]


def px4_files(calibrations: ExportedCalibrations) -> Mapping[str, str]:
    """Return the text of `px4.params` for QGroundControl; each line is vehicle, component, name, value and type."""
    lines = [
        *HEADING,
        "# Lost too: CAL_GYROn_ID, CAL_ACCn_ID, CAL_MAGn_ID, which only the vehicle has; PX4 uses parameters",
        "# with its sensor's ID only. Magnetic fields are in gauss.",
        *_lines(calibrations, PX4, lambda name, value: f"1\t1\t{name}\t{value!r}\t{PX4_FLOAT}"),
    ]
    if calibrations.over_temperature:
        lines += [
            "# Over temperature: reading - (X1 d + X2 d^2 + X3 d^3) - offset, d = T - TREF, T within TMIN and TMAX.",
            "# Lost: scale factors over temperature; TC_Gn_ID, TC_An_ID, which only the vehicle has.",
        ]
    for name, value in px4_parameters(calibrations.over_temperature, _number_imus(calibrations)):
        lines.append(f"1\t1\t{name}\t{value!r}\t{PX4_INT if isinstance(value, int) else PX4_FLOAT}")
    return {"px4.params": "\n".join(lines) + "\n"}


def ardupilot_files(calibrations: ExportedCalibrations) -> Mapping[str, str]:
    """Return the text of `ardupilot.param`; each line has a parameter's name and value."""
    lines = [*HEADING, *ARDUPILOT_NOTES, *_lines(calibrations, ARDUPILOT, lambda name, value: f"{name},{value!r}")]
    if polynomials := calibrations.over_temperature:
        lines += [
            "# Over temperature: reading - P(T - 35) + P(CALTEMP - 35) - offset, P(u) = 1e-6 (c1 u + c2 u^2 + c3 u^3),",
            "# temperatures within TMIN and TMAX. Lost: scale factors over temperature.",
            *(f"{name},{value!r}" for name, value in ardupilot_parameters(polynomials, _number_imus(calibrations))),
        ]
    if any(line.startswith("INS_GYR") for line in lines):
        lines += ["# Without this ArduPilot replaces the offsets of gyroscopes at each boot.", "INS_GYR_CAL,0"]
    return {"ardupilot.param": "\n".join(lines) + "\n"}


def _lines(
    calibrations: ExportedCalibrations, autopilot: Autopilot, form: Callable[[str, float], str]
) -> Iterator[str]:
    """Yield a line for each parameter, written by `form`, and comments on each sensor's calibration.

    Sensors are numbered in the order of the configuration; an accelerometer has its gyroscope's number. Raise Refused
    `nothing_to_export`.
    """
    numbers, fields = _number_imus(calibrations), list(calibrations.result.magnetometers)
    if not any(sensor.quantity in autopilot for sensor in calibrations.sensors):
        raise Refused("nothing_to_export", "the run calibrated no sensor", "Give a run that calibrates one")
    for sensor in calibrations.sensors:
        if sensor.quantity not in autopilot:
            yield f"# Lost: {printable(sensor.name)}: there is no parameter for it"
            continue
        yield from (f"# {line}" for line in calibrations.origin(sensor))
        number = fields.index(sensor.sensor) if sensor.quantity == FIELD else numbers[sensor.sensor]
        yield from (form(name, value) for name, value in sensor_parameters(autopilot, number, sensor))
    yield from (f"# Lost: {name}: there is no parameter for it" for name in calibrations.further_terms)
    yield from (f"# {printable(line)}" for kind in kinds() for line in kind.unsolved(calibrations.result))


def _number_imus(calibrations: ExportedCalibrations) -> dict[str, int]:
    """Return the number of each IMU, counted from 0 in the order of the calibrations, by the sensor's name."""
    names = dict.fromkeys(sensor.sensor for sensor in calibrations.sensors if sensor.quantity in IMU)
    return {name: i for i, name in enumerate(names)}


def symmetric(matrix: Array) -> Array:
    """Return the symmetric factor P (3, 3) of the polar decomposition `matrix` = R P, where R is a rotation."""
    squared, vectors = np.linalg.eigh(matrix.T @ matrix)
    root: Array = vectors @ np.diag(np.sqrt(squared)) @ vectors.T
    return root


def _find_diagonal(magnetometer: SensorCorrection) -> Array:
    """Return the diagonal (3,) of a magnetometer's symmetric correction."""
    return np.diag(symmetric(np.asarray(np.linalg.inv(magnetometer.matrix), dtype=np.float64)))


def _find_off_diagonal(magnetometer: SensorCorrection) -> Array:
    """Return the off-diagonal elements (3,) xy, xz, yz of a magnetometer's symmetric correction."""
    matrix = symmetric(np.asarray(np.linalg.inv(magnetometer.matrix), dtype=np.float64))
    return matrix[[0, 0, 1], [1, 2, 2]]


def _temperature_c(gyroscope: SensorCorrection) -> Sequence[float]:
    return () if gyroscope.temperature_c is None else [gyroscope.temperature_c]


# In a name, {index} counts the sensors from 0 and {number} from 1; {later} is {number}, but empty for the first sensor.
PX4: Autopilot = {
    RATE: {"CAL_GYRO{index}_{axis}OFF": lambda sensor: sensor.offset},
    ACCELERATION: {
        "CAL_ACC{index}_{axis}OFF": lambda sensor: sensor.offset,
        "CAL_ACC{index}_{axis}SCALE": lambda sensor: sensor.scale,
    },
    FIELD: {
        "CAL_MAG{index}_{axis}OFF": lambda sensor: sensor.offset / GAUSS_T,
        "CAL_MAG{index}_{axis}SCALE": _find_diagonal,
        "CAL_MAG{index}_{axis}ODIAG": _find_off_diagonal,
    },
}
ARDUPILOT: Autopilot = {
    RATE: {"INS_GYR{later}OFFS_{axis}": lambda sensor: sensor.offset, "INS_GYR{number}_CALTEMP": _temperature_c},
    ACCELERATION: {
        "INS_ACC{later}OFFS_{axis}": lambda sensor: sensor.offset,
        "INS_ACC{later}SCAL_{axis}": lambda sensor: sensor.scale,
    },
    FIELD: {
        "COMPASS_OFS{later}_{axis}": lambda sensor: -sensor.offset / MILLIGAUSS_T,
        "COMPASS_DIA{later}_{axis}": _find_diagonal,
        "COMPASS_ODI{later}_{axis}": _find_off_diagonal,
    },
}


def sensor_parameters(autopilot: Autopilot, index: int, sensor: SensorCorrection) -> Iterator[tuple[str, float]]:
    """Yield name and value of each parameter for the sensor number `index`, from 0; nothing if there are none."""
    numbers = {"index": index, "number": index + 1, "later": index + 1 if index else ""}
    for name, values_of in autopilot.get(sensor.quantity, {}).items():
        for axis, value in zip(AXES, values_of(sensor), strict=False):
            yield name.format(axis=axis, **numbers), float(value)
