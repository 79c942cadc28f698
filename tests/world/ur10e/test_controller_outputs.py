"""What the simulated controller tells over RTDE are an arm's outputs: names, types, and values that fit one another."""

import math
import struct

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rig.world.clock import TICK_S
from rig.world.laboratory import Laboratory
from rig.world.ur10e.interfaces.primary_server import PrimarySession
from rig.world.ur10e.interfaces.rtde import OutputRecipe, RtdeSession, build_package
from rig.world.ur10e.interfaces.variables import OUTPUTS, TYPES
from rig.world.world_section import read_world_section
from support.laboratories.ideal import ideal
from support.paths import DEMO

HOME = (0.0, -math.pi / 2, math.pi / 2, -math.pi / 2, -math.pi / 2, 0.0)
TILTED = (0.4, -1.4, 1.5, -1.1, -1.9, 0.7)

# RTDE guide of the maker, robot controller outputs, without the general purpose registers; types as in the table of the
# maker's C++ client library (tests/fake_rtde_server.cpp).
GUIDE = {
    "DOUBLE": """
        actual_execution_time actual_main_voltage actual_momentum
        actual_robot_braking_energy_dissipated actual_robot_current actual_robot_energy_consumed
        actual_robot_voltage collision_detection_ratio euromap67_24V_current euromap67_24V_voltage
        io_current joint_position_deviation_ratio payload speed_scaling standard_analog_input0
        standard_analog_input1 standard_analog_output0 standard_analog_output1 target_execution_time
        target_speed_fraction tcp_force_scalar timestamp tool_analog_input0 tool_analog_input1
        tool_output_current tool_temperature
    """,
    "INT32": """
        encoder0_raw encoder1_raw robot_mode safety_mode safety_status time_scale_source
        tool_output_voltage
    """,
    "UINT32": """
        analog_io_types euromap67_input_bits euromap67_output_bits input_bit_registers0_to_31
        input_bit_registers32_to_63 output_bit_registers0_to_31 output_bit_registers32_to_63
        robot_status_bits runtime_state safety_status_bits script_control_line
        tool_analog_input_types tool_mode
    """,
    "UINT64": """
        actual_configurable_digital_input_bits actual_configurable_digital_output_bits
        actual_digital_input_bits actual_digital_output_bits
    """,
    "UINT8": """
        tool_digital_output0_mode tool_digital_output1_mode tool_output_mode
    """,
    "VECTOR3D": """
        actual_tool_accelerometer elbow_position elbow_velocity payload_cog target_gravity
    """,
    "VECTOR6D": """
        actual_TCP_acceleration actual_TCP_force actual_TCP_pose actual_TCP_speed actual_current
        actual_current_as_torque actual_current_window actual_joint_voltage actual_q actual_qd
        ft_raw_wrench joint_control_output joint_temperatures payload_inertia
        target_TCP_acceleration target_TCP_pose target_TCP_speed target_current target_moment
        target_q target_qd target_qdd tcp_offset wrench_calc_from_currents
    """,
    "VECTOR6INT32": """
        joint_mode
    """,
}


def laboratory(*overrides: str) -> Laboratory:
    loaded = ideal(DEMO, overrides)
    new = Laboratory(loaded.config, read_world_section(loaded))
    new.unplug()
    return new


def ticks(one: Laboratory, count: int) -> None:
    for _ in range(count):
        one.step()


def value(one: Laboratory, name: str) -> np.ndarray:
    """One output, as a client reads it."""
    kind = OUTPUTS[name][0]
    data = OutputRecipe([name], 500.0, 1).pack(one.robot)
    return np.array(struct.unpack(f">{TYPES[kind][0]}", data[4:]))


def rotation(one: Laboratory) -> Rotation:
    return Rotation.from_rotvec(value(one, "actual_TCP_pose")[3:])


def asked(one: Laboratory, names: str) -> bytes:
    """The controller's answer to an output recipe in version 2 of the protocol."""
    session = RtdeSession(one.robot)
    session.receive(build_package("V", struct.pack(">H", 2)))
    return session.receive(build_package("O", struct.pack(">d", 125.0) + names.encode()))


def test_names_and_types_are_the_guides() -> None:
    registers = {name for name in OUTPUTS if name.rpartition("_")[2].isdigit() and "_register_" in name}
    expected = {name: kind for kind, names in GUIDE.items() for name in names.split()}
    assert {name: kind for name, (kind, _) in OUTPUTS.items() if name not in registers} == expected
    assert len(registers) == 2 * (48 + 48 + 64)


def test_configurable_outputs_are_the_second_eight_bits() -> None:
    one = laboratory()
    one.robot.digital_outputs = 0x3A5C3
    assert value(one, "actual_configurable_digital_output_bits")[0] == 0xA500


@pytest.mark.parametrize(("polyscope", "known"), [("5.14.0.0", False), ("5.23.0.0", True)])
def test_a_controller_does_not_know_the_outputs_of_later_ones(polyscope: str, known: bool) -> None:
    one = laboratory(f"world.arm.polyscope={polyscope}")
    for name in ("actual_robot_energy_consumed", "collision_detection_ratio", "time_scale_source"):
        answer = asked(one, f"timestamp,{name}")
        assert (b"NOT_FOUND" in answer) is not known
        assert answer[3] == known  # the recipe's number, 0 for none


def test_a_recipe_as_long_as_the_makers_test_program_sends_is_taken() -> None:
    """It asks for 9.2 kB of names at once."""
    one = laboratory()
    names = ["timestamp", *["actual_q"] * 1020]
    answer = asked(one, ",".join(names))
    assert len(",".join(names)) > 9_000 and answer[3] == 1 and answer[4:].count(b"VECTOR6D") == 1020
    assert len(OutputRecipe(names, 500.0, 1).pack(one.robot)) == 3 + 1 + 8 + 1020 * 48


def test_values_that_no_package_has_room_for_are_refused() -> None:
    answer = asked(laboratory(), ",".join(["actual_q"] * 1400))
    assert b"a recipe of 67200 bytes of values" in answer and answer.endswith(build_package("O", b"\0"))


def test_slider_and_scaling_multiply_to_what_the_joints_do() -> None:
    one = laboratory("world.arm.speed_slider=0.4")
    assert value(one, "speed_scaling")[0] == 0.0  # no program runs
    PrimarySession(one.robot).receive(b"def wait():\n  sleep(60)\nend\n")
    ticks(one, 1)
    one.robot.motion.move((*HOME[:5], 2.0), 1.0, 4.0)
    ticks(one, 500)
    assert value(one, "target_speed_fraction")[0] == 0.4 and value(one, "speed_scaling")[0] == 1.0
    assert value(one, "target_qd")[5] == pytest.approx(0.4)
    primary = PrimarySession(one.robot).greeting()
    at = primary.index(struct.pack(">iB", 5 + 8 + 7 + 2 + 24 + 1, 0)) + 5 + 8 + 7 + 2
    assert struct.unpack_from(">2d", primary, at) == (0.4, 1.0)
    one.robot.motion.fraction_wanted = 0.0  # as a pause does
    ticks(one, 200)
    assert value(one, "speed_scaling")[0] == 0.0


def test_the_accelerometer_of_an_arm_at_rest_shows_gravity_in_the_tools_axes() -> None:
    one = laboratory()
    one.robot.motion.move(TILTED, 2.0, 8.0)
    ticks(one, 2000)
    assert value(one, "actual_tool_accelerometer") == pytest.approx(rotation(one).inv().apply([0, 0, 9.82]), abs=2e-3)
    assert not value(one, "actual_TCP_acceleration").any() and not value(one, "actual_TCP_speed").any()


def test_speeds_and_accelerations_are_the_changes_of_the_poses() -> None:
    """Of the joints as they are, vibration included, and of those asked for, without it."""
    one = laboratory("world.arm.encoder_step_rad=0", "world.arm.encoder_noise_rad=0")
    one.robot.motion.move(TILTED, 1.0, 2.0)
    ticks(one, 60)
    pose: dict[str, list[np.ndarray]] = {"actual": [], "target": []}
    middle: dict[str, np.ndarray] = {}
    for tick in range(3):
        ticks(one, 1)
        for which, poses in pose.items():
            poses.append(value(one, f"{which}_TCP_pose"))
            if tick == 1:
                middle[f"{which} speed"] = value(one, f"{which}_TCP_speed")
                middle[f"{which} acceleration"] = value(one, f"{which}_TCP_acceleration")
    for which, (before, here, after) in pose.items():
        assert middle[f"{which} speed"][:3] == pytest.approx((after - before)[:3] / (2 * TICK_S), abs=2e-4)
        turned = (Rotation.from_rotvec(after[3:]) * Rotation.from_rotvec(before[3:]).inv()).as_rotvec()
        assert middle[f"{which} speed"][3:] == pytest.approx(turned / (2 * TICK_S), abs=2e-3)
        change = (after - 2 * here + before)[:3] / TICK_S**2
        assert middle[f"{which} acceleration"][:3] == pytest.approx(change, abs=0.02)
    assert np.abs(middle["actual speed"] - middle["target speed"]).max() > 1e-3


def test_the_elbow_is_where_the_upper_arm_ends() -> None:
    one = laboratory("world.arm.joints=ideal")
    assert value(one, "elbow_position") == pytest.approx([0, 0, 0.1807 + 0.6127], abs=1e-9)  # the upper arm stands
    one.robot.motion.speed((0.0, 1.0, 0.0, 0.0, 0.0, 0.0), 100.0)
    ticks(one, 10)
    x, y, z = value(one, "elbow_velocity")
    assert math.hypot(x, z) == pytest.approx(0.6127, rel=1e-6) and y == pytest.approx(0.0, abs=1e-9)


def test_an_arm_without_power_says_so() -> None:
    one = laboratory()
    assert value(one, "joint_mode").tolist() == [253] * 6 and value(one, "actual_joint_voltage").all()
    one.robot.power_off()
    assert value(one, "joint_mode").tolist() == [239] * 6
    assert not value(one, "actual_joint_voltage").any() and not value(one, "actual_robot_voltage").any()
    one.robot.power_on()
    ticks(one, 600)
    assert value(one, "joint_mode").tolist() == [255] * 6  # idle, brakes on


DRAWING = [(0, 0.1807, 90), (-0.6127, 0, 0), (-0.57155, 0, 0), (0, 0.17415, 90), (0, 0.11985, -90), (0, 0.11655, 0)]


def link_frames(q_rad: np.ndarray) -> list[np.ndarray]:
    """(4, 4) of the base and of each link, by Denavit and Hartenberg's lengths (m) and twists (°) of the drawing."""
    frames = [np.eye(4)]
    for angle, (a, d, alpha) in zip(q_rad, DRAWING, strict=True):
        turn, twist = np.eye(4), np.eye(4)
        turn[:3, :3], turn[:3, 3] = Rotation.from_euler("z", angle).as_matrix(), (0, 0, d)
        twist[:3, :3], twist[:3, 3] = Rotation.from_euler("x", alpha, degrees=True).as_matrix(), (a, 0, 0)
        frames.append(frames[-1] @ turn @ twist)
    return frames


def potential_energy(q_rad: np.ndarray, payload_kg: float) -> float:
    """J, of the maker's masses and of a payload 5 cm before the flange."""
    frames = link_frames(q_rad)
    own = [(0.021, 0, 0.027), (0.38, 0, 0.158), (0.24, 0, 0.068), (0, 0.007, 0.018), (0, 0.007, 0.018), (0, 0, -0.026)]
    masses = [7.369, 13.051, 3.989, 2.1, 1.98, 0.615]
    heights = [(frames[link + 1] @ [*centre, 1])[2] for link, centre in enumerate(own)]
    return 9.82 * float(np.dot(masses, heights) + payload_kg * (frames[-1] @ [0, 0, 0.05, 1])[2])


def test_at_rest_the_joints_bear_the_slope_of_the_potential_energy() -> None:
    one = laboratory()
    one.robot.set_payload(3.0, (0.0, 0.0, 0.05))
    one.robot.motion.move(TILTED, 2.0, 8.0)
    ticks(one, 2000)
    q, step = value(one, "target_q"), 1e-5 * np.eye(6)
    slope = [(potential_energy(q + each, 3.0) - potential_energy(q - each, 3.0)) / 2e-5 for each in step]
    assert value(one, "target_moment") == pytest.approx(slope, abs=1e-3)
    assert value(one, "actual_current_as_torque") == pytest.approx(slope, abs=1e-2)
    assert 30 < np.abs(slope).max() < 300  # the shoulder
    weight = rotation(one).inv().apply([0, 0, -3 * 9.82])
    assert value(one, "ft_raw_wrench") == pytest.approx([*weight, *np.cross([0, 0, 0.05], weight)], abs=1e-2)
    assert value(one, "actual_momentum")[0] == pytest.approx(0.0, abs=1e-6)
    one.robot.power_off()
    assert not value(one, "target_moment").any()


@pytest.mark.slow
def test_moments_are_those_that_carry_the_masses_along() -> None:
    """Over a move from rest to rest their work is the potential energy that was gained."""
    one = laboratory("world.arm.joints=ideal")
    before = potential_energy(value(one, "target_q"), 0.0)
    one.robot.motion.move(TILTED, 1.0, 2.0)
    work_j, largest = 0.0, 0.0
    while True:
        ticks(one, 1)
        work_j += float(value(one, "target_moment") @ value(one, "target_qd")) * TICK_S
        largest = max(largest, value(one, "actual_momentum")[0])
        if one.robot.motion.standing:
            break
    assert work_j == pytest.approx(potential_energy(value(one, "target_q"), 0.0) - before, abs=0.3)
    assert 1 < largest < 30
