"""A gyroscope's increments, that is, its rotations between two instants, and their sensitivity to matrix and bias.

    m = F ω + b,   Ċ = C [ω]×,   C(t₁)ᵀ C(t₂) = exp(φ₁) exp(φ₂) … exp(φₙ)

C maps body coordinates at t to those of the first reading; ω is the inertial rate in body coordinates and m its reading
by a gyroscope with the matrix F and the bias b. Between readings at ω₀ and ω₁ the rate follows a cubic whose slopes,
per step, are those of five readings, ω̇ₖ = (8 (ωₖ₊₁ − ωₖ₋₁) − ωₖ₊₂ + ωₖ₋₂)/12, so that the rotation vector of a step h
is, to fourth order (Magnus, Comm. Pure Appl. Math. 7 (1954) 649),

    φ = h (ω₀ + ω₁)/2 + h (ω̇₀ − ω̇₁)/12 + h² ω₀ × ω₁/12

The second term corrects the trapezoidal rule, the third is coning (Bortz, IEEE Trans. AES 7 (1971) 61). Slopes are per
step, not per second, so they stay as small as the readings' differences if time stamps jitter. The amplitude of an
oscillation with n readings per period is underestimated by (2π/n)⁴/720: 5e-6 at n = 25.

A small error of the parameters δθ = (δF row by row, δb) adds δω = −F⁻¹ (δF ω + δb) to the rate and rotates C:

    exp(S(t) δθ) C(t),   S(t) = −∫ C F⁻¹ [ω ⊗ I, I] dt        in coordinates of the first reading

so one pass gives C and S at all requested instants. The increment from t₁ to t₂ is then the rotation C(t₁)ᵀ C(t₂), with
the sensitivity C(t₁)ᵀ (S(t₂) − S(t₁)) in body coordinates at t₁.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

PARAMETERS = 12  # F row by row, b
BLOCK_READINGS = 1 << 16  # processed at once: 20 MB, whatever the recording's length


@dataclass(frozen=True, slots=True)
class IntegratedAttitudes:
    """A gyroscope's integrated attitudes at k instants, in increasing order.

    - `attitudes` (k, 3, 3): C, from body coordinates to those of the first reading.
    - `sensitivities` (k, 3, 12): S, derivative of C's rotation with respect to the gyroscope's matrix F (row by row)
      and bias b, in coordinates of the first reading.
    - `rates_rad_s` (k, 3) in body coordinates.
    """

    attitudes: Array
    sensitivities: Array
    rates_rad_s: Array


@dataclass(frozen=True, slots=True)
class Track:
    """Integrated attitudes (n, 3, 3), rates (n, 3) at each of n readings, and the `sensitivity` (3, 12) at the last.

    The sensitivity is defined as in `IntegratedAttitudes`.
    """

    attitudes: Array
    rates_rad_s: Array
    sensitivity: Array


@dataclass(frozen=True, slots=True)
class Increments:
    """The body's rotation between w pairs of instants.

    - `rotations` (w, 3, 3): each maps body coordinates at the end to those at the start.
    - `jacobian` (w, 3, 12): J. A change δθ of the gyroscope's matrix (row by row) and bias turns `rotations` R into
      exp(J δθ) R; J is in body coordinates at the start.
    """

    rotations: Array
    jacobian: Array


def integrate_attitudes(time_s: Array, readings: Array, matrix: Array, bias: Array, at_s: Array) -> IntegratedAttitudes:
    """Return the attitudes at the instants `at_s` (k,), integrated from a gyroscope's readings.

    Readings (n, 3) in rad/s at times (n,) are corrected by the gyroscope's `matrix` (3, 3) and `bias` (3,). Raise
    ValueError unless times increase strictly and instants increase within them.
    """
    if len(at_s) and (at_s[0] < time_s[0] or at_s[-1] > time_s[-1] or (np.diff(at_s) < 0).any()):
        raise ValueError("instants must rise, and lie within the readings' times")
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    interval = _find_slopes(time_s, (readings - bias) @ inverse.T)
    blocks = [
        _integrate_block(interval.part(block), at_s[instants], inverse)
        for block, instants in _split_into_blocks(time_s, at_s)
    ]
    attitude, sensitivity = np.eye(3), np.zeros((3, PARAMETERS))
    attitudes = []
    sensitivities = []
    rates = []
    for block_attitudes, block_sensitivities, block_rates in blocks:
        attitudes.append(attitude @ block_attitudes[:-1])
        sensitivities.append(sensitivity + attitude @ block_sensitivities[:-1])
        rates.append(block_rates)
        attitude, sensitivity = attitude @ block_attitudes[-1], sensitivity + attitude @ block_sensitivities[-1]
    return IntegratedAttitudes(np.concatenate(attitudes), np.concatenate(sensitivities), np.concatenate(rates))


def track(time_s: Array, readings: Array, matrix: Array) -> Track:
    """Return the attitudes at the times of the readings (n, 3), which are integrated as if they had no bias."""
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    interval = _find_slopes(time_s, readings @ inverse.T)
    steps = _whole_steps(interval)
    attitudes = _running_product(steps.vectors)
    per_rate_error = attitudes[:-1] @ steps.differentiate(inverse)
    per_matrix = np.tensordot(per_rate_error, steps.integrals_rad, (0, 0)).reshape(3, 9)
    per_bias = np.tensordot(per_rate_error, steps.durations_s, (0, 0))[..., 0]
    return Track(attitudes, interval.rates, np.hstack([per_matrix, per_bias]))


def increments(time_s: Array, readings: Array, matrix: Array, bias: Array, windows_s: Array) -> Increments:
    """Return the rotations over windows (w, 2) [start, end], which may overlap. See also `integrate_attitudes`."""
    at_s, index = np.unique(windows_s, return_inverse=True)
    path = integrate_attitudes(time_s, readings, matrix, bias, at_s)
    start, end = index.reshape(-1, 2).T
    inverse = np.swapaxes(path.attitudes[start], -1, -2)
    return Increments(inverse @ path.attitudes[end], inverse @ (path.sensitivities[end] - path.sensitivities[start]))


def _split_into_blocks(time_s: Array, at_s: Array) -> Iterator[tuple[slice, slice]]:
    """Yield two slices for each block: its readings, and the instants of `at_s` that lie among these readings.

    A block begins with the last reading of the previous block.
    """
    first = 0
    for start in range(0, len(time_s) - 1, BLOCK_READINGS):
        stop = min(start + BLOCK_READINGS + 1, len(time_s))
        last = len(at_s) if stop == len(time_s) else int(np.searchsorted(at_s, time_s[stop - 1]))
        yield slice(start, stop), slice(first, last)
        first = last


@dataclass(frozen=True, slots=True)
class _Interval:
    """The rates (n, 3) at times (n,), and their slopes (n, 3) per step."""

    time_s: Array
    rates: Array
    slopes: Array

    def part(self, block: slice) -> "_Interval":
        return _Interval(self.time_s[block], self.rates[block], self.slopes[block])


def _find_slopes(time_s: Array, rates: Array) -> _Interval:
    if len(time_s) < 2 or rates.shape != (len(time_s), 3) or not (np.diff(time_s) > 0).all():
        raise ValueError("a course needs readings (n, 3) at two or more rising times (n,)")
    slopes = np.asarray(np.gradient(rates, axis=0), dtype=np.float64)
    slopes[2:-2] = (8 * (rates[3:-1] - rates[1:-3]) - rates[4:] + rates[:-4]) / 12
    return _Interval(time_s, rates, slopes)


def _integrate_block(interval: _Interval, at_s: Array, inverse: Array) -> tuple[Array, Array, Array]:
    """Return attitudes (k + 1, 3, 3), sensitivities (k + 1, 3, 12) and rates (k, 3) of a block.

    They are C, S and ω of `IntegratedAttitudes`, integrated from the start of the block to each time in `at_s` (k,) and
    to the end of the block; the rates are those at `at_s`.
    """
    before = np.clip(np.searchsorted(interval.time_s, at_s, side="right") - 1, 0, len(interval.time_s) - 2)
    whole = _whole_steps(interval)
    attitudes = _running_product(whole.vectors)
    sensitivities = np.zeros((len(interval.time_s), 3, PARAMETERS))
    np.cumsum(whole.sensitivities(attitudes[:-1], inverse), axis=0, out=sensitivities[1:])
    part, rates = _steps_from(interval, before, (at_s - interval.time_s[before]) / np.diff(interval.time_s)[before])
    c = attitudes[before] @ _matrices(part.vectors)
    s = sensitivities[before] + part.sensitivities(attitudes[before], inverse)
    return np.concatenate([c, attitudes[-1:]]), np.concatenate([s, sensitivities[-1:]]), rates


@dataclass(frozen=True, slots=True)
class _IncrementSteps:
    """Steps that each begin at a reading: rotation vectors (k, 3), integrals (k, 3) of the rate, durations (k, 1)."""

    vectors: Array
    integrals_rad: Array
    durations_s: Array

    def differentiate(self, inverse: Array) -> Array:
        """Return the derivatives (k, 3, 3) of the steps' rotations with respect to the readings' integrated error.

        The rotation is in body coordinates at the start. The attitude half-way through a step is used for the whole
        step, which causes a relative error of about φ²/24 for a step by the angle φ.
        """
        return np.asarray(-_matrices(self.vectors / 2) @ inverse, dtype=np.float64)

    def sensitivities(self, attitudes: Array, inverse: Array) -> Array:
        """Return the increase (k, 3, 12) of S in each step; S is that of `IntegratedAttitudes`.

        The steps start at `attitudes` (k, 3, 3); `inverse` (3, 3) is F⁻¹.
        """
        per_rate_error = (attitudes @ self.differentiate(inverse))[..., None]
        per_matrix = (per_rate_error * self.integrals_rad[:, None, None, :]).reshape(-1, 3, 9)
        return np.concatenate([per_matrix, per_rate_error[..., 0] * self.durations_s[..., None]], axis=2)


def _whole_steps(interval: _Interval) -> _IncrementSteps:
    """Return the steps from each reading to the next."""
    h = np.diff(interval.time_s)[:, None]
    (w0, w1), (d0, d1) = ((values[:-1], values[1:]) for values in (interval.rates, interval.slopes))
    integrals = h * ((w0 + w1) / 2 + (d0 - d1) / 12)
    return _IncrementSteps(integrals + h**2 * np.cross(w0, w1) / 12, integrals, h)


def _steps_from(interval: _Interval, start: NDArray[np.intp], fraction: Array) -> tuple[_IncrementSteps, Array]:
    """Return steps over a `fraction` (k,) of an interval from the readings `start` (k,), and their end rates (k, 3)."""
    u = fraction[:, None]
    h = np.diff(interval.time_s)[start][:, None]
    w0, w1, d0, d1 = (values[index] for values in (interval.rates, interval.slopes) for index in (start, start + 1))
    # The rate is a cubic Hermite polynomial between readings; the cross product adds coning to its integral.
    integrals = h * (
        (u - u**3 + u**4 / 2) * w0
        + (u**3 - u**4 / 2) * w1
        + (u**2 / 2 - 2 * u**3 / 3 + u**4 / 4) * d0
        + (u**4 / 4 - u**3 / 3) * d1
    )
    rates = w0 + u**2 * (3 - 2 * u) * (w1 - w0) + u * (1 - u) * ((1 - u) * d0 - u * d1)
    return _IncrementSteps(integrals + (u * h) ** 2 * np.cross(w0, rates) / 12, integrals, u * h), rates


def _matrices(vectors: Array) -> Array:
    from scipy.spatial.transform import Rotation

    if not len(vectors):
        return np.zeros((0, 3, 3))
    return np.asarray(Rotation.from_rotvec(vectors).as_matrix(), dtype=np.float64)


def _running_product(vectors: Array) -> Array:
    """Return the attitudes (n + 1, 3, 3) after 0, 1, … n rotations by `vectors`, computed √n rows at a time."""
    width = int(np.ceil(np.sqrt(len(vectors))))
    padded = np.zeros((width * width, 3))
    padded[: len(vectors)] = vectors
    products = _matrices(padded).reshape(width, width, 3, 3)
    for column in range(1, width):
        products[:, column] = products[:, column - 1] @ products[:, column]
    for row in range(1, width):
        products[row] = products[row - 1, -1] @ products[row]
    return np.concatenate([np.eye(3)[None], products.reshape(-1, 3, 3)[: len(vectors)]])
