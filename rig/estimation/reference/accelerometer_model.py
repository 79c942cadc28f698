"""The readings of an accelerometer on an arm's flange: in attitudes at rest, and the first harmonic of sweeps.

    m = F (s + φ s²) + b,   s = Rᵀ v_ref + ω × (ω × (p + r)) + α × (p + r)

in flange coordinates; F includes the mounting, φ is the nonlinearity, b the bias, ω the angular rate, α the angular
acceleration. v_ref is the specific force at rest, in base coordinates, and R the rotation from flange to base. The
lever arm p, from the rotation axis to the flange, is given by the arm; r leads from the flange to the sensor.

If a joint turns by θ about the flange-fixed axis a, from the attitude R₀, at the constant rate ω, the specific force
has a mean, a cosine and a sine over its angle. With u = R₀ᵀ v_ref and c = ω² (a aᵀ − I) (p + r):

    mean: a (a·u) + c,   cosine: cos ψ (u − a (a·u)) + sin ψ a × u,   sine: sin ψ (u − a (a·u)) − cos ψ a × u

A joint turns unevenly. The weights that form mean, cosine and sine of the readings are also applied to ω² and α of the
encoders (`Sweeps.turning_rad2_s2`). Each of the three then contains c = ω² (a aᵀ − I) (p + r) + α a × (p + r), with
these weighted ω² and α. In uneven rotation, ω² and α are those of the time τ earlier, and gravity is rotated by a
further (ω − ω₀) τ, with the mean rate ω₀.

ψ = ω τ is the joint's rotation during the lag τ of the accelerometer behind the clock of its time stamps; its sign is
that of ω. If a gyroscope's readings have set that clock, τ is the lag behind the gyroscope. The filter's attenuation is
neglected; it is at most (ω τ)²/2, which is 14 ppm at 60°/s and 5 ms.

Dwells and sweeps form one list of K = N + 3 M vectors: the N dwells, then mean, cosine and sine of each of M sweeps. θ
(22,) contains F row by row, v_ref, b, r, τ and φ.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_errors import AccelerometerErrors
from rig.estimation.reference.reference_model import BIAS, REFERENCE, matrix

LEVER, DELAY, SECOND = slice(15, 18), 18, slice(19, 22)
PARAMETERS = 22
OWN_ERRORS = 3  # errors of a dwell: a small rotation of the flange
SHARED_ERRORS = 10  # of a station: a small rotation in the flange's frame, one in the base's, four waves of the angle
ROTATIONS = 6  # the first six of these ten: both rotations
INDEPENDENT_FRACTION = 0.2  # of δ², for errors independent in each dwell; the rest is for constant errors of the wrists
CROSS = np.swapaxes(np.cross(np.eye(3)[:, None], np.eye(3)), 1, 2)  # [v]× of the axes
SIZE_RATIO = 0.5**0.5  # of both rotations together, and of all waves, to δ: each equals a dwell's error


@dataclass(frozen=True, slots=True)
class Dwells:
    """Mean readings (N, 3) in m/s² at rest, the variances (N, 3) of these means, attitudes (N, 3, 3) flange to base."""

    readings_m_s2: Array
    variances_m2_s4: Array
    attitudes: Array


@dataclass(frozen=True, slots=True)
class Sweeps:
    """Whole revolutions at nearly constant speed.

    - harmonics_m_s2 (M, 3, 3): mean, cosine and sine over the joint's angle (rows) of the axes x y z.
    - swayed_m_s2 (M, 3, 3): mean, cosine and sine of the specific force that the sway of other joints causes; their
      encoders measure it.
    - covariances_m2_s4 (M, 9, 9): the harmonics' covariances, row by row (`rig.estimation.reference.sweep_harmonics`).
    - axes_flange (M, 3): unit vector about which the joint's angle grows; speeds_rad_s (M,): negative if it falls.
    - attitudes (M, 3, 3): flange to base at the angle zero.
    - arms_m (M, 3): the vector p from the axis to the flange's origin, in flange coordinates.
    - stations (M,): index of each sweep's station, a joint and a pose; sweeps of a station, in both directions, share
      errors.
    - turning_rad2_s2 (M, 6, 3): mean, cosine and sine of six terms of the joint's motion, which `FirstHarmonic` lists.
    """

    harmonics_m_s2: Array
    swayed_m_s2: Array
    covariances_m2_s4: Array
    axes_flange: Array
    speeds_rad_s: Array
    turning_rad2_s2: Array
    attitudes: Array
    arms_m: Array
    stations: NDArray[np.intp]

    def alone(self) -> "Sweeps":
        """Return the sweeps, each with a separate station."""
        return replace(self, stations=np.arange(len(self.stations)))


NO_DWELLS = Dwells(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3)))
NO_SWEEPS = Sweeps(
    harmonics_m_s2=np.zeros((0, 3, 3)),
    swayed_m_s2=np.zeros((0, 3, 3)),
    covariances_m2_s4=np.zeros((0, 9, 9)),
    axes_flange=np.zeros((0, 3)),
    speeds_rad_s=np.zeros(0),
    turning_rad2_s2=np.zeros((0, 6, 3)),
    attitudes=np.zeros((0, 3, 3)),
    arms_m=np.zeros((0, 3)),
    stations=np.zeros(0, dtype=np.intp),
)


@dataclass(frozen=True, slots=True)
class Movement:
    """Dwells and sweeps together; δ is the standard deviation of the arm's attitude errors.

    - `repeatability_rad`: std of each sweep's independent rotations; the sweeps of one station share all other errors.
    - `sensor_errors`: errors of the sensor itself; None if unknown.
    - `arm_turns` (P, 3 N + 10 M): the errors of N dwells (3 each) and M sweeps (10 each), ordered as the columns of
      `effects`, due to P constant errors of the arm, for δ = 1 rad; None if unknown.
    - `independent_fraction`: the fraction of δ² that is independent in each dwell.
    """

    dwells: Dwells
    sweeps: Sweeps
    repeatability_rad: float = 0.0
    sensor_errors: AccelerometerErrors | None = None
    arm_turns: Array | None = None
    independent_fraction: float = INDEPENDENT_FRACTION

    def omit(self, dwell: int) -> "Movement":
        """Return the movement without the dwell of index `dwell`."""
        remaining = np.arange(len(self.dwells.readings_m_s2)) != dwell
        dwells, columns = self.dwells, np.arange(OWN_ERRORS * dwell, OWN_ERRORS * (dwell + 1))
        return replace(
            self,
            dwells=Dwells(
                dwells.readings_m_s2[remaining], dwells.variances_m2_s4[remaining], dwells.attitudes[remaining]
            ),
            sensor_errors=None if self.sensor_errors is None else self.sensor_errors.omit(dwell),
            arm_turns=None if self.arm_turns is None else np.delete(self.arm_turns, columns, axis=1),
        )

    def readings(self) -> Array:
        """Return the readings (K, 3) in dwells, then the harmonics of sweeps, m/s²."""
        return np.concatenate([self.dwells.readings_m_s2, self.sweeps.harmonics_m_s2.reshape(-1, 3)])

    def noise(self) -> Array:
        """Return the covariance (3 K, 3 K) of the readings' noise."""
        still = self.dwells.variances_m2_s4.size
        noise = np.zeros((still + 9 * len(self.sweeps.speeds_rad_s),) * 2)
        noise[:still, :still] = np.diag(self.dwells.variances_m2_s4.ravel())
        for sweep, of_sweep in enumerate(self.sweeps.covariances_m2_s4):
            block = slice(still + 9 * sweep, still + 9 * sweep + 9)
            noise[block, block] = of_sweep
        return noise

    def segments(self) -> list[slice]:
        """Return the slice of each dwell, then of each sweep, among all 3 K readings."""
        still, turning = len(self.dwells.readings_m_s2), len(self.sweeps.speeds_rad_s)
        first = [3 * dwell for dwell in range(still)] + [3 * still + 9 * sweep for sweep in range(turning + 1)]
        return [slice(*ends) for ends in pairwise(first)]

    def constant(self) -> Array:
        """Return the factors (K,) of the bias: 1 in dwells and means of sweeps, 0 in cosines and sines of sweeps."""
        return np.concatenate(
            [np.ones(len(self.dwells.readings_m_s2)), np.tile([1.0, 0.0, 0.0], len(self.sweeps.speeds_rad_s))]
        )


def predicted(theta: Array, movement: Movement) -> Array:
    """Return the readings (K, 3) that the model predicts for the parameters `theta`."""
    s = find_force(theta, movement)
    readings: Array = (s + theta[SECOND] * _product(s, s, movement)) @ matrix(theta).T
    return readings + movement.constant()[:, None] * theta[BIAS]


def find_force(theta: Array, movement: Movement) -> Array:
    """Return the specific force s (K, 3), m/s², in dwells and sweeps."""
    gravity, lever = project_reference(theta[DELAY], movement), project_lever_arm(theta[DELAY], movement)
    s: Array = gravity @ theta[REFERENCE] + lever @ theta[LEVER]
    return s + find_flange_force(theta[DELAY], movement)


def project_reference(delay_s: float, movement: Movement) -> Array:
    """Return the matrices (K, 3, 3) that map the reference v_ref (3,) to the specific force that it causes."""
    sweeps = movement.sweeps
    to_flange = np.swapaxes(sweeps.attitudes, -1, -2)
    parallel = sweeps.axes_flange[:, :, None] * sweeps.axes_flange[:, None, :]
    across, rotated = np.eye(3) - parallel, cross(sweeps.axes_flange)
    phase = sweeps.speeds_rad_s * delay_s
    cos, sin = np.cos(phase)[:, None, None], np.sin(phase)[:, None, None]
    waves = (
        np.stack([parallel, cos * across + sin * rotated, sin * across - cos * rotated], axis=1) @ to_flange[:, None]
    )
    waves = waves + delay_s * _differentiate_lag(waves, sweeps)
    return np.concatenate([np.swapaxes(movement.dwells.attitudes, -1, -2), waves.reshape(-1, 3, 3)])


def _differentiate_lag(waves: Array, sweeps: Sweeps) -> Array:
    """Return the change of harmonics `waves` (M, 3, …) per second of the filter's lag, due to uneven rotation alone."""
    by_wave = (len(waves), 3, *(1,) * (waves.ndim - 2))
    cosine, sine = (sweeps.turning_rad2_s2[:, row] / sweeps.speeds_rad_s[:, None] for row in (4, 5))
    changed: Array = sine.reshape(by_wave) * waves[:, 1:2] - cosine.reshape(by_wave) * waves[:, 2:]
    return changed


def project_lever_arm(delay_s: float, movement: Movement) -> Array:
    """Return the matrices (K, 3, 3) that map a lever arm to the acceleration at its end, in dwells and sweeps.

    The matrices are zero in dwells; if the joint turns evenly, also in the cosines and sines of sweeps.
    """
    sweeps, now, change = movement.sweeps, slice(0, 2), slice(2, 4)
    turning = sweeps.turning_rad2_s2
    phase = (delay_s * sweeps.speeds_rad_s)[:, None, None]
    return _around_axes(turning[:, now] - phase * turning[:, change], movement)


def _around_axes(turning_rad2_s2: Array, movement: Movement) -> Array:
    """Return the matrices (K, 3, 3) that map a lever arm to the acceleration at its end.

    `turning_rad2_s2` (M, 2, 3) contains, for each sweep, the square ω² of the angular rate and the angular acceleration
    α, each as mean, cosine and sine over the joint's angle.
    """
    axes = movement.sweeps.axes_flange
    centripetal, euler = axes[:, :, None] * axes[:, None, :] - np.eye(3), cross(axes)
    squares, accelerations = np.moveaxis(turning_rad2_s2, 1, 0)[..., None, None]
    waves = squares * centripetal[:, None] + accelerations * euler[:, None]
    return np.concatenate([np.zeros((len(movement.dwells.readings_m_s2), 3, 3)), waves.reshape(-1, 3, 3)])


def find_flange_force(delay_s: float, movement: Movement) -> Array:
    """Return the specific force (K, 3), m/s², at the flange due to its lever arm and to the sway of other joints."""
    force: Array = (project_lever_arm(delay_s, movement) @ _arms(np.zeros(3), movement))[..., 0]
    force[len(movement.dwells.readings_m_s2) :] += movement.sweeps.swayed_m_s2.reshape(-1, 3)
    return force


def _arms(lever_m: Array, movement: Movement) -> Array:
    """Return the lever arms (K, 3, 1) from the axis of each sweep to the sensor; zero in dwells."""
    still = np.zeros((len(movement.dwells.readings_m_s2), 3))
    return np.concatenate([still, np.repeat(movement.sweeps.arms_m + lever_m, 3, axis=0)])[..., None]


def _differentiate_delay(theta: Array, movement: Movement) -> Array:
    """Return the derivative (K, 3) of the specific force with respect to the delay.

    A delay turns cosine and sine of gravity in a sweep, by the speed times the delay (`even`). Where the sweep turns
    unevenly, it also changes the lag between turning and readings (`uneven`), and the centripetal force (`later`).
    """
    sweeps = movement.sweeps
    evenly = replace(movement, sweeps=replace(sweeps, turning_rad2_s2=np.zeros_like(sweeps.turning_rad2_s2)))
    waves = _harmonics_of_sweeps(project_reference(theta[DELAY], evenly) @ theta[REFERENCE], movement)
    speeds = sweeps.speeds_rad_s[:, None]
    even = np.stack([np.zeros_like(waves[:, 0]), -speeds * waves[:, 2], speeds * waves[:, 1]], axis=1)
    uneven = _differentiate_lag(waves, sweeps) + theta[DELAY] * _differentiate_lag(even, sweeps)
    later = -speeds[..., None] * sweeps.turning_rad2_s2[:, 2:4]
    changes: Array = (_around_axes(later, movement) @ _arms(theta[LEVER], movement))[..., 0]
    changes[len(movement.dwells.readings_m_s2) :] += (even + uneven).reshape(-1, 3)
    return changes


def jacobian(theta: Array, movement: Movement) -> Array:
    """Return the derivative (3 K, 22) of the readings with respect to the parameters `theta`."""
    s, gravity = find_force(theta, movement), project_reference(theta[DELAY], movement)
    square = _product(s, s, movement)
    columns = np.zeros((*s.shape, PARAMETERS))
    for axis in range(3):
        columns[:, axis, 3 * axis : 3 * axis + 3] = s + theta[SECOND] * square
        columns[:, axis, BIAS.start + axis] = movement.constant()
    columns[..., REFERENCE] = _read(gravity, s, theta, movement)
    columns[..., LEVER] = _read(project_lever_arm(theta[DELAY], movement), s, theta, movement)
    columns[..., DELAY] = _read(_differentiate_delay(theta, movement)[..., None], s, theta, movement)[..., 0]
    columns[..., SECOND] = matrix(theta) * square[:, None, :]
    return columns.reshape(-1, PARAMETERS)


def effects(theta: Array, movement: Movement) -> Array:
    """Return the effect (3 K, P) of each of the arm's errors on the readings, per radian.

    Each dwell has three errors. All sweeps of a joint in one pose (a station) share ten: small rotations of flange and
    base, and the joint's angle error A cos θ + B sin θ + C cos 2θ + D sin 2θ. The wrists' constant errors
    (`Movement.arm_turns`), if known, come last and are common to all stations.
    """
    return combine_effects(*split_effects(theta, movement), movement.independent_fraction)


def split_effects(theta: Array, movement: Movement) -> tuple[Array, Array | None]:
    """Return the columns of `effects` in two parts: independent errors, and constant errors of the wrists or None."""
    independent = arm_effects(theta, movement)
    if movement.arm_turns is None:
        return independent, None
    return independent, arm_effects(theta, replace(movement, sweeps=movement.sweeps.alone())) @ movement.arm_turns.T


def combine_effects(independent: Array, constant: Array | None, fraction: float) -> Array:
    """Return the effects (3 K, P) of the arm's errors: first of the `independent` ones, then of the `constant` ones.

    The independent errors have a `fraction` of the variance, the constant errors the remainder. Without constant errors
    (None), the independent errors have the whole variance.
    """
    if constant is None:
        return independent
    return np.concatenate([np.sqrt(fraction) * independent, np.sqrt(1 - fraction) * constant], axis=1)


def arm_effects(theta: Array, movement: Movement) -> Array:
    """Return the effect (3 K, P) of the arm's errors on the readings; `effects` names the columns."""
    count, sweeps = len(movement.dwells.readings_m_s2), movement.sweeps
    gravity, s = project_reference(theta[DELAY], movement), find_force(theta, movement)
    stations, indices = np.unique(sweeps.stations, return_inverse=True)
    changes = np.zeros((len(gravity), 3, OWN_ERRORS * count + SHARED_ERRORS * len(stations)))
    for dwell, columns in enumerate(cross(s[:count])):
        changes[dwell, :, OWN_ERRORS * dwell : OWN_ERRORS * (dwell + 1)] = columns
    in_base, apparent = gravity[count:] @ cross(theta[REFERENCE]), gravity[count:] @ theta[REFERENCE]
    shared = SIZE_RATIO * np.concatenate(
        [cross(s[count:]), in_base, _differentiate_angle(apparent, theta, sweeps)], axis=2
    )
    for row, index in enumerate(np.repeat(indices, 3)):
        first = OWN_ERRORS * count + SHARED_ERRORS * index
        changes[count + row, :, first : first + SHARED_ERRORS] = shared[row]
    return _read(changes, s, theta, movement).reshape(3 * len(gravity), -1)


def _differentiate_angle(apparent: Array, theta: Array, sweeps: Sweeps) -> Array:
    """Return the harmonics (3 M, 3, 4) of the specific force due to angle errors w: cos θ, sin θ, cos 2θ, sin 2θ.

    Let a be the joint's axis, ω its rate, and p + r the lever arm from the axis to the sensor. Gravity (`apparent`)
    changes by w times the derivative of its first harmonic. The rate grows by ω w′, so the first two errors also add
    first harmonics of the centripetal acceleration, 2 ω² w′ (a aᵀ − I) (p + r), and of the Euler acceleration,
    ω² w″ a × (p + r). The effect of the delay on these is neglected.
    """
    axes, arms, squares = sweeps.axes_flange, sweeps.arms_m + theta[LEVER], sweeps.speeds_rad_s[:, None] ** 2
    _, cos, sin = np.moveaxis(apparent.reshape(-1, 3, 3), 1, 0)
    centripetal = squares * (axes * np.sum(axes * arms, axis=1, keepdims=True) - arms)
    euler, zeros = squares * np.cross(axes, arms), np.zeros_like(arms)
    harmonics = [  # mean, cosine and sine, for each of the four errors
        (sin / 2, -euler, -2 * centripetal),
        (-cos / 2, 2 * centripetal, -euler),
        (zeros, sin / 2, cos / 2),
        (zeros, -cos / 2, sin / 2),
    ]
    return np.moveaxis(np.array(harmonics), (0, 1, 2), (3, 1, 0)).reshape(-1, 3, 4)


def _read(changes: Array, s: Array, theta: Array, movement: Movement) -> Array:
    """Return the changes (K, 3, P) of the readings due to small changes (K, 3, P) of the specific force s (K, 3)."""
    if not theta[SECOND].any():
        return np.asarray(matrix(theta) @ changes, dtype=np.float64)
    nonlinear: Array = changes + 2 * theta[SECOND][:, None] * _product(s[..., None], changes, movement)
    return np.asarray(matrix(theta) @ nonlinear, dtype=np.float64)


def _product(one: Array, other: Array, movement: Movement) -> Array:
    """Return the elementwise product (K, 3, …); in sweeps the Fourier series' product, without its second harmonic."""
    count = len(movement.dwells.readings_m_s2)
    mean, cos, sin = np.moveaxis(_harmonics_of_sweeps(one, movement), 1, 0)
    others = np.moveaxis(_harmonics_of_sweeps(other, movement), 1, 0)
    waves = np.stack(
        [
            mean * others[0] + (cos * others[1] + sin * others[2]) / 2,
            mean * others[1] + cos * others[0],
            mean * others[2] + sin * others[0],
        ],
        axis=1,
    )
    return np.concatenate([one[:count] * other[:count], waves.reshape(-1, *waves.shape[2:])])


def _harmonics_of_sweeps(vectors: Array, movement: Movement) -> Array:
    """Return the mean, cosine and sine (M, 3, …) of the sweeps from the rows (K, …) of dwells and sweeps."""
    return vectors[len(movement.dwells.readings_m_s2) :].reshape(-1, 3, *vectors.shape[1:])


def cross(vectors: Array) -> Array:
    """Return the matrices [v]× (…, 3, 3) of vectors (…, 3)."""
    return np.asarray((vectors @ CROSS.reshape(3, 9)).reshape(*vectors.shape, 3), dtype=np.float64)
