"""The simulated laboratory's magnetic field, and what a magnetometer on the flange feels of it."""

from typing import Any

import numpy as np
import pytest

from rig.config.sensors.sensor_sections import MagnetometerSection
from rig.config.world.laboratory import WorldSiteSection
from rig.config.world.magnetism import IronSection, SimulatedMagnetometerSection
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.magnetic_field import MagneticField, Room, build_magnetic_field
from rig.world.ur10e.motion.forward_kinematics import frames

POSE = list(frames((0.1, -1.2, 1.9, -0.7, -1.4, 0.6)))
PLACES = ((0.0, 0.0, 0.0), (0.7, -0.2, 0.4))


def at_base(**section: object) -> np.ndarray:
    field = build_magnetic_field(
        WorldSiteSection.model_validate({"magnetic_field_ut": 50, "magnetic_dip_deg": 0} | section)
    )
    here, there = (np.array(field.flux_density_at(place, POSE, 3.0)) for place in PLACES)
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
    rotation = np.array(POSE[-1][0])
    base_t = np.array((2e-5, -1e-5, -4e-5))
    x, y, z = (rotation.T @ base_t).tolist()  # in the flange's axes
    # Sensor x along flange y, y along −x; then turned by 90° about z: what was y is −x now.
    magnetometer = MountedMagnetometer(section.mounting, SimulatedMagnetometerSection(), (0.0, 0.0, 90.0))
    felt = magnetometer.sense(MagneticField(Room((2e-5, -1e-5, -4e-5))), POSE, 0.0)
    assert felt == pytest.approx((-x, -y, z), abs=1e-12)
    assert np.linalg.norm(felt) == pytest.approx(np.linalg.norm(base_t))


def field_of(iron: tuple[IronSection, ...] = (), **site: object) -> MagneticField:
    return build_magnetic_field(WorldSiteSection.model_validate({"magnetic_field_ut": 0} | site), iron)


def test_a_gradient_changes_it_with_place_and_a_drift_with_time() -> None:
    field = field_of(magnetic_gradient_ut_m=(1, 2, 3, 4, 5), magnetic_drift_ut_min=(0.6, 0, -1.2))
    assert 1e6 * np.array(field.flux_density_at((1, 0, 0), POSE, 0.0)) == pytest.approx([1, 2, 3])
    assert 1e6 * np.array(field.flux_density_at((0, 1, 0), POSE, 0.0)) == pytest.approx([2, 4, 5])
    assert 1e6 * np.array(field.flux_density_at((0, 0, 1), POSE, 0.0)) == pytest.approx([3, 5, -5]), "it has no sources"
    assert 1e6 * np.array(field.flux_density_at((0, 0, 0), POSE, 30.0)) == pytest.approx([0.3, 0, -0.6])


def test_iron_is_a_dipole_that_moves_with_its_link() -> None:
    iron = IronSection(carried_by="wrist_2", position_mm=(0.0, 0.0, 60.0), moment_a_m2=(0.0, 0.0, 0.2))
    field = field_of((iron,))
    for angles in ((0.0, -1.5, 1.5, 0.3, -1.5, 0.0), (0.5, -1.0, 1.2, -2.0, 0.7, 2.0)):
        pose = list(frames(angles))
        rotation, origin = np.array(pose[5][0]), np.array(pose[5][1])

        def at(*place_m: float, pose: Any = pose, rotation: Any = rotation, origin: Any = origin) -> np.ndarray:
            """In the link's axes, µT, so far from the dipole."""
            here = origin + rotation @ np.add(place_m, (0, 0, 0.06))
            felt: np.ndarray = 1e6 * rotation.T @ np.array(field.flux_density_at(tuple(here), pose, 0.0))
            return felt

        assert at(0, 0, 0.1) == pytest.approx([0, 0, 40.0]), "on its axis: µ0 m / 2π r³"
        assert at(0.1, 0, 0) == pytest.approx([0, 0, -20.0])
        assert at(0.1, 0, 0.1) == pytest.approx(np.array([3, 0, 1]) / 2 * 20.0 / 8**0.5)


def test_a_sensor_on_an_extension_feels_the_field_where_it_is() -> None:
    field = field_of(magnetic_gradient_ut_m=(1, 2, 3, 4, 5))
    magnetometer = MountedMagnetometer(
        MagnetometerSection.model_validate({"part": "lsm9ds1_magnetometer", "serial_number": "M1"}).mounting,
        SimulatedMagnetometerSection(),
        offset_mm=(0.0, 0.0, 300.0),
    )
    rotation, place = (np.array(each) for each in POSE[-1])
    expected = rotation.T @ np.array(field.flux_density_at(tuple(place + 0.3 * rotation[:, 2]), POSE, 0.0))
    assert magnetometer.sense(field, POSE, 0.0) == pytest.approx(expected, abs=1e-15)
