"""The convention of a reference's quaternions, from the readings of a gyroscope on the same body.

A quaternion may transform body to room coordinates, or room to body. Under the right convention the body's rates are a
linear function of the gyroscope's readings, and the specific force has one direction in the room. The position of the
scalar part, first or last, only rotates the frames of body and room, so the gyroscope does not show this position. The
accelerometer does, because with the right position the room's z axis is vertical. The other position leads to the same
calibration, in other axes of the body.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.motion_file import QUATERNION, Columns
from rig.estimation.arrays import Array, integrate_rates, interpolate
from rig.estimation.sensor_axes import nearest_rotation
from rig.observation.external.csv_samples import Samples

COARSE_LAGS_S, FINE_LAGS_S = np.arange(-0.5, 0.501, 0.02), np.arange(-0.02, 0.0201, 0.002)
MIN_PAIRS, MAX_PAIRS = 30, 3000  # of rows
MIN_STEP_S, MAX_PAIR_S = 0.1, 1.0  # between rows, and between the two rows of a pair
MIN_RMS_RATE_RAD_S = 0.05  # a smaller one shows nothing
MIN_EXPLAINED, MAX_UNEXPLAINED_RATIO = 0.7, 0.7  # of the rates' variance; unexplained part, relative to the other fit's
MIN_GRAVITY, MIN_LEAD = 0.7, 0.1  # relative length of the mean specific force; lead over the other direction
MIN_VERTICAL_GRAVITY = 0.97  # component along the vertical axis of the room


@dataclass(frozen=True, slots=True)
class Convention:
    """A convention of quaternions, and how well the readings agree with it.

    - explained: the fraction of the variance of the attitudes' rates that the gyroscope's readings explain.
    - scalar_last: the columns read as qw qx qy qz contain qx qy qz qw.
    - inverse: the quaternions take room to body coordinates; None if the motion does not show it.
    - lag_s: the time by which the readings are later than the attitudes.
    - ratio: the rate that the attitudes show, divided by the gyroscope's reading.
    - gravity: length of the mean vector of specific force in the room, divided by the mean length of the vectors; near
      1 if the force has one direction; 0 without an accelerometer.
    - up: the room's axis that points upwards, as for `--up`; "" if no accelerometer shows it.
    """

    scalar_last: bool
    inverse: bool | None
    lag_s: float
    explained: float
    ratio: float = 1.0
    gravity: float = 0.0
    up: str = ""


def find_convention(samples: Samples, attitudes: Columns, *, is_order_named: bool) -> Convention | None:
    """Return the convention of a reference's `attitudes`, whose times are on the samples' clock.

    `is_order_named`: the file states which number is the scalar part. Return None if the motion does not show the
    convention, or if there is no gyroscope.
    """
    if RATE not in samples.readings:
        return None
    middles_s = (attitudes["start_s"] + attitudes["end_s"]) / 2
    order = np.argsort(middles_s)
    inside = order[(middles_s[order] > samples.time_s[0] + 0.5) & (middles_s[order] < samples.time_s[-1] - 0.5)]
    # Rates between rows that follow each other fast are mostly noise of the attitudes.
    inside = inside[np.unique(np.floor(middles_s[inside] / MIN_STEP_S), return_index=True)[1]][: MAX_PAIRS + 1]
    if len(inside) <= MIN_PAIRS:
        return None
    quaternions = np.column_stack([attitudes[name][inside] for name in QUATERNION])
    conventions = []
    for scalar_last in (False,) if is_order_named else (False, True):
        fits = [
            _fit(samples, middles_s[inside], quaternions, scalar_last=scalar_last, inverse=inverse)
            for inverse in (False, True)
        ]
        conventions.append(_choose_direction(*sorted(fits, key=lambda fit: -fit.explained)))
    best = max(conventions, key=lambda fit: (fit.inverse is not None, "z" in fit.up, fit.explained))
    return best if best.explained >= MIN_EXPLAINED else None


def _choose_direction(best: Convention, other: Convention) -> Convention:
    """Return the better of two fits for opposite directions; its `inverse` is None if readings do not show which.

    Turns about one axis at a time fit both directions. Then only the right direction of the quaternions keeps gravity
    constant in the room.
    """
    if 1 - best.explained <= MAX_UNEXPLAINED_RATIO * (1 - other.explained):
        return best
    by_gravity, against = sorted((best, other), key=lambda fit: -fit.gravity)
    if by_gravity.gravity >= max(MIN_GRAVITY, against.gravity + MIN_LEAD):
        return by_gravity
    return replace(best, inverse=None)


def _fit(samples: Samples, time_s: Array, quaternions: Array, *, scalar_last: bool, inverse: bool) -> Convention:
    """Return a given convention with the lag at which it fits the readings best, and how well it fits.

    `quaternions` (N, 4) are the reference's, at the times `time_s` (N,).
    """
    from scipy.spatial.transform import Rotation

    rotations = Rotation.from_quat(quaternions if scalar_last else np.roll(quaternions, -1, axis=1))
    rotations = rotations.inv() if inverse else rotations
    steps_s = np.diff(time_s)
    close = (steps_s > 0) & (steps_s < MAX_PAIR_S)
    rates = (rotations[:-1].inv() * rotations[1:]).as_rotvec()[close] / steps_s[close, None]
    if len(rates) < MIN_PAIRS or np.sqrt(np.mean(rates**2)) < MIN_RMS_RATE_RAD_S:
        return Convention(scalar_last, inverse, 0.0, 0.0)
    readings = samples.readings[RATE]
    total = integrate_rates(samples.time_s, readings)

    def fit_at(lag_s: float) -> float:
        return _explain(rates, _mean_rates(samples.time_s, total, time_s + lag_s, close))[0]

    coarse_s = max(COARSE_LAGS_S.tolist(), key=fit_at)
    lag_s = max((coarse_s + FINE_LAGS_S).tolist(), key=fit_at)
    turned = _mean_rates(samples.time_s, total, time_s + lag_s, close)
    fraction, matrix = _explain(rates, turned)
    gravity, up = 0.0, ""
    if ACCELERATION in samples.readings:
        forces = interpolate(time_s + lag_s, samples.time_s, samples.readings[ACCELERATION])
        gravity, up = _find_up(rotations.apply(forces @ nearest_rotation(matrix).T))
    ratio = float(np.sqrt(max(fraction, 0.0) * np.var(rates, axis=0).sum() / max(np.var(turned, axis=0).sum(), 1e-30)))
    return Convention(scalar_last, inverse, lag_s, fraction, ratio, gravity, up)


def _mean_rates(time_s: Array, total: Array, edges_s: Array, close: NDArray[np.bool_]) -> Array:
    angles = interpolate(edges_s, time_s, total)
    means: Array = np.diff(angles, axis=0)[close] / np.diff(edges_s)[close, None]
    return means


def _explain(rates: Array, readings: Array) -> tuple[float, Array]:
    """Return the fraction of the variance of `rates` (n, 3) that a linear map of `readings` explains, and this map."""
    design = np.column_stack([readings, np.ones(len(readings))])
    fit = np.linalg.lstsq(design, rates, rcond=None)[0]
    residuals = rates - design @ fit
    return 1 - float(np.mean(residuals**2) / np.mean((rates - rates.mean(axis=0)) ** 2)), np.asarray(
        fit[:3].T, dtype=np.float64
    )


def _find_up(forces: Array) -> tuple[float, str]:
    """Return the length of the mean vector of `forces` (n, 3), divided by the mean length of all vectors.

    Also return the room's axis along the mean vector, with its sign, as in "+z"; "" if the mean vector is too short or
    too oblique to show one.
    """
    mean = forces.mean(axis=0)
    mean /= max(float(np.linalg.norm(forces, axis=1).mean()), 1e-9)
    axis = int(np.argmax(np.abs(mean)))
    up = f"{'+' if mean[axis] > 0 else '-'}{'xyz'[axis]}" if abs(mean[axis]) >= MIN_VERTICAL_GRAVITY else ""
    return float(np.linalg.norm(mean)), up
