"""The simulated controller without its sockets: modes, safety, registers, programs, and the joints."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import isfinite
from typing import Protocol

from rig.world.clock import TICK_S, TICKS_PER_SECOND
from rig.world.ur10e.controller_messages import (
    INVALID_SETPOINT,
    MODE_CHANGED,
    STOPPED_FOR_TEST,
    ErrorReport,
    MessageKind,
    Messages,
    OutOfReach,
    ProgramError,
    ReportLevel,
)
from rig.world.ur10e.faults import ArmFaults
from rig.world.ur10e.modes import SAFETY_BITS, RobotMode, RuntimeState, SafetyMode
from rig.world.ur10e.motion.arm_models import MODELS, ArmModel
from rig.world.ur10e.motion.forward_kinematics import Vector, flange_pose, rotate_pose, rotation_from_vector
from rig.world.ur10e.motion.joint_motion import JointMotion
from rig.world.ur10e.motion.links import NOMINAL, Links
from rig.world.ur10e.motion.tcp_motion import TcpMotion, find_tcp_motion

ROUNDING_RAD = 1e-6  # a target on a joint's limit is within it
PROGRAM_STOP_RAD_S2 = 4.0
PROTECTIVE_STOP_RAD_S2 = 15.0
BRAKE_RAD_S2 = 40.0
START_DELAY_S = 0.02  # time between the last byte of a program and its first line
POWER_STEP_S = 0.5  # duration of powering on, and of releasing the brakes
UNLOCK_S = 0.5  # the maker's clients expect more than a millisecond and less than a second
E_SERIES, POLYSCOPE_X = (5,), (10,)  # the first versions of their software


class Program(Protocol):
    """A program that the controller plays, tick by tick."""

    name: str

    def step(self) -> bool:
        """Play one tick; return False when the program has ended. Raise `ProgramError` for its errors."""
        ...

    @property
    def waiting(self) -> bool:
        """Whether further ticks of the program change nothing until a client writes an input; False if unknown."""
        ...


@dataclass(slots=True)
class RegisterBank:
    """The general-purpose registers of one direction, inputs or outputs."""

    bits: list[bool] = field(default_factory=lambda: [False] * 128)
    ints: list[int] = field(default_factory=lambda: [0] * 48)
    doubles: list[float] = field(default_factory=lambda: [0.0] * 48)


@dataclass(frozen=True, slots=True)
class RobotIdentity:
    """The controller's serial number and software version."""

    serial_number: str
    polyscope: tuple[int, int, int, int]


class Robot:
    """The controller. Only its methods change it; `step` simulates 2 ms."""

    def __init__(
        self,
        identity: RobotIdentity,
        motion: JointMotion,
        remote_control: bool,
        speed_slider: float,
        links: Links = NOMINAL,
        *,
        model: ArmModel = MODELS["ur10e"],
        tool_rotation_rad: Vector = (0.0, 0.0, 0.0),
    ) -> None:
        """Build a controller that is powered and ready, with its joints at rest and no program."""
        self.identity = identity
        self.model = model
        self.links = links  # the links as the controller has them, not the true ones
        # The tool's frame in the flange's (m, rotation vector rad): same origin, possibly rotated.
        self.tcp_offset = (0.0, 0.0, 0.0, *tool_rotation_rad)
        self.motion = motion
        self.faults = ArmFaults()
        self.remote_control = remote_control
        self.tick = 0
        self._robot_mode = RobotMode.RUNNING
        self._safety_mode = SafetyMode.NORMAL
        self.runtime_state = RuntimeState.STOPPED
        self.inputs = RegisterBank()
        self.outputs = RegisterBank()
        self.claims: dict[str, object] = {}  # RTDE input → the connection that writes it
        self.digital_outputs = 0
        self.analog_outputs = [0.0, 0.0]
        self.payload_kg = 0.0
        self.payload_centre_m: tuple[float, ...] = (0.0, 0.0, 0.0)
        self.loaded_program = ""
        self.messages = Messages()
        self.watchdog_s = 0.0  # longest time between inputs before a program is stopped; 0: no watchdog
        self._last_input_tick = 0
        self._program: Program | None = None
        self._start: tuple[int, Program] | None = None
        self._started_tick = 0
        self._mode_changes: list[tuple[int, RobotMode]] = []
        self._stopped_tick = 0
        self._unlocked_tick: int | None = None  # end of a protective stop that is being unlocked
        self._still_since_tick = 0
        self._moved_tick = 0
        self.speed_slider = speed_slider
        self.motion.fraction_wanted = self._fraction

    @property
    def robot_mode(self) -> RobotMode:
        return self._robot_mode

    @robot_mode.setter
    def robot_mode(self, mode: RobotMode) -> None:
        """Set the mode; a change is reported at the primary interface, as is a change of the safety mode."""
        if mode != self._robot_mode:
            self.messages.report(ErrorReport(MODE_CHANGED, mode, ReportLevel.INFO))
        self._robot_mode = mode

    @property
    def safety_mode(self) -> SafetyMode:
        return self._safety_mode

    @safety_mode.setter
    def safety_mode(self, mode: SafetyMode) -> None:
        if mode != self._safety_mode:
            self.messages.say(mode.name, MessageKind.SAFETY_MODE)
        self._safety_mode = mode

    # -- time ----------------------------------------------------------------------------------------------------
    @property
    def time_s(self) -> float:
        return self.tick / TICKS_PER_SECOND

    @property
    def reported_time_s(self) -> float:
        """The time stamp in the controller's states and messages, s."""
        return self.time_s + self.faults.clock_step_s

    def step(self) -> None:
        """Simulate one tick: mode changes that are due, the program, the joints."""
        self.tick += 1
        if self._mode_changes and self._mode_changes[0][0] <= self.tick:
            self.robot_mode = self._mode_changes.pop(0)[1]
        if self._unlocked_tick is not None and self._unlocked_tick <= self.tick:
            self._unlocked_tick = None
            self.safety_mode = SafetyMode.NORMAL
        if self._start is not None and self._start[0] <= self.tick:
            self._program, self._start = self._start[1], None
            self.messages.say(self._program.name, MessageKind.KEY, "PROGRAM_XXX_STARTED")
            self.runtime_state, self._started_tick = RuntimeState.PLAYING, self.tick
        if self.runtime_state == RuntimeState.PLAYING:
            self._play()
        start_fault = self.faults.at_program_start
        if start_fault is not None and self._started_tick and start_fault.is_due(self.tick - self._started_tick):
            start_fault.act()
        self.motion.step(self.time_s)
        if not self.motion.standing:
            self._still_since_tick = self.tick
            if self.motion.moving:
                self._moved_tick = self.tick
        self._settle()

    @property
    def waiting(self) -> bool:
        """Whether the joints are at rest and stay so in the next ticks unless a client acts."""
        is_changing = self._start is not None or self._mode_changes or self._unlocked_tick is not None
        if is_changing or self.watchdog_s or not self.motion.still:
            return False
        program = self._program
        return self.runtime_state == RuntimeState.STOPPED or (
            self.runtime_state == RuntimeState.PLAYING and program is not None and program.waiting
        )

    def _play(self) -> None:
        """Play one tick of the program; stop it at an error, at its end, or if its watchdog gets no sign of life."""
        if self.watchdog_s and (self.tick - self._last_input_tick) * TICK_S > self.watchdog_s:
            self.stop_program("the RTDE watchdog stopped the program")
            return
        assert self._program is not None
        try:
            running = self._program.step()
        except OutOfReach:
            self.protective_stop(INVALID_SETPOINT)
            return
        except (ProgramError, ValueError, ArithmeticError) as error:  # the last two: unusable numbers
            self.messages.complain(error if isinstance(error, ProgramError) else ProgramError(str(error)))
            self.stop_program("")
            return
        if not running:
            self.stop_program("")

    def _settle(self) -> None:
        """Complete pausing and stopping once the joints are at rest; complete resuming at once."""
        if self.runtime_state == RuntimeState.PAUSING and (self.motion.standing or self.motion.fraction == 0.0):
            self.runtime_state = RuntimeState.PAUSED
        elif self.runtime_state == RuntimeState.RESUMING:
            self.runtime_state = RuntimeState.PLAYING
        elif self.runtime_state == RuntimeState.STOPPING and self.motion.standing:
            self.runtime_state = RuntimeState.STOPPED

    @property
    def is_polyscope_x(self) -> bool:
        """Whether the software is PolyScope X, which has no dashboard, but in its later versions a Robot API."""
        return self.identity.polyscope >= POLYSCOPE_X

    @property
    def local_control(self) -> bool:
        """Whether the controller accepts orders from the pendant only; always False for the CB3 series."""
        return not self.remote_control and self.identity.polyscope >= E_SERIES

    # -- programs ------------------------------------------------------------------------------------------------
    @property
    def program_name(self) -> str:
        return self._program.name if self._program is not None else self.loaded_program

    @property
    def ready(self) -> bool:
        """Whether a program may run: powered, brakes released, no safety stop."""
        return self.robot_mode == RobotMode.RUNNING and self.safety_mode in (SafetyMode.NORMAL, SafetyMode.REDUCED)

    def start_program(self, program: Program) -> None:
        """Play a program in place of the running one.

        While the brakes are on, the program is accepted but remains paused. If another program is paused, the new one
        only stops that program (Universal Robots Client Library, issue 123, observed with the maker's simulator).
        """
        paused = self.runtime_state in (RuntimeState.PAUSING, RuntimeState.PAUSED)
        if self.runtime_state != RuntimeState.STOPPED:
            self.stop_program("another program was started")
        if paused:
            return
        if self.safety_mode not in (SafetyMode.NORMAL, SafetyMode.REDUCED):
            self.messages.say(f"{program.name} was not started: {self.safety_mode.name}")
        elif self.robot_mode != RobotMode.RUNNING:
            self._program, self.runtime_state = program, RuntimeState.PAUSED
        else:
            self._start = (self.tick + round(START_DELAY_S * TICKS_PER_SECOND), program)

    def stop_program(self, reason: str) -> None:
        """Stop the program and the joints."""
        if reason:
            self.messages.say(reason)
        if self._program is not None:
            self.messages.say(self._program.name, MessageKind.KEY, "PROGRAM_XXX_STOPPED")
        self._start = None
        self._program = None
        self.watchdog_s = 0.0
        if self.runtime_state != RuntimeState.STOPPED:
            self.motion.stop(PROGRAM_STOP_RAD_S2)
            self.motion.fraction_wanted = self._fraction
            self.runtime_state = RuntimeState.STOPPED if self.motion.standing else RuntimeState.STOPPING

    def pause(self) -> bool:
        """Pause the program; the current move continues after play. Return whether a program was playing."""
        if self.runtime_state != RuntimeState.PLAYING:
            return False
        self.motion.fraction_wanted = 0.0
        self.runtime_state = RuntimeState.PAUSING
        return True

    def resume(self) -> bool:
        """Continue a paused program. Return whether this was possible."""
        if not self.ready or self.runtime_state not in (RuntimeState.PAUSING, RuntimeState.PAUSED):
            return False
        self.motion.fraction_wanted = self._fraction
        self.runtime_state = RuntimeState.RESUMING
        return True

    # -- safety and power ------------------------------------------------------------------------------------------
    def protective_stop(self, error: ErrorReport = STOPPED_FOR_TEST) -> None:
        if self.safety_mode in (SafetyMode.NORMAL, SafetyMode.REDUCED):
            self.messages.report(error)
            self._safety_stop(SafetyMode.PROTECTIVE_STOP)

    def emergency_stop(self) -> None:
        self._safety_stop(SafetyMode.ROBOT_EMERGENCY_STOP)
        self._mode_changes = [(self.tick + round(POWER_STEP_S * TICKS_PER_SECOND), RobotMode.POWER_OFF)]

    def safeguard_stop(self) -> None:
        """Stop as at a light curtain or a door: the program pauses, the joints stop on their path, powered."""
        if self.safety_mode in (SafetyMode.NORMAL, SafetyMode.REDUCED):
            self.safety_mode = SafetyMode.SAFEGUARD_STOP
            self.pause()

    def _safety_stop(self, mode: SafetyMode) -> None:
        self.safety_mode = mode
        self._unlocked_tick = None
        self._stopped_tick = self.tick
        self.stop_program(f"safety mode {mode.name}")
        self.motion.stop(PROTECTIVE_STOP_RAD_S2)

    @property
    def stopped_for_s(self) -> float:
        """Time since the last protective or emergency stop, s."""
        return (self.tick - self._stopped_tick) * TICK_S

    def unlock_protective_stop(self) -> None:
        """Begin to unlock a protective stop, which takes some time."""
        if self.safety_mode == SafetyMode.PROTECTIVE_STOP and self._unlocked_tick is None:
            self._unlocked_tick = self.tick + round(UNLOCK_S * TICKS_PER_SECOND)

    def restart_safety(self) -> None:
        """Restart the safety system, which clears a protective stop and leaves the arm without power."""
        self.power_off()
        if self.safety_mode == SafetyMode.PROTECTIVE_STOP:
            self._unlocked_tick = None
            self.safety_mode = SafetyMode.NORMAL

    def release(self) -> None:
        """Release the emergency stop button (the power stays off) or reset the safeguard; a program remains paused."""
        if self.safety_mode in (SafetyMode.ROBOT_EMERGENCY_STOP, SafetyMode.SAFEGUARD_STOP):
            self.safety_mode = SafetyMode.NORMAL

    def power_off(self) -> None:
        self.stop_program("the robot was powered off")
        self.motion.stop(BRAKE_RAD_S2)
        self._mode_changes = []
        self.robot_mode = RobotMode.POWER_OFF

    def power_on(self) -> None:
        if self.robot_mode == RobotMode.POWER_OFF and self.safety_mode != SafetyMode.ROBOT_EMERGENCY_STOP:
            self.robot_mode = RobotMode.POWER_ON
            self._mode_changes = [(self.tick + round(POWER_STEP_S * TICKS_PER_SECOND), RobotMode.IDLE)]

    def brake_release(self) -> None:
        self.power_on()
        if self.robot_mode in (RobotMode.POWER_ON, RobotMode.IDLE):
            is_due = self._mode_changes[-1][0] if self._mode_changes else self.tick
            self._mode_changes.append((is_due + round(POWER_STEP_S * TICKS_PER_SECOND), RobotMode.RUNNING))

    # -- settings of the operator and of clients -----------------------------------------------------------------------
    def set_speed_slider(self, fraction: float) -> None:
        if not isfinite(fraction):
            return
        self.speed_slider = min(max(fraction, 0.0), 1.0)
        self._update_scaling()

    def set_safety_limit(self, fraction: float) -> None:
        """Limit the speed to a fraction of the programmed one, as a safety limit does; 1 means no limit."""
        self.faults.safety_limit = min(max(fraction, 0.0), 1.0)
        self._update_scaling()

    @property
    def _fraction(self) -> float:
        """The permitted fraction of the programmed speed, due to the slider and the safety limit."""
        return self.speed_slider * self.faults.safety_limit

    def _update_scaling(self) -> None:
        if self.runtime_state not in (RuntimeState.PAUSING, RuntimeState.PAUSED):
            self.motion.fraction_wanted = self._fraction

    def lose_operation(self, mode: RobotMode) -> None:
        """Leave the running mode for another robot mode, as during an update of the firmware; the program stops."""
        self.stop_program(f"robot mode {mode.name}")
        self.motion.stop(BRAKE_RAD_S2)
        self._mode_changes = []
        self.robot_mode = mode

    def set_payload(self, mass_kg: float, centre_m: Sequence[float]) -> None:
        """Set the payload, unless the fault `payload_stays` prevents this. Raise `ProgramError` for invalid values."""
        limit_kg = self.model.payload_kg
        if not 0.0 <= mass_kg <= limit_kg:
            raise ProgramError(f"payload {mass_kg} kg is outside 0 to {limit_kg} kg")
        centre = tuple(float(coordinate) for coordinate in centre_m)
        if len(centre) != 3 or not all(map(isfinite, centre)):
            raise ProgramError(f"a payload's centre is three lengths, not {centre_m}")
        if not self.faults.payload_stays:
            self.payload_kg, self.payload_centre_m = mass_kg, centre

    def set_tcp(self, offset: Sequence[float]) -> None:
        if tuple(offset) != self.tcp_offset:
            raise ProgramError("not simulated: a tool centre point other than that of the installation")

    def feed_watchdog(self) -> None:
        """Reset the watchdog, because an RTDE client wrote an input."""
        self._last_input_tick = self.tick

    def set_watchdog(self, minimum_hz: float) -> None:
        self.watchdog_s = 1.0 / minimum_hz if minimum_hz > 0.0 else 0.0
        self._last_input_tick = self.tick

    # -- the tool's frame --------------------------------------------------------------------------------------------
    def tcp_pose(self, q_rad: Sequence[float]) -> tuple[float, ...]:
        """Return the tool centre point's pose (m, rotation vector rad) in the base frame at these joint angles."""
        return self._rotate_tool(flange_pose(q_rad, self.links), 1)

    def flange_pose_for(self, tcp_pose: Sequence[float]) -> tuple[float, ...]:
        """Return the flange's pose that puts the tool centre point at `tcp_pose`."""
        return self._rotate_tool(tcp_pose, -1)

    def _rotate_tool(self, pose: Sequence[float], sign: int) -> tuple[float, ...]:
        turn = [sign * angle for angle in self.tcp_offset[3:]]
        return rotate_pose(pose, rotation_from_vector(turn)) if any(turn) else tuple(pose)

    def is_within_limits(self, q_rad: Sequence[float]) -> bool:
        """Return whether the joint angles are within their limits."""
        return all(abs(q) <= limit + ROUNDING_RAD for q, limit in zip(q_rad, self.model.limit_rad, strict=True))

    # -- outputs of RTDE ---------------------------------------------------------------------------------------------
    @property
    def speed_scaling(self) -> float:
        """The joints' speed divided by the speed that the slider permits; clients multiply it by the slider's fraction.

        It is 0 while no program runs, as in logs of a UR3 of the CB3 series and of a UR10e.
        """
        if self.runtime_state == RuntimeState.STOPPED:
            return 0.0
        return min(1.0, self.motion.fraction / self.speed_slider) if self.speed_slider else 1.0

    @property
    def tcp_motion(self) -> TcpMotion:
        """The motion of the tool centre point as the encoders measure it."""
        return find_tcp_motion(*self.motion.actual, self.links)

    @property
    def target_tcp_motion(self) -> TcpMotion:
        """The commanded motion of the tool centre point."""
        now = self.motion.now
        return find_tcp_motion(now.target_q_rad, now.target_qd_rad_s, now.target_qdd_rad_s2, self.links)

    @property
    def still_since_s(self) -> float:
        """The controller's time at which the joints last moved, s; a paused move counts as rest."""
        return self._moved_tick * TICK_S

    @property
    def steady(self) -> bool:
        """Whether the joints have been at rest for half a second."""
        return (self.tick - self._still_since_tick) * TICK_S >= 0.5

    @property
    def robot_status_bits(self) -> int:
        powered = self.robot_mode >= RobotMode.POWER_ON
        return int(powered) | (self.runtime_state == RuntimeState.PLAYING) << 1

    @property
    def safety_status_bits(self) -> int:
        return SAFETY_BITS[self.safety_mode]
