"""Three axes that were held still in known attitudes to gravity or a field of known size: what both kinds share."""

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
from rig.observation.reference.acceleration import DwellReading
from rig.observation.statistics.mean import StaticReading

BESIDE: tuple[Method, ...] = ("maximum_likelihood", "as_published")  # whose solutions stand beside the chosen one
SEEN = 3.0  # standard deviations that the largest second-order term must have


@dataclass(frozen=True, slots=True)
class Triad:
    """Three axes by a solution's matrix F and bias, and by its covariance alone.

    `scale` (3,) is 1/‖row of F‖, `covariance` (6, 6) that of scale and bias. The `correction_matrix` M (3, 3) leads
    from a reading less its bias to the right-angled frame nearest to the axes.
    """

    scale: Array
    covariance: Array
    non_orthogonality_rad: Array
    non_orthogonality_std_rad: Array
    correction_matrix: Array

    @staticmethod
    def of(solution: ImuSolution | TriaxialSolution) -> "Triad":
        """The axes that a solution has."""
        axes = SensorAxes.of(solution.matrix)
        return Triad(
            axes.scale,
            scale_and_bias_covariance(solution.matrix, axes.scale, solution.covariance),
            axes.non_orthogonality_rad,
            axes.non_orthogonality_std_rad(solution.covariance[F, F]),
            axes.correction_matrix,
        )


def known_gravity(site: Site) -> KnownNorm:
    """What is known at a place of the specific force at rest, the opposite of gravity: it points up."""
    return KnownNorm(site.gravity_m_s2, np.array(site.up))


def known_field(site: Site, key: str) -> KnownNorm:
    """What is known of the field at a place. Raises Fault `field_strength_unknown`; `key` is how to say its size."""
    if site.magnetic_field_t is None:
        raise Fault(
            "field_strength_unknown",
            "the size of the magnetic field is not given, and the scale of a magnetometer is relative to it",
            f"Give {key}, as a reference magnetometer measured it where the sensor was",
        )
    up = np.array(site.up)
    return KnownNorm(site.magnetic_field_t, up if site.magnetic_field_upwards else -up)


def seen_in(dwells: Sequence[DwellReading | StaticReading], mounting: Array) -> Dwells:
    """The dwells in the nominal mounting's axes; the mean of rotations that hardly differ shrinks by encoder steps."""
    return Dwells(
        np.array([dwell.reading.mean for dwell in dwells]),
        np.array([dwell.reading.variance for dwell in dwells]),
        np.array([(mounting @ nearest_rotation(dwell.attitude)).T for dwell in dwells]),
    )


def check_mounted(matrix: Array) -> None:
    """Raises Fault `swapped_axes`, `mirrored_axis`, `wrong_mounting` where F is not that of the nominal mounting."""
    check_axes(SensorAxes.of(matrix).axes, np.eye(3))


def check_seen(second_order: Array, std: Array, remedy: str) -> None:
    """Whether any of the terms φ (3,) that were asked for is told. Raises Fault `second_order_not_seen`."""
    largest = float(np.max(np.abs(second_order) / std))
    if largest < SEEN:
        raise Fault(
            "second_order_not_seen", f"no second-order term is beyond {largest:.1f} of its standard deviations", remedy
        )
