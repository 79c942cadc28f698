"""The comparison of the gyroscope's axes with the accelerometer's, by the axes about which flips turn the body."""

from collections.abc import Sequence

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.by_hand.session_parts import HandRecording, nearest_face
from rig.estimation.sensor_axes import nearest_rotation

MAX_FLIP_COSINE = 0.3  # between the verticals before and after a quarter turn
MIN_ALIGNED_COSINE = 0.7  # between nearest axes of gyroscope and accelerometer, unless the frames are rotated
# fewest flips; largest unexplained fraction of their rotation: above it, moves were merged or rests were missed
MIN_FLIPS, MAX_UNEXPLAINED = 5, 0.2
MAX_SKEW_COSINE = 0.3  # between two axes: those of a part are nearer to a right angle
MAX_FRAME_ANGLE_RAD = 1.1  # of gyroscope and accelerometer: no fit converges from a larger one
MAX_SCALE_RATIO = 20.0  # a whole turn that is merged with a flip reads only five times as much; more is another unit
MIN_FIT_RATIO, MAX_FIT_RATIO = 0.58, 2.5  # within these the fit finds the scale, and limits judge it
MAX_RATE_RAD_S = 150.0  # no gyroscope of this kind reads as much: the unit is degrees


def check_axes(session: HandRecording) -> None:
    """Check the gyroscope's unit and, by quarter turns, its axes against the accelerometer's.

    If no single map from the accelerometer's axes to the gyroscope's explains all quarter turns, nothing is raised:
    rests were probably missed, so that several moves look like one. Raise Fault `wrong_unit`, `mirrored_axis`,
    `swapped_axes`, `wrong_mounting`.
    """
    if max((move.peak_rad_s for move in session.moves), default=0.0) > MAX_RATE_RAD_S:
        raise Fault("wrong_unit", "the readings look like degrees per second given as rad/s", "Give them in rad/s")
    if session.acceleration is None:
        return
    usable = [row for row, move in enumerate(session.moves) if move.is_usable]
    measured = [row for row, move in enumerate(session.moves) if not (move.lost or move.clipped)]
    # Moves that were refused because they contradict the others show wrong axes too, if they agree with each other.
    for rows in (usable, measured):
        _check_quarters(*_quarters(session, rows))


def _check_quarters(about: Array, swept: Array) -> None:
    """Raise Fault as `check_axes` does, if quarter turns `about` axes (k, 3) explain what was `swept` (k, 3)."""
    if len(about) < MIN_FLIPS or np.linalg.svd(about)[1][-1] < 0.5:
        return
    matrix = np.linalg.lstsq(about, swept, rcond=None)[0].T  # swept = M about
    sizes = np.linalg.norm(matrix, axis=1)
    if sizes.max() > MAX_SCALE_RATIO or sizes.min() < 1 / MAX_SCALE_RATIO:
        raise Fault(
            "wrong_unit", f"a quarter of a turn reads {sizes.max():.3g} times as much", "Give the readings in rad/s"
        )
    unit = matrix / sizes[:, None]
    strongest = np.argmax(np.abs(unit), axis=1)
    unexplained = np.linalg.norm(swept - about @ matrix.T) / np.linalg.norm(swept)
    skew = np.abs(unit @ unit.T - np.eye(3)).max()
    if unexplained > MAX_UNEXPLAINED or skew > MAX_SKEW_COSINE:
        return
    if sorted(strongest.tolist()) != [0, 1, 2] or (np.abs(unit[np.arange(3), strongest]) < MIN_ALIGNED_COSINE).any():
        _check_turned(unit)
        return
    names = [nearest_face(row) for row in unit]
    if names == ["+x", "+y", "+z"]:
        _check_size(sizes)
        return
    axes_read = f"the gyroscope's x, y, z read the rotation about the accelerometer's {', '.join(names)}"
    remedy = "Correct order and signs of the columns of one of them"
    raise Fault("mirrored_axis" if strongest.tolist() == [0, 1, 2] else "swapped_axes", axes_read, remedy)


def _check_size(sizes: Array) -> None:
    """Raise Fault `wrong_unit` if all axes read so much less or more than the true angle that no fit converges.

    `sizes` (3,) are the readings of a quarter turn, relative to the true ones.
    """
    if not (sizes.max() < MIN_FIT_RATIO or sizes.min() > MAX_FIT_RATIO):
        return
    size = float(np.mean(sizes))
    raise Fault(
        "wrong_unit",
        f"a quarter of a turn reads {size:.3g} times as much on all axes, as with the scale of another range",
        "Convert the counts by the scale of the range that the device's program sets",
    )


def _check_turned(unit: Array) -> None:
    """Raise Fault `wrong_mounting` if the gyroscope's axes, the rows of `unit`, are far from the accelerometer's."""
    angle_rad = float(np.linalg.norm(rotation_vectors(nearest_rotation(unit)[None])[0]))
    if angle_rad > MAX_FRAME_ANGLE_RAD:
        raise Fault(
            "wrong_mounting",
            f"the gyroscope's axes lie {np.degrees(angle_rad):.0f}° off the accelerometer's, which no order of "
            "columns explains",
            "Give both sensors' readings in one frame: turn those of one into the axes of the other",
        )


def _quarters(session: HandRecording, rows: Sequence[int]) -> tuple[Array, Array]:
    """Return the rotation vectors of k quarter turns among the moves `rows`, by accelerometer and by gyroscope."""
    about = []
    swept = []
    for row in rows:
        move, first, second = session.moves[row], session.rests[row], session.rests[row + 1]
        if first.acceleration_m_s2 is None or second.acceleration_m_s2 is None:
            continue
        start, end = (mean / np.linalg.norm(mean) for mean in (first.acceleration_m_s2, second.acceleration_m_s2))
        if abs(start @ end) > MAX_FLIP_COSINE:
            continue
        axis = np.cross(end, start)  # the vertical turns the other way in the body
        inside = (session.time_s >= move.start_s) & (session.time_s <= move.end_s)
        bias = (first.mean_rad_s + second.mean_rad_s) / 2
        about.append(axis / np.linalg.norm(axis) * np.arctan2(np.linalg.norm(axis), start @ end))
        swept.append(np.trapezoid(session.rates[inside] - bias, session.time_s[inside], axis=0))
    return np.array(about).reshape(-1, 3), np.array(swept).reshape(-1, 3)
