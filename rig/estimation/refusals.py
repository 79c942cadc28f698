"""Checks of input, shared by all estimators: each raises a named `rig.errors.Fault`.

`condition_of` computes rank and condition number of a design.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array

MAX_SCALE_RATIO = 4.0  # largest ratio, or its inverse: a wrong unit gives more, a sensor's scale error less
STUCK_RATIO = 0.01  # to the reading of the most sensitive axis, below which an axis is stuck
MIN_ALIGNMENT_COSINE = 0.7  # between an axis and its nominal direction; beyond 45° it is another axis
ANGLE_UNIT_RATIOS = (  # ratios of reading to true value if the unit is wrong
    (180 / np.pi, "the readings look like degrees per second given as rad/s"),
    (np.pi / 180, "the readings look like rad/s declared as °/s, or the rates like degrees per second given as rad/s"),
)
RATE_UNIT_RATIOS = (  # ratios of a table's rates over those of its attitudes
    (180 / np.pi, "they look like degrees per second given as rad/s"),
    (np.pi / 180, "they look like rad/s declared as °/s"),
)
UNIT_RATIOS = (
    *ANGLE_UNIT_RATIOS,
    (1 / 9.80665, "the readings look like g given as m/s²"),
    (9.80665, "the readings look like m/s² declared as g"),
)
MIN_SIDE_COSINE = 0.05  # between the reference and the direction that determines its sign
NO_FIT = "the readings contradict the attitudes so much that no fit converges"
MAX_CONSISTENT_RATIO = 3.0  # least ratio of residuals to their standard deviations that causes a warning


def require_shape(name: str, array: Array, shape: tuple[int, ...]) -> None:
    """Raise ValueError for a wrong shape: a mistake of the caller, not of the measurement."""
    if array.shape != shape:
        raise ValueError(f"{name} must be {shape}, not {array.shape}")


def check_finite(**arrays: Array) -> None:
    """Raise Fault `not_finite` naming the first array and row with a NaN or an infinity."""
    for name, array in arrays.items():
        finite = np.isfinite(array)
        if not finite.all():
            row = int(np.argwhere(~finite)[0][0])
            raise Fault(
                "not_finite",
                f"{name} contains values that are not numbers" + (f", row {row}" if len(array) > 1 else ""),
                "Look at the samples of that observation and record it again",
            )


def check_variances(variances: Array) -> None:
    """Raise Fault `bad_variance` unless every variance is positive."""
    if not (variances > 0).all():
        raise Fault(
            "bad_variance",
            "the variance of a mean reading is not positive",
            "Give the variance of each axis' mean in the squared unit of the reading",
        )


def check_count(observations: int, least: int, parameters: int) -> None:
    """Raise Fault `too_few_observations` for fewer than `least` observations; its message states `parameters`."""
    if observations < least:
        raise Fault(
            "too_few_observations",
            f"{observations} observations are too few for {parameters} parameters; at least {least} are needed",
            "Record more sweeps or attitudes; resume the run if it was interrupted",
        )


def check_speeds(speeds_rad_s: Array) -> None:
    """Raise Fault `bad_speed` unless every sweep's speed is positive."""
    if not (speeds_rad_s > 0).all():
        raise Fault(
            "bad_speed",
            f"a revolution's speed is {float(speeds_rad_s.min()):g} rad/s",
            "Give the speed as positive; a rest is not a revolution",
        )


def check_signal(means: Array) -> None:
    """Raise Fault `zero_reading` for a reading (…, 3) that is exactly zero on all three axes."""
    if not means.any(axis=-1).all():
        raise Fault(
            "zero_reading",
            "the sensor reads exactly zero in an observation",
            "Check that the sensor is connected and awake",
        )


def check_revolutions(means: Array, speeds_rad_s: Array, variances: Array, speed_std_rad_s: Array) -> None:
    """Check averaged revolutions: means, variances (N, 3), speeds and their standard deviations (N,).

    Raise Fault `not_finite`, `bad_variance`, `bad_speed`, `zero_reading`; ValueError for a wrong shape.
    """
    count = len(means)
    require_shape("means", means, (count, 3))
    require_shape("speeds", speeds_rad_s, (count,))
    require_shape("variances", variances, (count, 3))
    require_shape("speed_std", speed_std_rad_s, (count,))
    check_finite(means=means, speeds=speeds_rad_s, variances=variances, speed_std=speed_std_rad_s)
    check_variances(variances)
    check_speeds(speeds_rad_s)
    check_signal(means)


def check_duplicates(means: Array) -> None:
    """Raise Fault `duplicated_observation` if two mean readings of (N, 3) agree to the last bit."""
    if len(set(map(tuple, means.tolist()))) == len(means):  # for a few rows faster than sorting them
        return
    order = np.lexsort(means.T)
    same = (means[order[1:]] == means[order[:-1]]).all(axis=-1)
    first = int(np.argmax(same))
    earlier, again = sorted(order[first : first + 2].tolist())
    raise Fault(
        "duplicated_observation",
        f"observations {earlier} and {again} hold the same readings",
        "Give each recording once; a second sweep in one direction cannot replace the other direction",
    )


def check_reads(matrix: Array) -> None:
    """Raise Fault `stuck_sensor` if one axis, a row of `matrix` (3, 3), is much less sensitive than the others."""
    sizes = [math.hypot(*row) for row in matrix.tolist()]
    least = sizes.index(min(sizes))
    if sizes[least] < STUCK_RATIO * max(sizes):
        raise Fault(
            "stuck_sensor",
            f"the {'xyz'[least]} axis reads the same however the sensor is moved",
            "Check that axis' column, the sensor's supply and its bus wires, then repeat the recording",
        )


def check_unit(scale: Array, confusions: Sequence[tuple[float, str]] = ANGLE_UNIT_RATIOS) -> None:
    """Raise Fault `wrong_unit` if a scale factor (3,) is above 4 or below 1/4.

    `confusions` are pairs: the ratio of reading to true value that a wrong unit causes, and a text that explains it.
    """
    if not is_plausible(scale).all():
        typical = float(np.exp(np.mean(np.log(scale))))
        raise wrong_unit(f"the scale factors come out near {typical:.3g}", 1 / typical, confusions)


def check_reading_ratio(ratio: float, where: str) -> None:
    """Raise Fault `wrong_unit` if the ratio of readings to the turn rate is above 4 or below 1/4."""
    if not is_plausible(ratio).all():
        raise wrong_unit(f"in {where} the gyroscope reads {ratio:.3g} times the turn rate", ratio, ANGLE_UNIT_RATIOS)


def is_plausible(ratio: ArrayLike) -> NDArray[np.bool_]:
    """Return a mask of the plausible ratios of a sensor's reading to the true value: those between 1/4 and 4."""
    ratios = np.asarray(ratio, dtype=np.float64)
    return (ratios < MAX_SCALE_RATIO) & (ratios > 1 / MAX_SCALE_RATIO)


def wrong_unit(what: str, ratio: float, confusions: Sequence[tuple[float, str]]) -> Fault:
    """Return the Fault `wrong_unit` for the `ratio` of reading to true value, with the likely one of `confusions`."""
    likely = (guess for confused, guess in confusions if 0.7 < ratio / confused < 1.4)
    return Fault(
        "wrong_unit",
        f"{what}: {next(likely, 'check range and sensitivity')}",
        "Give readings and what they are compared with in the same SI unit",
    )


def check_axes(axes: Array, nominal: Array | None) -> None:
    """Check the sensor's axes, rows of (3, 3) in the flange frame, against their nominal directions.

    `nominal` (3, 3) holds the expected rows; without it only a left-handed sensor is refused. Raise Fault
    `mirrored_axis`, `swapped_axes`, `wrong_mounting`.
    """
    remedy = (
        "Correct the sensor's mounting in the configuration (in a file by --columns, factor: -1), the order of its "
        "axes, or how it is fixed"
    )
    if nominal is not None:
        cosines = axes @ nominal.T
        where = np.argmax(np.abs(cosines), axis=1)
        if sorted(where) == [0, 1, 2] and np.any(where != np.arange(3)):
            swaps = ", ".join(f"{'xyz'[i]} reads {'xyz'[where[i]]}" for i in range(3) if where[i] != i)
            raise Fault("swapped_axes", f"the sensor's axes are swapped: {swaps}", remedy)
        mirrored = [i for i in range(3) if cosines[i, i] < -MIN_ALIGNMENT_COSINE]
        if mirrored:
            names = ", ".join("xyz"[i] for i in mirrored)
            raise Fault("mirrored_axis", f"the sensor reads {names} with the wrong sign", remedy)
        worst = int(np.argmin(np.diag(cosines)))
        if cosines[worst, worst] < MIN_ALIGNMENT_COSINE:
            angle = float(np.degrees(np.arccos(cosines[worst, worst])))
            raise Fault(
                "wrong_mounting", f"the sensor's {'xyz'[worst]} axis lies {angle:.0f}° off its mounting", remedy
            )
    if _is_left_handed(axes):
        raise Fault("mirrored_axis", _describe_left_handed(axes), remedy)


def _describe_left_handed(axes: Array) -> str:
    """Describe left-handed axes, rows of (3, 3) in the body's frame, by the body axes that they lie along."""
    cosines = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    where = np.argmax(np.abs(cosines), axis=1)
    what = "the sensor's axes form a left-handed frame: "
    if sorted(where) != [0, 1, 2] or np.abs(cosines[np.arange(3), where]).min() < MIN_ALIGNMENT_COSINE:
        return f"{what}one is mirrored or two are swapped"
    mirrored = [f"-{'xyz'[j]}" if cosines[i, j] < 0 else "xyz"[j] for i, j in enumerate(where.tolist())]
    return f"{what}x, y, z read the body's {', '.join(mirrored)}"


def _is_left_handed(matrix: Array) -> bool:
    """Return whether the determinant of a matrix (3, 3) is negative; plain Python is the fastest for nine numbers."""
    (a, b, c), (d, e, f), (g, h, i) = matrix.tolist()
    return bool(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) < 0)


def check_rotations(attitudes: Array) -> None:
    """Raise Fault `bad_attitude` unless every matrix of (N, 3, 3) is a rotation."""
    deviations = np.abs(attitudes @ np.swapaxes(attitudes, -1, -2) - np.eye(3)).max(axis=(1, 2), initial=0.0)
    if deviations.max(initial=0.0) > 1e-6 or (np.linalg.det(attitudes) < 0).any():
        raise Fault(
            "bad_attitude",
            f"attitude {int(np.argmax(deviations)) + 1} is not a rotation (it misses by {deviations.max():.2g})",
            "Give attitudes as rotation matrices from body to table coordinates",
        )


def check_side(reference: Array, side: Array) -> None:
    """Raise Fault `sign_unknown` if `side` (3,) is nearly perpendicular to `reference` (3,).

    The readings determine `reference` except for its sign; the sign is chosen so that it points towards `side`.
    """
    if abs(reference @ side) < MIN_SIDE_COSINE * np.linalg.norm(reference) * np.linalg.norm(side):
        direction = ", ".join(f"{part:.2f}" for part in (reference / np.linalg.norm(reference)).tolist())
        raise Fault(
            "sign_unknown",
            f"by the readings and the attitudes the reference lies along ({direction}), at right angles to the "
            "direction that should show its sign",
            "Give a direction along which the reference points, for example the vertical for gravity; check that the "
            "attitudes' numbers stand in the order w x y z",
        )


def check_handedness(matrix: Array) -> None:
    """Raise Fault `mirrored_axis` if `matrix` (3, 3) belongs to a left-handed sensor."""
    if _is_left_handed(matrix):
        raise Fault(
            "mirrored_axis",
            _describe_left_handed(matrix),
            "Correct the order and signs of the sensor's axes (in a file by --columns, factor: -1), or the side the "
            "reference points to",
        )


def untrustworthy_attitudes(what: str, remedy: str = "") -> Fault:
    """Return the Fault for attitudes that the readings contradict; `remedy` is added to the advice to check them."""
    return Fault(
        "attitude_untrustworthy",
        what,
        "Check the attitudes: their frame, their direction (body to table), headings that were not measured, "
        f"an attitude that was not reached{remedy}",
    )


def report_inverted() -> Fault:
    """Return the Fault for inverted attitudes, that is, attitudes whose inverses agree with the readings."""
    return Fault(
        "inverted_attitudes",
        "the readings contradict the attitudes and agree with their inverses",
        "Give quaternions that take body to table coordinates: conjugate those that take table to body",
    )


def report_scalar_last() -> Fault:
    """Return the Fault for quaternions whose scalar part is the last number in the file but was read as the first."""
    return Fault(
        "inverted_attitudes",
        "the readings contradict the attitudes and agree with quaternions in the order x y z w: qw holds x, qx y, qy z "
        "and qz w",
        "Name the columns in their order: qx, qy, qz, qw",
    )


@contextmanager
def convergence_required() -> Iterator[None]:
    """Run a block that fits attitudes; raise Fault `attitude_untrustworthy` if it fails numerically."""
    try:
        yield
    except np.linalg.LinAlgError:
        raise untrustworthy_attitudes(NO_FIT) from None


@dataclass(frozen=True, slots=True)
class Conditioning:
    """The rank of a design, and its condition number: the largest over the smallest of the needed singular values."""

    rank: int
    condition: float


def condition_of(design: Array, needed: int, noise: float = 0.0) -> Conditioning:
    """Return the conditioning of a design (n, p) with columns in comparable units, which should have the rank `needed`.

    Singular values below rounding errors, or below three times `noise` (the norm of measurement noise in a measured
    design), do not count towards the rank.
    """
    singular = np.linalg.svd(design, compute_uv=False).tolist()
    floor = max(1e-10 * singular[0], 3 * noise)
    last = singular[needed - 1] if len(singular) >= needed else 0.0
    condition = singular[0] / last if last > 0 else float("inf")
    return Conditioning(sum(size > floor for size in singular), condition)


def check_conditioning(conditioned: Conditioning, needed: int, limit: float, what: str, remedy: str) -> None:
    """Raise Fault `rank_deficient` below the `needed` rank, `ill_conditioned` above the condition number `limit`."""
    if conditioned.rank < needed:
        undetermined = f"the observations leave {what} undetermined ({conditioned.rank} of {needed})"
        raise Fault("rank_deficient", undetermined, remedy)
    if not conditioned.condition <= limit:
        raise Fault(
            "ill_conditioned",
            f"the observations hardly determine {what} (condition {conditioned.condition:.3g}; the limit is {limit:g})",
            remedy,
        )


def warn_of_residuals(residuals: Array, variances: Array, dof: int) -> tuple[str, ...]:
    """Return a warning if residuals are much larger than their `variances` explain, else an empty tuple.

    `dof` is the fit's residual degrees of freedom.
    """
    if dof <= 0:
        return ()
    ratio = math.sqrt(float(np.sum(residuals**2 / variances)) / dof)
    if ratio < MAX_CONSISTENT_RATIO:
        return ()
    return (f"residuals are {ratio:.1f} times what the variances explain: the readings contain more than noise",)
