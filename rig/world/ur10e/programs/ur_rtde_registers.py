"""The registers of ur_rtde and its program, counted from the client's offset."""

from collections.abc import Sequence

from rig.world.ur10e.robot import Robot


class ProgramRegisters:
    """The registers of one program, whose register 0 is the controller's register `offset`."""

    def __init__(self, robot: Robot, offset: int) -> None:
        self._robot = robot
        self._offset = offset

    def integer(self, index: int) -> int:
        """Return an integer that the client has written."""
        return self._robot.inputs.ints[self._offset + index]

    def doubles(self, first: int, count: int) -> tuple[float, ...]:
        start = self._offset + first
        return tuple(self._robot.inputs.doubles[start : start + count])

    def write_integer(self, index: int, value: int) -> None:
        """Write an integer for the client; register 0 holds the program's state, ready or done."""
        self._robot.outputs.ints[self._offset + index] = value

    def write_doubles(self, values: Sequence[float]) -> None:
        self._robot.outputs.doubles[self._offset : self._offset + len(values)] = values
