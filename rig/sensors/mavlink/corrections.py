"""An autopilot's corrections of its readings, as its parameters state them: undone, or refused by name. Pure.

ArduPilot (AP_InertialSensor_Backend.cpp: _rotate_and_correct_gyro and _accel, apply_gyro_filters) subtracts the effect
of temperature and an offset, scales accelerations, and rotates by AHRS_ORIENTATION from the axes of the board's
definition. Then it filters by notches and a low-pass of second order. PX4 (src/lib/sensor_calibration, `Correct`) has
the same order and rotates by SENS_BOARD_ROT. Its messages contain unfiltered means over IMU_INTEG_RATE (VehicleIMU); in
HIGHRES_IMU its estimator's bias is subtracted (HIGHRES_IMU.hpp).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rig.config.sensors.mavlink_section import MavlinkSection
from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError
from rig.sensors.mavlink.dialect import ARDUPILOT
from rig.sensors.mavlink.orientations import board_rotation

AXES = "XYZ"
MIN_CUTOFF_HZ = 5.0  # a slower low-pass filter has not settled when a sweep's steady part begins


@dataclass(frozen=True, slots=True)
class ParameterNames:
    """The names of one IMU's parameters.

    - `gyro_offset`, `force_offset`, `force_scale`: its correction, a name for each axis.
    - `orientation`: the orientation of its board.
    - `must_be_zero`: parameters of corrections that cannot be undone, if they exist.
    - `filters`: its low-pass filters.
    - `others`: parameters of further IMUs, 0 if there are none.
    - `identity`: a parameter that is 0 if the correction is not applied.
    """

    gyro_offset: tuple[str, ...]
    force_offset: tuple[str, ...]
    force_scale: tuple[str, ...]
    orientation: str
    must_be_zero: tuple[str, ...]
    filters: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    identity: str | None = None

    @property
    def needed(self) -> tuple[str, ...]:
        """The parameters that are required to interpret the IMU's readings."""
        required = (*self.gyro_offset, *self.force_offset, *self.force_scale, self.orientation, *self.filters)
        return required if self.identity is None else (*required, self.identity)


@dataclass(frozen=True, slots=True)
class OnboardCorrection:
    """A correction to undo: rate = R (raw − offset), force = R scale (raw − offset), R (3, 3) the orientation."""

    gyro_offset_rad_s: Array = field(default_factory=partial(np.zeros, 3))
    force_offset_m_s2: Array = field(default_factory=partial(np.zeros, 3))
    force_scale: Array = field(default_factory=partial(np.ones, 3))
    orientation: Array = field(default_factory=partial(np.eye, 3))

    def raw_rate(self, rate_rad_s: Array) -> Array:
        """Return rates (n, 3) before the correction, in the sensor's own axes."""
        raw: Array = rate_rad_s @ self.orientation + self.gyro_offset_rad_s
        return raw

    def raw_force(self, force_m_s2: Array) -> Array:
        """Return specific forces (n, 3) before the correction, in the sensor's own axes."""
        raw: Array = force_m_s2 @ self.orientation / self.force_scale + self.force_offset_m_s2
        return raw


def parameter_names(firmware: int, section: MavlinkSection) -> ParameterNames:
    """Return the firmware's names of the configured IMU's parameters."""
    instance = section.instance
    if firmware == ARDUPILOT:
        nth = str(instance + 1) if instance else ""
        gyro = f"INS_GYR{nth}OFFS" if instance else "INS_GYROFFS"
        return ParameterNames(
            gyro_offset=tuple(f"{gyro}_{axis}" for axis in AXES),
            force_offset=tuple(f"INS_ACC{nth}OFFS_{axis}" for axis in AXES),
            force_scale=tuple(f"INS_ACC{nth}SCAL_{axis}" for axis in AXES),
            orientation="AHRS_ORIENTATION",
            must_be_zero=(f"INS_TCAL{instance + 1}_ENABLE", "INS_NOTCH_ENABLE", "INS_HNTCH_ENABLE", "INS_HNTC2_ENABLE"),
            filters=("INS_GYRO_FILTER", "INS_ACCEL_FILTER"),
            others=("INS_GYR2_ID", "INS_GYR3_ID"),
        )
    # Its estimator's bias affects HIGHRES_IMU alone; the estimator learns offsets when it assumes rest.
    bias = ("EKF2_EN",) if section.imu == "HIGHRES_IMU" else ()
    board = tuple(f"SENS_BOARD_{axis}_OFF" for axis in AXES)
    return ParameterNames(
        gyro_offset=tuple(f"CAL_GYRO{instance}_{axis}OFF" for axis in AXES),
        force_offset=tuple(f"CAL_ACC{instance}_{axis}OFF" for axis in AXES),
        force_scale=tuple(f"CAL_ACC{instance}_{axis}SCALE" for axis in AXES),
        orientation="SENS_BOARD_ROT",
        must_be_zero=("TC_G_ENABLE", "TC_A_ENABLE", "IMU_GYRO_CAL_EN", "SENS_IMU_AUTOCAL", *board, *bias),
        others=("CAL_GYRO1_ID", "CAL_GYRO2_ID"),
        identity=f"CAL_GYRO{instance}_ID",
    )


def refusals(sensor: str, names: ParameterNames, parameters: Mapping[str, float]) -> Iterator[SensorError]:
    """Yield the SensorErrors of corrections that cannot be undone.

    They are `autopilot_corrects`, `autopilot_orientation`, `autopilot_filter_slow`, `autopilot_not_calibrated`,
    `autopilot_parameter_missing`.
    """
    missing = [name for name in names.needed if name not in parameters]
    if missing:
        yield SensorError(
            "autopilot_parameter_missing",
            f"{sensor}: the autopilot has no parameter {', '.join(missing)}",
            "Check that it has that IMU, and that its firmware is not older than ArduPilot 4.0 or PX4 1.12",
        )
        return
    for name in names.must_be_zero:
        if parameters.get(name, 0.0) != 0.0:
            yield SensorError(
                "autopilot_corrects",
                f"{sensor}: {name} is {parameters[name]:g}, so the autopilot changes its readings in a way that cannot "
                "be undone",
                f"Set {name} to 0 for the calibration, restart the autopilot, and set it back afterwards",
            )
    if board_rotation(parameters[names.orientation]) is None:
        yield SensorError(
            "autopilot_orientation",
            f"{sensor}: {names.orientation} is {parameters[names.orientation]:g}, which is not made of right angles",
            f"Set {names.orientation} to 0 for the calibration, and set it back afterwards",
        )
    for name in names.filters:
        if 0.0 < parameters[name] < MIN_CUTOFF_HZ:
            yield SensorError(
                "autopilot_filter_slow",
                f"{sensor}: {name} is {parameters[name]:g} Hz, too slow to have settled when a turn is measured",
                f"Set {name} to {MIN_CUTOFF_HZ:g} or more; ArduPilot's default is 20",
            )
    if names.identity is not None and parameters[names.identity] == 0.0:
        yield SensorError(
            "autopilot_not_calibrated",
            f"{sensor}: {names.identity} is 0, so the autopilot does not say which sensor its offsets belong to",
            "Calibrate the sensor once with QGroundControl, which enters its number",
        )


def read_correction(names: ParameterNames, parameters: Mapping[str, float]) -> OnboardCorrection:
    """Return the correction to undo. Raise ValueError for an orientation that `refusals` refuses."""
    orientation = board_rotation(parameters[names.orientation])
    if orientation is None:
        raise ValueError(f"{names.orientation} is refused before")
    scale = _vector(names.force_scale, parameters)
    return OnboardCorrection(
        _vector(names.gyro_offset, parameters),
        _vector(names.force_offset, parameters),
        np.where(scale == 0.0, 1.0, scale),
        orientation,
    )


def delay_s(names: ParameterNames, parameters: Mapping[str, float]) -> float:
    """Return the delay of rates, s, due to a second-order Butterworth low-pass, √2 / (2π cut-off); 0 without filter."""
    cutoff_hz = parameters.get(names.filters[0], 0.0) if names.filters else 0.0
    return float(np.sqrt(2.0) / (2.0 * np.pi * cutoff_hz)) if cutoff_hz > 0 else 0.0


def _vector(names: Sequence[str], parameters: Mapping[str, float]) -> Array:
    return np.array([parameters[name] for name in names])
