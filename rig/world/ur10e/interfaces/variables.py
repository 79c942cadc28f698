"""RTDE's variables: names, types, sources of outputs, destinations of inputs."""

from collections.abc import Callable, Sequence
from typing import Any

from rig.world.ur10e.modes import RobotMode
from rig.world.ur10e.motion.moments import Load, find_load
from rig.world.ur10e.motion.tcp_motion import GRAVITY, find_elbow
from rig.world.ur10e.robot import Robot

Get = Callable[[Robot], Any]
Put = Callable[[Robot, Any], None]

# RTDE type → (struct format, number of values)
TYPES = {
    "BOOL": ("?", 1), "UINT8": ("B", 1), "UINT32": ("I", 1), "UINT64": ("Q", 1), "INT32": ("i", 1), "DOUBLE": ("d", 1),
    "VECTOR3D": ("3d", 3), "VECTOR6D": ("6d", 6), "VECTOR6INT32": ("6i", 6), "VECTOR6UINT32": ("6I", 6),
}  # fmt: skip

JOINT_MODE_OFF = 239
JOINT_MODES = {RobotMode.RUNNING: 253, RobotMode.IDLE: 255}
CONFIGURABLE_MASK = 0xFF00  # the configurable digital inputs and outputs

# The first versions of controllers with these outputs (RTDE guide, "introduced in version").
MIN_VERSIONS: dict[str, tuple[int, int]] = {
    "collision_detection_ratio": (5, 15),
    "time_scale_source": (5, 17),
    "actual_robot_energy_consumed": (5, 23),
    "actual_robot_braking_energy_dissipated": (5, 23),
}


def find_output_type(robot: Robot, name: str) -> str:
    """Return the RTDE type of an output; "NOT_FOUND" if this version of the controller does not have it."""
    is_known = name in OUTPUTS and robot.identity.polyscope[:2] >= MIN_VERSIONS.get(name, (0, 0))
    return OUTPUTS[name][0] if is_known else "NOT_FOUND"


def _constant(value: Any) -> Get:
    return lambda robot: value


def _bits(registers: Sequence[bool], first: int) -> int:
    return sum(1 << i for i in range(32) if registers[first + i])


def joint_modes(robot: Robot) -> tuple[int, ...]:
    return (JOINT_MODES.get(robot.robot_mode, JOINT_MODE_OFF),) * 6


def _supply_v(robot: Robot) -> float:
    return 48.0 if robot.robot_mode >= RobotMode.POWER_ON else 0.0


def _actual_load(robot: Robot) -> Load:
    motion = robot.motion
    joints = motion.q_rad, motion.qd_rad_s, motion.qdd_rad_s2
    return find_load(joints, robot.payload_kg, robot.payload_centre_m, robot.links, robot.model.bodies)


def _target_load(robot: Robot) -> Load:
    now = robot.motion.now
    joints = now.target_q_rad, now.target_qd_rad_s, now.target_qdd_rad_s2
    return find_load(joints, robot.payload_kg, robot.payload_centre_m, robot.links, robot.model.bodies)


def _moments(load_of: Callable[[Robot], Load]) -> Get:
    """Return a getter of the joints' moments, which are zero without power because the brakes bear the load."""
    return lambda robot: load_of(robot).moments_nm if robot.robot_mode == RobotMode.RUNNING else ZERO6


ZERO6 = (0.0,) * 6

OUTPUTS: dict[str, tuple[str, Get]] = {
    "timestamp": ("DOUBLE", lambda r: r.reported_time_s),
    "target_q": ("VECTOR6D", lambda r: r.motion.now.target_q_rad),
    "target_qd": ("VECTOR6D", lambda r: r.motion.now.target_qd_rad_s),
    "target_qdd": ("VECTOR6D", lambda r: r.motion.now.target_qdd_rad_s2),
    "actual_q": ("VECTOR6D", lambda r: r.faults.report_angles(r.motion.actual_q_rad)),
    "actual_qd": ("VECTOR6D", lambda r: r.motion.actual_qd_rad_s),
    "actual_TCP_pose": ("VECTOR6D", lambda r: r.tcp_pose(r.motion.actual_q_rad)),
    "actual_TCP_speed": ("VECTOR6D", lambda r: r.tcp_motion.speed),
    "actual_TCP_acceleration": ("VECTOR6D", lambda r: r.tcp_motion.acceleration),
    "actual_tool_accelerometer": ("VECTOR3D", lambda r: r.tcp_motion.accelerometer),
    "target_TCP_pose": ("VECTOR6D", lambda r: r.tcp_pose(r.motion.now.target_q_rad)),
    "target_TCP_speed": ("VECTOR6D", lambda r: r.target_tcp_motion.speed),
    "target_TCP_acceleration": ("VECTOR6D", lambda r: r.target_tcp_motion.acceleration),
    "elbow_position": ("VECTOR3D", lambda r: find_elbow(r.motion.q_rad, r.motion.qd_rad_s, r.links)[0]),
    "elbow_velocity": ("VECTOR3D", lambda r: find_elbow(r.motion.q_rad, r.motion.qd_rad_s, r.links)[1]),
    "target_moment": ("VECTOR6D", _moments(_target_load)),
    "actual_current_as_torque": ("VECTOR6D", _moments(_actual_load)),
    "actual_momentum": ("DOUBLE", lambda r: _actual_load(r).momentum_kg_m_s),
    "ft_raw_wrench": ("VECTOR6D", lambda r: _actual_load(r).wrench),
    "tcp_offset": ("VECTOR6D", lambda r: r.tcp_offset),
    "robot_mode": ("INT32", lambda r: r.robot_mode),
    "joint_mode": ("VECTOR6INT32", joint_modes),
    "safety_mode": ("INT32", lambda r: r.safety_mode),
    "safety_status": ("INT32", lambda r: r.safety_mode),
    "robot_status_bits": ("UINT32", lambda r: r.robot_status_bits),
    "safety_status_bits": ("UINT32", lambda r: r.safety_status_bits),
    "runtime_state": ("UINT32", lambda r: r.runtime_state),
    "speed_scaling": ("DOUBLE", lambda r: r.speed_scaling),
    "target_speed_fraction": ("DOUBLE", lambda r: r.speed_slider),
    "actual_digital_output_bits": ("UINT64", lambda r: r.digital_outputs),
    "actual_configurable_digital_output_bits": ("UINT64", lambda r: r.digital_outputs & CONFIGURABLE_MASK),
    "actual_joint_voltage": ("VECTOR6D", lambda r: (_supply_v(r),) * 6),
    "actual_robot_voltage": ("DOUBLE", _supply_v),
    "standard_analog_output0": ("DOUBLE", lambda r: r.analog_outputs[0]),
    "standard_analog_output1": ("DOUBLE", lambda r: r.analog_outputs[1]),
    "payload": ("DOUBLE", lambda r: r.payload_kg),
    "payload_cog": ("VECTOR3D", lambda r: r.payload_centre_m),
    "output_bit_registers0_to_31": ("UINT32", lambda r: _bits(r.outputs.bits, 0)),
    "output_bit_registers32_to_63": ("UINT32", lambda r: _bits(r.outputs.bits, 32)),
    "input_bit_registers0_to_31": ("UINT32", lambda r: _bits(r.inputs.bits, 0)),
    "input_bit_registers32_to_63": ("UINT32", lambda r: _bits(r.inputs.bits, 32)),
}

# Quantities without simulated physics: constant, and plausible for an idle controller.
_CONSTANTS: dict[tuple[str, Any], str] = {
    ("VECTOR6D", ZERO6): """target_current actual_current actual_current_window joint_control_output actual_TCP_force
        wrench_calc_from_currents payload_inertia""",
    ("VECTOR6D", (28.0,) * 6): "joint_temperatures",
    ("VECTOR3D", GRAVITY): "target_gravity",
    ("DOUBLE", 0.0): """standard_analog_input0 standard_analog_input1 io_current tcp_force_scalar
        collision_detection_ratio joint_position_deviation_ratio tool_analog_input0 tool_analog_input1
        tool_output_current euromap67_24V_voltage euromap67_24V_current actual_robot_energy_consumed
        actual_robot_braking_energy_dissipated""",
    ("DOUBLE", 1.0): "target_execution_time",
    ("DOUBLE", 0.3): "actual_execution_time actual_robot_current",
    ("DOUBLE", 28.0): "tool_temperature",
    ("DOUBLE", 48.0): "actual_main_voltage",
    ("UINT64", 0): "actual_digital_input_bits actual_configurable_digital_input_bits",
    ("UINT32", 0): """analog_io_types tool_analog_input_types euromap67_input_bits euromap67_output_bits
        script_control_line""",
    ("UINT32", 255): "tool_mode",
    ("UINT8", 0): "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode",
    ("INT32", 0): "encoder0_raw encoder1_raw time_scale_source tool_output_voltage",
}
OUTPUTS |= {name: (kind, _constant(value)) for (kind, value), names in _CONSTANTS.items() for name in names.split()}

# General purpose registers, each a variable of its own: name in RTDE, type, name in `Registers`, which of them.
_REGISTERS = (
    ("int", "INT32", "ints", range(48)),
    ("double", "DOUBLE", "doubles", range(48)),
    ("bit", "BOOL", "bits", range(64, 128)),
)


def _register(side: str, kind: str, index: int) -> Get:
    return lambda robot: getattr(getattr(robot, side), kind)[index]


OUTPUTS |= {
    f"{side}_{name}_register_{i}": (rtde_type, _register(f"{side}s", kind, i))
    for side in ("input", "output")
    for name, rtde_type, kind, numbers in _REGISTERS
    for i in numbers
}


# -- inputs ------------------------------------------------------------------------------------------------------
def _put_register(kind: str, index: int) -> Put:
    def put(robot: Robot, value: Any) -> None:
        getattr(robot.inputs, kind)[index] = value

    return put


def _put_bits(first: int) -> Put:
    def put(robot: Robot, value: int) -> None:
        robot.inputs.bits[first : first + 32] = [bool(value >> i & 1) for i in range(32)]

    return put


def _ignore(robot: Robot, value: Any) -> None:
    """Ignore an input: a mask, because `apply_masked` reads it, or a force, because it is not simulated."""


INPUTS: dict[str, tuple[str, Put]] = {
    "speed_slider_mask": ("UINT32", _ignore), "speed_slider_fraction": ("DOUBLE", _ignore),
    "standard_digital_output_mask": ("UINT8", _ignore), "standard_digital_output": ("UINT8", _ignore),
    "configurable_digital_output_mask": ("UINT8", _ignore), "configurable_digital_output": ("UINT8", _ignore),
    "tool_digital_output_mask": ("UINT8", _ignore), "tool_digital_output": ("UINT8", _ignore),
    "standard_analog_output_mask": ("UINT8", _ignore), "standard_analog_output_type": ("UINT8", _ignore),
    "standard_analog_output_0": ("DOUBLE", _ignore), "standard_analog_output_1": ("DOUBLE", _ignore),
    "external_force_torque": ("VECTOR6D", _ignore),
    "input_bit_registers0_to_31": ("UINT32", _put_bits(0)), "input_bit_registers32_to_63": ("UINT32", _put_bits(32)),
}  # fmt: skip
INPUTS |= {
    f"input_{name}_register_{i}": (rtde_type, _put_register(kind, i))
    for name, rtde_type, kind, numbers in _REGISTERS
    for i in numbers
}

DIGITAL_OUTPUTS = (("standard", 0), ("configurable", 8), ("tool", 16))  # kind, first bit of actual_digital_output_bits


def apply_masked(robot: Robot, values: dict[str, Any]) -> None:
    """Apply the inputs that act only if their mask is set."""
    if values.get("speed_slider_mask"):
        robot.set_speed_slider(values.get("speed_slider_fraction", robot.speed_slider))
    for kind, first in DIGITAL_OUTPUTS:
        mask = values.get(f"{kind}_digital_output_mask", 0) << first
        if mask:
            bits = values.get(f"{kind}_digital_output", 0) << first
            robot.digital_outputs = robot.digital_outputs & ~mask | bits & mask
    for index in range(2):
        if values.get("standard_analog_output_mask", 0) >> index & 1:
            robot.analog_outputs[index] = values.get(f"standard_analog_output_{index}", 0.0)
