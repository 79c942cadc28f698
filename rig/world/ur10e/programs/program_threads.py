"""Programs as cooperative threads: generators that yield once a tick."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from rig.world.ur10e.controller_messages import ProgramError
from rig.world.ur10e.motion.cartesian import plan_straight_line, solve_inverse_kinematics
from rig.world.ur10e.motion.forward_kinematics import flange_pose
from rig.world.ur10e.motion.trajectory import plan_joint_move, plan_soft_joint_move
from rig.world.ur10e.robot import Robot

Steps = Iterator[None]

MAX_NUMBER = 1e6  # angles, lengths, speeds and accelerations, all in SI units
MIN_SPEED, MIN_LINE_SPEED_M_S = 1e-6, 1e-3  # rad/s; the least accelerations have the same numbers
HAND_OVER_RAD_S2 = 4.0  # deceleration before a move that follows a killed one


@dataclass(frozen=True, slots=True)
class ScriptMove:
    """A movej, or a movel if `straight`. The target is joint angles, or a pose of the tool's frame if `is_pose`.

    Speed and acceleration are in rad/s and rad/s², for a straight move in m/s and m/s². `is_soft`: it starts gently.
    """

    target: tuple[float, ...]
    speed: float
    acceleration: float
    straight: bool = False
    is_pose: bool = False
    is_soft: bool = False


def check_finite(values: Sequence[float]) -> None:
    """Raise `ProgramError` if a number is too large for any joint."""
    if not all(abs(value) <= MAX_NUMBER for value in values):
        raise ProgramError(f"a number no joint can follow among {list(values)}")


class Threads:
    """The threads of one program. Only one at a time may move the robot."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self._threads: dict[str, Steps] = {}
        self._mover: str | None = None

    def run(self, name: str, steps: Steps) -> None:
        self._threads[name] = steps

    def kill(self, name: str) -> None:
        self._threads.pop(name, None)
        self.let_go(name)

    @property
    def any(self) -> bool:
        """Whether any thread runs besides the main one."""
        return bool(self._threads)

    def is_running(self, name: str) -> bool:
        return name in self._threads

    def step(self) -> None:
        """Step every thread once."""
        for name, steps in list(self._threads.items()):
            if next(steps, StopIteration) is StopIteration:
                self.kill(name)

    def take(self, name: str) -> None:
        """Claim the joints for a thread. Raise `ProgramError` if another thread has them."""
        if self._mover not in (None, name):
            raise ProgramError("another thread is already controlling the robot")
        self._mover = name

    def let_go(self, name: str) -> None:
        if self._mover == name:
            self._mover = None

    def move(self, name: str, move: ScriptMove) -> Steps:
        """Move the joints for the thread `name`, until they rest at the target."""
        if not min(move.speed, move.acceleration) >= (MIN_LINE_SPEED_M_S if move.straight else MIN_SPEED):
            raise ProgramError("a move needs a speed and an acceleration above zero")
        check_finite([*move.target, move.speed, move.acceleration])
        self.take(name)
        yield from self.stopj(name, HAND_OVER_RAD_S2)
        self.take(name)
        motion, links = self.robot.motion, self.robot.links
        if move.straight:
            pose = self.robot.flange_pose_for(move.target) if move.is_pose else flange_pose(move.target, links)
            trajectory = yield from plan_straight_line(motion.settled_q_rad, pose, move.speed, move.acceleration, links)
        else:
            target = move.target
            if move.is_pose:
                target = solve_inverse_kinematics(self.robot.flange_pose_for(target), motion.settled_q_rad, links)
            start, limits = motion.settled_q_rad, motion.speed_limit_rad_s
            plan = plan_soft_joint_move if move.is_soft else plan_joint_move
            trajectory = plan(start, target, move.speed, move.acceleration, limits)
        if not self.robot.is_within_limits(trajectory.end_rad):
            raise ProgramError("joint position out of limits: a target lies beyond a joint's limit")
        motion.follow(trajectory)
        while not motion.standing:
            yield
        self.let_go(name)

    def stopj(self, name: str, deceleration_rad_s2: float) -> Steps:
        """Slow the joints down to rest."""
        self.take(name)
        if not self.robot.motion.standing:
            self.robot.motion.stop(max(deceleration_rad_s2, 0.01))
            while not self.robot.motion.standing:
                yield
        self.let_go(name)
