"""The first harmonic of one revolution: mean, cosine and sine of accelerometer readings over the joint's angle.

This harmonic is for an accelerometer what the mean of a revolution is for a gyroscope. The effects of the servo's
vibration follow from the joint's own speed: centripetal acceleration by the change of ω², Euler acceleration by the
angular acceleration α, and gravity by the joint's extra rotation during the filter's lag. One regression removes all
these effects, so they neither bias the result nor count as noise. It also removes the second and the third harmonic,
due to angle errors and a nonlinear sensor. Changes of the speed with one to four periods per revolution cannot be
separated from gravity, so their effect remains. An oscillation of the arm that its encoders do not measure is a peak in
the spectrum of the residuals. It is removed as well, because a revolution is not a whole number of the oscillation's
periods.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.errors import Fault
from rig.estimation.arrays import Array, median_step
from rig.estimation.refusals import check_finite, require_shape

REVOLUTION_TOLERANCE = 0.05  # of the samples' angle, in revolutions
HARMONICS = 3  # of the angle; only the first is used
VIBRATION_HARMONICS = 100  # per revolution: up to 17 Hz at 60°/s
MIN_SAMPLES = 50
SPEED_MEAN_RAD = float(np.radians(2.0))  # a speed is averaged over it: half lies outside the revolution at its ends
EMPTY_COLUMN_RATIO = 1e-9  # relative size below which a column is zero, as for an arm without vibration


@dataclass(frozen=True, slots=True)
class JointTurn:
    """The motion of the joint that turns, at n times.

    - `speed_rad_s`: 2π over the time of a revolution, negative if the angle falls.
    - `angle_rad` (n,): from the arm's states, zero at the start of the revolution.
    - `acceleration_rad_s2` (n,): the angular acceleration, as `estimate_acceleration` returns it.
    """

    speed_rad_s: float
    angle_rad: Array
    acceleration_rad_s2: Array


@dataclass(frozen=True, slots=True)
class FirstHarmonic:
    """The first harmonic of n samples, its uncertainty, and the joint's motion.

    - `harmonic_m_s2` (3, 3): mean, cosine, sine (rows) of the axes x y z; `covariance_m2_s4` (9, 9), row by row.
    - `swayed_m_s2` (3, 3): mean, cosine, sine of the force due to other joints' sway, in the sensor's nominal axes.
    - `speed_rad_s`: the joint's mean speed, negative if its angle falls.
    - `noise_m_s2` (3,): std of one sample, with `dof` degrees of freedom; `residuals_m_s2` (n, 3).
    - `vibration_m_s2` (3,): RMS of the removed vibration of servo and arm.
    - `turning_rad2_s2` (6, 3): mean, cosine and sine, by the same weights, of six terms of the joint's motion: ω², α,
      d(ω²)/dψ, dα/dψ, ω₀ (ω − ω₀) cos θ, ω₀ (ω − ω₀) sin θ. ω is the joint's rate, ω₀ the mean rate, α the angular
      acceleration, θ the angle, ψ = ω₀ t. The last four terms describe the lag of the sensor's filter.
    """

    harmonic_m_s2: Array
    swayed_m_s2: Array
    covariance_m2_s4: Array
    speed_rad_s: float
    noise_m_s2: Array
    dof: int
    residuals_m_s2: Array
    vibration_m_s2: Array
    turning_rad2_s2: Array


def first_harmonic(
    time_s: ArrayLike,
    readings_m_s2: ArrayLike,
    turn: JointTurn,
    swayed_m_s2: ArrayLike,
    *,
    coloured: Callable[[Array], float],
    swings: Callable[[Array], Array],
) -> FirstHarmonic:
    """Return the first harmonic of one whole revolution of n samples.

    - time_s (n,): on the arm's clock.
    - readings_m_s2 (n, 3): the specific force.
    - turn: the joint's motion at these times.
    - swayed_m_s2 (n, 3): the specific force due to the sway of other joints, in the sensor's nominal axes.
    - coloured: takes residuals (n,); returns the variance of their mean, relative to that of white noise.
    - swings: takes residuals (n, 3); returns columns (n, k), the oscillations at the peaks of their spectrum.

    Raise Fault `not_finite`, `incomplete_revolution`; ValueError for a wrong shape.
    """
    t, readings, swayed = (np.asarray(values, dtype=np.float64) for values in (time_s, readings_m_s2, swayed_m_s2))
    angle, count = turn.angle_rad, len(t)
    shapes = (
        ("readings", readings, (count, 3)),
        ("angle", angle, (count,)),
        ("acceleration", turn.acceleration_rad_s2, (count,)),
        ("sway", swayed, (count, 3)),
    )
    for name, array, shape in shapes:
        require_shape(name, array, shape)
    check_finite(time=t, **{name: array for name, array, _ in shapes})
    m = readings - swayed
    _require_revolution(angle)
    mean_speed = turn.speed_rad_s
    uneven = _smooth(t, angle, mean_speed)
    columns = np.hstack([_fourier_columns(angle, HARMONICS), _list_vibration(uneven, angle, mean_speed)])
    columns = np.hstack([columns, swings(_regression(columns, m)[1])])  # oscillations left in the residuals
    inverse, residuals = _regression(columns, m)
    size = np.linalg.norm(columns, axis=0)
    rank = np.linalg.matrix_rank(columns / np.where(size > 0, size, 1.0), rtol=EMPTY_COLUMN_RATIO)
    scatter = residuals.T @ residuals / (count - rank)
    gain: Array = inverse[:3]  # from readings to mean, cosine and sine
    vibration = columns[:, 1 + 2 * HARMONICS :] @ (inverse[1 + 2 * HARMONICS :] @ m)
    long_run = _find_long_run_covariance(residuals, scatter, coloured)
    return FirstHarmonic(
        harmonic_m_s2=gain @ readings,
        swayed_m_s2=gain @ swayed,
        covariance_m2_s4=np.asarray(np.kron(gain @ gain.T, long_run), dtype=np.float64),
        speed_rad_s=mean_speed,
        noise_m_s2=np.sqrt(np.diag(scatter)),
        dof=count - int(rank),
        residuals_m_s2=residuals,
        vibration_m_s2=np.sqrt(np.mean(vibration**2, axis=0)),
        turning_rad2_s2=_motion_terms(uneven, turn) @ gain.T,
    )


def estimate_acceleration(angle_rad: Callable[[Array], Array], time_s: Array, speed_rad_s: float) -> Array:
    """Return a joint's angular acceleration (n,), rad/s², from mean speeds half a step before and after each sample.

    - angle_rad: returns the joint's angles (n,) at times (n,), also shortly before and after the samples.
    - time_s (n,): the samples' times, equally spaced; speed_rad_s: the joint's speed, without its sign.

    Each speed is a mean over `SPEED_MEAN_RAD`. The sum of the accelerations depends only on the speeds at both ends of
    the revolution, so the encoders' noise stays small.
    """
    step_s, half_s = median_step(time_s), SPEED_MEAN_RAD / 2 / speed_rad_s

    def mean_speed(middle_s: Array) -> Array:
        return (angle_rad(middle_s + half_s) - angle_rad(middle_s - half_s)) / (2 * half_s)

    return (mean_speed(time_s + step_s / 2) - mean_speed(time_s - step_s / 2)) / step_s


def evenly_turning(speed_rad_s: float) -> Array:
    """Return `FirstHarmonic.turning_rad2_s2` (6, 3) of a joint that turns at constant speed."""
    turning = np.zeros((6, 3))
    turning[0, 0] = speed_rad_s**2
    return turning


def _regression(columns: Array, readings: Array) -> tuple[Array, Array]:
    """Return the least-squares map (p, n) from readings to coefficients of `columns` (n, p), and residuals (n, 3)."""
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(columns / size, rcond=EMPTY_COLUMN_RATIO) / size[:, None]
    return inverse, readings - columns @ (inverse @ readings)


def _find_long_run_covariance(residuals: Array, scatter: Array, coloured: Callable[[Array], float]) -> Array:
    """Return the long-run covariance (3, 3) of residuals (n, 3), by their autocorrelation along principal axes.

    A vibration is along one principal axis and averages out almost entirely, unlike the noise along the other two.
    Along x, y, z the noise would seem to have the vibration's correlation. `scatter` (3, 3) is the covariance of the
    residuals; `coloured` takes a series and returns the factor by which its correlation changes a mean's variance.
    """
    variances, directions = np.linalg.eigh(scatter)
    projected = residuals @ directions
    long_run = variances * np.array([coloured(projected[:, k]) for k in range(3)])
    return np.asarray((directions * long_run) @ directions.T, dtype=np.float64)


def _require_revolution(angle_rad: Array) -> None:
    """Raise Fault `incomplete_revolution` unless angles (n,) of equally spaced samples cover one revolution."""
    travel = angle_rad[-1] - angle_rad[0] if len(angle_rad) else 0.0
    covered_rad = abs(travel) * len(angle_rad) / max(len(angle_rad) - 1, 1)  # with the last sample's interval
    if len(angle_rad) < MIN_SAMPLES or abs(covered_rad / (2 * np.pi) - 1) > REVOLUTION_TOLERANCE:
        raise Fault(
            "incomplete_revolution",
            f"{len(angle_rad)} samples cover {np.degrees(covered_rad):.0f}° and not one whole revolution",
            "Give the samples of exactly one revolution, or repeat the sweep",
        )


def _fourier_columns(angle_rad: Array, count: int) -> Array:
    """Return the columns 1, cos θ, sin θ, cos 2θ, … (n, 1 + 2 `count`) at the angles θ (n,)."""
    multiples = angle_rad[:, None] * np.arange(1, count + 1)
    waves = np.stack([np.cos(multiples), np.sin(multiples)], axis=-1).reshape(len(angle_rad), -1)
    return np.column_stack([np.ones_like(angle_rad), waves])


@dataclass(frozen=True, slots=True)
class _Unevenness:
    """The unevenness of a joint's motion: `rate` (n,) minus its mean, and `jerk` (n,), SI units.

    `fast` (4, n): the rate and its first three derivatives, without the lowest four harmonics of a revolution.
    """

    rate: Array
    jerk: Array
    fast: Array


def _smooth(time_s: Array, angle_rad: Array, mean_speed_rad_s: float) -> _Unevenness:
    """Return the deviations of the joint from constant speed.

    The joint's angle is smoothed by harmonics of the revolution and then differentiated, which leaves slow deviations
    nearly without the encoders' noise.
    """
    passed_s = time_s - time_s[0]
    waves = _fourier_columns(mean_speed_rad_s * passed_s, min(VIBRATION_HARMONICS, len(time_s) // 4))
    normal = waves.T @ waves  # nearly diagonal: over a turn the waves are orthogonal
    ahead_rad = angle_rad - angle_rad[0] - mean_speed_rad_s * passed_s
    excess = mean_speed_rad_s * _differentiate(np.linalg.solve(normal, waves.T @ ahead_rad))
    fast = excess.copy()
    # Multiplied by cos θ, these slow waves would become the mean or a harmonic of the model.
    fast[: 1 + 2 * (HARMONICS + 1)] = 0.0
    derivatives = [fast]
    for _ in range(3):
        derivatives.append(mean_speed_rad_s * _differentiate(derivatives[-1]))
    jerk = mean_speed_rad_s**2 * _differentiate(_differentiate(excess))
    return _Unevenness(waves @ excess, waves @ jerk, np.array(derivatives) @ waves.T)


def _motion_terms(uneven: _Unevenness, turn: JointTurn) -> Array:
    """Return the terms (6, n) of the joint's motion in the specific force; see `FirstHarmonic.turning_rad2_s2`.

    The acceleration α is that of `turn`, because `uneven` is smoothed by harmonics of the revolution, which have equal
    speeds at both ends. With a vibration of no whole number of periods the speeds differ, and α's mean is not zero.
    """
    mean_rate, acceleration = turn.speed_rad_s, turn.acceleration_rad_s2
    rate = mean_rate + uneven.rate
    return np.stack(
        [
            rate**2,
            acceleration,
            2 * rate * acceleration / mean_rate,
            uneven.jerk / mean_rate,
            mean_rate * uneven.rate * np.cos(turn.angle_rad),
            mean_rate * uneven.rate * np.sin(turn.angle_rad),
        ]
    )


def _list_vibration(uneven: _Unevenness, angle_rad: Array, mean_speed_rad_s: float) -> Array:
    """Return the specific force (n, 6) of the joint's vibration, with derivatives for the filter's lag.

    ω is the joint's rate and ω₀ its mean. Of the centripetal acceleration only the linear part, 2 ω₀ (ω − ω₀), is
    returned, without the square (ω − ω₀)². This square has a mean, which the columns of a vibration at one frequency
    could imitate, so that the regression would remove it from the mean of the readings. The model accounts for the
    square instead, by `FirstHarmonic.turning_rad2_s2`.
    """
    rate, *derivatives = uneven.fast
    return np.column_stack([rate, *derivatives, rate * np.cos(angle_rad), rate * np.sin(angle_rad)])


def _differentiate(coefficients: Array) -> Array:
    """Return the coefficients (1 + 2 k,) of a Fourier series' derivative: constant, cosine, sine, cosine, …"""
    cos, sin = coefficients[1::2], coefficients[2::2]
    times = np.arange(1, len(cos) + 1)
    return np.concatenate([[0.0], np.stack([times * sin, -times * cos], axis=-1).ravel()])
