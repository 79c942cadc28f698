"""The three axes of an accelerometer or magnetometer calibrated in known attitudes to gravity or a field."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.recording.settings import Site
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import Dwells
from rig.estimation.reference.imu import ImuSolution
from rig.estimation.reference.reference_budget import scale_and_bias_covariance
from rig.estimation.reference.reference_model import F, KnownNorm
from rig.estimation.reference.triaxial import Method, TriaxialSolution
from rig.estimation.refusals import check_axes
from rig.estimation.sensor_axes import SensorAxes, nearest_rotation
from rig.observation.reference.dwell_acceleration import DwellReading
from rig.observation.statistics.mean import StaticReading

COMPARED_METHODS: tuple[Method, ...] = ("maximum_likelihood", "as_published")  # reported with the chosen one
MIN_SECOND_ORDER_STDS = 3.0  # size of the largest second-order term, in its standard deviations


@dataclass(frozen=True, slots=True)
class Triad:
    """Three axes from a solution's matrix F (3, 3), with the uncertainty of the solution alone.

    - `scale` (3,): one divided by the norm of each row of F; `covariance` (6, 6): that of scale and bias.
    - `correction_matrix` M (3, 3): takes readings minus bias to the orthogonal frame nearest to the sensor's axes.
    """

    scale: Array
    covariance: Array
    non_orthogonality_rad: Array
    non_orthogonality_std_rad: Array
    correction_matrix: Array

    @staticmethod
    def from_solution(solution: ImuSolution | TriaxialSolution) -> "Triad":
        """Return the axes of a solution."""
        axes = SensorAxes.from_matrix(solution.matrix)
        return Triad(
            axes.scale,
            scale_and_bias_covariance(solution.matrix, axes.scale, solution.covariance),
            axes.non_orthogonality_rad,
            axes.non_orthogonality_std_rad(solution.covariance[F, F]),
            axes.correction_matrix,
        )


def gravity_reference(site: Site) -> KnownNorm:
    """Return the reference of an accelerometer at rest: the specific force, which points upwards."""
    return KnownNorm(site.gravity_m_s2, np.array(site.up))


def field_reference(site: Site, key: str) -> KnownNorm:
    """Return the stated field at the site. Raise Fault `field_strength_unknown`, which names its option, `key`."""
    if site.magnetic_field_t is None:
        raise Fault(
            "field_strength_unknown",
            "the size of the magnetic field is not given, but the scale of a magnetometer is relative to it",
            f"Give {key} as a reference magnetometer measured it at the sensor's position",
        )
    up = np.array(site.up)
    return KnownNorm(site.magnetic_field_t, up if site.magnetic_field_upwards else -up)


def stack_dwells(dwells: Sequence[DwellReading | StaticReading], mounting: Array) -> Dwells:
    """Return the means of dwells, with attitudes as rotations, in the axes of the nominal `mounting` (3, 3)."""
    return Dwells(
        np.array([dwell.reading.mean for dwell in dwells]),
        np.array([dwell.reading.variance for dwell in dwells]),
        np.array([(mounting @ nearest_rotation(dwell.attitude)).T for dwell in dwells]),
    )


def check_mounted(matrix: Array) -> None:
    """Raise Fault `swapped_axes`, `mirrored_axis` or `wrong_mounting` if `matrix` contradicts the nominal mounting."""
    check_axes(SensorAxes.from_matrix(matrix).axes, np.eye(3))


def check_identifiable(second_order: Array, std: Array, remedy: str) -> None:
    """Raise Fault `second_order_not_seen` unless one of the quadratic terms (3,) is significant given its `std`."""
    largest = float(np.max(np.abs(second_order) / std))
    if largest < MIN_SECOND_ORDER_STDS:
        raise Fault(
            "second_order_not_seen",
            f"the largest second-order term is only {largest:.1f} times its standard deviation",
            remedy,
        )
