"""Readings of a magnetometer on the simulated arm in attitudes, without a board."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.config.procedures.attitude_sets import ATTITUDE_SETS
from rig.config.sensors.sensor_sections import MountingSection, mounting_matrix
from rig.config.world.laboratory import WorldSiteSection
from rig.config.world.magnetism import IronSection, SimulatedMagnetometerSection
from rig.estimation.reference.magnetometer import Uniformity, uniformity
from rig.estimation.reference.reference_model import KnownNorm
from rig.estimation.reference.triaxial import Method, TriaxialSolution, solve_triaxial
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.magnetic_field import build_magnetic_field
from rig.world.ur10e.motion.forward_kinematics import frames

FIELD_UT = 48.0
NOISE_T = 0.02e-6  # of a mean over 3 s of the LSM9DS1-M: 0.32 µT a sample at 80 Hz
TRUTH = {
    "scale": [1.03, 0.98, 1.02],
    "bias_ut": [21.0, -34.0, 15.0],
    "non_orthogonality_deg": [0.8, -0.5, 0.6],
}
UPRIGHT = {"x": "+x", "y": "+y", "z": "+z"}
OVER = {"x": "+x", "y": "-y", "z": "-z"}
ROUND = {"x": "-x", "y": "-y", "z": "+z"}
HOUSING = {"carried_by": "wrist_2", "position_mm": [0, 0, 60]}  # of joint wrist 3, between that joint and the flange
ARM = np.radians([0.0, -90.0, 90.0])


@dataclass(frozen=True)
class Seen:
    """The true parameters of a `solution` from attitudes, and whether the field appeared `uniform`."""

    bias_t: np.ndarray
    matrix: np.ndarray
    solution: TriaxialSolution
    uniform: Uniformity
    mounting: np.ndarray


def solve_field(
    seed: int,
    *,
    site: Mapping[str, Any] | None = None,
    iron: Sequence[Mapping[str, Any]] = (),
    extension_mm: float = 300.0,
    mounting: Mapping[str, str] = UPRIGHT,
    method: Method = "attitude_weighted",
) -> Seen:
    """Solve the attitudes of a magnetometer at `extension_mm` from the flange of an arm without errors."""
    section = MountingSection.model_validate(mounting)
    simulated = SimulatedMagnetometerSection.model_validate(TRUTH)
    mounted = MountedMagnetometer(section, simulated, offset_mm=(0.0, 0.0, extension_mm))
    field = build_magnetic_field(
        WorldSiteSection.model_validate({"magnetic_field_ut": FIELD_UT, "magnetic_dip_deg": 65.0} | dict(site or {})),
        [IronSection.model_validate(iron_section) for iron_section in iron],
    )
    poses = [list(frames([*ARM, *np.radians(wrists)])) for wrists in ATTITUDE_SETS["magnetic"]]
    sensed = np.array([mounted.sense(field, pose, 0.0) for pose in poses])
    matrix = _matrix()
    rng = np.random.default_rng(seed)
    readings = sensed @ matrix.T + np.array(mounted.truth.bias_t) + rng.normal(0.0, NOISE_T, sensed.shape)
    rows = mounting_matrix(section)
    attitudes = np.array([np.array(pose[-1][0]) @ rows.T for pose in poses])
    variances = np.full(sensed.shape, NOISE_T**2)
    solution = solve_triaxial(readings, attitudes, variances, KnownNorm(1e-6 * FIELD_UT, (0, 0, -1)), method=method)
    alike = uniformity(solution, readings, attitudes, variances, 0.0)
    return Seen(np.array(mounted.truth.bias_t), matrix, solution, alike, rows)


def _matrix() -> np.ndarray:
    """Return the true F as the world's own sensor has it: the readings in unit fields."""
    from firmware_host.emulator.parts.magnetometer import Magnetometer, MagnetometerTruth

    truth = MagnetometerTruth(
        scale=TRUTH["scale"], non_orthogonality_rad=np.radians(TRUTH["non_orthogonality_deg"]).tolist()
    )

    def read(unit: list[float]) -> list[float]:
        return Magnetometer(lambda time_s: unit, truth, 0).read(0.0)

    return np.array([read(unit) for unit in np.eye(3).tolist()]).T
