"""The mounted sensors and the earlier calibrations of their serial numbers, confirmed before anything moves."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Refused
from rig.station.events import Prompt
from rig.station.operator_station import Station


@dataclass(frozen=True, slots=True)
class CalibratedBefore:
    """A valid calibration in the history: its `number` there, its day, its verdict.

    `board_unique_id` is None if the sensor was on no board.
    """

    part: str
    serial_number: str
    simulated: bool
    number: int
    day: str
    verdict: str
    board_unique_id: str | None

    @property
    def words(self) -> str:
        """The day, the verdict and the number of the calibration, in words."""
        return f"{self.day}, {self.verdict.upper()} (calibration {self.number})"


@dataclass(frozen=True, slots=True)
class Memory:
    """The earlier calibrations of the sensors' serial numbers, the newest first.

    `silent`: why no calibration can be read, None if the history answered. `moved`: the serial numbers of sensors that
    the operator declared to be on another board than before.
    """

    calibrations: Sequence[CalibratedBefore] = ()
    silent: str | None = "no history was asked"
    moved: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class MountedSensor:
    """A sensor of this run: its name, its part, and its board, None if the sensor has a port of its own.

    `last`: the last calibration of its serial number. `other_board`: the last of them on any board, None if there is
    none, if it was on the present board, or if the sensor is on no board now.
    """

    name: str
    part: str
    serial_number: str
    board: str | None
    last: CalibratedBefore | None
    other_board: CalibratedBefore | None


@dataclass(frozen=True, slots=True)
class Mounted:
    """The sensors that are turned, and their earlier calibrations."""

    sensors: tuple[MountedSensor, ...]
    memory: Memory

    @property
    def doubtful(self) -> tuple[MountedSensor, ...]:
        """The sensors last calibrated on another board, without those that the operator declared as moved."""
        moved = self.memory.moved
        return tuple(sensor for sensor in self.sensors if sensor.other_board and sensor.serial_number not in moved)

    def lines(self) -> Iterator[str]:
        """Yield a line for each board and sensor, with the sensor's last calibration."""
        for board in dict.fromkeys(sensor.board for sensor in self.sensors if sensor.board is not None):
            yield f"The board is {board}."
        for sensor in self.sensors:
            before = "not calibrated before" if sensor.last is None else f"last calibrated {sensor.last.words}"
            past = f", {before}" if self.memory.silent is None else ""
            if sensor.other_board is not None:
                past += f", on another board ({sensor.other_board.board_unique_id})"
            yield f"{sensor.name}: {sensor.part} {sensor.serial_number}{past}."
        if self.memory.silent is not None:
            yield f"What was calibrated before is not known: {self.memory.silent}."


def find_mounted(
    sensors: Mapping[str, RecordedSensor], board: str | None, memory: Memory, *, simulated: bool
) -> Mounted:
    """Return the sensors of a run that can be calibrated, with their earlier calibrations.

    `sensors` are by name; `board` identifies the board, None without one. A calibration of a simulated sensor does not
    count for a real one, nor the reverse.
    """
    turned = []
    for name, sensor in sensors.items():
        if not sensor.has_axes:
            continue
        identity = sensor.part, sensor.serial_number, simulated
        same = [past for past in memory.calibrations if (past.part, past.serial_number, past.simulated) == identity]
        on_board = board if sensor.on_board else None
        other_board = next((past for past in same if past.board_unique_id is not None), None)
        if on_board is None or other_board is None or other_board.board_unique_id == on_board:
            other_board = None
        turned.append(
            MountedSensor(name, sensor.part, sensor.serial_number, on_board, next(iter(same), None), other_board)
        )
    return Mounted(tuple(turned), memory)


def ask_of_other_boards(mounted: Mounted, station: Station) -> None:
    """Ask the operator to confirm the serial number of each doubtful sensor. Raise Refused `other_board`."""
    doubtful = mounted.doubtful
    if not doubtful:
        return
    statements = [
        _describe_other_board(sensor, sensor.other_board) for sensor in doubtful if sensor.other_board is not None
    ]
    numbers = ", ".join(sensor.serial_number for sensor in doubtful)
    another = (
        "If this is another sensor, its serial number in the configuration is wrong, and the history would count this "
        "calibration as one of the other sensor."
    )
    question = Prompt(
        (*statements, another),
        f"go on with {numbers} on another board",
        to_tick=f"I have looked: the serial number is {numbers}, on another board than before",
        for_a_person=True,
    )
    if not station.ask(question):
        wrong = ", ".join(f"sensors.{sensor.name}.serial_number" for sensor in doubtful)
        stated = " ".join(f"--other-board {sensor.serial_number}" for sensor in doubtful)
        raise Refused(
            "other_board",
            "; ".join(statement.rstrip(".") for statement in statements),
            f"Correct {wrong}; or, where a sensor was moved to this board, state that: {stated}",
        )


def _describe_other_board(sensor: MountedSensor, last: CalibratedBefore) -> str:
    return (
        f"{sensor.part} {sensor.serial_number} was last calibrated {last.words} on ANOTHER board, "
        f"{last.board_unique_id}; this one is {sensor.board}."
    )
