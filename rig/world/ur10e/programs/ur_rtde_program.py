"""The program that ur_rtde uploads, simulated by its register protocol, not by its text.

A client writes a command into input integer register 0. When the command is done, the program answers 2 in output
integer register 0; the client writes 0, and the program answers 1 (ready). Real-time commands are never answered 2.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from rig.world.clock import TICK_S
from rig.world.ur10e.controller_messages import ProgramError
from rig.world.ur10e.motion.cartesian import approach_speed, solve_inverse_kinematics, solve_joint_speeds
from rig.world.ur10e.motion.trajectory import Joints
from rig.world.ur10e.programs.program_threads import ScriptMove, Steps, Threads, check_finite
from rig.world.ur10e.programs.ur_rtde_questions import UNSIMULATED_CODES, build_questions
from rig.world.ur10e.programs.ur_rtde_registers import ProgramRegisters
from rig.world.ur10e.robot import Robot

REALTIME_CODES = frozenset({6, 9, 10, 11, 24, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71})
STOP_SCRIPT = 255
READY_STATE, DONE_STATE = 1, 2

FOLLOWING_RAD_S2 = 40.0  # acceleration of joints that follow a target from tick to tick

Command = Callable[[], Steps]


@dataclass(frozen=True, slots=True)
class SpeedTarget:
    """Target speeds of the joints, rad/s, and their acceleration, rad/s².

    If `of_tool`, the speeds are the tool's velocity in the base frame, m/s and rad/s; the acceleration is in m/s².
    """

    speed: Joints
    acceleration: float
    of_tool: bool = False


class ControlProgram:
    """The program `rtde_control` of ur_rtde. `path`: the moves injected into it (moveJ with a path)."""

    name = "rtde_control"

    def __init__(self, robot: Robot, register_offset: int, path: Sequence[ScriptMove]) -> None:
        """Fill the table of commands by their numbers in register 0."""
        self._robot = robot
        self._registers = ProgramRegisters(robot, register_offset)
        self._path = tuple(path)
        self._threads = Threads(robot)
        self._servo_target: tuple[Joints, float] = (robot.motion.now.target_q_rad, 0.1)
        self._speed_target = SpeedTarget((0.0,) * 6, 0.5)
        self._operation = self._writes = 0
        self._idle_code: int | None = None  # the command at the main thread's last yield between commands
        self._commands: dict[int, Command] = {
            1: self._movej,
            2: self._movej_ik,
            3: self._movel,
            4: self._movel_fk,
            9: self._speedj,
            10: self._speedl,
            11: self._servoj,
            15: self._speed_stop,
            16: self._servo_stop,
            24: self._servol,
            33: self._stop,
            34: self._stop,
            45: self._move_path,
        }
        self._questions = build_questions(robot, self._registers)
        self._main = self._loop()

    def step(self) -> bool:
        self._threads.step()
        return next(self._main, StopIteration) is not StopIteration

    @property
    def waiting(self) -> bool:
        """Whether every command of the client is finished and answered, and no thread runs."""
        return not self._threads.any and self._idle_code is not None and self._registers.integer(0) == self._idle_code

    def _loop(self) -> Steps:
        """Run the main loop of ur_rtde's program: take a code from register 0, carry it out, report its end."""
        self._signal_async(-1)
        self._registers.write_integer(0, READY_STATE)
        executing = False
        while True:
            code = self._registers.integer(0)
            if code == 0 or code in REALTIME_CODES:
                executing = False if code == 0 else executing
                if code:
                    yield from self._command(code)()
                self._registers.write_integer(0, READY_STATE)
            elif not executing:
                if code == STOP_SCRIPT:
                    return
                yield from self._command(code)()
                self._registers.write_integer(0, DONE_STATE)
                executing = True
            self._idle_code = None if code in REALTIME_CODES else code
            yield
            self._idle_code = None

    def _command(self, code: int) -> Command:
        if code in self._questions:
            return partial(_run_instant, self._questions[code])
        if code not in self._commands:
            name = f" ({UNSIMULATED_CODES[code]})" if code in UNSIMULATED_CODES else ""
            raise ProgramError(f"not simulated: command {code}{name} of rtde_control")
        return self._commands[code]

    def _asynchronously(self) -> bool:
        return self._registers.integer(1) == 1

    def _signal_async(self, progress: int) -> None:
        """Write the progress word of an asynchronous operation: operation id, write count, running bit, progress."""
        self._writes = (self._writes + 1) % 128
        if progress == 0:
            self._operation = (self._operation + 1) % 128
        word = self._operation << 24 | self._writes << 16
        if progress >= 0:
            word |= 1 << 15 | min(progress, 0x7FFF)
        self._registers.write_integer(2, word)

    # -- moves ---------------------------------------------------------------------------------------------------
    def _move_to_request(self, straight: bool, is_pose: bool) -> Steps:
        *target, speed, acceleration = self._registers.doubles(0, 8)
        return self._move([ScriptMove(tuple(target), speed, acceleration, straight, is_pose)])

    def _movej(self) -> Steps:
        return self._move_to_request(straight=False, is_pose=False)

    def _movej_ik(self) -> Steps:
        return self._move_to_request(straight=False, is_pose=True)

    def _movel(self) -> Steps:
        return self._move_to_request(straight=True, is_pose=True)

    def _movel_fk(self) -> Steps:
        return self._move_to_request(straight=True, is_pose=False)

    def _move_path(self) -> Steps:
        return self._move(self._path)

    def _move(self, path: Sequence[ScriptMove]) -> Steps:
        self._kill_async("move")
        if self._asynchronously():
            self._threads.run("move", self._async_move(path))
            return
        for step in path:
            yield from self._threads.move("main", step)

    def _async_move(self, path: Sequence[ScriptMove]) -> Steps:
        for index, step in enumerate(path):
            self._signal_async(index)
            yield from self._threads.move("move", step)
        self._signal_async(-1)

    def _kill_async(self, name: str) -> None:
        if self._threads.is_running(name):
            self._threads.kill(name)
            self._signal_async(-1)

    def _stop(self) -> Steps:
        self._kill_async("stop")
        self._kill_async("move")
        deceleration = self._registers.doubles(0, 1)[0]
        if self._asynchronously():
            self._threads.run("stop", self._async_stop(deceleration))
            return
        yield from self._threads.stopj("main", deceleration)

    def _async_stop(self, deceleration: float) -> Steps:
        self._signal_async(0)
        yield from self._threads.stopj("stop", deceleration)
        self._signal_async(-1)

    def _speedj(self) -> Steps:
        return self._speed(of_tool=False)

    def _speedl(self) -> Steps:
        return self._speed(of_tool=True)

    def _speed(self, of_tool: bool) -> Steps:
        *velocity, acceleration, _ = self._registers.doubles(0, 8)
        check_finite([*velocity, acceleration])
        self._speed_target = SpeedTarget(tuple(velocity), max(acceleration, 0.01), of_tool)
        if not self._threads.is_running("speed"):
            self._threads.run("speed", self._speed_thread())
        return _nothing()

    def _speed_thread(self) -> Steps:
        """Follow the newest joint or tool speed every tick."""
        last = None
        tool: Sequence[float] = (0.0,) * 6
        while True:
            self._threads.take("speed")
            target_speed = self._speed_target
            if target_speed.of_tool:
                tool = approach_speed(tool, target_speed.speed, target_speed.acceleration * TICK_S)
                current = self._robot.motion.now.target_q_rad
                self._robot.motion.speed(solve_joint_speeds(current, tool, self._robot.links), FOLLOWING_RAD_S2)
            elif target_speed != last:
                self._robot.motion.speed(target_speed.speed, target_speed.acceleration)
            last = target_speed
            yield

    def _speed_stop(self) -> Steps:
        self._threads.kill("speed")
        return self._threads.stopj("main", self._registers.doubles(0, 1)[0])

    def _servoj(self) -> Steps:
        values = self._registers.doubles(0, 11)
        check_finite(values)
        return self._servo(values[:6], values[9])

    def _servol(self) -> Steps:
        values = self._registers.doubles(0, 11)
        check_finite(values)
        pose = self._robot.flange_pose_for(values[:6])
        return self._servo(solve_inverse_kinematics(pose, self._robot.motion.q_rad, self._robot.links), values[9])

    def _servo(self, target: Joints, lookahead_s: float) -> Steps:
        self._servo_target = (target, max(lookahead_s, 0.03))
        if not self._threads.is_running("servo"):
            self._threads.run("servo", self._servo_thread())
        return _nothing()

    def _servo_thread(self) -> Steps:
        """Steer towards the newest target every tick, to arrive there after the look-ahead time."""
        while True:
            self._threads.take("servo")
            target, lookahead_s = self._servo_target
            current = self._robot.motion.now.target_q_rad
            velocity = tuple((b - a) / lookahead_s for a, b in zip(current, target, strict=True))
            self._robot.motion.speed(velocity, FOLLOWING_RAD_S2)
            yield

    def _servo_stop(self) -> Steps:
        self._threads.kill("servo")
        return self._threads.stopj("main", self._registers.doubles(0, 1)[0])


def _run_instant(act: Callable[[], None]) -> Steps:
    act()
    return iter(())


def _nothing() -> Steps:
    return iter(())
