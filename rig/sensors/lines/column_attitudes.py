"""Attitudes in an unknown log: quaternions are read; rotation matrices and angles are only reported."""

import re
from collections.abc import Sequence

import numpy as np

from rig.config.units import UNITS
from rig.data.recording.motion_file import QUATERNION
from rig.estimation.arrays import Array
from rig.observation.formats.table_layout import TableLayout

LENGTH_TOLERANCE = 2e-3  # of the length of a quaternion, and of a matrix's row
QUATERNION_NAME = re.compile(r"(?:.*_)?(?:q|quat|quaternion|orientation|rot|rotation|attitude)_?([wxyz0-3])")
QUATERNION_DIGITS = {"0": "qw", "1": "qx", "2": "qy", "3": "qz"}
ANGLE_WORDS = {"yaw", "pitch", "roll", "heading", "azimuth", "phi", "theta", "psi", "euler"}
# Mat[1][2], DCM_12, rot_11, R11, M23
MATRIX_NAME = re.compile(r"(?:.*_)?(?:mat|matrix|dcm\w*)(?:_.*)?|(?:.*_)?(?:r|m|c|rot)_?[0-3]_?[0-3]")
OTHER_WORD = re.compile(r"gyr|acc|mag|temp|baro|press|lat(?!e)|lon|alt|vel|speed|pos(?!e)|free|grav")


def describe_unread_attitudes(layout: TableLayout, matrices: Sequence[int], angles: Sequence[int]) -> list[str]:
    """Return sentences on how to convert the log's rotation matrices or, if it has none, its angles, to quaternions.

    `matrices` and `angles` are the columns that contain them. The list is empty if there are neither.
    """
    if matrices:
        first, last = layout.name(matrices[0]), layout.name(matrices[8])
        return [
            "attitudes are rotation matrices: attitudes are read as quaternions, qw qx qy qz; convert them, M (n, 9) "
            f"being the columns {first} to {last}: "
            "scipy.spatial.transform.Rotation.from_matrix(M.reshape(-1, 3, 3)).as_quat(scalar_first=True)"
        ]
    if angles:
        names = " ".join(layout.headings[index] for index in angles)
        return [f"the order of the turns in {names}: attitudes are read as quaternions, qw qx qy qz; convert them"]
    return []


def list_angles(layout: TableLayout) -> list[int]:
    """Return the columns whose headings name attitude angles and state no unit of a rate."""
    return [
        index
        for index in layout.numbers
        if ANGLE_WORDS.intersection(re.split(r"[\W_\d]+", layout.headings[index].lower()))
        and "rate" not in layout.headings[index].lower()
        and (layout.units[index] not in UNITS or UNITS[layout.units[index]].quantity != UNITS["rad/s"].quantity)
    ]


def find_matrices(layout: TableLayout, values: Array) -> list[int]:
    """Return the columns of rotation matrices. Nine adjacent columns are a matrix, row by row or column by column."""
    numbers, matrices = set(layout.numbers), list[int]()
    for start in layout.numbers:
        indices = [*range(start, start + 9)]
        if start not in matrices and numbers.issuperset(indices) and _are_rotations(values[:, indices]):
            matrices += indices
    return matrices


def _are_rotations(values: Array) -> bool:
    """Return whether most rows of `values` (n, 9) are orthonormal matrices (3, 3), written row by row."""
    whole = values[np.isfinite(values).all(axis=1)]
    if len(whole) < 2:
        return False
    matrices = whole.reshape(-1, 3, 3)
    errors = np.abs(matrices @ matrices.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    return bool(np.median(errors) < LENGTH_TOLERANCE)


def find_quaternion(layout: TableLayout, values: Array, matrices: Sequence[int]) -> dict[str, int]:
    """Return the columns of a quaternion by its components qw qx qy qz; empty if there is none.

    The columns are found by their names, or else as four adjacent columns whose norm is 1. The columns of rotation
    `matrices` are left out, because a matrix row next to a number near zero has this norm too. Columns whose headings
    name another quantity are left out as well.
    """
    named: dict[str, int] = {}
    for index in layout.numbers:
        if (match := QUATERNION_NAME.fullmatch(_plain(layout.headings[index]))) is not None and index not in matrices:
            named.setdefault(QUATERNION_DIGITS.get(match[1], f"q{match[1]}"), index)
    if set(named) == set(QUATERNION) and _have_length_1(values[:, [*named.values()]]):
        return {name: named[name] for name in QUATERNION}
    others = {layout.time, *matrices, *list_angles(layout)}
    others |= {index for index in layout.numbers if _says_otherwise(layout, index)}
    for start in layout.numbers:
        indices = [start + offset for offset in range(4)]
        if set(indices) <= set(layout.numbers) - others and _have_length_1(values[:, indices]):
            return dict(zip(QUATERNION, indices, strict=True))
    return {}


def _says_otherwise(layout: TableLayout, index: int) -> bool:
    """Return whether a heading excludes a quaternion: it names a matrix element or another quantity, or has a unit."""
    name = _plain(re.sub(r"\[x.*?\]", "", layout.headings[index]))
    has_unit = layout.units[index] in UNITS and layout.units[index] != "1"
    return has_unit or MATRIX_NAME.fullmatch(name) is not None or OTHER_WORD.search(name) is not None


def _plain(heading: str) -> str:
    """Return a heading in small letters, with a single underscore between its words."""
    return re.sub(r"[\W_]+", "_", heading.lower()).strip("_")


def _have_length_1(values: Array) -> bool:
    whole = values[np.isfinite(values).all(axis=1)]
    return len(whole) > 1 and bool(np.median(np.abs(np.linalg.norm(whole, axis=1) - 1)) < LENGTH_TOLERANCE)
