"""The first harmonic of one revolution: mean, cosine and sine over the joint's angle of what an accelerometer read.

It is the natural extension of the mean that a gyroscope's revolution is reduced to. What the servo's vibration adds is
known from the joint's own speed: centripetal acceleration by ω² less the square of its mean, Euler acceleration by the
angular acceleration α, and gravity by what the joint turns more while the filter lags. All of it is taken out in one
regression, so it neither turns the result nor counts as noise. So are the second and the third harmonic, which an
angle that errs and a sensor that is not linear make. A speed that changes only once to four times in a turn cannot be
told from gravity; what it does stays. An arm that also swings at a frequency of its own, of which its encoders see
nothing, shows as a line in what is left; it is taken out as well, for a turn does not end where such a swing does.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.refusals import check_finite, require_shape

WHOLE_TURN = 0.05  # of a turn, that the samples may miss or exceed
WAVES = 3  # harmonics of the angle; only the first is wanted
VIBRATION_WAVES = 100  # in a turn: 17 Hz at 60°/s
MIN_SAMPLES = 50
EMPTY = 1e-9  # an arm without vibration leaves columns empty


@dataclass(frozen=True, slots=True)
class FirstHarmonic:
    """`harmonic_m_s2` (3, 3): mean, cosine, sine (rows) of the axes x y z; `covariance_m2_s4` (9, 9), row by row.

    `speed_rad_s`: 2π over the time of a turn, negative where the angle falls. `noise_m_s2` (3,) of one sample, by so
    many degrees of `freedom`; `residuals_m_s2` (n, 3) are samples less what was fitted. `vibration_m_s2` (3,) is the
    RMS of what was taken out as the servo's or a swing. `turning_rad2_s2` (6, 3): mean, cosine and sine, by the very
    same weights, of the rate's square ω² and the angular acceleration α, of how each of them changes per radian of the
    mean turning, and of ω₀ (ω − ω₀) cos θ and sin θ, where ω₀ is the mean rate: a filter's lag shows these four.
    """

    harmonic_m_s2: Array
    covariance_m2_s4: Array
    speed_rad_s: float
    noise_m_s2: Array
    freedom: int
    residuals_m_s2: Array
    vibration_m_s2: Array
    turning_rad2_s2: Array


def first_harmonic(
    time_s: ArrayLike,
    readings_m_s2: ArrayLike,
    angle_rad: ArrayLike,
    speed_rad_s: ArrayLike,
    *,
    coloured: Callable[[Array], float],
    swings: Callable[[Array], Array],
) -> FirstHarmonic:
    """Reduce one whole revolution of n samples.

    `time_s` (n,) on the arm's clock, `readings_m_s2` (n, 3); `angle_rad`, `speed_rad_s` (n,): of the joint at these
    times, by the arm's states, the angle counted from where the attitude is known. `coloured` gives the factor by which
    the variance of a mean of residuals (n,) differs from that of white noise. `swings` gives columns (n, k) of all that
    stands out of residuals (n, 3) as a line.

    Raises Fault `not_finite`, `incomplete_revolution`; ValueError for a wrong shape.
    """
    t, m, angle, speed = (
        np.asarray(each, dtype=np.float64) for each in (time_s, readings_m_s2, angle_rad, speed_rad_s)
    )
    count = len(t)
    for name, array, shape in (("readings", m, (count, 3)), ("angle", angle, (count,)), ("speed", speed, (count,))):
        require_shape(name, array, shape)
    check_finite(time=t, readings=m, angle=angle, speed=speed)
    mean_speed = _mean_speed(t, angle)
    uneven = _uneven(t, speed, mean_speed)
    columns = np.hstack([_waves(angle, WAVES), _of_vibration(uneven, angle, mean_speed)])
    columns = np.hstack([columns, swings(_regression(columns, m)[1])])
    inverse, residuals = _regression(columns, m)
    size = np.linalg.norm(columns, axis=0)
    unknown = np.linalg.matrix_rank(columns / np.where(size > 0, size, 1.0), rtol=EMPTY)
    scatter = residuals.T @ residuals / (count - unknown)
    gain: Array = inverse[:3]
    shaking = columns[:, 1 + 2 * WAVES :] @ (inverse[1 + 2 * WAVES :] @ m)
    left = _left_of_mean(residuals, scatter, coloured)
    return FirstHarmonic(
        harmonic_m_s2=gain @ m,
        covariance_m2_s4=np.asarray(np.kron(gain @ gain.T, left), dtype=np.float64),
        speed_rad_s=mean_speed,
        noise_m_s2=np.sqrt(np.diag(scatter)),
        freedom=count - int(unknown),
        residuals_m_s2=residuals,
        vibration_m_s2=np.sqrt(np.mean(shaking**2, axis=0)),
        turning_rad2_s2=_turning(uneven, angle, mean_speed) @ gain.T,
    )


def evenly_turning(speed_rad_s: float) -> Array:
    """(6, 3) `FirstHarmonic.turning_rad2_s2` of a joint that turns evenly."""
    turning = np.zeros((6, 3))
    turning[0, 0] = speed_rad_s**2
    return turning


def _regression(columns: Array, readings: Array) -> tuple[Array, Array]:
    """(p, n) what takes readings (n, 3) to the coefficients of `columns` (n, p), and what these leave, (n, 3)."""
    size = np.linalg.norm(columns, axis=0)
    size = np.where(size > 0, size, 1.0)
    inverse = np.linalg.pinv(columns / size, rcond=EMPTY) / size[:, None]
    return inverse, readings - columns @ (inverse @ readings)


def _left_of_mean(residuals: Array, scatter: Array, coloured: Callable[[Array], float]) -> Array:
    """(3, 3) the scatter of residuals (n, 3) as far as it does not average out better or worse than white noise.

    Told apart along its own directions: a vibration is one of them and averages out nearly whole, the noise across it
    does not. Along x, y, z both are mixed, and the vibration's correlation would be taken for that of what is left.
    """
    spread, directions = np.linalg.eigh(scatter)
    along = residuals @ directions
    left = spread * np.array([coloured(along[:, k]) for k in range(3)])
    return np.asarray((directions * left) @ directions.T, dtype=np.float64)


def _mean_speed(time_s: Array, angle_rad: Array) -> float:
    """2π/T: the mean by time, which a vibration does not change over a whole turn."""
    travel = angle_rad[-1] - angle_rad[0] if len(angle_rad) else 0.0
    turned = abs(travel) * len(angle_rad) / max(len(angle_rad) - 1, 1)  # the last sample's own share
    if len(angle_rad) < MIN_SAMPLES or abs(turned / (2 * np.pi) - 1) > WHOLE_TURN:
        raise Fault(
            "incomplete_revolution",
            f"{len(angle_rad)} samples cover {np.degrees(turned):.0f}° and not one whole revolution",
            "Give the samples of exactly one revolution, or repeat the sweep",
        )
    return float(travel / (time_s[-1] - time_s[0]))


def _waves(angle_rad: Array, count: int) -> Array:
    """(n, 1 + 2 count): 1, cos θ, sin θ, cos 2θ, …"""
    turned = angle_rad[:, None] * np.arange(1, count + 1)
    waves = np.stack([np.cos(turned), np.sin(turned)], axis=-1).reshape(len(angle_rad), -1)
    return np.column_stack([np.ones_like(angle_rad), waves])


@dataclass(frozen=True, slots=True)
class _Uneven:
    """The joint's `rate` (n,) less its mean, `acceleration` (n,) and `jerk` (n,), and what of them comes fast.

    `fast` (4, n): the rate and its first three derivatives, without what changes once to four times in a turn.
    """

    rate: Array
    acceleration: Array
    jerk: Array
    fast: Array


def _uneven(time_s: Array, speed_rad_s: Array, mean_speed_rad_s: float) -> _Uneven:
    """How unevenly the joint turns.

    Differences of encoder steps are noise, so the speed is smoothed first: it is what its waves in the time of a turn
    make of it, and they are differentiated.
    """
    waves = _waves(mean_speed_rad_s * (time_s - time_s[0]), min(VIBRATION_WAVES, len(time_s) // 4))
    together = waves.T @ waves  # nearly diagonal: over a turn the waves are orthogonal
    excess = np.asarray(np.linalg.solve(together, waves.T @ (speed_rad_s - mean_speed_rad_s)), dtype=np.float64)
    fast = excess.copy()
    fast[: 1 + 2 * (WAVES + 1)] = 0.0  # times cos θ, a slower one is the mean or a wave that is wanted
    changes = [fast]
    for _ in range(3):
        changes.append(mean_speed_rad_s * _changed(changes[-1]))
    accelerated = mean_speed_rad_s * _changed(excess)
    jerked = mean_speed_rad_s * _changed(accelerated)
    return _Uneven(waves @ excess, waves @ accelerated, waves @ jerked, np.array(changes) @ waves.T)


def _turning(uneven: _Uneven, angle_rad: Array, mean_speed_rad_s: float) -> Array:
    """(6, n) what `FirstHarmonic.turning_rad2_s2` holds of it."""
    rate = mean_speed_rad_s + uneven.rate
    return np.stack(
        [
            rate**2,
            uneven.acceleration,
            2 * rate * uneven.acceleration / mean_speed_rad_s,
            uneven.jerk / mean_speed_rad_s,
            mean_speed_rad_s * uneven.rate * np.cos(angle_rad),
            mean_speed_rad_s * uneven.rate * np.sin(angle_rad),
        ]
    )


def _of_vibration(uneven: _Uneven, angle_rad: Array, mean_speed_rad_s: float) -> Array:
    """(n, 6) what the joint's uneven speed is felt as. A filter's lag shows α's change, and the change of this."""
    rate, *of_acceleration = uneven.fast
    squared = (2 * mean_speed_rad_s + rate) * rate
    return np.column_stack([squared, *of_acceleration, rate * np.cos(angle_rad), rate * np.sin(angle_rad)])


def _changed(coefficients: Array) -> Array:
    """(1 + 2 k,) the derivative of a sum of waves."""
    cos, sin = coefficients[1::2], coefficients[2::2]
    times = np.arange(1, len(cos) + 1)
    return np.concatenate([[0.0], np.stack([times * sin, -times * cos], axis=-1).ravel()])
