"""What is said of an event, who hears it, and that nobody who listens can end a run."""

import io
from pathlib import Path

import pytest
from rich.console import Console
from rich.live import Live

from rig.errors import Fault, Refused
from rig.motion.steps import Rest
from rig.station.events import (
    Advice,
    Answered,
    CalibrationStored,
    Crashed,
    Failed,
    Interrupted,
    ListenerDropped,
    PhaseRecorded,
    PhaseSkipped,
    Plotted,
    Progress,
    Prompt,
    Remembered,
    RunEvent,
    RunFolderWritten,
    RunResumed,
    SamplesTaken,
    SamplingStarted,
    SensorSamples,
)
from rig.station.log import log
from rig.station.operator_station import Stations, always_yes
from rig.station.view import LiveView
from rig.station.words import line, reason
from support.processes.full_disk import full_disk

SAMPLES = (SensorSamples("gyro", 100, 2, {"rate": (0.0, 0.0, 1.0)}), SensorSamples("reference", 50, 1, {}))


class Everything:
    """Remembers all it is told."""

    def __init__(self) -> None:
        self.events: list[RunEvent] = []

    def event(self, event: RunEvent) -> None:
        self.events.append(event)


def test_a_line_is_made_of_what_the_event_holds() -> None:
    assert line(RunResumed(2, 6)) == "resuming: 2 of 6 sweeps and dwells are recorded and valid"
    assert line(PhaseRecorded(SAMPLES, 4)) == "recorded: 150 samples, 3 lost; 4 arm states missed"
    stored = CalibrationStored("gyro", "lsm9ds1", "LSM9DS1-001", 3)
    assert line(stored) == "stored on the board: gyro, lsm9ds1 LSM9DS1-001, record 3"
    said = line(PhaseSkipped("verify"))
    assert said == "not verified: the calibration failed its limits, so the board keeps its old calibration"
    assert line(Plotted(("one", "other"))) == "plotted: one, other (.png, .svg)"
    assert line(RunFolderWritten(Path("a run"))) == "written: a run"
    kept = "the data are kept in a run"
    again = f"{kept}; to repeat refused sweeps: rig resume 'a run'"
    assert line(Advice(Path("a run"), "rig resume 'a run'", repeats=True)) == again
    going_on = f"{kept}; after correcting the cause, continue with: rig resume 'a run'"
    assert line(Advice(Path("a run"), "rig resume 'a run'", repeats=False)) == going_on
    assert line(Remembered("h", (8,))) == "entered in h as calibration 8 (rig history show 8)"
    assert line(Remembered("h", (8, 9, 10))) == "entered in h as calibrations 8 to 10 (rig history show 8)"
    assert "as calibrations 8, 11 (" in (line(Remembered("h", (8, 11))) or "")
    assert line(SamplesTaken(SAMPLES)) is None and line(Failed(Fault("x", "y", "z"))) is None


def test_the_log_keeps_lines_and_reasons_with_the_time(tmp_path: Path) -> None:
    with log(tmp_path / "log.txt") as listener:
        events = (
            SamplingStarted(),
            SamplesTaken(SAMPLES),
            Failed(Fault("no_luck", "it broke", "Mend it")),
            Interrupted("interrupted"),
            Crashed("Traceback"),
        )
        for event in events:
            listener.event(event)
    said = (tmp_path / "log.txt").read_text(encoding="utf-8").splitlines()
    assert [text[24:] for text in said] == [
        "INFO sampling: every sensor sends readings",
        "INFO no_luck: it broke. Mend it.",
        "INFO interrupted",
        "INFO Traceback",
    ]
    assert reason(SamplingStarted()) is None


def test_a_log_on_a_full_disk_is_no_error(tmp_path: Path) -> None:
    with full_disk(), log(tmp_path / "log.txt") as listener:
        listener.event(SamplingStarted())
    assert (tmp_path / "log.txt").read_bytes() == b""


def test_a_log_is_not_written_into_a_device_or_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "log.txt").symlink_to(tmp_path / "elsewhere")
    for path in (Path("/dev/full"), tmp_path / "log.txt"):
        with pytest.raises(Refused, match=r"run_folder: .*(regular file|symbolic links)"), log(path):
            pass
    assert not (tmp_path / "elsewhere").exists()


def test_everyone_hears_everything_and_one_answers() -> None:
    one, other = Everything(), Everything()
    asked: list[tuple[tuple[str, ...], str]] = []

    def answer(announcement: object, to_do: str) -> bool:
        assert isinstance(announcement, tuple)
        asked.append((announcement, to_do))
        return False

    station = Stations((one, other), answer)
    station.event(SamplingStarted())
    prompt = Prompt(("The arm will move.",), "start")
    assert not station.ask(prompt)
    assert asked == [(("The arm will move.",), "start")]
    assert one.events == other.events == [SamplingStarted(), prompt, Answered(agreed=False)]


class Raising:
    """Cannot bear to be told that sampling started."""

    def __init__(self) -> None:
        self.events: list[RunEvent] = []

    def event(self, event: RunEvent) -> None:
        self.events.append(event)
        if isinstance(event, SamplingStarted):
            raise ValueError("too much")


def test_a_listener_that_raises_is_dropped_and_the_others_are_told_so_once() -> None:
    one, raising, other = Everything(), Raising(), Everything()
    station = Stations((one, raising, other), always_yes)
    told = (PhaseSkipped("verify"), SamplingStarted(), PhaseSkipped("verify"))
    for event in told:
        station.event(event)
    dropped = ListenerDropped("Raising", "ValueError: too much")
    assert one.events == other.events == [*told[:2], dropped, told[2]]
    assert raising.events == list(told[:2])
    assert line(dropped) == "Raising was disconnected from this run: it failed (ValueError: too much)"


def test_the_log_keeps_where_a_script_failed() -> None:
    failed = Fault("script_failed", "it broke", "Mend it")
    failed.__cause__ = ZeroDivisionError("by nothing")
    assert reason(Failed(failed)) == "script_failed: it broke. Mend it.\nZeroDivisionError: by nothing"


def test_the_live_view_shows_every_quantity_that_a_sensor_sends() -> None:
    """Rates, what the accelerometer beside feels, a field; who has sent nothing is waited for."""
    imu = SensorSamples("imu", 100, 2, {"rate": (0.0, 0.0, 1.0), "acceleration": (0.0, -9.81, 0.5)})
    compass = SensorSamples("compass", 9, 0, {"field": (2e-5, 0.0, -4e-5)})
    step = Rest(name="rest", duration_s=3.0)
    progress = Progress(1, 4, step, 0.5, 1.5, 1.5, 0.0)
    console = Console(width=100, file=io.StringIO(), record=True)
    with Live(console=console, auto_refresh=False) as live:
        seen = LiveView(live)
        seen.event(SamplesTaken((imu, compass, SensorSamples("late", 0, 0, {}))))
        seen.event(progress)
    rows = [row.split(maxsplit=1) for row in console.export_text().splitlines()]
    shown = [" ".join(row) for row in rows if row]
    assert any(row.startswith("imu ") and "+57.30 °/s, 100 samples, 2 lost" in row for row in shown)
    assert any(row.startswith("imu, accelerometer") and "-9.81" in row and "m/s²" in row for row in shown)
    assert any(row.startswith("compass ") and "-40.00 µT, 9 samples, 0 lost" in row for row in shown)
    assert any(row.startswith("late ") and "waiting, 0 samples" in row for row in shown)
