"""Queries and settings of a client of ur_rtde: the commands of its program that move nothing, by number."""

from collections.abc import Callable, Sequence

from rig.world.clock import TICK_S
from rig.world.ur10e.controller_messages import ProgramError
from rig.world.ur10e.motion.cartesian import solve_inverse_kinematics
from rig.world.ur10e.motion.forward_kinematics import compose_poses, flange_pose
from rig.world.ur10e.motion.trajectory import Joints
from rig.world.ur10e.programs.program_threads import check_finite
from rig.world.ur10e.programs.ur_rtde_registers import ProgramRegisters
from rig.world.ur10e.robot import Robot


def build_questions(robot: Robot, registers: ProgramRegisters) -> dict[int, Callable[[], None]]:
    """Return a function for each command that takes no time, by number; a `ProgramError` ends the program."""

    def put(values: Sequence[float]) -> None:
        registers.write_doubles(values)

    def say(yes: bool) -> None:
        registers.write_integer(1, int(yes))

    def read_start() -> Joints:
        return registers.doubles(6, 6)

    def solve_pose(start_rad: Joints) -> Joints:
        """Return the joint angles that bring the tool to the requested pose."""
        pose = registers.doubles(0, 6)
        check_finite([*pose, *start_rad])
        return solve_inverse_kinematics(robot.flange_pose_for(pose), start_rad, robot.links)

    def is_reachable(start_rad: Joints) -> bool:
        try:
            return robot.is_within_limits(solve_pose(start_rad))
        except ProgramError:
            return False

    def set_payload() -> None:
        mass, *centre = registers.doubles(0, 4)
        robot.set_payload(mass, centre if any(centre) else robot.payload_centre_m)

    def forward_kinematics() -> None:
        q, offset = registers.doubles(0, 6), registers.doubles(6, 6)
        put(compose_poses(flange_pose(q, robot.links), offset))

    return {
        8: lambda: None,  # zeroFtSensor: no force acts on the simulated sensor
        17: set_payload,
        26: lambda: put([TICK_S]),
        29: lambda: robot.set_tcp(registers.doubles(0, 6)),
        30: lambda: put(solve_pose(read_start())),
        31: robot.protective_stop,
        35: lambda: robot.set_watchdog(registers.doubles(0, 1)[0]),
        36: lambda: say(is_reachable(robot.motion.q_rad)),
        37: lambda: say(robot.is_within_limits(registers.doubles(0, 6))),
        38: lambda: put([0.0] * 6),
        39: lambda: put(compose_poses(registers.doubles(0, 6), registers.doubles(6, 6))),
        40: lambda: put(robot.tcp_offset),
        43: lambda: put(robot.tcp_pose(robot.motion.actual_q_rad)),
        44: forward_kinematics,
        46: lambda: put(solve_pose(robot.motion.q_rad)),
        47: lambda: say(robot.steady),
        58: lambda: put(flange_pose(robot.motion.actual_q_rad, robot.links)),
        60: lambda: say(is_reachable(robot.motion.q_rad)),
        61: lambda: say(is_reachable(read_start())),
    }


UNSIMULATED_CODES = {
    6: "forceMode", 7: "forceModeStop", 12: "servoC", 18: "teachMode", 19: "endTeachMode", 20: "forceModeSetDamping",
    21: "forceModeSetGainScaling", 25: "toolContact", 27: "getActualJointPositionsHistory", 28: "getTargetWaypoint",
    41: "jogStart", 42: "jogStop", 51: "moveUntilContact", 52: "freedriveMode", 53: "endFreedriveMode",
    54: "getFreedriveStatus", 56: "ftRtdeInputEnable", 57: "enableExternalFtSensor", 59: "setGravity",
    62: "startContactDetection", 63: "stopContactDetection", 64: "readContactDetection", 65: "setTargetPayload",
    66: "directTorque", 67: "getMassMatrix", 68: "getCoriolisAndCentrifugalTorques",
    69: "getTargetJointAccelerations", 70: "getJacobian", 71: "getJacobianTimeDerivative",
}  # fmt: skip
"""The commands that end the simulated program, by the names of the client's methods."""
