"""The program that ur_rtde uploads, acted out: its register protocol, not its text.

A client writes a command into input integer register 0; the program answers 2 in output integer register 0 when it is
done, the client writes 0, the program answers 1 (ready). Real-time commands are never answered 2.
"""

from collections.abc import Callable, Iterator, Sequence

from rig.world.clock import TICK_S
from rig.world.ur10e.cartesian import joints_for
from rig.world.ur10e.controller_messages import ProgramError
from rig.world.ur10e.forward_kinematics import flange_pose
from rig.world.ur10e.program_threads import Move, Steps, Threads, finite
from rig.world.ur10e.robot import JOINT_LIMIT_RAD, Robot
from rig.world.ur10e.trajectory import Joints

REALTIME = frozenset({6, 9, 10, 11, 24, 25, 26, 27, 38, 58, 66, 67, 68, 69, 70, 71})
STOP_SCRIPT = 255
READY, DONE = 1, 2

Command = Callable[[], Steps]


class ControlProgram:
    """`rtde_control`, as uploaded by ur_rtde. `path` holds the moves injected into it (moveJ with a path)."""

    name = "rtde_control"

    def __init__(self, robot: Robot, register_offset: int, path: Sequence[Move]) -> None:
        self._robot = robot
        self._offset = register_offset
        self._path = tuple(path)
        self._threads = Threads(robot)
        self._servo_target: tuple[Joints, float] = (robot.motion.now.target_q_rad, 0.1)
        self._speed_target: tuple[Joints, float] = ((0.0,) * 6, 0.5)
        self._operation = self._writes = 0
        self._heard: int | None = None  # the command that was there when the main thread last gave way between two
        self._commands: dict[int, Command] = {
            1: self._movej,
            2: self._movej_ik,
            3: self._movel,
            4: self._movel_fk,
            9: self._speedj,
            11: self._servoj,
            15: self._speed_stop,
            16: self._servo_stop,
            17: self._set_payload,
            26: self._step_time,
            29: self._set_tcp,
            31: self._protective_stop,
            33: self._stop,
            34: self._stop,
            35: self._set_watchdog,
            37: self._within_limits,
            38: self._torques,
            40: self._tcp_offset,
            43: self._forward_kinematics,
            45: self._move_path,
            46: self._inverse_kinematics,
            47: self._is_steady,
            58: self._flange_pose,
        }
        self._main = self._loop()

    def step(self) -> bool:
        self._threads.step()
        return next(self._main, StopIteration) is not StopIteration

    @property
    def waiting(self) -> bool:
        """Every command is done and answered, and no thread runs."""
        return not self._threads.any and self._heard is not None and self._int(0) == self._heard

    def _loop(self) -> Steps:
        self._signal_async(-1)
        self._answer(READY)
        executing = False
        while True:
            code = self._int(0)
            if code == 0 or code in REALTIME:
                executing = False if code == 0 else executing
                if code:
                    yield from self._command(code)()
                self._answer(READY)
            elif not executing:
                if code == STOP_SCRIPT:
                    return
                yield from self._command(code)()
                self._answer(DONE)
                executing = True
            self._heard = None if code in REALTIME else code
            yield
            self._heard = None

    def _command(self, code: int) -> Command:
        if code not in self._commands:
            raise ProgramError(f"the simulated controller does not know command {code} of rtde_control")
        return self._commands[code]

    # -- registers -------------------------------------------------------------------------------------------------
    def _int(self, index: int) -> int:
        return self._robot.inputs.ints[self._offset + index]

    def _doubles(self, first: int, count: int) -> tuple[float, ...]:
        start = self._offset + first
        return tuple(self._robot.inputs.doubles[start : start + count])

    def _answer(self, value: int) -> None:
        self._robot.outputs.ints[self._offset] = value

    def _result(self, value: int) -> None:
        self._robot.outputs.ints[self._offset + 1] = value

    def _results(self, values: Sequence[float]) -> None:
        self._robot.outputs.doubles[self._offset : self._offset + len(values)] = values

    def _signal_async(self, progress: int) -> None:
        """The word an asynchronous operation is watched by: operation id, write count, running bit, progress."""
        self._writes = (self._writes + 1) % 128
        if progress == 0:
            self._operation = (self._operation + 1) % 128
        word = self._operation << 24 | self._writes << 16
        if progress >= 0:
            word |= 1 << 15 | min(progress, 0x7FFF)
        self._robot.outputs.ints[self._offset + 2] = word

    # -- moves ---------------------------------------------------------------------------------------------------
    def _asked(self, straight: bool, is_pose: bool) -> Steps:
        *target, speed, acceleration = self._doubles(0, 8)
        return self._move([Move(tuple(target), speed, acceleration, straight, is_pose)])

    def _movej(self) -> Steps:
        return self._asked(straight=False, is_pose=False)

    def _movej_ik(self) -> Steps:
        return self._asked(straight=False, is_pose=True)

    def _movel(self) -> Steps:
        return self._asked(straight=True, is_pose=True)

    def _movel_fk(self) -> Steps:
        return self._asked(straight=True, is_pose=False)

    def _move_path(self) -> Steps:
        return self._move(self._path)

    def _move(self, path: Sequence[Move]) -> Steps:
        self._kill_async("move")
        if self._int(1) == 1:
            self._threads.run("move", self._async_move(path))
            return
        for step in path:
            yield from self._threads.move("main", step)

    def _async_move(self, path: Sequence[Move]) -> Steps:
        for index, step in enumerate(path):
            self._signal_async(index)
            yield from self._threads.move("move", step)
        self._signal_async(-1)

    def _kill_async(self, name: str) -> None:
        if self._threads.running(name):
            self._threads.kill(name)
            self._signal_async(-1)

    def _stop(self) -> Steps:
        self._kill_async("stop")
        self._kill_async("move")
        deceleration = self._doubles(0, 1)[0]
        if self._int(1) == 1:
            self._threads.run("stop", self._async_stop(deceleration))
            return
        yield from self._threads.stopj("main", deceleration)

    def _async_stop(self, deceleration: float) -> Steps:
        self._signal_async(0)
        yield from self._threads.stopj("stop", deceleration)
        self._signal_async(-1)

    def _speedj(self) -> Steps:
        *velocity, acceleration, _ = self._doubles(0, 8)
        finite([*velocity, acceleration])
        self._speed_target = (tuple(velocity), acceleration)
        if not self._threads.running("speed"):
            self._threads.run("speed", self._speed_thread())
        return _nothing()

    def _speed_thread(self) -> Steps:
        done = None
        while True:
            self._threads.take("speed")
            if self._speed_target != done:
                self._robot.motion.speed(self._speed_target[0], max(self._speed_target[1], 0.01))
                done = self._speed_target
            yield

    def _speed_stop(self) -> Steps:
        self._threads.kill("speed")
        return self._threads.stopj("main", self._doubles(0, 1)[0])

    def _servoj(self) -> Steps:
        values = self._doubles(0, 11)
        finite(values)
        self._servo_target = (values[:6], max(values[9], 0.03))
        if not self._threads.running("servo"):
            self._threads.run("servo", self._servo_thread())
        return _nothing()

    def _servo_thread(self) -> Steps:
        """Every tick steer towards the newest target: the way left is to be made in the look-ahead time."""
        while True:
            self._threads.take("servo")
            target, lookahead_s = self._servo_target
            here = self._robot.motion.now.target_q_rad
            velocity = tuple((b - a) / lookahead_s for a, b in zip(here, target, strict=True))
            self._robot.motion.speed(velocity, 40.0)
            yield

    def _servo_stop(self) -> Steps:
        self._threads.kill("servo")
        return self._threads.stopj("main", self._doubles(0, 1)[0])

    # -- settings and questions ------------------------------------------------------------------------------------
    def _set_payload(self) -> Steps:
        mass, *centre = self._doubles(0, 4)
        self._robot.set_payload(mass, centre if any(centre) else self._robot.payload_centre_m)
        return _nothing()

    def _set_tcp(self) -> Steps:
        self._robot.set_tcp(self._doubles(0, 6))
        return _nothing()

    def _tcp_offset(self) -> Steps:
        self._results(self._robot.tcp_offset)
        return _nothing()

    def _step_time(self) -> Steps:
        self._results([TICK_S])
        return _nothing()

    def _set_watchdog(self) -> Steps:
        self._robot.set_watchdog(self._doubles(0, 1)[0])
        return _nothing()

    def _within_limits(self) -> Steps:
        self._result(int(all(abs(q) <= JOINT_LIMIT_RAD for q in self._doubles(0, 6))))
        return _nothing()

    def _torques(self) -> Steps:
        self._results([0.0] * 6)
        return _nothing()

    def _forward_kinematics(self) -> Steps:
        self._results(self._robot.tcp_pose(self._robot.motion.actual_q_rad))
        return _nothing()

    def _flange_pose(self) -> Steps:
        self._results(flange_pose(self._robot.motion.actual_q_rad, self._robot.links))
        return _nothing()

    def _inverse_kinematics(self) -> Steps:
        flange = self._robot.flange_for(self._doubles(0, 6))
        self._results(joints_for(flange, self._robot.motion.q_rad, self._robot.links))
        return _nothing()

    def _is_steady(self) -> Steps:
        self._result(int(self._robot.steady))
        return _nothing()

    def _protective_stop(self) -> Steps:
        self._robot.protective_stop()
        return _nothing()


def _nothing() -> Iterator[None]:
    return iter(())
