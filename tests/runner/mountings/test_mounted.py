"""What the operator is told and asked of the sensors before anything moves."""

from collections.abc import Sequence

import pytest

from rig.data.quantity import FIELD
from rig.data.recording.channel import triad_channel
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Refused
from rig.runner.mounted_sensors import CalibratedBefore, Memory, Mounted, ask_of_other_boards, find_mounted
from rig.station.operator_station import Stations, always_yes

HERE, THERE = "0123456789abcdef01234567", "f" * 24


def sensor(serial_number: str, clock: str | None = None) -> RecordedSensor:
    return RecordedSensor("lsm9ds1", serial_number, 100.0, (triad_channel(FIELD, 1e-8, 32767, None),), clock=clock)


def before(board: str | None, day: str = "2026-11-20", *, simulated: bool = False) -> CalibratedBefore:
    return CalibratedBefore("lsm9ds1", "G-0042", simulated, 8, day, "pass", board)


def carried(*known: CalibratedBefore, moved: frozenset[str] = frozenset(), clock: str | None = None) -> Mounted:
    return find_mounted({"gyro": sensor("G-0042", clock)}, HERE, Memory(known, None, moved), simulated=False)


class Operator:
    """Remembers what was asked, and says the same to all of it."""

    def __init__(self, *, agrees: bool) -> None:
        self.agrees, self.asked = agrees, list[str]()

    def __call__(self, announcement: Sequence[str], to_do: str) -> bool:
        self.asked.append(" ".join([*announcement, to_do]))
        return self.agrees


def test_the_operator_reads_what_is_turned_and_when_it_was_calibrated() -> None:
    assert list(carried(before(HERE)).lines()) == [
        f"The board is {HERE}.",
        "gyro: lsm9ds1 G-0042, last calibrated 2026-11-20, PASS (calibration 8).",
    ]
    assert list(carried().lines())[1] == "gyro: lsm9ds1 G-0042, not calibrated before."


def test_a_history_that_says_nothing_is_not_taken_for_an_empty_one() -> None:
    known = find_mounted({"gyro": sensor("G-0042")}, HERE, Memory(silent="the history is off"), simulated=False)
    assert list(known.lines())[1:] == [
        "gyro: lsm9ds1 G-0042.",
        "What was calibrated before is not known: the history is off.",
    ]


def test_a_serial_number_on_another_board_is_asked_about_with_both_boards() -> None:
    operator = Operator(agrees=True)
    ask_of_other_boards(carried(before(THERE)), Stations((), operator))
    (asked,) = operator.asked
    assert "lsm9ds1 G-0042 was last calibrated 2026-11-20, PASS (calibration 8) on ANOTHER board" in asked
    assert HERE in asked and THERE in asked and asked.endswith("go on with G-0042 on another board")


def test_nobody_agrees_beforehand_to_a_serial_number_on_another_board() -> None:
    for station in (Stations((), always_yes, attended=False), Stations((), Operator(agrees=False))):
        with pytest.raises(Refused, match="ANOTHER board") as refused:
            ask_of_other_boards(carried(before(THERE)), station)
        assert refused.value.name == "other_board"
        assert "sensors.gyro.serial_number" in refused.value.remedy and "--other-board G-0042" in refused.value.remedy


@pytest.mark.parametrize(
    "sound",
    [
        carried(),
        carried(before(HERE)),
        carried(before(HERE, "2026-11-21"), before(THERE)),  # it was moved here before the last time
        carried(before(None, "2026-11-21"), before(HERE)),
        carried(before(THERE, simulated=True)),
        carried(before(THERE), clock="gyro"),  # it has a port of its own
        carried(before(THERE), moved=frozenset({"G-0042"})),
    ],
)
def test_nothing_is_asked_of_a_sensor_where_it_was(sound: Mounted) -> None:
    operator = Operator(agrees=False)
    ask_of_other_boards(sound, Stations((), operator))
    assert operator.asked == []


def test_readings_without_a_board_do_not_hide_on_which_board_a_sensor_was() -> None:
    assert [each.serial_number for each in carried(before(None, "2026-11-21"), before(THERE)).doubtful] == ["G-0042"]
