"""What is mounted, beside what is remembered of its serial numbers: told, and asked, before anything moves."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Refused
from rig.station.events import Prompt
from rig.station.station import Station


@dataclass(frozen=True, slots=True)
class CalibratedBefore:
    """A calibration that a history remembers and that counts: its `number` there, its day, its verdict.

    `board_unique_id` is None where the sensor was on no board.
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
        """When it was and what came of it."""
        return f"{self.day}, {self.verdict.upper()} (calibration {self.number})"


@dataclass(frozen=True, slots=True)
class Memory:
    """What is remembered of the sensors' serial numbers, the newest first.

    `silent` is why nothing is known of them, None where the history answered; `moved` are serial numbers of sensors
    that sit on another board than before, as whoever runs the rig has stated.
    """

    calibrations: Sequence[CalibratedBefore] = ()
    silent: str | None = "no history was asked"
    moved: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class MountedSensor:
    """A sensor of this run: its name, what it is, the board it is on (None: a port of its own).

    `last` is the last calibration of its serial number, `elsewhere` the last one on a board where that was another.
    """

    name: str
    part: str
    serial_number: str
    board: str | None
    last: CalibratedBefore | None
    elsewhere: CalibratedBefore | None


@dataclass(frozen=True, slots=True)
class Mounted:
    """The sensors that are turned, and what is remembered of them."""

    sensors: tuple[MountedSensor, ...]
    memory: Memory

    @property
    def doubtful(self) -> tuple[MountedSensor, ...]:
        """The sensors whose serial number is known with another board, unless that is stated to be right."""
        found = (each for each in self.sensors if each.elsewhere is not None)
        return tuple(each for each in found if each.serial_number not in self.memory.moved)

    def lines(self) -> Iterator[str]:
        """Which sensors they are, on which board, and what is remembered of each."""
        for board in dict.fromkeys(each.board for each in self.sensors if each.board is not None):
            yield f"The board is {board}."
        for each in self.sensors:
            before = "not calibrated before" if each.last is None else f"last calibrated {each.last.words}"
            known = f", {before}" if self.memory.silent is None else ""
            if each.elsewhere is not None:
                known += f", on another board ({each.elsewhere.board_unique_id})"
            yield f"{each.name}: {each.part} {each.serial_number}{known}."
        if self.memory.silent is not None:
            yield f"What was calibrated before is not known: {self.memory.silent}."


def mounted(sensors: Mapping[str, RecordedSensor], board: str | None, memory: Memory, *, simulated: bool) -> Mounted:
    """The sensors of a run that can be calibrated, by name, on the board of that identifier.

    What is simulated and what is not are two.
    """
    found = []
    for name, sensor in sensors.items():
        if not sensor.has_axes:
            continue
        of = sensor.part, sensor.serial_number, simulated
        same = [each for each in memory.calibrations if (each.part, each.serial_number, each.simulated) == of]
        here = board if sensor.on_board else None
        elsewhere = next((each for each in same if each.board_unique_id is not None), None)
        if here is None or elsewhere is None or elsewhere.board_unique_id == here:
            elsewhere = None
        found.append(MountedSensor(name, sensor.part, sensor.serial_number, here, next(iter(same), None), elsewhere))
    return Mounted(tuple(found), memory)


def ask_of_other_boards(mounted: Mounted, station: Station) -> None:
    """Have the operator say of each doubtful sensor that it is the one of before. Raises Refused `other_board`."""
    doubtful = mounted.doubtful
    if not doubtful:
        return
    said = [_elsewhere(each, each.elsewhere) for each in doubtful if each.elsewhere is not None]
    numbers = ", ".join(each.serial_number for each in doubtful)
    another = (
        "If this is another sensor, its serial number in the configuration is wrong, and this calibration would be "
        "taken for one of the other sensor."
    )
    question = Prompt(
        (*said, another),
        f"go on with {numbers} on another board",
        to_tick=f"I have looked: the serial number is {numbers}, on another board than before",
        for_a_person=True,
    )
    if not station.ask(question):
        wrong = ", ".join(f"sensors.{each.name}.serial_number" for each in doubtful)
        stated = " ".join(f"--other-board {each.serial_number}" for each in doubtful)
        raise Refused(
            "other_board",
            "; ".join(each.rstrip(".") for each in said),
            f"Correct {wrong}; or, where a sensor was moved to this board, state that: {stated}",
        )


def _elsewhere(sensor: MountedSensor, last: CalibratedBefore) -> str:
    return (
        f"{sensor.part} {sensor.serial_number} was last calibrated {last.words} on ANOTHER board, "
        f"{last.board_unique_id}; this one is {sensor.board}."
    )
