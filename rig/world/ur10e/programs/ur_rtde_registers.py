"""The registers over which ur_rtde and its program speak, counted from where the client wants them."""

from collections.abc import Sequence

from rig.world.ur10e.robot import Robot


class ProgramRegisters:
    """The registers of one program: the first is number `offset` of the controller's."""

    def __init__(self, robot: Robot, offset: int) -> None:
        self._robot = robot
        self._offset = offset

    def whole(self, index: int) -> int:
        """What the client has written, as `doubles`."""
        return self._robot.inputs.ints[self._offset + index]

    def doubles(self, first: int, count: int) -> tuple[float, ...]:
        start = self._offset + first
        return tuple(self._robot.inputs.doubles[start : start + count])

    def answer(self, index: int, value: int) -> None:
        """What the client reads, as `results`; the first says whether the program is ready or done."""
        self._robot.outputs.ints[self._offset + index] = value

    def results(self, values: Sequence[float]) -> None:
        self._robot.outputs.doubles[self._offset : self._offset + len(values)] = values
