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
from rig.world.ur10e.motion.forward_kinematics import Vector, flange_pose, rotate_pose, rotation_from_vector
from rig.world.ur10e.motion.joint_motion import JointMotion
from rig.world.ur10e.motion.links import NOMINAL, Links
from rig.world.ur10e.motion.models import MODELS, ArmModel
from rig.world.ur10e.motion.tcp_motion import TcpMotion, tcp_motion

ROUNDING_RAD = 1e-6  # a target on a joint's limit is within it
PROGRAM_STOP_RAD_S2 = 4.0
PROTECTIVE_STOP_RAD_S2 = 15.0
BRAKE_RAD_S2 = 40.0
START_DELAY_S = 0.02  # between the last byte of a program and its first line
POWER_STEP_S = 0.5  # powering on, releasing the brakes
E_SERIES, POLYSCOPE_X = (5,), (10,)  # their first versions


class Program(Protocol):
    """Something the controller plays, a tick at a time."""

    name: str

    def step(self) -> bool:
        """One tick; False when the program has ended. Raises `ProgramError`."""
        ...

    @property
    def waiting(self) -> bool:
        """Whether ticks change nothing until a client writes an input; False where that is not known."""
        ...


@dataclass(slots=True)
class RegisterBank:
    """General-purpose registers of one direction."""

    bits: list[bool] = field(default_factory=lambda: [False] * 128)
    ints: list[int] = field(default_factory=lambda: [0] * 48)
    doubles: list[float] = field(default_factory=lambda: [0.0] * 48)


@dataclass(frozen=True, slots=True)
class Identity:
    """What the controller says of itself."""

    serial_number: str
    polyscope: tuple[int, int, int, int]


class Robot:
    """The controller. Everything that changes it is a method here; `step` makes it 2 ms older."""

    def __init__(
        self,
        identity: Identity,
        motion: JointMotion,
        remote_control: bool,
        speed_slider: float,
        links: Links = NOMINAL,
        *,
        model: ArmModel = MODELS["ur10e"],
        tool_turn_rad: Vector = (0.0, 0.0, 0.0),
    ) -> None:
        self.identity = identity
        self.model = model
        self.links = links  # as it knows them
        # The tool's frame in the flange's (m, rotation vector rad): it stands in the same place, and may be turned.
        self.tcp_offset = (0.0, 0.0, 0.0, *tool_turn_rad)
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
        self.watchdog_s = 0.0  # a program stops when no input came for so long; 0: no watchdog
        self._last_input_tick = 0
        self._program: Program | None = None
        self._start: tuple[int, Program] | None = None
        self._started_tick = 0
        self._mode_changes: list[tuple[int, RobotMode]] = []
        self._stopped_tick = 0
        self._still_since_tick = 0
        self._moved_tick = 0
        self.speed_slider = speed_slider
        self.motion.fraction_wanted = self._fraction

    @property
    def robot_mode(self) -> RobotMode:
        return self._robot_mode

    @robot_mode.setter
    def robot_mode(self, mode: RobotMode) -> None:
        """Every change is told at the primary interface, this and the safety mode's."""
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
        """The time that it stamps its states and messages with."""
        return self.time_s + self.faults.clock_step_s

    def step(self) -> None:
        """Make one tick: modes due, the program's turn, the joints."""
        self.tick += 1
        if self._mode_changes and self._mode_changes[0][0] <= self.tick:
            self.robot_mode = self._mode_changes.pop(0)[1]
        if self._start is not None and self._start[0] <= self.tick:
            self._program, self._start = self._start[1], None
            self.messages.say(self._program.name, MessageKind.KEY, "PROGRAM_XXX_STARTED")
            self.runtime_state, self._started_tick = RuntimeState.PLAYING, self.tick
        if self.runtime_state == RuntimeState.PLAYING:
            self._play()
        at_start = self.faults.at_program_start
        if at_start is not None and self._started_tick and at_start.due(self.tick - self._started_tick):
            at_start.act()
        self.motion.step(self.time_s)
        if not self.motion.standing:
            self._still_since_tick = self.tick
            if self.motion.moving:
                self._moved_tick = self.tick
        self._settle()

    @property
    def waiting(self) -> bool:
        """Whether the joints stand, and nothing but a client can let them move in the ticks to come."""
        if self._start is not None or self._mode_changes or self.watchdog_s or not self.motion.still:
            return False
        program = self._program
        return self.runtime_state == RuntimeState.STOPPED or (
            self.runtime_state == RuntimeState.PLAYING and program is not None and program.waiting
        )

    def _play(self) -> None:
        if self.watchdog_s and (self.tick - self._last_input_tick) * TICK_S > self.watchdog_s:
            self.stop_program("the RTDE watchdog stopped the program")
            return
        assert self._program is not None
        try:
            running = self._program.step()
        except OutOfReach:
            self.protective_stop(INVALID_SETPOINT)
            return
        except (ProgramError, ValueError, ArithmeticError) as error:  # the last two: numbers that lead to none
            self.messages.complain(error if isinstance(error, ProgramError) else ProgramError(str(error)))
            self.stop_program("")
            return
        if not running:
            self.stop_program("")

    def _settle(self) -> None:
        """Finish the states that last until the joints have followed."""
        if self.runtime_state == RuntimeState.PAUSING and (self.motion.standing or self.motion.fraction == 0.0):
            self.runtime_state = RuntimeState.PAUSED
        elif self.runtime_state == RuntimeState.RESUMING:
            self.runtime_state = RuntimeState.PLAYING
        elif self.runtime_state == RuntimeState.STOPPING and self.motion.standing:
            self.runtime_state = RuntimeState.STOPPED

    @property
    def is_polyscope_x(self) -> bool:
        """Whether its software has a Robot API, or nothing, in place of a dashboard."""
        return self.identity.polyscope >= POLYSCOPE_X

    @property
    def local_control(self) -> bool:
        """Whether the pendant alone may order something; the CB3 series does not know the difference."""
        return not self.remote_control and self.identity.polyscope >= E_SERIES

    # -- programs ------------------------------------------------------------------------------------------------
    @property
    def program_name(self) -> str:
        return self._program.name if self._program is not None else self.loaded_program

    @property
    def ready(self) -> bool:
        """Powered, brakes released, no safety stop: a program may run."""
        return self.robot_mode == RobotMode.RUNNING and self.safety_mode in (SafetyMode.NORMAL, SafetyMode.REDUCED)

    def start_program(self, program: Program) -> None:
        """Play a program instead of what runs now.

        While the brakes are on it is taken and stands paused, and whatever comes while a program is paused only stops
        that one. (Universal Robots Client Library, issue 123, seen with the maker's simulator.)
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
        """Stop the program, and the joints with it."""
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
        """Pause: the move is finished after play."""
        if self.runtime_state != RuntimeState.PLAYING:
            return False
        self.motion.fraction_wanted = 0.0
        self.runtime_state = RuntimeState.PAUSING
        return True

    def resume(self) -> bool:
        """Go on after a pause."""
        if not self.ready or self.runtime_state not in (RuntimeState.PAUSING, RuntimeState.PAUSED):
            return False
        self.motion.fraction_wanted = self._fraction
        self.runtime_state = RuntimeState.RESUMING
        return True

    # -- safety and power ------------------------------------------------------------------------------------------
    def protective_stop(self, why: ErrorReport = STOPPED_FOR_TEST) -> None:
        if self.safety_mode in (SafetyMode.NORMAL, SafetyMode.REDUCED):
            self.messages.report(why)
            self._safety_stop(SafetyMode.PROTECTIVE_STOP)

    def emergency_stop(self) -> None:
        self._safety_stop(SafetyMode.ROBOT_EMERGENCY_STOP)
        self._mode_changes = [(self.tick + round(POWER_STEP_S * TICKS_PER_SECOND), RobotMode.POWER_OFF)]

    def safeguard_stop(self) -> None:
        """A light curtain or a door: the program pauses and the joints stop on their way, powered."""
        if self.safety_mode in (SafetyMode.NORMAL, SafetyMode.REDUCED):
            self.safety_mode = SafetyMode.SAFEGUARD_STOP
            self.pause()

    def _safety_stop(self, mode: SafetyMode) -> None:
        self.safety_mode = mode
        self._stopped_tick = self.tick
        self.stop_program(f"safety mode {mode.name}")
        self.motion.stop(PROTECTIVE_STOP_RAD_S2)

    @property
    def stopped_for_s(self) -> float:
        """Seconds since the last protective or emergency stop."""
        return (self.tick - self._stopped_tick) * TICK_S

    def unlock_protective_stop(self) -> None:
        if self.safety_mode == SafetyMode.PROTECTIVE_STOP:
            self.safety_mode = SafetyMode.NORMAL

    def release(self) -> None:
        """Pull the emergency stop button out again, the robot stays without power; or close the safeguard and reset it,
        what it paused stays so until it is played."""
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
            due = self._mode_changes[-1][0] if self._mode_changes else self.tick
            self._mode_changes.append((due + round(POWER_STEP_S * TICKS_PER_SECOND), RobotMode.RUNNING))

    # -- what the operator and clients set ---------------------------------------------------------------------------
    def set_speed_slider(self, fraction: float) -> None:
        if not isfinite(fraction):
            return
        self.speed_slider = min(max(fraction, 0.0), 1.0)
        self._scale_anew()

    def set_safety_limit(self, fraction: float) -> None:
        """A limit of the safety settings leaves this fraction of the programmed speed; 1 for none."""
        self.faults.safety_limit = min(max(fraction, 0.0), 1.0)
        self._scale_anew()

    @property
    def _fraction(self) -> float:
        """How fast a program may be played: by the slider, and by the safety settings."""
        return self.speed_slider * self.faults.safety_limit

    def _scale_anew(self) -> None:
        if self.runtime_state not in (RuntimeState.PAUSING, RuntimeState.PAUSED):
            self.motion.fraction_wanted = self._fraction

    def lose_operation(self, mode: RobotMode) -> None:
        """The arm leaves its operation for another mode, as where its firmware is updated: no program goes on."""
        self.stop_program(f"robot mode {mode.name}")
        self.motion.stop(BRAKE_RAD_S2)
        self._mode_changes = []
        self.robot_mode = mode

    def set_payload(self, mass_kg: float, centre_m: Sequence[float]) -> None:
        most_kg = self.model.payload_kg
        if not 0.0 <= mass_kg <= most_kg:
            raise ProgramError(f"payload {mass_kg} kg is outside 0 to {most_kg} kg")
        centre = tuple(float(each) for each in centre_m)
        if len(centre) != 3 or not all(map(isfinite, centre)):
            raise ProgramError(f"a payload's centre is three lengths, not {centre_m}")
        if not self.faults.payload_stays:
            self.payload_kg, self.payload_centre_m = mass_kg, centre

    def set_tcp(self, offset: Sequence[float]) -> None:
        if tuple(offset) != self.tcp_offset:
            raise ProgramError("not simulated: a tool centre point other than that of the installation")

    def input_received(self) -> None:
        """An RTDE client wrote an input: feeds the watchdog."""
        self._last_input_tick = self.tick

    def set_watchdog(self, minimum_hz: float) -> None:
        self.watchdog_s = 1.0 / minimum_hz if minimum_hz > 0.0 else 0.0
        self._last_input_tick = self.tick

    # -- the tool's frame --------------------------------------------------------------------------------------------
    def tcp_pose(self, q_rad: Sequence[float]) -> tuple[float, ...]:
        """Pose of the tool centre point (m, rotation vector rad) in the base's frame, at these joint angles."""
        return self._turned(flange_pose(q_rad, self.links), 1)

    def flange_for(self, tcp_pose: Sequence[float]) -> tuple[float, ...]:
        """The flange's pose that brings the tool centre point to this one."""
        return self._turned(tcp_pose, -1)

    def _turned(self, pose: Sequence[float], sign: int) -> tuple[float, ...]:
        turn = [sign * angle for angle in self.tcp_offset[3:]]
        return rotate_pose(pose, rotation_from_vector(turn)) if any(turn) else tuple(pose)

    def within_limits(self, q_rad: Sequence[float]) -> bool:
        """Whether the joints may stand so."""
        return all(abs(q) <= limit + ROUNDING_RAD for q, limit in zip(q_rad, self.model.limit_rad, strict=True))

    # -- what RTDE reports -------------------------------------------------------------------------------------------
    @property
    def speed_scaling(self) -> float:
        """How much slower than the slider asks the joints go: clients multiply both."""
        return min(1.0, self.motion.fraction / self.speed_slider) if self.speed_slider else 1.0

    @property
    def tcp_motion(self) -> TcpMotion:
        """How the tool centre point moves by the encoders."""
        return tcp_motion(*self.motion.actual, self.links)

    @property
    def target_tcp_motion(self) -> TcpMotion:
        """How it is meant to move."""
        now = self.motion.now
        return tcp_motion(now.target_q_rad, now.target_qd_rad_s, now.target_qdd_rad_s2, self.links)

    @property
    def still_since_s(self) -> float:
        """The controller's time at which the joints last moved; a paused movement stands still."""
        return self._moved_tick * TICK_S

    @property
    def steady(self) -> bool:
        """Standing still for half a second."""
        return (self.tick - self._still_since_tick) * TICK_S >= 0.5

    @property
    def robot_status_bits(self) -> int:
        powered = self.robot_mode >= RobotMode.POWER_ON
        return int(powered) | (self.runtime_state == RuntimeState.PLAYING) << 1

    @property
    def safety_status_bits(self) -> int:
        return SAFETY_BITS[self.safety_mode]
