"""Simple URScript programs: straight lines of statements, played one after another."""

import ast
import re
from collections.abc import Callable
from typing import Any

from rig.world.clock import TICKS_PER_SECOND
from rig.world.program import Steps, Threads
from rig.world.robot import ProgramError, Robot
from rig.world.trajectory import Joints

CALL = re.compile(r"([a-z_][a-z_0-9]*)\((.*)\)$", re.IGNORECASE)
FRAME = re.compile(r"^(def|sec)\s+(\w+)\s*\(\s*\)\s*:$")


def arguments(statement: str) -> dict[str, Any]:
    """What a call gives, by keyword or by place ("0", "1", …). Raises `ProgramError` for anything but literals."""
    match = CALL.match(statement)
    if match is None:
        raise ProgramError(f"not simulated: {statement}")
    source = re.sub(r"\bp\[", "[", match.group(2))
    try:
        call = ast.parse(f"f({source})", mode="eval").body
        assert isinstance(call, ast.Call)
        values = {str(i): ast.literal_eval(value) for i, value in enumerate(call.args)}
        return values | {str(item.arg): ast.literal_eval(item.value) for item in call.keywords}
    except (SyntaxError, ValueError):
        raise ProgramError(f"not simulated: {statement}") from None


def joints(value: Any) -> Joints:
    """Six joint angles. Raises `ProgramError` when it is something else."""
    if not isinstance(value, list) or len(value) != 6:
        raise ProgramError(f"six joint angles expected, got {value}")
    return tuple(float(angle) for angle in value)


class ScriptProgram:
    """A program of statements without variables, loops or conditions."""

    def __init__(self, robot: Robot, lines: list[str]) -> None:
        self._robot = robot
        self._threads = Threads(robot)
        statements = [line.split("#", 1)[0].strip() for line in lines]
        statements = [statement for statement in statements if statement]
        frame = FRAME.match(statements[0]) if statements else None
        self.name = frame.group(2) if frame else "unnamed"
        if frame:
            statements = statements[1:-1]
        for statement in statements:
            call = CALL.match(statement)
            if call is None or call.group(1) not in (*STATEMENTS, "textmsg"):
                raise ProgramError(f"not simulated: {statement}")
        self._main = self._play(statements)

    def step(self) -> bool:
        return next(self._main, StopIteration) is not StopIteration

    def _play(self, statements: list[str]) -> Steps:
        for statement in statements:
            name = statement.split("(", 1)[0]
            if name == "textmsg":
                self._robot.say(statement[len("textmsg(") : -1])
                continue
            yield from STATEMENTS[name](self._robot, self._threads, Arguments(statement).value)


class Arguments:
    """The arguments of one call, found by keyword or place."""

    def __init__(self, statement: str) -> None:
        self._statement, self._values = statement, arguments(statement)

    def value(self, place: str, keyword: str, default: Any = None) -> Any:
        found = self._values.get(keyword, self._values.get(place, default))
        if found is None:
            raise ProgramError(f"{self._statement} needs {keyword}")
        return found


Value = Callable[..., Any]


def _movej(robot: Robot, threads: Threads, value: Value) -> Steps:
    target = joints(value("0", "q"))
    speed, acceleration = float(value("2", "v", 1.05)), float(value("1", "a", 1.4))
    return threads.movej("main", target, speed, acceleration)


def _speedj(robot: Robot, threads: Threads, value: Value) -> Steps:
    threads.take("main")
    robot.motion.speed(joints(value("0", "qd")), float(value("1", "a")))
    yield from _wait(float(value("2", "t", 0.0)))
    threads.let_go("main")


def _stopj(robot: Robot, threads: Threads, value: Value) -> Steps:
    return threads.stopj("main", float(value("0", "a")))


def _sleep(robot: Robot, threads: Threads, value: Value) -> Steps:
    return _wait(float(value("0", "t")))


def _wait(duration_s: float) -> Steps:
    for _ in range(round(duration_s * TICKS_PER_SECOND)):
        yield


def _sync(robot: Robot, threads: Threads, value: Value) -> Steps:
    yield


def _at_once(action: Callable[[Robot, Value], None]) -> Callable[[Robot, Threads, Value], Steps]:
    def steps(robot: Robot, threads: Threads, value: Value) -> Steps:
        action(robot, value)
        return iter(())

    return steps


def _payload(robot: Robot, value: Value) -> None:
    robot.set_payload(float(value("0", "m")), value("1", "cog", [0.0, 0.0, 0.0]))


def _tcp(robot: Robot, value: Value) -> None:
    robot.tcp_offset = tuple(float(x) for x in value("0", "pose"))


def _digital_out(first: int) -> Callable[[Robot, Value], None]:
    def put(robot: Robot, value: Value) -> None:
        bit = 1 << first + int(value("0", "n"))
        robot.digital_outputs = robot.digital_outputs | bit if value("1", "b") else robot.digital_outputs & ~bit

    return put


def _integer_register(robot: Robot, value: Value) -> None:
    robot.outputs.ints[int(value("0", "address"))] = int(value("1", "value"))


def _float_register(robot: Robot, value: Value) -> None:
    robot.outputs.doubles[int(value("0", "address"))] = float(value("1", "value"))


def _boolean_register(robot: Robot, value: Value) -> None:
    robot.outputs.bits[int(value("0", "address"))] = bool(value("1", "value"))


STATEMENTS: dict[str, Callable[[Robot, Threads, Value], Steps]] = {
    "movej": _movej, "speedj": _speedj, "stopj": _stopj, "sleep": _sleep, "sync": _sync,
    "popup": _at_once(lambda robot, value: robot.say(str(value("0", "s")))),
    "set_payload": _at_once(_payload), "set_target_payload": _at_once(_payload), "set_tcp": _at_once(_tcp),
    "set_gravity": _at_once(lambda robot, value: None),
    "set_digital_out": _at_once(_digital_out(0)), "set_standard_digital_out": _at_once(_digital_out(0)),
    "set_configurable_digital_out": _at_once(_digital_out(8)), "set_tool_digital_out": _at_once(_digital_out(16)),
    "write_output_integer_register": _at_once(_integer_register),
    "write_output_float_register": _at_once(_float_register),
    "write_output_boolean_register": _at_once(_boolean_register),
    "protective_stop": _at_once(lambda robot, value: robot.protective_stop()),
    "power_down": _at_once(lambda robot, value: robot.power_off()),
}  # fmt: skip
