"""What comes at each question of a station: its own answers decide, everything else is asked again."""

from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from rig.batch.batch_journal import open_journal
from rig.batch.batch_state import BatchPart, Begun, Doubt, Entry, PartBegun, PartEnded, state_of
from rig.batch.operators import Operator
from rig.batch.part_sequence import Bench, Desk, Work
from rig.batch.status import Now, after, update_by_batch
from rig.commands.configured import load_configured
from rig.config.judging.station_section import StationSection
from rig.errors import Fault, Refused
from rig.motion.steps import Rest
from rig.runner.announcement import mounting
from rig.runner.mounted_sensors import CalibratedBefore, Memory, Mounted, MountedSensor, ask_of_other_boards
from rig.station.events import PhaseRecorded, Progress, SamplesTaken, SensorSamples
from rig.station.operator_station import Stations
from rig.station.questions import CHOICES, Kind, Question
from rig.turners.turner_registry import kind_of
from support.paths import CONFIGS, ROOT

AT = "2026-11-25T08:00:00+00:00"
PART = BatchPart(1, "G-001", "01-G-001", AT)
NUMBERS = ("G-001", "G-002", "17")  # the part's own number, a scan of another one, a bare number
YES, NO, AGAIN = True, False, None
# answer:   ""     "y"    "yes"  "go"   "n"  "no"  a number
TABLE = {
    "mount": (YES, AGAIN, AGAIN, AGAIN, NO, NO, AGAIN),
    "go": (AGAIN, AGAIN, AGAIN, YES, NO, NO, AGAIN),
    "doubt": (AGAIN, YES, YES, AGAIN, NO, NO, AGAIN),
    "again": (AGAIN, YES, YES, AGAIN, NO, NO, AGAIN),
    "stage": (AGAIN, AGAIN, AGAIN, YES, NO, NO, AGAIN),  # of an item that is mounted several times
    "board": (AGAIN, YES, YES, AGAIN, NO, NO, AGAIN),  # by the history the number was on another one
}
KINDS = {"stage": "go", "board": "doubt"}  # of questions that a run asks; the others are called as their kind
COMES = [("",), ("y", "Y"), ("yes", "Yes"), ("go", "GO"), ("n",), ("no", "No"), NUMBERS]


class Typist:
    """A voice with answers in their order, which leaves after the last one."""

    def __init__(self, *answers: str) -> None:
        self.left: Iterator[str] = iter(answers)
        self.asked = list[Question]()

    def answer(self, question: Question) -> str | None:
        self.asked.append(question)
        return next(self.left, None)


def ask(kind: str, typist: Typist) -> bool:
    operator = Operator(typist)
    match kind:
        case "mount":
            return operator.is_mounted(PART)
        case "go":
            return operator.agrees(("The arm will move.",), "start")
        case "stage":
            servo = load_configured(CONFIGS / "servo.yaml")
            stage = mounting(servo.phase.plan(), 1, kind_of(servo.loaded.config.turner).words)
            return operator.agrees(stage.announcement, stage.to_do)
        case "board":
            return ask_of_another_board(operator)
        case "doubt":
            return operator.goes_on(Doubt("G-001 is done"))
        case _:
            return operator.tries_again(PART, Fault("board_link_lost", "the cable was pulled out", "Plug it in"))


def ask_of_another_board(operator: Operator) -> bool:
    """Ask what a run does if the history has the sensor on another board; return whether it goes on."""
    past = CalibratedBefore(
        "lsm9ds1", "G-001", simulated=True, number=7, day="2026-11-20", verdict="pass", board_unique_id="0123"
    )
    mounted = Mounted((MountedSensor("gyro", "lsm9ds1", "G-001", "4567", past, past),), Memory((past,), None))
    station = Stations((), operator.agrees)
    try:
        ask_of_other_boards(mounted, station)
    except Refused:
        return False
    return True


@pytest.mark.parametrize(
    ("kind", "comes", "meaning"),
    [
        (kind, text, meaning)
        for kind, row in TABLE.items()
        for texts, meaning in zip(COMES, row, strict=True)
        for text in texts
    ],
)
def test_an_answer_means_one_question_and_anything_else_is_asked_again(
    kind: str, comes: str, meaning: bool | None
) -> None:
    own_no, own_yes = "no", {"mount": "", "go": "go"}.get(KINDS.get(kind, kind), "yes")
    for then, decided in ((own_no, False), (own_yes, True)):
        typist = Typist(comes, then)
        assert ask(kind, typist) is (decided if meaning is None else meaning)
        assert {question.kind for question in typist.asked} == {KINDS.get(kind, kind)}
        assert len(typist.asked) == (2 if meaning is None else 1)
        assert all(comes in question.hint for question in typist.asked[1:])
    assert ask(kind, Typist()) is False  # the operator has left


@pytest.mark.parametrize("comes", ["y", "Yes", "go", "n", "NO"])
def test_an_answer_to_another_question_is_no_serial_number(comes: str) -> None:
    typist = Typist(comes, "G-002")
    assert Operator(typist).next_part([]) == "G-002"
    assert comes in typist.asked[1].hint


def test_a_number_is_taken_an_empty_line_ends_the_batch_and_so_does_an_operator_who_leaves() -> None:
    assert [Operator(Typist(text)).next_part([]) for text in (*NUMBERS, "")] == [*NUMBERS, None]
    assert Operator(Typist()).next_part([]) is None


def test_the_page_for_technicians_has_this_table() -> None:
    page = (ROOT / "docs" / "how-to" / "at-the-rig" / "station.md").read_text(encoding="utf-8")
    lines = [line.strip("| ").split(" | ") for line in page.splitlines() if line.startswith("| ")]
    rows = {name: cells for name, *cells in lines if len(cells) == len(COMES) - 2}
    names = {"mount": "mount", "go": "start", "doubt": "continue anyway?", "again": "again?"}
    names |= {"stage": "mount for a stage", "board": "another board?"}
    assert names.keys() == TABLE.keys()
    said = {
        YES: {"it is mounted", "the arm moves", "yes"},
        NO: {"put aside", "does not start", "no"},
        AGAIN: {"asked again"},
    }
    for kind, name in names.items():
        empty, y, yes, go, n, no, number = TABLE[kind]
        assert (y, n) == (yes, no)  # one column of the page
        for cell, meaning in zip(rows[name], (empty, yes, go, no, number), strict=True):
            assert cell in said[meaning], (name, cell)


class Contrary:
    """An operator who gives each question everything that does not answer it, and then the answer."""

    def __init__(self, *numbers: str) -> None:
        self._numbers = iter((*numbers, ""))
        self._pending = list[str]()
        self.kinds = list[Kind]()

    def answer(self, question: Question) -> str:
        if not question.hint:
            assert not self._pending, f"{self._pending} answered another question than they were for"
            self.kinds.append(question.kind)
            self._pending = self._wrong(question.kind)
        return self._pending.pop(0)

    def _wrong(self, kind: Kind) -> list[str]:
        if kind == "number":
            return ["y", "go", "no", next(self._numbers)]
        wrong = [text for texts, meaning in zip(COMES, TABLE[kind], strict=True) if meaning is AGAIN for text in texts]
        return [*wrong, {"mount": "", "go": "go"}.get(kind, "yes")]


@pytest.mark.slow
def test_a_batch_loses_no_part_whatever_is_typed_or_scanned_at_each_question(tmp_path: Path) -> None:
    """One part ends in a fault first, one number comes twice: so every kind of question is asked."""
    faults = {"G-002": [Fault("board_link_lost", "the cable was pulled out", "Plug it in")]}

    def run(part: BatchPart, folder: Path, desk: Desk) -> PartEnded:
        assert desk.agrees(("The arm will move.",), "start")
        for fault in faults.pop(part.serial, []):
            raise fault
        return PartEnded("pass", AT)

    bench = cast(Bench, SimpleNamespace(simulated=True, today=lambda serial: None, fit=lambda serial: None, run=run))
    voice = Contrary("G-001", "G-002", "G-001")
    journal = open_journal(tmp_path / "batch", tmp_path, Begun("A. Person", "W-1", AT))
    Work(journal, StationSection(), Operator(voice), bench).all_parts()
    assert [(part.serial, part.ended and part.ended.outcome) for part in journal.batch.parts] == [
        ("G-001", "pass"), ("G-002", "pass"), ("G-001", "pass"),
    ]  # fmt: skip
    assert set(voice.kinds) == {"number", *TABLE} - KINDS.keys()


def test_in_doubt_the_first_choice_does_not_go_on() -> None:
    primary: dict[Kind, bool] = {kind: choices[0].yes for kind, choices in CHOICES.items() if choices}
    assert primary["doubt"] is False


def test_a_verdict_stands_until_the_next_part_begins() -> None:
    ended: list[Entry] = [
        Begun("", "", AT),
        PartBegun("G-001", "01-G-001", AT),
        PartEnded("fail", AT, "gyro.bias is too large", truth="simulated truth: 5 of 6 values within U of it"),
    ]
    now = update_by_batch(Now(), state_of(ended))
    assert (now.verdict, now.why) == (("G-001", "fail"), "gyro.bias is too large")
    assert now.truth == "simulated truth: 5 of 6 values within U of it"
    now = update_by_batch(now, state_of([*ended, PartBegun("G-002", "02-G-002", AT)]))
    assert (now.verdict, now.why, now.truth, now.part) == (None, "", "", "G-002")


def test_during_a_run_progress_rates_and_samples_are_shown_and_afterwards_no_rate() -> None:
    now = after(Now(), Progress(2, 4, Rest("rest", 10.0), 0.5, 15.0, 45.0, 1.0471975511965976))
    now = after(now, SamplesTaken((SensorSamples("gyro", 200, 1, {}),)))
    assert (now.fraction, now.turn_deg_s, now.left_s, now.sensors) == (0.25, 60.0, 45.0, (("gyro", 200, 1),))
    now = after(now, PhaseRecorded((), 0))
    assert (now.fraction, now.turn_deg_s) == (None, None)
