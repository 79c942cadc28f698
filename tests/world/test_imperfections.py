"""Every imperfection of the simulated laboratory, measured where the rig would: at the board's and the arm's wires."""

import json
import math
import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from firmware_host.frames import FrameReader
from rig.config.load import load
from rig.config.sensors.sensor_sections import SensorSection
from rig.config.world.laboratory import SimulatedSensorSection, WorldSection
from rig.world.board.sensor_truth import SensorTruth
from rig.world.clock import TICK_S, TICKS_PER_SECOND, WorldClock
from rig.world.ur10e.controller_messages import ProgramError
from rig.world.ur10e.interfaces.primary_server import PrimarySession
from rig.world.ur10e.interfaces.rtde import OutputRecipe
from rig.world.ur10e.motion.flange_motion import BodyMotion
from rig.world.ur10e.motion.forward_kinematics import flange_rate
from rig.world.world_section import read_world_section
from support.laboratories.ideal import ideal_document
from support.laboratories.laboratory_host import Host, host
from support.paths import DEMO

pytestmark = pytest.mark.slow

CRYSTAL = 122 * 32_768 / 4e6  # how fast the board's clock runs that is locked to it
COUNT = math.radians(8.75e-3)  # rad/s, of an LSM9DS1 at ±245 °/s
EARTH = 7.292115e-5
G = 9.80665
HOME = (0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0)
TILTED = (0.4, -1.4, 1.5, -1.1, -1.9, 0.7)
A_M = (0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0)
D_M = (0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655)
ALPHA = (math.pi / 2, 0.0, 0.0, math.pi / 2, -math.pi / 2, 0.0)


def laboratory(gyro: Mapping[str, object] | None = None, **world: Any) -> Host:
    """demo.yaml's board, streaming, with an ideal arm and gyroscope but for what is asked for."""
    arm = {"joints": "ideal", **(world.pop("arm", None) or {})}
    ideal = {"scale": [1, 1, 1], "bias_rad_s": [0, 0, 0], "noise_rad_s": 0}
    section = {"arm": arm, "sensors": {"gyro": {**ideal, **(gyro or {})}}, **world}
    return host(load(DEMO, [f"world={json.dumps(section)}"]))


def items(one: Host, field: str) -> np.ndarray:
    """A column of all samples since `received` was cleared, or the board's time of each."""
    frames = FrameReader().feed(bytes(one.received))
    samples = [frame for frame in frames if frame.name == "samples"]
    if field == "time_us":
        return np.concatenate(
            [frame.values["base_time_us"] + frame.items["delta_us"].astype(float) for frame in samples]
        )
    return np.concatenate([frame.items[field] for frame in samples])


def rates(one: Host, ticks: int) -> np.ndarray:
    """(n, 3) rad/s, what the board sends in so many ticks."""
    one.ticks(50)  # what is on its way
    one.received.clear()
    one.ticks(ticks)
    return items(one, "counts") * COUNT


def stand(one: Host, q_rad: Sequence[float]) -> None:
    """Drive there and wait for everything to come to rest."""
    one.laboratory.robot.motion.move(tuple(q_rad), 2.0, 8.0)
    one.ticks(1)
    while not one.laboratory.robot.motion.standing:
        one.ticks(1)
    one.ticks(200)


def turning(one: Host, joint: int, speed_rad_s: float) -> None:
    """A joint at a constant speed, after its ramp."""
    one.laboratory.robot.motion.speed(tuple(speed_rad_s if j == joint else 0.0 for j in range(6)), 50.0)
    one.ticks(100)


def chain(q_rad: Sequence[float], extra: Mapping[str, Sequence[float]] | None = None) -> np.ndarray:
    """(4, 4) place of the flange, by matrices."""
    more = extra or {}
    none = (0.0,) * 6
    place = np.eye(4)
    for joint in range(6):
        turn, shift = np.eye(4), np.eye(4)
        turn[:3, :3] = Rotation.from_euler("z", q_rad[joint] + more.get("theta", none)[joint]).as_matrix()
        turn[2, 3] = D_M[joint] + more.get("d", none)[joint]
        shift[:3, :3] = Rotation.from_euler("x", ALPHA[joint] + more.get("alpha", none)[joint]).as_matrix()
        shift[0, 3] = A_M[joint] + more.get("a", none)[joint]
        place = place @ turn @ shift
    return place


def states(one: Host, ticks: int, *names: str) -> np.ndarray:
    """(n, values) of RTDE's data packages at every tick, the names in alphabetical order."""
    output = OutputRecipe(sorted(names), 500.0, 1)
    values = []
    for _ in range(ticks):
        one.ticks(1)
        data = output.pack(one.laboratory.robot)
        values.append(struct.unpack(f">{(len(data) - 4) // 8}d", data[4:]))
    return np.array(values)


# -- the site ------------------------------------------------------------------------------------------------------
def test_a_gyroscope_at_rest_feels_the_earth_turn() -> None:
    """With a scale of 1/1000 its readings are a thousand times what they should be: enough counts to see it."""
    one = laboratory({"scale": [1e-3] * 3}, site={"latitude_deg": 52, "heading_deg": 90})
    for pose in (HOME, TILTED):
        stand(one, pose)
        north_up = EARTH * np.array([0.0, math.cos(math.radians(52)), math.sin(math.radians(52))])  # base x looks east
        expected = 1e3 * chain(pose)[:3, :3].T @ north_up
        assert rates(one, 100)[-1] == pytest.approx(expected, abs=COUNT)


def test_without_a_latitude_it_feels_nothing() -> None:
    assert not rates(laboratory({"scale": [1e-3] * 3}), 100).any()


# -- the sensor ----------------------------------------------------------------------------------------------------
SIMULATED = SimulatedSensorSection.model_validate(
    {"scale": [1, 1, 1], "bias_rad_s": [0, 0, 0], "g_sensitivity_rad_s_per_g": [[0.01, 0, 0]] * 3}
)
PER_G = [[0.05, 0.01, 0.0], [0.0, 0.06, 0.0], [0.02, 0.0, 0.07]]


def test_gravity_shows_in_the_readings_of_a_g_sensitive_gyroscope() -> None:
    """On a base that is tilted, with mounting."""
    one = laboratory(
        {"g_sensitivity_rad_s_per_g": PER_G, "mounting_error_deg": [0, 0, 90]},
        site={"base_tilt_deg": [4, 0], "gravity_m_s2": 9.81},
    )
    for pose in (HOME, TILTED):
        stand(one, pose)
        up = Rotation.from_euler("x", -4, degrees=True).apply([0, 0, 9.81 / G])
        x, y, z = chain(pose)[:3, :3].T @ up
        assert rates(one, 100)[-1] == pytest.approx(np.array(PER_G) @ [y, -x, z], abs=COUNT)


def test_gravity_is_that_of_where_the_arm_stands_when_nobody_looked_on_the_way() -> None:
    one = laboratory({"g_sensitivity_rad_s_per_g": PER_G})
    assert rates(one, 100)[-1] == pytest.approx(np.array(PER_G) @ chain(HOME)[:3, :3].T @ [0, 0, 1], abs=COUNT)
    one.laboratory.unplug()
    stand(one, TILTED)
    sensor = SensorTruth(SensorSection.model_validate({"part": "lsm9ds1", "serial_number": "A"}), SIMULATED)
    felt = one.laboratory.on_arm.arm.motion_at(one.laboratory.robot.time_s)
    assert sensor.sense(felt)[3:] == pytest.approx(chain(TILTED)[:3, :3].T @ [0, 0, 1], abs=1e-9)


def test_a_sensor_off_the_axis_feels_the_turn_push_it_inwards() -> None:
    """Wrist 3 at 3 rad/s, 80 and 60 mm off its axis: −ω² r of 0.73 and 0.55 m/s², in a place without gravity."""
    one = laboratory({"g_sensitivity_rad_s_per_g": PER_G, "offset_mm": [80, 60, 25]}, site={"gravity_m_s2": 0})
    turning(one, 5, 3.0)
    force_g = -(3.0**2) * np.array([0.080, 0.060, 0.0]) / G
    assert rates(one, 100)[-1] - (0, 0, 3.0) == pytest.approx(np.array(PER_G) @ force_g, abs=COUNT)


def test_a_sensor_far_from_a_turning_wrist_feels_it_too() -> None:
    """Wrist 1 carries the flange along by its own way of it; the ripple's acceleration is in it."""
    one = laboratory({"g_sensitivity_rad_s_per_g": PER_G, "offset_mm": [20, -10, 30]}, site={"gravity_m_s2": 0})
    turning(one, 3, 2.0)
    one.received.clear()
    one.ticks(200)
    place = chain(HOME)
    elbow = chain((*HOME[:3], 0.0, 0.0, 0.0), {"d": (0, 0, 0, -D_M[3], -D_M[4], -D_M[5])})[:3, 3]  # on wrist 1's axis
    sensor = place[:3, 3] + place[:3, :3] @ [0.020, -0.010, 0.030]
    joint_axis = np.array([0.0, -1.0, 0.0])  # of shoulder, elbow and wrist 1, with the base at 0
    lever = sensor - elbow
    inwards = -(2.0**2) * (lever - joint_axis * (joint_axis @ lever))
    force_g = place[:3, :3].T @ inwards / G  # turns along with the body: the same in its axes all the time
    rate = place[:3, :3].T @ (2.0 * joint_axis)
    assert items(one, "counts")[-1] * COUNT == pytest.approx(rate + np.array(PER_G) @ force_g, abs=COUNT)


def test_a_scale_that_grows_with_the_rate() -> None:
    one = laboratory({"nonlinearity_odd_per_rad_s": 0.01, "nonlinearity_even_per_rad_s": 0.002})
    for speed in (-3.0, 1.0, 3.0):
        turning(one, 5, speed)
        expected = speed * (1 + 0.01 * abs(speed) + 0.002 * speed)
        assert rates(one, 50)[-1, 2] == pytest.approx(expected, abs=COUNT)


def test_a_part_warms_up_and_its_thermometer_shows_it() -> None:
    """LSM9DS1: 16 counts per degree from 25 °C."""
    one = laboratory(
        {
            "temperature_c": 40,
            "start_temperature_c": 20,
            "warm_up_s": 10,
            "bias_rad_s": [0.01, 0.02, 0.03],
            "bias_rad_s_per_k": [1e-3, 2e-3, 3e-3],
        }
    )
    for _ in range(4):
        reading = rates(one, 400)[-1]
        seen_c = 25 + items(one, "temperature_counts")[-1] / 16
        expected_c = 40 - 20 * math.exp(-one.laboratory.robot.time_s / 10)
        assert seen_c == pytest.approx(expected_c, abs=0.3)
        bias = np.array([0.01, 0.02, 0.03]) + np.array([1e-3, 2e-3, 3e-3]) * (seen_c - 40)
        assert reading == pytest.approx(-bias, abs=3e-3 / 16 + COUNT)


def test_a_bias_walks_as_its_truth_alone_states() -> None:
    """The emulated sensor's readings are those of `SensorTruth`, which needs neither board nor arm."""
    walk = {"bias_random_walk_rad_s_per_sqrt_s": 0.02, "bias_instability_rad_s": 0.005, "scale": [1, 1, 1]}
    one = laboratory({**walk, "bias_rad_s": [0.01, 0.0, 0.0]}, seed=5)
    simulated = SimulatedSensorSection.model_validate({**walk, "bias_rad_s": [0.01, 0, 0], "noise_rad_s": 0})
    sensor = SensorSection.model_validate({"part": "lsm9ds1", "serial_number": "A"})
    still = BodyMotion((0.0,) * 3, (0.0,) * 3, (0.0,) * 3)
    seen = rates(one, 1000)
    times_s = 0.137 + items(one, "time_us") * 1e-6 / (CRYSTAL * 1.000012)  # boot_time_s, crystal_ppm of demo.yaml
    alone = SensorTruth(sensor, simulated).readings(times_s, still, np.random.SeedSequence([5, 0]))
    assert np.abs(seen - alone).max() < 1.5e-3  # the time stamps are late by the interrupt's delay
    assert np.ptp(alone, axis=0).min() > 0.01


def test_a_filter_and_a_delay_make_readings_late() -> None:
    """On a ramp of 5 rad/s² a reading is short by 5 rad/s² times (delay + 1/(2π bandwidth))."""
    ramps = []
    for late in (dict[str, object](), {"delay_ms": 20, "bandwidth_hz": 10}):
        one = laboratory(late)
        one.laboratory.robot.motion.speed((0.0, 0.0, 0.0, 0.0, 0.0, 3.0), 5.0)
        one.ticks(100)
        ramps.append(rates(one, 100)[:40, 2])
    assert np.mean(ramps[0] - ramps[1]) == pytest.approx(5 * (0.020 + 1 / (2 * math.pi * 10)), rel=0.01)


# -- the arm -------------------------------------------------------------------------------------------------------
KNOWN = {
    "delta_theta_rad": [1e-3, -2e-3, 3e-3, 1e-3, -1e-3, 2e-3],
    "delta_a_mm": [1, -2, 3, 0.5, 0, 1],
    "delta_d_mm": [-1, 10, -10, 0.5, 0.2, 0.1],
    "delta_alpha_rad": [1e-3, -1e-3, 2e-3, -8e-4, 4e-4, 0],
}
EXTRA = {
    "theta": KNOWN["delta_theta_rad"],
    "a": [1e-3 * length for length in KNOWN["delta_a_mm"]],
    "d": [1e-3 * length for length in KNOWN["delta_d_mm"]],
    "alpha": KNOWN["delta_alpha_rad"],
}


def test_the_controller_reports_the_calibration_of_its_arm() -> None:
    """KinematicsInfo (sub-package 5 of the primary port), and the pose that RTDE tells."""
    one = laboratory(arm={"calibration": KNOWN, "unmodelled": {"twist_rad": [0, 0, 0, 0.01, 0.01, 0]}})
    package = PrimarySession(one.laboratory.robot).greeting()
    at = package.index(struct.pack(">iB", 5 + 6 * 4 + 24 * 8 + 4, 5))
    theta, a, d, alpha = np.array(struct.unpack_from(">24d", package, at + 5 + 24)).reshape(4, 6)
    assert theta == pytest.approx(EXTRA["theta"])
    assert a == pytest.approx(np.array(A_M) + EXTRA["a"])
    assert d == pytest.approx(np.array(D_M) + EXTRA["d"])
    assert alpha == pytest.approx(np.array(ALPHA) + EXTRA["alpha"])
    assert struct.unpack_from(">I", package, at + 5 + 24 + 24 * 8) == (2,)  # a calibrated arm
    stand(one, TILTED)
    (pose,) = states(one, 1, "actual_TCP_pose")
    place = chain(TILTED, EXTRA)  # without the residue, which it does not know
    assert pose[:3] == pytest.approx(place[:3, 3], abs=1e-9)
    assert Rotation.from_rotvec(pose[3:]).as_matrix() == pytest.approx(place[:3, :3], abs=1e-9)


def test_a_straight_move_ends_where_the_calibrated_arm_is_meant_to_be() -> None:
    """The controller's own kinematics are those it reports."""
    one = laboratory(arm={"calibration": KNOWN})
    goal = chain((*HOME[:5], 0.2), EXTRA)
    pose = [*goal[:3, 3], *Rotation.from_matrix(goal[:3, :3]).as_rotvec()]
    session = PrimarySession(one.laboratory.robot)
    session.receive(f"movej(p[{','.join(map(str, pose))}], a=8, v=2)\n".encode())
    one.ticks(600)
    (seen,) = states(one, 1, "actual_q")
    assert seen == pytest.approx((*HOME[:5], 0.2), abs=1e-6)


TOOL_DEG = [20.0, -30.0, 50.0]


def test_a_turned_tool_frame_shows_in_every_pose() -> None:
    """RTDE and the primary interface tell the tool's frame, which is the flange's turned by the offset."""
    one = laboratory(arm={"tcp_rotation_deg": TOOL_DEG})
    stand(one, TILTED)
    turn, flange = Rotation.from_rotvec(TOOL_DEG, degrees=True), chain(TILTED)
    package = PrimarySession(one.laboratory.robot).greeting()
    primary = struct.unpack_from(">12d", package, package.index(struct.pack(">iB", 5 + 12 * 8, 4)) + 5)
    told = states(one, 1, "actual_TCP_pose", "target_TCP_pose", "tcp_offset")[0]
    for pose in (told[:6], told[6:12], primary[:6]):
        assert pose[:3] == pytest.approx(flange[:3, 3], abs=1e-4)
        assert Rotation.from_rotvec(pose[3:]).as_matrix() == pytest.approx(flange[:3, :3] @ turn.as_matrix(), abs=1e-4)
    for offset in (told[12:], primary[6:]):
        assert offset == pytest.approx([0, 0, 0, *np.radians(TOOL_DEG)])


@pytest.mark.one_in(2)
@pytest.mark.parametrize("move", ["movej", "movel"])
def test_a_pose_that_is_asked_for_is_the_tools(move: str) -> None:
    one = laboratory(arm={"tcp_rotation_deg": TOOL_DEG})
    stand(one, TILTED)
    goal = (*TILTED[:5], TILTED[5] + 0.2)
    turned = Rotation.from_matrix(chain(goal)[:3, :3]) * Rotation.from_rotvec(TOOL_DEG, degrees=True)
    pose = [*chain(goal)[:3, 3], *turned.as_rotvec()]
    PrimarySession(one.laboratory.robot).receive(f"{move}(p[{','.join(map(str, pose))}], a=8, v=2)\n".encode())
    one.ticks(600)
    (seen,) = states(one, 1, "actual_q")
    assert seen == pytest.approx(goal, abs=1e-5)


def test_the_tools_frame_is_the_pendants_to_change() -> None:
    robot = laboratory(arm={"tcp_rotation_deg": TOOL_DEG}).laboratory.robot
    robot.set_tcp(robot.tcp_offset)
    with pytest.raises(ProgramError, match="not simulated"):
        robot.set_tcp((0.0,) * 6)


def test_twists_turn_the_axis_that_the_sensor_feels() -> None:
    """Wrist 2 turns about an axis that lies across wrist 3's: known and unknown parts of its twist add up."""
    one = laboratory(
        arm={
            "calibration": {"delta_alpha_rad": [0, 0, 0, 0, 0.03, 0]},
            "unmodelled": {"twist_rad": [0, 0, 0, 0, 0.02, 0]},
        }
    )
    turning(one, 4, 2.0)
    twist = -math.pi / 2 + 0.05
    assert rates(one, 50)[-1] == pytest.approx([0, 2 * math.sin(twist), 2 * math.cos(twist)], abs=COUNT)


@pytest.mark.thorough
def test_an_encoders_error_shows_once_and_twice_in_a_turn_of_the_rate() -> None:
    one = laboratory(arm={"unmodelled": {"encoder_once_rad": 0.01, "encoder_twice_rad": 0.004}})
    turning(one, 5, 2.0)
    seen = rates(one, round(math.pi * TICKS_PER_SECOND) + 5)[: round(math.pi * 238), 2]
    angle = 2 * math.pi * np.arange(len(seen)) / (math.pi * 238)
    once, twice = (2 * abs(np.mean((seen - 2.0) * np.exp(1j * n * angle))) for n in (1, 2))
    assert once == pytest.approx(2.0 * 0.01, rel=0.02)
    assert twice == pytest.approx(2.0 * 2 * 0.004, rel=0.02)


@pytest.mark.thorough
def test_hysteresis_is_missing_from_a_way_back() -> None:
    """The angle that the sensor's readings add up to, twice forth and once back, each by a radian."""
    one = laboratory(arm={"unmodelled": {"hysteresis_rad": 1e-3}})
    turned = []
    for target in (1.0, 2.0, 3.0, 2.0):
        one.ticks(50)
        one.received.clear()
        one.laboratory.robot.motion.move((*HOME[:5], target), 2.0, 8.0)
        one.ticks(700)
        turned.append(items(one, "counts")[:, 2].sum() * COUNT / 238)
    assert turned[1:] == pytest.approx([1.0, 1.0, -1.0 + 1e-3], abs=1e-4)


def test_a_standing_arm_vibrates_unseen_by_its_encoders() -> None:
    one = laboratory(arm={"vibration_rms_rad_s": 0.01, "vibration_hz": 17})
    seen = rates(one, 1000)
    assert np.sqrt(np.mean(seen**2, axis=0)) == pytest.approx([0.01] * 3, rel=0.05)  # a wrist along each axis
    frequency = np.abs(np.fft.rfft(seen[:, 0])).argmax() * 238 / len(seen)
    assert frequency == pytest.approx(17, abs=0.5)
    assert not np.ptp(states(one, 50, "actual_q"), axis=0).any()


def test_a_vibration_that_encoders_see_is_in_their_angles_and_speeds_as_sensors_feel_it() -> None:
    one = laboratory(arm={"vibration_measured_rms_rad_s": 0.01, "vibration_measured_hz": 17})
    felt = rates(one, 1000)
    assert np.sqrt(np.mean(felt**2, axis=0)) == pytest.approx([0.01] * 3, rel=0.05)
    *seen, time_s = np.transpose(states(one, 500, "actual_q", "actual_qd", "timestamp"))
    angles, speeds = seen[3:6], seen[9:]
    assert not np.ptp(seen[:3], axis=1).any()
    turn = 2 * math.pi * 17
    columns = np.column_stack([np.cos(turn * time_s), np.sin(turn * time_s), np.ones(len(time_s))])
    for angle, speed in zip(angles, speeds, strict=True):
        (c, s, _), (by_c, by_s, mean) = (np.linalg.lstsq(columns, each, rcond=None)[0] for each in (angle, speed))
        assert math.hypot(by_c, by_s) == pytest.approx(math.sqrt(2) * 0.01, rel=1e-6)
        assert (by_c, by_s, mean) == pytest.approx((turn * s, -turn * c, 0), abs=1e-8)


def test_a_vibration_that_encoders_see_is_felt_when_they_see_it() -> None:
    """Standing and turning."""
    one = laboratory(arm={"vibration_measured_rms_rad_s": 0.05, "vibration_measured_hz": 11})
    robot, arm = one.laboratory.robot, one.laboratory.on_arm.arm
    for speed_rad_s in (0.0, 1.0):
        turning(one, 5, speed_rad_s)
        for _ in range(50):
            one.ticks(1)
            q_rad, qd_rad_s, _ = robot.motion.actual
            rate, _, _ = arm.motion_at(arm.true_time_s(robot.time_s))
            assert rate == pytest.approx(flange_rate(q_rad, qd_rad_s), abs=1e-9)
            assert robot.motion.actual_q_rad == q_rad


def test_a_stopped_arm_swings_out() -> None:
    one = laboratory(arm={"settling_rad": 1e-3, "settling_hz": 12, "settling_decay_s": 0.3})
    motion = one.laboratory.robot.motion
    motion.move((*HOME[:5], 1.0), 2.0, 8.0)
    one.ticks(1)
    while not motion.standing:
        one.ticks(1)
    seen = rates(one, 300)[:, 2]
    turn, peak = 2 * math.pi * 12, np.abs(seen)
    assert peak.max() == pytest.approx(1e-3 * turn * math.exp(-0.1 / 0.3), rel=0.1)  # `rates` begins 0.1 s later
    assert peak[int(0.3 * 238) :].max() == pytest.approx(peak[: int(0.1 * 238)].max() * math.exp(-1), rel=0.1)


@pytest.mark.thorough
def test_the_controllers_clock_is_fast_and_the_arm_with_it() -> None:
    """What it calls 3 rad/s is more by everybody else's seconds."""
    one = laboratory(arm={"clock_ppm": 1000})
    turning(one, 5, 3.0)
    assert rates(one, 1000)[:, 2].mean() == pytest.approx(3.0 * 1.001, abs=COUNT / 2)
    time_s, *_, speed = np.transpose(states(one, 10, "timestamp", "actual_qd")[:, [6, 5]]).tolist()
    assert speed == pytest.approx([3.0] * 10)
    assert np.diff(time_s) == pytest.approx([TICK_S] * 9, abs=1e-12)


def test_its_time_passes_faster_on_the_wall_too() -> None:
    now_s = 0.0
    clock = WorldClock(1.0, lambda: now_s, laboratory(arm={"clock_ppm": 1000}).laboratory.tick_s)
    while now_s < 20.0:
        if (wait_s := clock.wait_s()) <= 0.0:
            clock.count()
        now_s += max(wait_s, 1e-6)
    assert clock.time_s / now_s == pytest.approx(1.001, abs=2e-4)


def test_states_are_not_of_the_instant_they_are_stamped_with() -> None:
    one = laboratory(arm={"state_jitter_s": 2e-4})
    turning(one, 5, 1.0)
    seen = states(one, 1500, "timestamp", "actual_q")
    time_s, angle = seen[:, 6], seen[:, 5]
    slope, start = np.polyfit(time_s, angle, 1)
    assert slope == pytest.approx(1.0, abs=1e-4)
    assert np.std(angle - start - slope * time_s) == pytest.approx(2e-4, rel=0.1)


# -- nothing -------------------------------------------------------------------------------------------------------
@pytest.mark.thorough
def test_left_out_or_written_as_its_default_an_imperfection_is_none() -> None:
    """To the byte, at both ends of the wire."""
    demo = ideal_document(DEMO)["world"]
    written = WorldSection.model_validate(demo).model_dump(mode="json", exclude_none=True)
    said = []
    for section in (demo, written):
        loaded = load(DEMO, [f"world={json.dumps(section)}"])
        assert read_world_section(loaded).arm.unmodelled.encoder_once_rad == 0.0
        one = host(loaded)
        one.laboratory.robot.motion.move(TILTED, 1.0, 4.0)
        said.append((states(one, 500, "actual_q", "actual_TCP_pose").tobytes(), bytes(one.received)))
    assert said[0] == said[1]
