"""What an accelerometer on an arm's flange feels: at rest in attitudes, and in sweeps by their first harmonic.

    m = F (s + φ s²) + b,   s = Rᵀ v_ref + ω × (ω × (p + r)) + α × (p + r)

in flange coordinates; F holds the mounting. v_ref is the specific force at rest, in base coordinates; p goes from the
axis that turns to the flange, the arm knows it; r, the lever arm, from the flange to the sensor.

A joint that turns by θ about the flange-fixed axis a, from the attitude R₀, at the constant rate ω, is felt as a mean,
a cosine and a sine over its angle. With u = R₀ᵀ v_ref and c = ω² (a aᵀ − 1) (p + r):

    mean: a (a·u) + c,   cosine: cos ψ (u − a (a·u)) + sin ψ a × u,   sine: sin ψ (u − a (a·u)) − cos ψ a × u

A joint turns unevenly. The weights that make mean, cosine and sine of the readings make those of ω² and of α as the
encoders have them (`Sweeps.turning_rad2_s2`), and c is each of these times (a aᵀ − 1) (p + r) and a × (p + r). What the
lag changes in an uneven turn is that ω² and α are those of τ before, and that gravity turned by (ω − ω₀) τ less.

ψ = ω τ is what the joint turns while the accelerometer lags behind the clock of its time stamps: with opposite signs
for opposite directions. Where a gyroscope's readings have set that clock, τ is the lag behind the gyroscope. What the
filter takes of the size, (ω τ)²/2 at most, is left out: 14 ppm at 60°/s and 5 ms.

Dwells and sweeps are one list of K = N + 3 M vectors: the N dwells, then mean, cosine and sine of each of M sweeps.
θ (22,) holds F row by row, v_ref, b, r, τ and φ.
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
OWN_ERRORS = 3  # of a dwell: a small turn of the flange
SHARED_ERRORS = 10  # of a station: a small turn in the flange's frame, one in the base's, four waves of the angle
TURNS = 6  # of these ten, both turns
OWN_SHARE = 0.2  # of δ², in what is off anew in each dwell; the others are what each wrist always errs by
CROSS = np.swapaxes(np.cross(np.eye(3)[:, None], np.eye(3)), 1, 2)  # [v]× of the axes
SHARE = 0.5**0.5  # of δ, in each: so both turns together are off as far as a dwell is, and so are all waves together


@dataclass(frozen=True, slots=True)
class Dwells:
    """Mean readings (N, 3) in m/s² at rest, the variances (N, 3) of these means, attitudes (N, 3, 3) flange to base."""

    readings_m_s2: Array
    variances_m2_s4: Array
    attitudes: Array


@dataclass(frozen=True, slots=True)
class Sweeps:
    """Whole revolutions at nearly constant speed.

    - `harmonics_m_s2` (M, 3, 3): mean, cosine and sine over the joint's angle (rows) of the axes x y z;
      `covariances_m2_s4` (M, 9, 9) of these nine, row by row. `rig.estimation.reference.sweep_harmonics` makes both.
    - `axes_flange` (M, 3): unit vector of a growing angle; `speeds_rad_s` (M,): negative where the angle falls.
    - `attitudes` (M, 3, 3): flange to base where the angle is counted from.
    - `arms_m` (M, 3): p, from the axis to the flange's origin, in flange coordinates.
    - `stations` (M,): a number for each joint and pose; sweeps of one station, both ways, share the arm's errors.
    - `turning_rad2_s2` (M, 6, 3): mean, cosine and sine of how the joint turned: see
      `rig.estimation.reference.sweep_harmonics.FirstHarmonic`.
    """

    harmonics_m_s2: Array
    covariances_m2_s4: Array
    axes_flange: Array
    speeds_rad_s: Array
    turning_rad2_s2: Array
    attitudes: Array
    arms_m: Array
    stations: NDArray[np.intp]

    def alone(self) -> "Sweeps":
        """The sweeps, each at a station of its own."""
        return replace(self, stations=np.arange(len(self.stations)))


NO_DWELLS = Dwells(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3, 3)))
NO_SWEEPS = Sweeps(
    harmonics_m_s2=np.zeros((0, 3, 3)),
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
    """Dwells and sweeps together.

    `repeatability_rad`: the standard deviation of the small turns by which each sweep is off for itself, about each
    axis, where those of one station share all else: a joint that is come to from the other side stands elsewhere.
    `own`: what the sensor itself adds; None of sensors of which nothing is known.
    `arm_turns` (P, 3 N + 10 M): what P errors of the arm's do to each dwell and sweep, by δ, as `effects` counts their
    turns; None where nothing is known of the arm but that it errs. `own_share` of δ² is off anew in each dwell.
    """

    dwells: Dwells
    sweeps: Sweeps
    repeatability_rad: float = 0.0
    own: AccelerometerErrors | None = None
    arm_turns: Array | None = None
    own_share: float = OWN_SHARE

    def without(self, dwell: int) -> "Movement":
        """The movement with all but one dwell."""
        left = np.arange(len(self.dwells.readings_m_s2)) != dwell
        kept, places = self.dwells, np.arange(OWN_ERRORS * dwell, OWN_ERRORS * (dwell + 1))
        return replace(
            self,
            dwells=Dwells(kept.readings_m_s2[left], kept.variances_m2_s4[left], kept.attitudes[left]),
            own=None if self.own is None else self.own.without(dwell),
            arm_turns=None if self.arm_turns is None else np.delete(self.arm_turns, places, axis=1),
        )

    def readings(self) -> Array:
        """(K, 3) readings in dwells, then the harmonics of sweeps, m/s²."""
        return np.concatenate([self.dwells.readings_m_s2, self.sweeps.harmonics_m_s2.reshape(-1, 3)])

    def noise(self) -> Array:
        """(3 K, 3 K) covariance of the readings' noise."""
        own = self.dwells.variances_m2_s4.size
        whole = np.zeros((own + 9 * len(self.sweeps.speeds_rad_s),) * 2)
        whole[:own, :own] = np.diag(self.dwells.variances_m2_s4.ravel())
        for sweep, covariance in enumerate(self.sweeps.covariances_m2_s4):
            place = slice(own + 9 * sweep, own + 9 * sweep + 9)
            whole[place, place] = covariance
        return whole

    def pieces(self) -> list[slice]:
        """Where the readings of each dwell stand among all 3 K, then those of each sweep."""
        still, swept = len(self.dwells.readings_m_s2), len(self.sweeps.speeds_rad_s)
        first = [3 * dwell for dwell in range(still)] + [3 * still + 9 * sweep for sweep in range(swept + 1)]
        return [slice(*ends) for ends in pairwise(first)]

    def constant(self) -> Array:
        """(K,) 1 where the bias is read, 0 in a cosine and a sine."""
        return np.concatenate(
            [np.ones(len(self.dwells.readings_m_s2)), np.tile([1.0, 0.0, 0.0], len(self.sweeps.speeds_rad_s))]
        )


def predicted(theta: Array, movement: Movement) -> Array:
    """(K, 3) readings of the model."""
    s = felt(theta, movement)
    readings: Array = (s + theta[SECOND] * _product(s, s, movement)) @ matrix(theta).T
    return readings + movement.constant()[:, None] * theta[BIAS]


def felt(theta: Array, movement: Movement) -> Array:
    """s (K, 3), what is felt in dwells and sweeps."""
    gravity, lever = of_gravity(theta[DELAY], movement), of_lever(theta[DELAY], movement)
    s: Array = gravity @ theta[REFERENCE] + lever @ theta[LEVER]
    return s + of_arms(theta[DELAY], movement)


def of_gravity(delay_s: float, movement: Movement) -> Array:
    """(K, 3, 3) what takes v_ref to what is felt of it."""
    sweeps = movement.sweeps
    to_flange = np.swapaxes(sweeps.attitudes, -1, -2)
    along = sweeps.axes_flange[:, :, None] * sweeps.axes_flange[:, None, :]
    across, turned = np.eye(3) - along, cross(sweeps.axes_flange)
    phase = sweeps.speeds_rad_s * delay_s
    cos, sin = np.cos(phase)[:, None, None], np.sin(phase)[:, None, None]
    waves = np.stack([along, cos * across + sin * turned, sin * across - cos * turned], axis=1) @ to_flange[:, None]
    waves = waves + delay_s * _turned_unevenly(waves, sweeps)
    return np.concatenate([np.swapaxes(movement.dwells.attitudes, -1, -2), waves.reshape(-1, 3, 3)])


def _turned_unevenly(waves: Array, sweeps: Sweeps) -> Array:
    """Return (M, 3, …) what a second of lag changes in waves (M, 3, …) of the angle, beside a turn at the mean rate."""
    by_wave = (len(waves), 3, *(1,) * (waves.ndim - 2))
    cosine, sine = (sweeps.turning_rad2_s2[:, row] / sweeps.speeds_rad_s[:, None] for row in (4, 5))
    changed: Array = sine.reshape(by_wave) * waves[:, 1:2] - cosine.reshape(by_wave) * waves[:, 2:]
    return changed


def of_lever(delay_s: float, movement: Movement) -> Array:
    """(K, 3, 3) what takes the lever arm to the acceleration of turning: at constant speed in a sweep's mean alone."""
    sweeps, now, change = movement.sweeps, slice(0, 2), slice(2, 4)
    turning = sweeps.turning_rad2_s2
    phase = (delay_s * sweeps.speeds_rad_s)[:, None, None]
    return _around_axes(turning[:, now] - phase * turning[:, change], movement)


def _around_axes(turning_rad2_s2: Array, movement: Movement) -> Array:
    """(K, 3, 3) what takes a lever arm to its acceleration by ω² and α (M, 2, 3) in sweeps."""
    axes = movement.sweeps.axes_flange
    centripetal, euler = axes[:, :, None] * axes[:, None, :] - np.eye(3), cross(axes)
    squares, accelerations = np.moveaxis(turning_rad2_s2, 1, 0)[..., None, None]
    waves = squares * centripetal[:, None] + accelerations * euler[:, None]
    return np.concatenate([np.zeros((len(movement.dwells.readings_m_s2), 3, 3)), waves.reshape(-1, 3, 3)])


def of_arms(delay_s: float, movement: Movement) -> Array:
    """(K, 3) acceleration by which the flange itself turns, m/s²."""
    acceleration: Array = (of_lever(delay_s, movement) @ _arms(np.zeros(3), movement))[..., 0]
    return acceleration


def _arms(lever_m: Array, movement: Movement) -> Array:
    """(K, 3, 1) from the axis of each sweep to the sensor; zero in dwells."""
    still = np.zeros((len(movement.dwells.readings_m_s2), 3))
    return np.concatenate([still, np.repeat(movement.sweeps.arms_m + lever_m, 3, axis=0)])[..., None]


def _by_delay(theta: Array, movement: Movement) -> Array:
    """Return (K, 3) the derivative of what is felt by the delay."""
    sweeps = movement.sweeps
    evenly = replace(movement, sweeps=replace(sweeps, turning_rad2_s2=np.zeros_like(sweeps.turning_rad2_s2)))
    waves = _waves(of_gravity(theta[DELAY], evenly) @ theta[REFERENCE], movement)
    speeds = sweeps.speeds_rad_s[:, None]
    even = np.stack([np.zeros_like(waves[:, 0]), -speeds * waves[:, 2], speeds * waves[:, 1]], axis=1)
    uneven = _turned_unevenly(waves, sweeps) + theta[DELAY] * _turned_unevenly(even, sweeps)
    later = -speeds[..., None] * sweeps.turning_rad2_s2[:, 2:4]
    changes: Array = (_around_axes(later, movement) @ _arms(theta[LEVER], movement))[..., 0]
    changes[len(movement.dwells.readings_m_s2) :] += (even + uneven).reshape(-1, 3)
    return changes


def jacobian(theta: Array, movement: Movement) -> Array:
    """(3 K, 22) derivative of the readings with respect to θ."""
    s, gravity = felt(theta, movement), of_gravity(theta[DELAY], movement)
    square = _product(s, s, movement)
    columns = np.zeros((*s.shape, PARAMETERS))
    for axis in range(3):
        columns[:, axis, 3 * axis : 3 * axis + 3] = s + theta[SECOND] * square
        columns[:, axis, BIAS.start + axis] = movement.constant()
    columns[..., REFERENCE] = _read(gravity, s, theta, movement)
    columns[..., LEVER] = _read(of_lever(theta[DELAY], movement), s, theta, movement)
    columns[..., DELAY] = _read(_by_delay(theta, movement)[..., None], s, theta, movement)[..., 0]
    columns[..., SECOND] = matrix(theta) * square[:, None, :]
    return columns.reshape(-1, PARAMETERS)


def effects(theta: Array, movement: Movement) -> Array:
    """(3 K, P) change of the readings by each of the arm's errors, per radian; P = 3 N + 10 for each station.

    A dwell has three of its own. All points of a station's sweeps share ten: small turns of the flange and of the base,
    and waves of the joint's angle, A cos θ + B sin θ + C cos 2θ + D sin 2θ, of which the first harmonic is kept. Where
    the wrists' errors are known by kind they follow, shared by all.
    """
    return shared_out(*new_and_always(theta, movement), movement.own_share)


def new_and_always(theta: Array, movement: Movement) -> tuple[Array, Array | None]:
    """The columns of `effects` by what is off anew each time, and by what each wrist always errs by, if it is known."""
    own = turned(theta, movement)
    if movement.arm_turns is None:
        return own, None
    return own, turned(theta, replace(movement, sweeps=movement.sweeps.alone())) @ movement.arm_turns.T


def shared_out(own: Array, always: Array | None, own_share: float) -> Array:
    """(3 K, P) columns of the arm's errors, of δ² as the new ones and those of always share it."""
    if always is None:
        return own
    return np.concatenate([np.sqrt(own_share) * own, np.sqrt(1 - own_share) * always], axis=1)


def turned(theta: Array, movement: Movement) -> Array:
    """How the readings change with small turns of dwells and stations, each for itself."""
    count, sweeps = len(movement.dwells.readings_m_s2), movement.sweeps
    gravity, s = of_gravity(theta[DELAY], movement), felt(theta, movement)
    stations, places = np.unique(sweeps.stations, return_inverse=True)
    changes = np.zeros((len(gravity), 3, OWN_ERRORS * count + SHARED_ERRORS * len(stations)))
    for dwell, own in enumerate(cross(s[:count])):
        changes[dwell, :, OWN_ERRORS * dwell : OWN_ERRORS * (dwell + 1)] = own
    in_base, pulled = gravity[count:] @ cross(theta[REFERENCE]), gravity[count:] @ theta[REFERENCE]
    shared = SHARE * np.concatenate([cross(s[count:]), in_base, _of_angle(pulled, theta, sweeps)], axis=2)
    for row, place in enumerate(np.repeat(places, 3)):
        first = OWN_ERRORS * count + SHARED_ERRORS * place
        changes[count + row, :, first : first + SHARED_ERRORS] = shared[row]
    return _read(changes, s, theta, movement).reshape(3 * len(gravity), -1)


def _of_angle(pulled: Array, theta: Array, sweeps: Sweeps) -> Array:
    """(3 M, 3, 4) change of what is felt by waves w of the angle: gravity `pulled` turns by w, the rate grows by ω w′.

    Gravity by w times the derivative of its first harmonic; centripetal 2 ω² w′ (a aᵀ − 1) (p + r) and Euler
    ω² w″ a × (p + r) have a first harmonic for the waves once a turn. What the delay changes in this is left out.
    """
    axes, arms, squares = sweeps.axes_flange, sweeps.arms_m + theta[LEVER], sweeps.speeds_rad_s[:, None] ** 2
    _, cos, sin = np.moveaxis(pulled.reshape(-1, 3, 3), 1, 0)
    centripetal = squares * (axes * np.sum(axes * arms, axis=1, keepdims=True) - arms)
    euler, nothing = squares * np.cross(axes, arms), np.zeros_like(arms)
    waves = [
        (sin / 2, -euler, -2 * centripetal),
        (-cos / 2, 2 * centripetal, -euler),
        (nothing, sin / 2, cos / 2),
        (nothing, -cos / 2, sin / 2),
    ]
    return np.moveaxis(np.array(waves), (0, 1, 2), (3, 1, 0)).reshape(-1, 3, 4)


def _read(changes: Array, s: Array, theta: Array, movement: Movement) -> Array:
    """What changes (K, 3, P) of s (K, 3) change in the readings."""
    if not theta[SECOND].any():
        return np.asarray(matrix(theta) @ changes, dtype=np.float64)
    grown: Array = changes + 2 * theta[SECOND][:, None] * _product(s[..., None], changes, movement)
    return np.asarray(matrix(theta) @ grown, dtype=np.float64)


def _product(one: Array, other: Array, movement: Movement) -> Array:
    """(K, 3, …) element by element; in a sweep that of two waves, of which the first harmonic is kept."""
    count = len(movement.dwells.readings_m_s2)
    mean, cos, sin = np.moveaxis(_waves(one, movement), 1, 0)
    others = np.moveaxis(_waves(other, movement), 1, 0)
    waves = np.stack(
        [
            mean * others[0] + (cos * others[1] + sin * others[2]) / 2,
            mean * others[1] + cos * others[0],
            mean * others[2] + sin * others[0],
        ],
        axis=1,
    )
    return np.concatenate([one[:count] * other[:count], waves.reshape(-1, *waves.shape[2:])])


def _waves(vectors: Array, movement: Movement) -> Array:
    """(M, 3, …) mean, cosine and sine out of the list of (K, …)."""
    return vectors[len(movement.dwells.readings_m_s2) :].reshape(-1, 3, *vectors.shape[1:])


def cross(vectors: Array) -> Array:
    """(…, 3, 3) matrices [v]×."""
    return np.asarray((vectors @ CROSS.reshape(3, 9)).reshape(*vectors.shape, 3), dtype=np.float64)
