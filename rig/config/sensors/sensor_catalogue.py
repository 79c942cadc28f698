"""The sensors for which the rig has drivers, with their possible data rates and ranges."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import radians, sqrt
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

RATE_TOLERANCE = 2e-4  # relative: 333.33 stands for 1000/3, and the closest two rates of a part are 5e-4 apart


@dataclass(frozen=True, slots=True)
class DeliveredErrors:
    """The errors of a part as it is delivered: half-widths, None if its data sheet has no figure.

    `rate_percent` is the error of the part's own data rate, over all temperatures.
    """

    bias_deg_s: float | None = None
    scale_percent: float | None = None
    acceleration_bias_mg: float | None = None
    acceleration_scale_percent: float | None = None
    rate_percent: float | None = None


@dataclass(frozen=True, slots=True)
class PartSpec:
    """One kind of sensor, by its data sheet: limits (half-widths) unless stated otherwise.

    - rates_hz, ranges_deg_s: all data rates and ranges of its gyroscope.
    - rates_rule: the permitted rates in words.
    - default_rate_hz, default_range_deg_s: the values used if the configuration sets none.
    - g_sensitivity_deg_s_g: change of a reading by 1 g.
    - nonlinearity_percent: deviation from the best straight line, of full scale.
    - asymmetry_percent: the even part of the nonlinearity.
    - bias_deg_s_k, scale_ppm_k: change of bias and scale with temperature.
    - angle_random_walk_deg_sqrt_h: white noise, typical.
    - bias_instability_deg_h: the least Allan deviation of the bias.
    - non_orthogonality_deg: deviation from 90° between two axes.
    - ranges_g: the ranges of its accelerometer, the usual one first; the data rate is the gyroscope's.
    - acceleration_noise_ug_sqrt_hz: noise density, one-sided, as data sheets state it.
    - acceleration_nonlinearity_percent: relative to the range that acceleration_nonlinear_over_g states.
    - acceleration_bias_mg_k, acceleration_scale_ppm_k, acceleration_bias_instability_ug: as the gyroscope's.
    - acceleration_nonlinear_over_g: the range of that nonlinearity, in either direction; 0 for the configured range.
    - delivered: the errors, as delivered, of the quantities that a calibration estimates.
    - own_port: whether it has a port and a clock of its own.
    - any_rate: whether this kind stands for any sensor. Its section then states rates and ranges, and the limits here
      are those of a consumer part.
    """

    rates_hz: tuple[float, ...]
    rates_rule: str
    ranges_deg_s: tuple[float, ...]
    default_rate_hz: float
    default_range_deg_s: float
    g_sensitivity_deg_s_g: float
    nonlinearity_percent: float
    asymmetry_percent: float
    bias_deg_s_k: float
    scale_ppm_k: float
    angle_random_walk_deg_sqrt_h: float
    bias_instability_deg_h: float
    non_orthogonality_deg: float
    ranges_g: tuple[float, ...]
    acceleration_noise_ug_sqrt_hz: float
    acceleration_nonlinearity_percent: float
    acceleration_bias_mg_k: float
    acceleration_scale_ppm_k: float
    acceleration_bias_instability_ug: float
    acceleration_nonlinear_over_g: float = 0.0
    delivered: DeliveredErrors = DeliveredErrors()
    own_port: bool = False
    any_rate: bool = False

    @property
    def angle_random_walk_rad_sqrt_s(self) -> float:
        """The standard deviation of the angle after 1 s due to white noise alone, rad/√s."""
        return radians(self.angle_random_walk_deg_sqrt_h) / 60

    @property
    def velocity_random_walk_ug_sqrt_s(self) -> float:
        """The standard deviation of an accelerometer's mean over 1 s by white noise alone, µg·√s."""
        return self.acceleration_noise_ug_sqrt_hz / sqrt(2)

    def accept_rate(self, rate_hz: float) -> float:
        """Return the part's exact rate for a nominal `rate_hz`. Raise ValueError naming the nearest if no rate fits."""
        if self.any_rate:
            return positive(rate_hz)
        return nearest_rate(rate_hz, self.rates_hz, self.rates_rule)

    def accept_range(self, range_deg_s: float) -> float:
        """Return `range_deg_s` if the part has this range. Otherwise raise ValueError with the part's nearest range."""
        return positive(range_deg_s) if self.any_rate else one_of(range_deg_s, self.ranges_deg_s)


@dataclass(frozen=True, slots=True)
class MagnetometerPart:
    """One kind of magnetometer: data rates that suit dwells of seconds, and ranges, the usual one first."""

    rates_hz: tuple[float, ...]
    ranges_gauss: tuple[float, ...]
    default_rate_hz: float

    def accept_rate(self, rate_hz: float) -> float:
        """Return the part's exact rate for a nominal `rate_hz`. Raise ValueError naming the nearest if no rate fits."""
        return nearest_rate(rate_hz, self.rates_hz, list_numbers(self.rates_hz))

    def accept_range(self, range_gauss: float) -> float:
        """Return `range_gauss` if the part has this range. Otherwise raise ValueError with the part's nearest range."""
        return one_of(range_gauss, self.ranges_gauss)


def nearest_rate(rate_hz: float, rates_hz: Sequence[float], rule: str) -> float:
    """Return the exact rate for a nominal `rate_hz`. Raise ValueError naming the nearest rate if none matches."""
    nearest = min(rates_hz, key=lambda rate: abs(rate - rate_hz))
    if abs(nearest - rate_hz) > RATE_TOLERANCE * nearest:
        raise ValueError(f"not available; the nearest is {nearest:.6g}; allowed: {rule}")
    return nearest


def one_of(value: float, allowed: Sequence[float]) -> float:
    """Return `value` if it is allowed. Otherwise raise ValueError with the nearest allowed one."""
    if value not in allowed:
        nearest = min(allowed, key=lambda candidate: abs(candidate - value))
        raise ValueError(f"not available; the nearest is {nearest:g}; allowed: {list_numbers(allowed)}")
    return value


def positive(value: float) -> float:
    """Return `value` if it is above zero. Raise ValueError otherwise."""
    if not value > 0:
        raise ValueError("must be above 0")
    return value


def list_numbers(values: Sequence[float]) -> str:
    """Return numbers separated by commas: `125, 250, 500`."""
    return ", ".join(f"{value:g}" for value in values)


def has_own_port(part: str) -> bool:
    """Return whether the part has its own port and clock; an unknown part has none."""
    return part in PARTS and PARTS[part].own_port


PARTS: Mapping[str, PartSpec] = MappingProxyType(
    {
        "lsm9ds1": PartSpec(  # datasheet DocID025715, tables 3 and 46
            rates_hz=(14.9, 59.5, 119, 238, 476, 952),
            rates_rule="14.9, 59.5, 119, 238, 476, 952",
            ranges_deg_s=(245, 500, 2000),
            default_rate_hz=238,
            default_range_deg_s=245,
            g_sensitivity_deg_s_g=0.1,  # not stated; that of the MPU-6050, a part of the same kind, PS-MPU-6000A 6.1
            nonlinearity_percent=0.1,  # not stated; this and the following are those of the MPU-9250
            asymmetry_percent=0.02,
            bias_deg_s_k=30 / 65,
            scale_ppm_k=4e4 / 65,
            angle_random_walk_deg_sqrt_h=0.42,
            bias_instability_deg_h=10,  # not stated; assumed, as consumer parts have it
            non_orthogonality_deg=1.15,
            ranges_g=(2, 4, 8, 16),
            acceleration_noise_ug_sqrt_hz=150,  # not stated; assumed
            # of the accelerometer: not stated; that of the MPU-9250
            acceleration_nonlinearity_percent=0.5,
            acceleration_bias_mg_k=1.5,
            acceleration_scale_ppm_k=260,
            acceleration_bias_instability_ug=30,
            delivered=DeliveredErrors(bias_deg_s=30),  # at ±2000 °/s
        ),
        "mpu9250": PartSpec(  # register map RM-MPU-9250A-00, registers 25 (SMPLRT_DIV) and 27 (GYRO_CONFIG)
            rates_hz=tuple(1000 / (1 + divider) for divider in range(250)),
            rates_rule="1000/(n + 1) with n = 0 … 249",
            ranges_deg_s=(250, 500, 1000, 2000),
            default_rate_hz=200,
            default_range_deg_s=250,
            g_sensitivity_deg_s_g=0.1,  # not stated; that of the MPU-6050, PS-MPU-6000A 6.1
            nonlinearity_percent=0.1,  # PS-MPU-9250A-01, table 1
            asymmetry_percent=0.02,  # not stated; assumed: a vibrating element vibrates alike in both directions
            bias_deg_s_k=30 / 65,  # ±30 °/s from −40 to 85 °C (table 1), taken as linear from 25 °C
            scale_ppm_k=4e4 / 65,  # ±4 % (table 1)
            angle_random_walk_deg_sqrt_h=0.42,  # 0.01 °/s/√Hz, one-sided (table 1): times 60 / √2
            bias_instability_deg_h=10,  # not stated; assumed, as that of the LSM9DS1
            non_orthogonality_deg=1.15,  # cross-axis sensitivity ±2 % (table 1)
            ranges_g=(2, 4, 8, 16),
            acceleration_noise_ug_sqrt_hz=300,  # PS-MPU-9250A-01, section 3.2
            # of the accelerometer: PS-MPU-9250A-01, table 2; changes by its -40 to 85 °C
            acceleration_nonlinearity_percent=0.5,
            acceleration_bias_mg_k=1.5,
            acceleration_scale_ppm_k=260,
            acceleration_bias_instability_ug=30,  # not stated; assumed, as consumer parts have it
            delivered=DeliveredErrors(bias_deg_s=5, scale_percent=3, rate_percent=1),  # PS-MPU-9250A-01, table 1
        ),
        "adis16465": PartSpec(  # datasheet, register DEC_RATE; the range is the model's: -1, -2 and -3 have one each
            rates_hz=tuple(2000 / (1 + divider) for divider in range(2000)),
            rates_rule="2000/(n + 1) with n = 0 … 1999",
            ranges_deg_s=(125, 500, 2000),
            default_rate_hz=200,
            default_range_deg_s=500,
            g_sensitivity_deg_s_g=0.015,  # as the datasheet of the ADIS16445 states
            # This and the following are assumed: the part's data sheet states them, but was not looked up.
            nonlinearity_percent=0.2,
            asymmetry_percent=0.004,
            bias_deg_s_k=0.2 / 60,
            scale_ppm_k=3e3 / 60,
            angle_random_walk_deg_sqrt_h=0.15,  # data sheet, features
            bias_instability_deg_h=2,  # data sheet, features: that of the -1 (±125 °/s), assumed for the others
            non_orthogonality_deg=0.15,  # axis to axis ±0.05° (data sheet, features), taken as a std: three of it
            ranges_g=(8,),
            acceleration_noise_ug_sqrt_hz=23,  # assumed: the part's data sheet states it, but was not looked up
            # Of the accelerometer, assumed: the part's data sheet states it, but was not looked up.
            acceleration_nonlinearity_percent=0.25,
            acceleration_nonlinear_over_g=2,
            acceleration_bias_mg_k=0.05,
            acceleration_scale_ppm_k=20,
            acceleration_bias_instability_ug=3.6,  # data sheet, features
        ),
        # DS-000347 rev. 1.8, section 14.37; at lower rates the filter passes more than half the sample rate
        "icm42688p": PartSpec(
            rates_hz=(25, 50, 100, 200, 500, 1000, 2000),
            rates_rule="25, 50, 100, 200, 500, 1000, 2000",
            ranges_deg_s=(15.625, 31.25, 62.5, 125, 250, 500, 1000, 2000),
            default_rate_hz=200,
            default_range_deg_s=250,
            g_sensitivity_deg_s_g=0.1,  # not stated; that of the MPU-6050, PS-MPU-6000A 6.1
            nonlinearity_percent=0.1,  # table 1
            asymmetry_percent=0.02,  # not stated; assumed, as of the MPU-9250
            bias_deg_s_k=0.005,  # table 1, 0 to 70 °C
            scale_ppm_k=50,  # table 1, ±0.005 %/°C
            angle_random_walk_deg_sqrt_h=0.119,  # 0.0028 °/s/√Hz, one-sided (table 1): times 60 / √2
            bias_instability_deg_h=10,  # not stated; assumed, as of the MPU-9250
            non_orthogonality_deg=0.72,  # cross-axis sensitivity ±1.25 % (table 1)
            ranges_g=(2, 4, 8, 16),
            acceleration_noise_ug_sqrt_hz=70,  # table 2: that of z; x and y have 65
            # of the accelerometer: table 2
            acceleration_nonlinearity_percent=0.1,
            acceleration_nonlinear_over_g=2,
            acceleration_bias_mg_k=0.15,
            acceleration_scale_ppm_k=50,
            acceleration_bias_instability_ug=30,  # not stated; assumed, as consumer parts have it
            delivered=DeliveredErrors(
                bias_deg_s=0.5,  # table 1
                scale_percent=0.5,
                acceleration_bias_mg=20,  # table 2
                acceleration_scale_percent=0.5,
                rate_percent=3.5,  # table 4: ±1.5 % at 25 °C and ±2 % with temperature, the gyroscope's clock
            ),
        ),
        "lsm6dsv16x": PartSpec(  # DS13510 rev. 4, table 20: three sets of rates of the high-accuracy mode
            rates_hz=tuple(
                sorted(fastest / 2**n for fastest in (1600, 1920, 2000) for n in range(8)),
            ),
            rates_rule="1600/2ⁿ, 1920/2ⁿ, 2000/2ⁿ with n = 0 … 7",
            ranges_deg_s=(125, 250, 500, 1000, 2000),
            default_rate_hz=240,
            default_range_deg_s=250,
            g_sensitivity_deg_s_g=0.1,  # not stated; that of the MPU-6050, PS-MPU-6000A 6.1
            nonlinearity_percent=0.1,  # not stated; assumed, as of the ICM-42688-P
            asymmetry_percent=0.02,  # not stated; assumed, as of the MPU-9250
            bias_deg_s_k=0.006,  # table 3
            scale_ppm_k=70,  # table 3, ±0.007 %/°C
            angle_random_walk_deg_sqrt_h=0.119,  # 2.8 mdps/√Hz, one-sided (table 3): times 60 / √2
            bias_instability_deg_h=10,  # not stated; assumed, as of the MPU-9250
            non_orthogonality_deg=0.72,  # not stated; assumed, as of the ICM-42688-P
            ranges_g=(2, 4, 8, 16),
            acceleration_noise_ug_sqrt_hz=60,  # table 3, high-performance mode, whose noise this mode has (section 6.5)
            acceleration_nonlinearity_percent=0.1,  # not stated; assumed, as of the ICM-42688-P
            acceleration_nonlinear_over_g=2,
            acceleration_bias_mg_k=0.07,  # table 3
            acceleration_scale_ppm_k=100,  # table 3, ±0.01 %/°C
            acceleration_bias_instability_ug=30,  # not stated; assumed, as consumer parts have it
            # Table 3; the accelerometer's scale factor has no figure there
            delivered=DeliveredErrors(bias_deg_s=1, scale_percent=0.3, acceleration_bias_mg=12, rate_percent=1),
        ),
        "kvh1775": PartSpec(  # ICD 56-0298 Rev. B, command =DR; -01 and -25 have one range of acceleration each
            rates_hz=(1, 5, 10, 25, 50, 100, 250, 500, 750, 1000, 3600, 5000),
            rates_rule="1, 5, 10, 25, 50, 100, 250, 500, 750, 1000, 3600, 5000",
            ranges_deg_s=(490,),  # from the maker's data sheet
            default_rate_hz=1000,
            default_range_deg_s=490,
            # Not stated; assumed: 1 °/h/g, because light is not sensitive to acceleration.
            g_sensitivity_deg_s_g=0.0003,
            nonlinearity_percent=0.005,  # assumed: 50 ppm, as usual for an optical scale factor
            asymmetry_percent=0.0005,
            bias_deg_s_k=1 / 3600 / 60,  # assumed: 1 °/h over 60 K
            scale_ppm_k=200 / 60,  # assumed: 200 ppm over 60 K
            angle_random_walk_deg_sqrt_h=0.012,  # TRIAX, table 1
            bias_instability_deg_h=0.05,  # assumed: the maker's typical value
            non_orthogonality_deg=0.06,  # assumed: 1 mrad
            ranges_g=(10, 25),
            acceleration_noise_ug_sqrt_hz=168,  # TRIAX, table 1: 0.0701 m/s/√h, times √2 / 60
            # Of the accelerometer, assumed: the maker's data sheet states it, but was not looked up.
            acceleration_nonlinearity_percent=0.9,
            acceleration_nonlinear_over_g=10,
            acceleration_bias_mg_k=0.05,
            acceleration_scale_ppm_k=100,
            acceleration_bias_instability_ug=50,
            own_port=True,
        ),
        # Autopilots have many kinds of IMUs: the values below are those of TDK's ICM-42688-P (DS-000347, tables 1 and
        # 2), which most present flight controllers have; what it does not state is that of the MPU-9250.
        "mavlink": PartSpec(
            rates_hz=tuple(range(5, 401)),
            rates_rule="5, 6, … 400",
            ranges_deg_s=(250, 500, 1000, 2000),
            default_rate_hz=100,
            default_range_deg_s=2000,
            g_sensitivity_deg_s_g=0.1,
            nonlinearity_percent=0.1,
            asymmetry_percent=0.02,
            bias_deg_s_k=0.005,
            scale_ppm_k=50,
            angle_random_walk_deg_sqrt_h=0.12,  # 0.0028 °/s/√Hz, one-sided: times 60 / √2
            bias_instability_deg_h=10,
            non_orthogonality_deg=0.72,  # cross-axis sensitivity ±1.25 %
            ranges_g=(16, 8, 4),
            acceleration_noise_ug_sqrt_hz=70,
            acceleration_nonlinearity_percent=0.1,
            acceleration_nonlinear_over_g=2,
            acceleration_bias_mg_k=0.15,
            acceleration_scale_ppm_k=50,
            acceleration_bias_instability_ug=30,
            own_port=True,
        ),
        "lines": PartSpec(  # any device: assumed as poor as the worst part above; `uncertainty` states better
            rates_hz=(),
            rates_rule="any; what the device prints",
            ranges_deg_s=(),
            default_rate_hz=100,
            default_range_deg_s=250,
            g_sensitivity_deg_s_g=0.1,
            nonlinearity_percent=0.2,
            asymmetry_percent=0.02,
            bias_deg_s_k=30 / 65,
            scale_ppm_k=4e4 / 65,
            angle_random_walk_deg_sqrt_h=0.42,
            bias_instability_deg_h=10,
            non_orthogonality_deg=1.15,
            ranges_g=(),
            acceleration_noise_ug_sqrt_hz=300,
            acceleration_nonlinearity_percent=0.5,
            acceleration_bias_mg_k=1.5,
            acceleration_scale_ppm_k=260,
            acceleration_bias_instability_ug=30,
            own_port=True,
            any_rate=True,
        ),
    }
)

MAGNETOMETERS: Mapping[str, MagnetometerPart] = MappingProxyType(
    {
        "lsm9ds1_magnetometer": MagnetometerPart(  # datasheet DocID025715, table 3 and register CTRL_REG1_M
            rates_hz=(5, 10, 20, 40, 80), ranges_gauss=(4, 8, 12, 16), default_rate_hz=80
        ),
    }
)

CATALOGUE: Mapping[str, PartSpec | MagnetometerPart] = MappingProxyType({**PARTS, **MAGNETOMETERS})

if TYPE_CHECKING:
    PartName = str
    MagnetometerName = str
else:  # the names that a configuration may use, for the message about a misspelt one
    PartName = Literal[tuple(PARTS)]
    MagnetometerName = Literal[tuple(MAGNETOMETERS)]
