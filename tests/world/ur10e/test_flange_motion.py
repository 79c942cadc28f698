"""What the flange feels is what its path in space says, differentiated: of any arm, on a tilted ground that turns."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from rig.config.world.laboratory import CalibrationSection, WorldSiteSection
from rig.world.site import build_site
from rig.world.ur10e.motion.flange_motion import find_flange_motion, find_motion, transfer_force
from rig.world.ur10e.motion.forward_kinematics import flange_pose, flange_rate
from rig.world.ur10e.motion.links import NOMINAL, links
from rig.world.ur10e.motion.true_arm import build_calibrated_links

Array = np.ndarray

EARTH = 7.292115e-5  # rad/s
A_M = np.array([0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0])
D_M = np.array([0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655])
ALPHA = np.array([90.0, 0.0, 0.0, 90.0, -90.0, 0.0])
CALIBRATION = CalibrationSection(
    delta_theta_rad=(1e-3, -2e-3, 3e-3, 1e-3, -1e-3, 2e-3),
    delta_a_mm=(1.0, -2.0, 3.0, 0.5, 0.0, 1.0),
    delta_d_mm=(-1.0, 10.0, -10.0, 0.5, 0.2, 0.1),
    delta_alpha_rad=(1e-3, -1e-3, 2e-3, -8e-4, 4e-4, 0.0),
)
angles = st.tuples(*[st.floats(-6, 6)] * 6)
speeds = st.tuples(*[st.floats(-2, 2)] * 6)


def chain(q: Array) -> tuple[Array, Array]:
    """Rotation and position of the flange of the calibrated arm, by matrices."""
    place = np.eye(4)
    for joint in range(6):
        turn, shift = np.eye(4), np.eye(4)
        turn[:3, :3] = Rotation.from_euler("z", q[joint] + CALIBRATION.delta_theta_rad[joint]).as_matrix()
        twist = math.radians(ALPHA[joint]) + CALIBRATION.delta_alpha_rad[joint]
        shift[:3, :3] = Rotation.from_euler("x", twist).as_matrix()
        shift[:3, 3] = A_M[joint] + 1e-3 * CALIBRATION.delta_a_mm[joint], 0, 0
        turn[2, 3] = D_M[joint] + 1e-3 * CALIBRATION.delta_d_mm[joint]
        place = place @ turn @ shift
    return place[:3, :3], place[:3, 3]


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(angles, speeds, speeds, st.tuples(*[st.floats(-0.1, 0.1)] * 3))
def test_rate_and_force_are_the_derivatives_of_the_path_among_the_stars(
    q: tuple[float, ...], qd: tuple[float, ...], qdd: tuple[float, ...], offset_m: tuple[float, ...]
) -> None:
    """A thousand times the Earth's rate, so that what it does is far above what differences resolve."""
    site = build_site(WorldSiteSection(latitude_deg=40, heading_deg=70, base_tilt_deg=(3, -2)))
    ground = 1000 * np.array(site.earth_rate_rad_s)
    site = type(site)(tuple(ground.tolist()), site.specific_force_m_s2)

    def place(time_s: float) -> tuple[Array, Array]:
        rotation, position = chain(np.array(q) + np.array(qd) * time_s + 0.5 * np.array(qdd) * time_s**2)
        turned = Rotation.from_rotvec(ground * time_s).as_matrix()  # the base among the stars
        return turned @ rotation, turned @ (position + rotation @ np.array(offset_m))

    step = 1e-3
    (before, p), (here, r), (after, s) = (place(time_s) for time_s in (-step, 0.0, step))
    rate = Rotation.from_matrix(before.T @ after).as_rotvec() / (2 * step)
    force = here.T @ ((p - 2 * r + s) / step**2 + np.array(site.specific_force_m_s2))
    now = find_flange_motion(q, qd, qdd, build_calibrated_links(CALIBRATION), site)
    assert now.rate_rad_s == pytest.approx(rate, abs=2e-4)
    assert transfer_force(now.rate_rad_s, now.change_rad_s2, now.force_m_s2, offset_m) == pytest.approx(force, abs=2e-3)


def test_the_pose_of_a_calibrated_arm_is_that_of_its_own_links() -> None:
    q = (0.3, -1.2, 1.4, -0.7, -1.5, 2.0)
    rotation, position = chain(np.array(q))
    pose = flange_pose(q, build_calibrated_links(CALIBRATION))
    assert pose[:3] == pytest.approx(position, abs=1e-12)
    assert Rotation.from_rotvec(pose[3:]).as_matrix() == pytest.approx(rotation, abs=1e-12)
    assert math.dist(pose[:3], flange_pose(q)[:3]) > 1e-3  # the drawing's arm is elsewhere


def test_without_deviations_the_links_are_the_drawings() -> None:
    assert links() == NOMINAL
    assert [link.alpha_rad for link in NOMINAL] == np.radians(ALPHA).tolist()
    assert find_flange_motion(
        (0.1,) * 6, (0.2,) * 6, (0.0,) * 6, NOMINAL, build_site(WorldSiteSection())
    ).rate_rad_s == flange_rate((0.1,) * 6, (0.2,) * 6)


def test_arrays_of_instants_are_felt_as_single_ones() -> None:
    rng = np.random.default_rng(1)
    q, qd, qdd = rng.normal(size=(3, 6, 4))
    arm, site = build_calibrated_links(CALIBRATION), build_site(WorldSiteSection(latitude_deg=-33))
    turns = [(np.cos(q[j] + arm[j].theta_rad), np.sin(q[j] + arm[j].theta_rad)) for j in range(6)]
    all_at_once = find_motion(turns, list(qd), list(qdd), arm, site)
    for instant in range(4):
        alone = find_flange_motion(q[:, instant].tolist(), qd[:, instant].tolist(), qdd[:, instant].tolist(), arm, site)
        for many, one in zip(all_at_once, alone, strict=True):
            assert [component[instant] for component in many] == pytest.approx(one)


@pytest.mark.parametrize(
    ("heading_deg", "north"), [(0, (1, 0, 0)), (90, (0, 1, 0)), (180, (-1, 0, 0)), (30, (math.sqrt(0.75), 0.5, 0))]
)
def test_the_ground_turns_about_the_poles_axis(heading_deg: float, north: tuple[float, ...]) -> None:
    """At heading 90° the base's x axis looks east, so its y axis looks north."""
    site = build_site(WorldSiteSection(latitude_deg=52, heading_deg=heading_deg, gravity_m_s2=9.81))
    latitude = math.radians(52)
    expected = EARTH * (math.cos(latitude) * np.array(north) + math.sin(latitude) * np.array([0, 0, 1]))
    assert site.earth_rate_rad_s == pytest.approx(expected, abs=1e-12)
    assert site.specific_force_m_s2 == pytest.approx((0, 0, 9.81))


def test_a_tilted_base_sees_gravity_and_the_pole_from_the_side() -> None:
    upright, tilted = (
        build_site(WorldSiteSection(latitude_deg=52, heading_deg=20, base_tilt_deg=tilt)) for tilt in ((0, 0), (2, -1))
    )
    base = Rotation.from_euler("XY", [2, -1], degrees=True)  # first about x, then about the new y
    for name in ("earth_rate_rad_s", "specific_force_m_s2"):
        assert getattr(tilted, name) == pytest.approx(base.inv().apply(getattr(upright, name)), abs=1e-12)


def test_without_a_latitude_the_ground_does_not_turn() -> None:
    assert build_site(WorldSiteSection()).earth_rate_rad_s == (0, 0, 0)
