"""Attitudes that were interpolated between a reference's reports are told from measured ones."""

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array
from rig.observation.external.attitude_import import select_reports
from rig.observation.motion.interpolated_attitudes import find_interpolated
from support.external.arm_log import ArmLog, record

LOG = ArmLog(stops=5, visits=1, rests_s=0.7, error_rad=0.0, latency_s=0.0, jitter_s=0.0)
READINGS_S = np.arange(1.0, 12.0, 0.01)


def reports() -> tuple[Array, Array]:
    """Times (k,) and unit quaternions (k, 4) with six decimals, whose sign changes in mid-motion."""
    recorded = record(LOG, 3)
    quaternions = Rotation.from_matrix(recorded.attitudes).as_quat(scalar_first=True)
    quaternions[len(quaternions) // 2 :] *= -1
    return recorded.stamps_s, np.round(quaternions, 6)


def interpolated(by: Literal["time", "row"]) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Times (n,), quaternions (n, 4) linear between reports, and a mask (n,) of the rows that are reports."""
    stamps_s, quaternions = reports()
    rows_s = np.unique(np.concatenate([READINGS_S, stamps_s])) if by == "time" else READINGS_S
    reported = (
        np.isin(rows_s, stamps_s)
        if by == "time"
        else np.isin(np.arange(len(rows_s)), np.searchsorted(rows_s, stamps_s))
    )
    position = rows_s if by == "time" else np.arange(len(rows_s))
    at = stamps_s if by == "time" else np.searchsorted(rows_s, stamps_s)
    return rows_s, np.column_stack([np.interp(position, at, column) for column in quaternions.T]), reported


@pytest.mark.parametrize("by", ["time", "row"])
def test_rows_between_reports_are_found_also_through_zero(by: Literal["time", "row"]) -> None:
    rows_s, quaternions, reported = interpolated(by)
    mask = find_interpolated(rows_s, quaternions)
    moved = np.concatenate([[0.0], np.linalg.norm(np.diff(quaternions, axis=0), axis=1)]) > 1e-3
    assert mask[moved & ~reported].mean() > 0.98 and not mask[moved & reported].any()
    assert np.abs(np.linalg.norm(quaternions, axis=1) - 1).max() > 0.5  # between q and −q
    assert np.abs(np.linalg.norm(quaternions[~mask], axis=1) - 1).max() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("poses_hz", [14.0, 100.0, 500.0])
def test_measured_attitudes_are_all_kept(poses_hz: float) -> None:
    recorded = record(replace(LOG, poses_hz=poses_hz, report_rad=1e-6), 5)
    quaternions = Rotation.from_matrix(recorded.attitudes).as_quat(scalar_first=True)
    for digits in (15, 6, 4):
        assert not find_interpolated(recorded.stamps_s, np.round(quaternions, digits)).any()


def test_a_steady_turn_and_a_long_rest_are_measured() -> None:
    time_s = np.arange(0, 20, 0.01)
    angles = np.maximum(time_s - 15, 0.0)[:, None] * [0.3, 0.1, 1.0]
    quaternions = Rotation.from_rotvec(angles).as_quat(scalar_first=True)
    assert not find_interpolated(time_s, np.round(quaternions, 7)).any()


@pytest.mark.slow
@pytest.mark.parametrize("length", [0.99, 1.01])
def test_quaternions_of_another_length_are_not_left_out_as_interpolated(length: float) -> None:
    recorded = record(replace(LOG, poses_hz=100), 5)
    quaternions = length * Rotation.from_matrix(recorded.attitudes).as_quat(scalar_first=True)
    for rows in (quaternions, np.tile(quaternions[0], (50, 1))):
        assert not find_interpolated(recorded.stamps_s[: len(rows)], rows).any()


def test_what_is_left_out_has_its_reason_and_its_first_row() -> None:
    rows_s, quaternions, reported = interpolated("row")
    columns = {
        "start_s": rows_s - 1e-3,
        "end_s": rows_s + 1e-3,
        **dict(zip(("qw", "qx", "qy", "qz"), quaternions.T, strict=True)),
    }
    _, numbers, (omitted,) = select_reports(columns)
    assert len(numbers) + omitted.count == omitted.total == len(rows_s) and omitted.count > 0.5 * (~reported).sum()
    assert "interpolated between the attitudes that the reference reported" in str(omitted)
    assert omitted.first == f"row {min(set(range(1, len(rows_s) + 1)) - set(numbers.tolist()))}"


@pytest.mark.parametrize("number", [np.nan, np.inf, 1e200, 0.0])
def test_rows_whose_quaternions_are_no_numbers_are_left_out(number: float) -> None:
    quaternions = Rotation.from_rotvec(np.outer(np.linspace(0, 3, 50), [0.6, 0.0, 0.8])).as_quat(scalar_first=True)
    quaternions[[7, 30]] = number
    time_s = np.arange(50) / 25
    columns = {"start_s": time_s - 1e-3, "end_s": time_s + 1e-3}
    columns |= dict(zip(("qw", "qx", "qy", "qz"), quaternions.T, strict=True))
    _, numbers, (omitted,) = select_reports(columns)
    assert numbers.tolist() == [row for row in range(1, 51) if row not in (8, 31)]
    assert (omitted.count, omitted.first) == (2, "row 8") and "no numbers" in omitted.reason
