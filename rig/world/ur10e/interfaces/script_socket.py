"""The script sockets, ports 30001 to 30003: they take programs and recognise the one that ur_rtde uploads.

Source: the maker's URScript manual. A text is a program once its blocks are closed; a line outside a block is a program
by itself. The text of `rtde_control` is not interpreted; `ur_rtde_program` simulates it. Other programs may use the
statements of `urscript`. In local control no program is accepted. Switching to local control closes the open
connections, and a connection that is opened in local control remains read-only (Universal Robots ROS Driver, issue
459).
"""

import re
from collections.abc import Callable, Iterator

from rig.world.ur10e.controller_messages import READ_ONLY, ProgramError
from rig.world.ur10e.programs.program_threads import ScriptMove
from rig.world.ur10e.programs.ur_rtde_program import ControlProgram
from rig.world.ur10e.programs.urscript import Arguments, ScriptProgram, read_move
from rig.world.ur10e.robot import Program, Robot

PRIMARY_PORT, SECONDARY_PORT, REALTIME_PORT = 30001, 30002, 30003
TEXT_BYTES = 1 << 20  # the longest program; that of ur_rtde has some 60 000
REGISTER_OFFSETS = (0, 24)  # the lower and the upper half of the registers: ur_rtde takes either
BLOCK = re.compile(r"(def|sec|thread|if|while|for)\b.*:$")


class ScriptReader:
    """A reader that splits the arriving bytes into whole programs."""

    def __init__(self) -> None:
        self._partial = b""
        self._lines: list[str] = []
        self._depth = 0
        self._size = 0  # bytes of the incomplete program

    def feed(self, data: bytes) -> Iterator[list[str]]:
        """Yield the lines of each program that `data` completes. Raise `ProgramError` if a program is too long."""
        self._size += len(data)
        *lines, self._partial = (self._partial + data).split(b"\n")
        for raw in lines:
            line = raw.decode(errors="replace").rstrip()
            words = line.split("#", 1)[0].strip()
            if not words and not self._lines:
                continue
            self._lines.append(line)
            if BLOCK.match(words):
                self._depth += 1
            elif words == "end":
                self._depth = max(0, self._depth - 1)
            if self._depth == 0:
                program, self._size = self._lines, len(self._partial)
                self._lines = []
                yield program
        if self._size > TEXT_BYTES:
            raise ProgramError(f"a program of more than {TEXT_BYTES} bytes is not accepted")


def compile_program(robot: Robot, lines: list[str]) -> Program:
    """Return the program of an uploaded text. Raise `ProgramError` for statements that are not simulated."""
    text = "\n".join(lines)
    if lines[0].startswith("def rtde_control()"):
        return ControlProgram(robot, _parse_register_offset(text), tuple(_parse_path(lines)))
    return ScriptProgram(robot, lines)


def _parse_register_offset(text: str) -> int:
    """Return the register offset that `text` sets, 0 if it sets none.

    Raise `ProgramError` for an offset that rtde_control never uses.
    """
    match = re.search(r"reg_offset_int\s*=[^\n]*\n\s*(\d+)", text)
    offset = int(match.group(1)) if match else 0
    if offset not in REGISTER_OFFSETS:
        raise ProgramError(f"registers from {offset} on are not those of rtde_control")
    return offset


def _parse_path(lines: list[str]) -> Iterator[ScriptMove]:
    """Yield the moves that ur_rtde injected into `exec_move_path`."""
    start = next((i for i, line in enumerate(lines) if "# inject move path" in line), len(lines))
    for line in lines[start + 1 :]:
        statement = line.strip()
        name = statement.split("(", 1)[0]
        if statement == "end":
            return
        if name in ("movej", "movel"):
            yield read_move(name, Arguments(statement))
        elif name != "signal_async_progress":
            raise ProgramError(f"not simulated: {statement} in a path")


ORDERS: dict[str, Callable[[Robot], object]] = {
    "power on": Robot.power_on,
    "power off": Robot.power_off,
    "set robotmode run": Robot.brake_release,
    "set unlock protective stop": Robot.unlock_protective_stop,  # also before 5 s: the maker's test_primary_client.cpp
    "stop program": lambda robot: robot.stop_program("stopped by a client"),
    "pause program": Robot.pause,
    "resume program": Robot.resume,
}


class ScriptSession:
    """The world's side of one connection to a script socket."""

    dialogue = True

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._read_only = robot.local_control  # as long as the connection is open
        self.closing = False
        self._reader = ScriptReader()

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        """Carry out the client's programs, or in local control report that none is accepted; return no answer."""
        try:
            for lines in self._reader.feed(data):
                if self._read_only or self._robot.local_control:
                    self._robot.messages.report(READ_ONLY)
                else:
                    self._obey(lines)
        except ProgramError as error:
            self._robot.messages.complain(error)
            self._reader = ScriptReader()
            self.closing = True
        return b""

    def tick(self) -> bytes:
        return b""

    def handle_close(self) -> None:
        pass

    def _obey(self, lines: list[str]) -> None:
        """Carry out a line or a program, and report its errors as messages."""
        order = ORDERS.get(lines[0].strip())
        if order is not None:
            order(self._robot)
            return
        try:
            program = compile_program(self._robot, lines)
            if lines[0].lstrip().startswith("sec "):
                run_secondary(program)
            else:
                self._robot.start_program(program)
        except ProgramError as error:
            self._robot.messages.complain(error)
        except (TypeError, ValueError, ArithmeticError) as error:  # a value of a kind the statement cannot take
            self._robot.messages.complain(ProgramError(str(error)))


def run_secondary(program: Program) -> None:
    """Run a secondary program, which takes no time and does not disturb the main one."""
    if program.step():
        raise ProgramError("a secondary program may not take time")
