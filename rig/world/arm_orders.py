"""The control channel's orders for the simulated arm, with which tests make its controller misbehave."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

from rig.world.laboratory import Laboratory
from rig.world.ur10e.interfaces import dashboard_server, script_socket
from rig.world.ur10e.modes import RobotMode, SafetyMode
from rig.world.ur10e.robot import Robot

FIELDBUS = "fieldbus"  # the owner of registers that `register_in_use` claims
Reply = dict[str, Any]


class ArmWorld(Protocol):
    """The parts of a world on which an arm's orders act."""

    @property
    def laboratory(self) -> Laboratory: ...
    def close_arm(self, *, listen: bool) -> None: ...
    def close_arm_port(self, port: int) -> None: ...
    def silence_arm(self, duration_s: float) -> None: ...
    def set_remote_control(self, on: bool) -> None: ...


def build_arm_orders(world: ArmWorld) -> Mapping[str, Callable[..., Reply | None]]:
    """Return the orders to the simulated arm by name, as functions of their JSON arguments."""
    robot = world.laboratory.robot

    def claim(first: int, last: int) -> None:
        for number in range(int(first), int(last) + 1):
            robot.claims[f"input_int_register_{number}"] = FIELDBUS
            robot.claims[f"input_double_register_{number}"] = FIELDBUS

    def step_clock(seconds: float) -> None:
        robot.faults.clock_step_s += float(seconds)

    def encoder(joint: int, error_rad: float) -> None:
        robot.faults.encoder_error_rad[int(joint)] = float(error_rad)

    return {
        "protective_stop": robot.protective_stop,
        "emergency_stop": robot.emergency_stop,
        "safeguard_stop": robot.safeguard_stop,
        "release": robot.release,
        "unlock": lambda: _unlock(robot),
        "power_off": robot.power_off,
        "power_on": robot.power_on,
        "brake_release": robot.brake_release,
        "robot_mode": lambda name: robot.lose_operation(RobotMode[name]),
        "pause": lambda: {"done": robot.pause()},
        "play": lambda: {"done": robot.resume()},
        "stop_program": lambda: robot.stop_program("stopped on the pendant"),
        "speed_slider": robot.set_speed_slider,
        "safety_limit": lambda fraction: robot.set_safety_limit(float(fraction)),
        "payload": lambda mass_kg: robot.set_payload(float(mass_kg), robot.payload_centre_m),
        "payload_stays": lambda on: setattr(robot.faults, "payload_stays", bool(on)),
        "step_clock": step_clock,
        "encoder": encoder,
        "remote_control": lambda on: world.set_remote_control(bool(on)),
        "register_in_use": lambda name="input_int_register_0": robot.claims.update({name: FIELDBUS}),
        "register_free": lambda name="input_int_register_0": _drop(robot, name),
        "registers_in_use": claim,
        "registers_free": lambda: _free(robot),
        "close_arm": lambda listen=True: world.close_arm(listen=bool(listen)),
        "close_dashboard": lambda: world.close_arm_port(dashboard_server.PORT),
        "close_primary": lambda: world.close_arm_port(script_socket.PRIMARY_PORT),
        "silence_arm": lambda duration_s: world.silence_arm(float(duration_s)),
    }


def robot_state(robot: Robot) -> Reply:
    """Return the controller's state as the control channel reports it."""
    return {
        "q_rad": robot.motion.q_rad,
        "qd_rad_s": robot.motion.qd_rad_s,
        "moving": robot.motion.moving,
        "still_since_s": robot.still_since_s,
        "program_running": robot.robot_status_bits >> 1 & 1 == 1,
        "program": robot.program_name,
        "runtime_state": robot.runtime_state.name,
        "robot_mode": robot.robot_mode.name,
        "safety_mode": robot.safety_mode.name,
        "speed_slider": robot.speed_slider,
        "speed_scaling": robot.motion.fraction,
        "remote_control": robot.remote_control,
        "payload_kg": robot.payload_kg,
        "payload_centre_m": robot.payload_centre_m,
        "claims": sorted(robot.claims),
        "messages": [message.text for message in robot.messages.after(0)],
    }


def _unlock(robot: Robot) -> None:
    """Unlock a protective stop on the pendant. Raise ValueError if the controller does not permit it yet."""
    if robot.safety_mode == SafetyMode.PROTECTIVE_STOP and robot.stopped_for_s < dashboard_server.UNLOCK_AFTER_S:
        raise ValueError(dashboard_server.UNLOCK_REFUSAL)
    robot.unlock_protective_stop()


def _free(robot: Robot) -> None:
    """Release the registers that a fieldbus has claimed, but not those that the rig has claimed."""
    for name in [name for name, owner in robot.claims.items() if owner is FIELDBUS]:
        del robot.claims[name]


def _drop(robot: Robot, name: str) -> None:
    robot.claims.pop(name, None)
