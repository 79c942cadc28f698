"""Magnetometers from dwells in known attitudes: TRIAX, Eq. (7), on an arm.

As they are mounted: iron and currents that turn with a magnetometer are part of what is found of it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rig.analysis.attitudes import scale_and_bias_covariance
from rig.analysis.calibration import or_fault
from rig.data.run_file import RecordedMagnetometer
from rig.data.settings import RunSettings
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.magnetometer import MagnetometerSolution, solve_magnetometer
from rig.estimation.reference_model import F
from rig.estimation.refusals import check_axes
from rig.estimation.sensor_axes import angle_jacobian, nearest_rotation, non_orthogonality
from rig.estimation.triaxial import Method
from rig.observation.field import FieldReading, field_readings
from rig.observation.observed_run import ObservedRun

ESTIMATOR: Method = "attitude_weighted"
BESIDE: tuple[Method, ...] = ("maximum_likelihood", "as_published")


@dataclass(frozen=True, slots=True)
class MagnetometerResult:
    """One magnetometer's calibration m = F B + b in the axes of its nominal mounting, and what it rests on.

    `scale` (3,) is 1/‖row of F‖, relative to the field's size `field_t`; `covariance` (6, 6) that of scale and bias.
    `beside` are the other methods' solutions, or the Fault each ends in.
    """

    sensor: RecordedMagnetometer
    field_t: float
    solution: MagnetometerSolution
    scale: Array
    covariance: Array
    non_orthogonality_rad: Array
    non_orthogonality_std_rad: Array
    beside: Mapping[Method, MagnetometerSolution | Fault]
    dwells: tuple[FieldReading, ...]

    @property
    def correction_matrix(self) -> Array:
        """(3, 3) M of B = M (m − b), in the right-angled frame nearest to the magnetometer's own axes."""
        axes = self.solution.matrix * self.scale[:, None]
        matrix: Array = nearest_rotation(axes) @ np.linalg.inv(self.solution.matrix)
        return matrix


def calibrate_magnetometers(
    recordings: Sequence[ObservedRun], settings: RunSettings
) -> dict[str, MagnetometerResult | Fault]:
    """Every magnetometer that was recorded, or the Fault for which it is not calibrated.

    `no_attitudes` where none were held, `field_strength_unknown`, those of `field_readings` and of `solve_triaxial`,
    `swapped_axes`, `mirrored_axis`, `wrong_mounting`.
    """
    return {
        name: or_fault(partial(_calibrated, name, sensor, recordings, settings))
        for name, sensor in recordings[0].run.magnetometers.items()
    }


def _calibrated(
    name: str, sensor: RecordedMagnetometer, recordings: Sequence[ObservedRun], settings: RunSettings
) -> MagnetometerResult:
    site = settings.site
    if not settings.planned_dwells:
        raise Fault(
            "no_attitudes",
            "recorded only: sweeps do not calibrate a magnetometer",
            "Use the procedure static_attitudes or imu, which hold attitudes",
        )
    if site is None or site.magnetic_field_t is None:
        raise Fault(
            "field_strength_unknown",
            "recorded only: the size of the field is not given, and the scale of a magnetometer is relative to it",
            "Give site.magnetic_field_ut, as a reference magnetometer measured it where the sensor stands",
        )
    dwells = tuple(each for run in recordings for each in field_readings(run, name, settings.observation))
    mounting = np.array(sensor.mounting)
    solve = partial(
        solve_magnetometer,
        np.array([dwell.reading.mean for dwell in dwells]),
        np.array([(mounting @ nearest_rotation(dwell.attitude)).T for dwell in dwells]),
        np.array([dwell.reading.variance for dwell in dwells]),
        field_t=site.magnetic_field_t,
        side=(1.0 if site.magnetic_field_upwards else -1.0) * np.array(site.up),
    )
    solution = solve(method=ESTIMATOR)
    scale = 1 / np.linalg.norm(solution.matrix, axis=1)
    axes = solution.matrix * scale[:, None]
    check_axes(axes, np.eye(3))
    angles = angle_jacobian(axes, scale, nearest_rotation(axes))
    return MagnetometerResult(
        sensor=sensor,
        field_t=site.magnetic_field_t,
        solution=solution,
        scale=scale,
        covariance=scale_and_bias_covariance(solution.matrix, scale, solution.covariance),
        non_orthogonality_rad=non_orthogonality(axes),
        non_orthogonality_std_rad=np.sqrt(np.diag(angles @ solution.covariance[F, F] @ angles.T))[:3],
        beside={method: or_fault(partial(solve, method=method)) for method in BESIDE},
        dwells=dwells,
    )
