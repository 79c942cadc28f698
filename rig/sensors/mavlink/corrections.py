"""What an autopilot has done to readings before it sends them, by its parameters: undone, or refused by name. Pure.

ArduPilot, AP_InertialSensor_Backend.cpp (_rotate_and_correct_gyro, _rotate_and_correct_accel): readings in the axes of
the sensor as the board's definition has them, less temperature's part, less an offset, accelerations then times a
scale, all turned by AHRS_ORIENTATION; then notches and a low-pass of second order (apply_gyro_filters). PX4,
src/lib/sensor_calibration (`Correct`): the same order, turned by SENS_BOARD_ROT; its messages hold the means over
IMU_INTEG_RATE of what no filter has seen (VehicleIMU), in HIGHRES_IMU less the bias that its estimator believes in
(HIGHRES_IMU.hpp).
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from rig.config.sensors.mavlink_section import MavlinkSection
from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError
from rig.sensors.mavlink.dialect import ARDUPILOT
from rig.sensors.mavlink.orientations import signed_axes

AXES = "XYZ"
LEAST_CUTOFF_HZ = 5.0  # of a low-pass: below that it has not settled where a sweep's steady part begins


@dataclass(frozen=True, slots=True)
class Names:
    """How the parameters of one IMU are called: those of its correction, a name for each axis, and what else counts."""

    gyro_offset: tuple[str, ...]
    force_offset: tuple[str, ...]
    force_scale: tuple[str, ...]
    orientation: str
    off: tuple[str, ...]  # must be 0 where they exist: each corrects in a way that cannot be undone
    filters: tuple[str, ...] = ()
    others: tuple[str, ...] = ()  # not 0 where there is a further IMU
    identity: str | None = None  # must not be 0: without it the correction is not applied

    @property
    def needed(self) -> tuple[str, ...]:
        """The parameters without which nothing is known of its readings."""
        named = (*self.gyro_offset, *self.force_offset, *self.force_scale, self.orientation, *self.filters)
        return named if self.identity is None else (*named, self.identity)


@dataclass(frozen=True, slots=True)
class Correction:
    """What is undone: rate = R (raw − offset), force = R scale (raw − offset), R (3, 3) the board's orientation."""

    gyro_offset_rad_s: Array = field(default_factory=partial(np.zeros, 3))
    force_offset_m_s2: Array = field(default_factory=partial(np.zeros, 3))
    force_scale: Array = field(default_factory=partial(np.ones, 3))
    orientation: Array = field(default_factory=partial(np.eye, 3))

    def raw_rate(self, rate_rad_s: Array) -> Array:
        """Rates (n, 3) as they were before, in the sensor's own axes."""
        raw: Array = rate_rad_s @ self.orientation + self.gyro_offset_rad_s
        return raw

    def raw_force(self, force_m_s2: Array) -> Array:
        """Specific forces (n, 3) as they were before, in the sensor's own axes."""
        raw: Array = force_m_s2 @ self.orientation / self.force_scale + self.force_offset_m_s2
        return raw


def names_of(firmware: int, section: MavlinkSection) -> Names:
    """How that firmware calls the parameters of the configured IMU."""
    place = section.instance
    if firmware == ARDUPILOT:
        nth = str(place + 1) if place else ""
        gyro = f"INS_GYR{nth}OFFS" if place else "INS_GYROFFS"
        return Names(
            gyro_offset=tuple(f"{gyro}_{axis}" for axis in AXES),
            force_offset=tuple(f"INS_ACC{nth}OFFS_{axis}" for axis in AXES),
            force_scale=tuple(f"INS_ACC{nth}SCAL_{axis}" for axis in AXES),
            orientation="AHRS_ORIENTATION",
            off=(f"INS_TCAL{place + 1}_ENABLE", "INS_NOTCH_ENABLE", "INS_HNTCH_ENABLE", "INS_HNTC2_ENABLE"),
            filters=("INS_GYRO_FILTER", "INS_ACCEL_FILTER"),
            others=("INS_GYR2_ID", "INS_GYR3_ID"),
        )
    # Its estimator's bias goes into HIGHRES_IMU alone; it learns offsets by itself while it believes that it rests.
    bias = ("EKF2_EN",) if section.imu == "HIGHRES_IMU" else ()
    board = tuple(f"SENS_BOARD_{axis}_OFF" for axis in AXES)
    return Names(
        gyro_offset=tuple(f"CAL_GYRO{place}_{axis}OFF" for axis in AXES),
        force_offset=tuple(f"CAL_ACC{place}_{axis}OFF" for axis in AXES),
        force_scale=tuple(f"CAL_ACC{place}_{axis}SCALE" for axis in AXES),
        orientation="SENS_BOARD_ROT",
        off=("TC_G_ENABLE", "TC_A_ENABLE", "IMU_GYRO_CAL_EN", "SENS_IMU_AUTOCAL", *board, *bias),
        others=("CAL_GYRO1_ID", "CAL_GYRO2_ID"),
        identity=f"CAL_GYRO{place}_ID",
    )


def refusals(sensor: str, names: Names, parameters: Mapping[str, float]) -> Iterator[SensorError]:
    """What cannot be undone: `autopilot_corrects`, `autopilot_orientation`, `autopilot_filter_slow`,
    `autopilot_not_calibrated`, `autopilot_parameter_missing`.
    """
    missing = [name for name in names.needed if name not in parameters]
    if missing:
        yield SensorError(
            "autopilot_parameter_missing",
            f"{sensor}: the autopilot has no parameter {', '.join(missing)}",
            "See that it has that IMU, and that its firmware is no older than ArduPilot 4.0 or PX4 1.12",
        )
        return
    for name in names.off:
        if parameters.get(name, 0.0) != 0.0:
            yield SensorError(
                "autopilot_corrects",
                f"{sensor}: {name} is {parameters[name]:g}, so the autopilot changes its readings in a way that cannot "
                "be undone",
                f"Set {name} to 0 for the calibration, restart the autopilot, and set it back afterwards",
            )
    if signed_axes(parameters[names.orientation]) is None:
        yield SensorError(
            "autopilot_orientation",
            f"{sensor}: {names.orientation} is {parameters[names.orientation]:g}, which is not made of right angles",
            f"Set {names.orientation} to 0 for the calibration, and set it back afterwards",
        )
    for name in names.filters:
        if 0.0 < parameters[name] < LEAST_CUTOFF_HZ:
            yield SensorError(
                "autopilot_filter_slow",
                f"{sensor}: {name} is {parameters[name]:g} Hz, too slow to have settled when a turn is measured",
                f"Set {name} to {LEAST_CUTOFF_HZ:g} or more; 20 is what ArduPilot comes with",
            )
    if names.identity is not None and parameters[names.identity] == 0.0:
        yield SensorError(
            "autopilot_not_calibrated",
            f"{sensor}: {names.identity} is 0, so the autopilot does not say which sensor its offsets belong to",
            "Calibrate the sensor once with QGroundControl, which enters its number",
        )


def correction_of(names: Names, parameters: Mapping[str, float]) -> Correction:
    """What is undone, by parameters that `refusals` has nothing against."""
    orientation = signed_axes(parameters[names.orientation])
    if orientation is None:
        raise ValueError(f"{names.orientation} is refused before")
    scale = _vector(names.force_scale, parameters)
    return Correction(
        _vector(names.gyro_offset, parameters),
        _vector(names.force_offset, parameters),
        np.where(scale == 0.0, 1.0, scale),
        orientation,
    )


def delay_s(names: Names, parameters: Mapping[str, float]) -> float:
    """The delay of rates by a low-pass of second order (Butterworth): √2 / (2π f); 0 without one."""
    cutoff_hz = parameters.get(names.filters[0], 0.0) if names.filters else 0.0
    return float(np.sqrt(2.0) / (2.0 * np.pi * cutoff_hz)) if cutoff_hz > 0 else 0.0


def _vector(names: Sequence[str], parameters: Mapping[str, float]) -> Array:
    return np.array([parameters[name] for name in names])
