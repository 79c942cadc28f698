"""A gyroscope's increments: how far it has turned between two instants, and what that says of its matrix and its bias.

    m = F ω + b,   Ċ = C [ω]×,   C(t₁)ᵀ C(t₂) = exp(φ₁) exp(φ₂) … exp(φₙ)

C takes body coordinates at t to those of the first reading; ω is the rate against the stars, in body coordinates.
Between readings at ω₀ and ω₁ the rate goes along a cubic whose slopes, per step, are those of five readings,
ω̇ₖ = (8 (ωₖ₊₁ − ωₖ₋₁) − ωₖ₊₂ + ωₖ₋₂)/12, so that the rotation vector of a step h is, to its fourth order (Magnus, Comm.
Pure Appl. Math. 7 (1954) 649),

    φ = h (ω₀ + ω₁)/2 + h (ω̇₀ − ω̇₁)/12 + h² ω₀ × ω₁/12

with the second term for what a straight line would cut off, the third for coning. Slopes are counted per step, not per
second: where time stamps jitter they stay as small as the readings' differences are. A swing with n readings to its
period is taken for (2π/n)⁴/720 less than it is: 5e-6 at n = 25.

A small error of the parameters δθ = (δF row by row, δb) adds δω = −F⁻¹ (δF ω + δb) to the rate and turns the attitude:

    exp(S(t) δθ) C(t),   S(t) = −∫ C F⁻¹ [ω ⊗ 1, 1] dt        in coordinates of the first reading

so one pass gives C and S at all instants that are asked for, and an increment between any two of them is a difference.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

PARAMETERS = 12  # F row by row, b
BLOCK = 1 << 16  # readings taken at once: 20 MB, however long the recording is


@dataclass(frozen=True, slots=True)
class Course:
    """Where a gyroscope says that it was at k instants, rising.

    - `attitudes` (k, 3, 3): C, body coordinates to those of the first reading.
    - `sensitivities` (k, 3, 12): S, how C turns with F (row by row) and b, in coordinates of the first reading.
    - `rates_rad_s` (k, 3) in body coordinates.
    """

    attitudes: Array
    sensitivities: Array
    rates_rad_s: Array


@dataclass(frozen=True, slots=True)
class Track:
    """The course at each of n readings: attitudes (n, 3, 3) and rates (n, 3), and S (3, 12) at the last."""

    attitudes: Array
    rates_rad_s: Array
    sensitivity: Array


@dataclass(frozen=True, slots=True)
class Increments:
    """How the body turned between w pairs of instants.

    - `rotations` (w, 3, 3): body coordinates at the end to those at the start.
    - `jacobian` (w, 3, 12): J, how a rotation turns with F (row by row) and b: exp(J δθ) × rotation, so in body
      coordinates at the start.
    """

    rotations: Array
    jacobian: Array


def course(time_s: Array, readings: Array, matrix: Array, bias: Array, at_s: Array) -> Course:
    """The course by readings (n, 3) in rad/s taken at times (n,), with F (3, 3) and b (3,), at instants (k,).

    Times rise strictly, instants rise and lie within them: ValueError otherwise.
    """
    if len(at_s) and (at_s[0] < time_s[0] or at_s[-1] > time_s[-1] or (np.diff(at_s) < 0).any()):
        raise ValueError("instants must rise, and lie within the readings' times")
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    whole = _stretch(time_s, (readings - bias) @ inverse.T)
    found = [_in_block(whole.part(taken), at_s[asked], inverse) for taken, asked in _blocks(time_s, at_s)]
    attitude, sensitivity = np.eye(3), np.zeros((3, PARAMETERS))
    attitudes, sensitivities, there = [], [], []
    for c, s, w in found:
        attitudes.append(attitude @ c[:-1])
        sensitivities.append(sensitivity + attitude @ s[:-1])
        there.append(w)
        attitude, sensitivity = attitude @ c[-1], sensitivity + attitude @ s[-1]
    return Course(np.concatenate(attitudes), np.concatenate(sensitivities), np.concatenate(there))


def track(time_s: Array, readings: Array, matrix: Array) -> Track:
    """The course at the readings themselves, given less their bias; otherwise as `course`."""
    inverse = np.asarray(np.linalg.inv(matrix), dtype=np.float64)
    whole = _stretch(time_s, readings @ inverse.T)
    steps = _whole_steps(whole)
    attitudes = _running_product(steps.vectors)
    middle = attitudes[:-1] @ steps.middle(inverse)
    by_matrix = np.tensordot(middle, steps.turned, (0, 0)).reshape(3, 9)
    by_bias = np.tensordot(middle, steps.lasting_s, (0, 0))[..., 0]
    return Track(attitudes, whole.rates, np.hstack([by_matrix, by_bias]))


def increments(time_s: Array, readings: Array, matrix: Array, bias: Array, windows_s: Array) -> Increments:
    """How the body turned in windows (w, 2) from start to end, which may overlap; otherwise as `course`."""
    at_s, place = np.unique(windows_s, return_inverse=True)
    found = course(time_s, readings, matrix, bias, at_s)
    start, end = place.reshape(-1, 2).T
    back = np.swapaxes(found.attitudes[start], -1, -2)
    return Increments(back @ found.attitudes[end], back @ (found.sensitivities[end] - found.sensitivities[start]))


def _blocks(time_s: Array, at_s: Array) -> Iterator[tuple[slice, slice]]:
    """Readings and the instants between them; each block begins with the last reading of the one before."""
    first = 0
    for start in range(0, len(time_s) - 1, BLOCK):
        stop = min(start + BLOCK + 1, len(time_s))
        last = len(at_s) if stop == len(time_s) else int(np.searchsorted(at_s, time_s[stop - 1]))
        yield slice(start, stop), slice(first, last)
        first = last


@dataclass(frozen=True, slots=True)
class _Stretch:
    """Times (n,), rates (n, 3) at them, and the slopes (n, 3) of these per step."""

    time_s: Array
    rates: Array
    slopes: Array

    def part(self, taken: slice) -> "_Stretch":
        return _Stretch(self.time_s[taken], self.rates[taken], self.slopes[taken])


def _stretch(time_s: Array, rates: Array) -> _Stretch:
    if len(time_s) < 2 or rates.shape != (len(time_s), 3) or not (np.diff(time_s) > 0).all():
        raise ValueError("a course needs readings (n, 3) at two rising times (n,) at least")
    slopes = np.asarray(np.gradient(rates, axis=0), dtype=np.float64)
    slopes[2:-2] = (8 * (rates[3:-1] - rates[1:-3]) - rates[4:] + rates[:-4]) / 12
    return _Stretch(time_s, rates, slopes)


def _in_block(taken: _Stretch, at_s: Array, inverse: Array) -> tuple[Array, Array, Array]:
    """C and S at the instants of a block and, last, at its end, in body coordinates of its beginning; the rates."""
    before = np.clip(np.searchsorted(taken.time_s, at_s, side="right") - 1, 0, len(taken.time_s) - 2)
    whole = _whole_steps(taken)
    attitudes = _running_product(whole.vectors)
    sensitivities = np.zeros((len(taken.time_s), 3, PARAMETERS))
    np.cumsum(whole.sensitivities(attitudes[:-1], inverse), axis=0, out=sensitivities[1:])
    part, rates = _steps(taken, before, (at_s - taken.time_s[before]) / np.diff(taken.time_s)[before])
    c = attitudes[before] @ _matrices(part.vectors)
    s = sensitivities[before] + part.sensitivities(attitudes[before], inverse)
    return np.concatenate([c, attitudes[-1:]]), np.concatenate([s, sensitivities[-1:]]), rates


@dataclass(frozen=True, slots=True)
class _Steps:
    """Steps from readings on: rotation vectors φ (k, 3), of which `turned` (k, 3) is without coning, times (k, 1)."""

    vectors: Array
    turned: Array
    lasting_s: Array

    def middle(self, inverse: Array) -> Array:
        """How the rates' errors turn the steps, (k, 3, 3) in body coordinates of their start.

        The attitude half-way stands for all of the step: that is the exponential's derivative to φ²/24.
        """
        return np.asarray(-_matrices(self.vectors / 2) @ inverse, dtype=np.float64)

    def sensitivities(self, attitudes: Array, inverse: Array) -> Array:
        """S (k, 3, 12) of each step from `attitudes` (k, 3, 3) on."""
        middle = (attitudes @ self.middle(inverse))[..., None]
        by_matrix = middle * self.turned[:, None, None, :]
        return np.concatenate([by_matrix.reshape(-1, 3, 9), middle[..., 0] * self.lasting_s[..., None]], axis=2)


def _whole_steps(taken: _Stretch) -> _Steps:
    """The steps from each reading to the next."""
    h = np.diff(taken.time_s)[:, None]
    (w0, w1), (d0, d1) = ((each[:-1], each[1:]) for each in (taken.rates, taken.slopes))
    turned = h * ((w0 + w1) / 2 + (d0 - d1) / 12)
    return _Steps(turned + h**2 * np.cross(w0, w1) / 12, turned, h)


def _steps(taken: _Stretch, start: NDArray[np.intp], part: Array) -> tuple[_Steps, Array]:
    """Steps from readings `start` (k,) a `part` (k,) of the way to the next, and the rates (k, 3) then."""
    u = part[:, None]
    h = np.diff(taken.time_s)[start][:, None]
    w0, w1, d0, d1 = (each[place] for each in (taken.rates, taken.slopes) for place in (start, start + 1))
    turned = h * (
        (u - u**3 + u**4 / 2) * w0
        + (u**3 - u**4 / 2) * w1
        + (u**2 / 2 - 2 * u**3 / 3 + u**4 / 4) * d0
        + (u**4 / 4 - u**3 / 3) * d1
    )
    rates = w0 + u**2 * (3 - 2 * u) * (w1 - w0) + u * (1 - u) * ((1 - u) * d0 - u * d1)
    return _Steps(turned + (u * h) ** 2 * np.cross(w0, rates) / 12, turned, u * h), rates


def _matrices(vectors: Array) -> Array:
    from scipy.spatial.transform import Rotation

    if not len(vectors):
        return np.zeros((0, 3, 3))
    return np.asarray(Rotation.from_rotvec(vectors).as_matrix(), dtype=np.float64)


def _running_product(vectors: Array) -> Array:
    """(n + 1, 3, 3): 1, exp(φ₁), exp(φ₁) exp(φ₂), …; in rows of √n, all rows at once."""
    width = int(np.ceil(np.sqrt(len(vectors))))
    padded = np.zeros((width * width, 3))
    padded[: len(vectors)] = vectors
    products = _matrices(padded).reshape(width, width, 3, 3)
    for column in range(1, width):
        products[:, column] = products[:, column - 1] @ products[:, column]
    for row in range(1, width):
        products[row] = products[row - 1, -1] @ products[row]
    return np.concatenate([np.eye(3)[None], products.reshape(-1, 3, 3)[: len(vectors)]])
