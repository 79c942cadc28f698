"""The simulated laboratory's magnetic field, and what a magnetometer on the flange feels of it."""

import numpy as np
import pytest

from rig.config.sensor_sections import MagnetometerSection
from rig.config.world_models import SimulatedMagnetometerSection, SiteSection
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.magnetic_field import UniformField, magnetic_field_of
from rig.world.ur10e.forward_kinematics import flange_frame

PLACES = ((0.0, 0.0, 0.0), (0.7, -0.2, 0.4))


def at_base(**section: object) -> np.ndarray:
    field = magnetic_field_of(SiteSection.model_validate({"magnetic_field_ut": 50, "magnetic_dip_deg": 0} | section))
    here, there = (np.array(field.at(place)) for place in PLACES)
    assert np.array_equal(here, there), "it is the same everywhere"
    return 1e6 * here


@pytest.mark.parametrize(
    ("section", "expected"),
    [
        ({}, (50, 0, 0)),  # the base's x axis points north
        ({"magnetic_dip_deg": 90}, (0, 0, -50)),
        ({"magnetic_dip_deg": -30}, (50 * 3**0.5 / 2, 0, 25)),  # south of the magnetic equator
        ({"magnetic_declination_deg": 90}, (0, -50, 0)),  # to the east, and the base's y axis points west
        ({"heading_deg": 90}, (0, 50, 0)),  # x to the east, y to the north
        ({"heading_deg": 40, "magnetic_declination_deg": 40}, (50, 0, 0)),
        (
            {"magnetic_dip_deg": 90, "base_tilt_deg": (5, 0)},
            (0, -50 * np.sin(np.radians(5)), -50 * np.cos(np.radians(5))),
        ),
    ],
)
def test_the_field_dips_and_turns_as_the_earths(section: dict[str, object], expected: tuple[float, ...]) -> None:
    assert at_base(**section) == pytest.approx(expected, abs=1e-9)


def test_a_magnetometer_feels_it_in_its_own_axes() -> None:
    section = MagnetometerSection.model_validate(
        {"part": "lsm9ds1_magnetometer", "serial_number": "M1", "mounting": {"x": "+y", "y": "-x", "z": "+z"}}
    )
    simulated = SimulatedMagnetometerSection(mounting_error_deg=(0.0, 0.0, 90.0))
    flange = flange_frame((0.1, -1.2, 1.9, -0.7, -1.4, 0.6))
    rotation = np.array(flange[0])
    base_t = np.array((2e-5, -1e-5, -4e-5))
    x, y, z = (rotation.T @ base_t).tolist()  # in the flange's axes
    # Sensor x along flange y, y along −x; then turned by 90° about z: what was y is −x now.
    felt = MountedMagnetometer(section, simulated).feels(UniformField((2e-5, -1e-5, -4e-5)), flange)
    assert felt == pytest.approx((-x, -y, z), abs=1e-12)
    assert np.linalg.norm(felt) == pytest.approx(np.linalg.norm(base_t))
