"""Simple URScript programs: statements and endless loops, played in sequence."""

import ast
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeGuard

from rig.world.clock import TICKS_PER_SECOND
from rig.world.ur10e.controller_messages import OutOfReach, ProgramError
from rig.world.ur10e.motion.trajectory import Joints
from rig.world.ur10e.programs.program_threads import ScriptMove, Steps, Threads, check_finite
from rig.world.ur10e.robot import Robot

MAX_NESTING = 50  # loops inside loops
CALL = re.compile(r"([a-z_][a-z_0-9]*)\((.*)\)$", re.IGNORECASE)
TEXT = re.compile(r'"[^"]*"|\'[^\']*\'')  # text in quotation marks, in which brackets and # have no meaning
FRAME = re.compile(r"^(def|sec)\s+(\w+)\s*\(\s*\)\s*:$")


def parse_arguments(statement: str) -> dict[str, Any]:
    """Return a call's arguments by keyword or index ("0", "1", …). Raise `ProgramError` unless all are constants."""
    match = CALL.match(statement)
    if match is None:
        raise ProgramError(f"not simulated: {statement}")
    source = re.sub(r"\bp\[([^\]]*)\]", r"(\1)", match.group(2))  # a pose becomes a tuple, joints stay a list
    try:
        call = ast.parse(f"f({source})", mode="eval").body
        if not isinstance(call, ast.Call):
            raise ValueError("more than a call")
        values = {str(i): evaluate_constant(value) for i, value in enumerate(call.args)}
        return values | {str(item.arg): evaluate_constant(item.value) for item in call.keywords}
    except (SyntaxError, ValueError, ArithmeticError, TypeError, RecursionError, MemoryError):
        # The last two: the parser's errors for brackets nested too deeply.
        raise ProgramError(f"not simulated: {statement}") from None


OPERATIONS: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip


def evaluate_constant(node: ast.expr) -> Any:
    """Return the value of a literal or of an expression of numbers (`0 + 0`). Raise ValueError, ArithmeticError."""
    match node:
        case ast.BinOp(left, operation, right) if type(operation) in OPERATIONS:
            one, other = evaluate_constant(left), evaluate_constant(right)
            if not (isinstance(one, int | float) and isinstance(other, int | float)):
                raise ValueError("no number")
            return OPERATIONS[type(operation)](one, other)
        case ast.List(values):
            return [evaluate_constant(value) for value in values]
        case ast.Tuple(values):
            return tuple(evaluate_constant(value) for value in values)
        case _:
            return ast.literal_eval(node)


def read_joints(value: Any) -> Joints:
    """Return six joint angles. Raise `ProgramError` for any other value."""
    if not isinstance(value, list) or len(value) != 6:
        raise ProgramError(f"six joint angles expected, got {value}")
    return tuple(float(angle) for angle in value)


@dataclass(frozen=True, slots=True)
class Call:
    """A statement and its position in the program."""

    text: str
    position: tuple[int, int]


@dataclass(frozen=True, slots=True)
class Loop:
    """The loop `while True:` with its body."""

    body: "Block"


Block = tuple[Call | Loop, ...]


def check_brackets(lines: Sequence[str]) -> None:
    """Raise `ProgramError` at the line at which the controller's compiler detects unbalanced brackets.

    The compiler detects an open bracket at the next line that is not empty. The message contains that line.
    """
    depth = 0
    for number, line in enumerate(lines, 1):
        text = TEXT.sub("", line).split("#", 1)[0]
        if text.strip() and depth > 0:
            raise ProgramError(f"syntax_error_on_line:{number}:{line}:", (number, 1))
        depth += sum(text.count(bracket) for bracket in "([") - sum(text.count(bracket) for bracket in ")]")
        if depth < 0:
            raise ProgramError(f"syntax_error_on_line:{number}:{line}:", (number, 1))


def parse_program(lines: Sequence[str]) -> tuple[str, Block]:
    """Return name and body of a program.

    Raise `ProgramError` at the first line that is not simulated. If the line calls an unknown function, the message is
    that of the maker's compiler.
    """
    check_brackets(lines)
    name = "unnamed"
    stack: list[list[Call | Loop]] = [[]]
    for number, line in enumerate(lines, 1):
        text = line.split("#", 1)[0].strip()
        frame = FRAME.match(text)
        call = CALL.match(text)
        if not text:
            continue
        if frame and number == 1:
            name = frame.group(2)
        elif text == "while True:":
            if len(stack) > MAX_NESTING:
                raise ProgramError("not simulated: loops so deep in one another", (number, 1))
            stack.append([])
        elif text == "end" and len(stack) > 1:
            body = stack.pop()
            stack[-1].append(Loop(tuple(body)))
        elif call and call.group(1) in STATEMENTS:
            stack[-1].append(Call(text, (number, len(line) - len(line.lstrip()) + 1)))
        elif text != "end":
            what = f"compile_error_name_not_found:{call.group(1)}:" if call else f"not simulated: {text}"
            raise ProgramError(what, (number, len(line) - len(line.lstrip()) + 1))
    return name, tuple(stack[0])


def is_lone_move(body: Block) -> TypeGuard[tuple[Call]]:
    """Return whether a program is one movej and nothing else."""
    return len(body) == 1 and isinstance(body[0], Call) and body[0].text.startswith("movej(")


class ScriptProgram:
    """A program of the statements in `STATEMENTS` and endless loops: no variables, no conditions."""

    waiting = False  # unknown whether it waits

    def __init__(self, robot: Robot, lines: Sequence[str]) -> None:
        self._robot = robot
        self._threads = Threads(robot)
        self.name, body = parse_program(lines)
        self._main = self._play_move(body[0]) if is_lone_move(body) else self._play(body)

    def step(self) -> bool:
        return next(self._main, StopIteration) is not StopIteration

    def _play_move(self, call: Call) -> Steps:
        """Play the only movej of a program, which starts gently."""
        try:
            yield from self._threads.move("main", replace(read_move("movej", Arguments(call.text)), is_soft=True))
        except OutOfReach:
            raise
        except (ProgramError, TypeError, ValueError, IndexError, ArithmeticError) as error:
            raise ProgramError(str(error), call.position) from None

    def _play(self, block: Block) -> Steps:
        """Play the statements of a block in order; a loop plays its body for ever."""
        for item in block:
            if isinstance(item, Loop):
                while True:
                    yield from self._play(item.body)
                    yield  # a loop that takes no time would block other threads
            try:
                yield from STATEMENTS[item.text.split("(", 1)[0]](self._robot, self._threads, Arguments(item.text))
            except OutOfReach:
                raise
            except (ProgramError, TypeError, ValueError, IndexError, ArithmeticError) as error:
                raise ProgramError(str(error), item.position) from None


class Arguments:
    """The arguments of one call, by keyword or index."""

    def __init__(self, statement: str) -> None:
        self._statement, self._values = statement, parse_arguments(statement)

    def all(self) -> list[Any]:
        return list(self._values.values())

    def __call__(self, index: str, keyword: str, default: Any = None) -> Any:
        value = self._values.get(keyword, self._values.get(index, default))
        if value is None:
            raise ProgramError(f"{self._statement} needs {keyword}")
        return value


def read_move(name: str, value: Arguments) -> ScriptMove:
    """Return the move of a `movej` or `movel`. A blend radius is not simulated, so the arm stops at every target."""
    target = value("0", "pose" if name == "movel" else "q")
    if not isinstance(target, (list, tuple)) or len(target) != 6:
        raise ProgramError(f"{name}: six joint angles or a pose expected, got {target}")
    speed, acceleration = (0.25, 1.2) if name == "movel" else (1.05, 1.4)  # URScript's defaults
    numbers = tuple(float(number) for number in target)
    speed, acceleration = float(value("2", "v", speed)), float(value("1", "a", acceleration))
    return ScriptMove(numbers, speed, acceleration, straight=name == "movel", is_pose=isinstance(target, tuple))


def _movej(robot: Robot, threads: Threads, value: Arguments) -> Steps:
    return threads.move("main", read_move("movej", value))


def _movel(robot: Robot, threads: Threads, value: Arguments) -> Steps:
    return threads.move("main", read_move("movel", value))


def _speedj(robot: Robot, threads: Threads, value: Arguments) -> Steps:
    threads.take("main")
    velocity, acceleration = read_joints(value("0", "qd")), float(value("1", "a"))
    check_finite([*velocity, acceleration])
    robot.motion.speed(velocity, max(acceleration, 0.01))
    yield from _wait(float(value("2", "t", 0.0)))
    threads.let_go("main")


def _stopj(robot: Robot, threads: Threads, value: Arguments) -> Steps:
    return threads.stopj("main", float(value("0", "a")))


def _sleep(robot: Robot, threads: Threads, value: Arguments) -> Steps:
    return _wait(float(value("0", "t")))


def _wait(duration_s: float) -> Steps:
    for _ in range(round(duration_s * TICKS_PER_SECOND)):
        yield


def _sync(robot: Robot, threads: Threads, value: Arguments) -> Steps:
    yield


def _wrap(action: Callable[[Robot, Arguments], None]) -> Callable[[Robot, Threads, Arguments], Steps]:
    def steps(robot: Robot, threads: Threads, value: Arguments) -> Steps:
        action(robot, value)
        return iter(())

    return steps


def _payload(robot: Robot, value: Arguments) -> None:
    robot.set_payload(float(value("0", "m")), value("1", "cog", [0.0, 0.0, 0.0]))


def _tcp(robot: Robot, value: Arguments) -> None:
    robot.set_tcp(value("0", "pose"))


def _digital_out(first: int) -> Callable[[Robot, Arguments], None]:
    """Return the statement that sets one of eight digital outputs; the first of them is bit `first`."""

    def put(robot: Robot, value: Arguments) -> None:
        number = int(value("0", "n"))
        if not 0 <= number < 8:
            raise ProgramError(f"there is no output {number}")
        bit = 1 << first + number
        robot.digital_outputs = robot.digital_outputs | bit if value("1", "b") else robot.digital_outputs & ~bit

    return put


def _integer_register(robot: Robot, value: Arguments) -> None:
    number = int(value("1", "value"))
    if not -(2**31) <= number < 2**31:
        raise ProgramError(f"{number} does not fit an integer register")
    robot.outputs.ints[int(value("0", "address"))] = number


def _float_register(robot: Robot, value: Arguments) -> None:
    robot.outputs.doubles[int(value("0", "address"))] = float(value("1", "value"))


def _boolean_register(robot: Robot, value: Arguments) -> None:
    robot.outputs.bits[int(value("0", "address"))] = bool(value("1", "value"))


def _say(robot: Robot, value: Arguments) -> None:
    robot.messages.say("".join(str(part) for part in value.all()))


STATEMENTS: dict[str, Callable[[Robot, Threads, Arguments], Steps]] = {
    "movej": _movej, "movel": _movel, "speedj": _speedj, "stopj": _stopj, "sleep": _sleep, "sync": _sync,
    "textmsg": _wrap(_say), "popup": _wrap(_say),
    "set_payload": _wrap(_payload), "set_target_payload": _wrap(_payload), "set_tcp": _wrap(_tcp),
    "set_gravity": _wrap(lambda robot, value: None),
    "set_digital_out": _wrap(_digital_out(0)), "set_standard_digital_out": _wrap(_digital_out(0)),
    "set_configurable_digital_out": _wrap(_digital_out(8)), "set_tool_digital_out": _wrap(_digital_out(16)),
    "write_output_integer_register": _wrap(_integer_register),
    "write_output_float_register": _wrap(_float_register),
    "write_output_boolean_register": _wrap(_boolean_register),
    "protective_stop": _wrap(lambda robot, value: robot.protective_stop()),
    "power_down": _wrap(lambda robot, value: robot.power_off()),
}  # fmt: skip
