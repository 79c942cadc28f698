"""What is said of an event, who hears it, and that nobody who listens can end a run."""

from pathlib import Path

from rig.errors import Fault
from rig.station.events import (
    Answered,
    Crashed,
    Failed,
    Interrupted,
    Message,
    PhaseRecorded,
    Prompt,
    RunEvent,
    RunResumed,
    SamplesTaken,
    SensorSamples,
)
from rig.station.log import log
from rig.station.station import Stations
from rig.station.words import line, reason

SAMPLES = (SensorSamples("gyro", 100, 2, (0.0, 0.0, 1.0)), SensorSamples("reference", 50, 1, None))


class Everything:
    """Remembers all it is told."""

    def __init__(self) -> None:
        self.events: list[RunEvent] = []

    def event(self, event: RunEvent) -> None:
        self.events.append(event)


def test_a_line_is_made_of_what_the_event_holds() -> None:
    assert line(RunResumed(2, 6)) == "resuming: 2 of 6 sweeps are recorded, sound and known to the board"
    assert line(PhaseRecorded(SAMPLES, 4)) == "recorded: 150 samples, 3 lost; 4 arm states missed"
    assert line(SamplesTaken(SAMPLES)) is None and line(Failed(Fault("x", "y", "z"))) is None


def test_the_log_keeps_lines_and_reasons_with_the_time(tmp_path: Path) -> None:
    with log(tmp_path / "log.txt") as listener:
        events = (
            Message("good morning"),
            SamplesTaken(SAMPLES),
            Failed(Fault("no_luck", "it broke", "Mend it")),
            Interrupted("interrupted"),
            Crashed("Traceback"),
        )
        for event in events:
            listener.event(event)
    said = (tmp_path / "log.txt").read_text(encoding="utf-8").splitlines()
    assert [text[24:] for text in said] == [
        "INFO good morning", "INFO no_luck: it broke. Mend it.", "INFO interrupted", "INFO Traceback",
    ]  # fmt: skip
    assert reason(Message("good morning")) is None


def test_a_log_on_a_full_disk_is_no_error() -> None:
    with log(Path("/dev/full")) as listener:
        listener.event(Message("lost"))


def test_everyone_hears_everything_and_one_answers() -> None:
    one, other = Everything(), Everything()
    asked: list[tuple[tuple[str, ...], str]] = []

    def answer(announcement: object, to_do: str) -> bool:
        assert isinstance(announcement, tuple)
        asked.append((announcement, to_do))
        return False

    station = Stations((one, other), answer)
    station.event(Message("good morning"))
    prompt = Prompt(("The arm will move.",), "start")
    assert not station.ask(prompt)
    assert asked == [(("The arm will move.",), "start")]
    assert one.events == other.events == [Message("good morning"), prompt, Answered(agreed=False)]
