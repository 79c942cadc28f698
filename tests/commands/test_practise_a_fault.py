"""The page `practise-a-fault`, done as it says: each word typed, each answer compared, in one laboratory for all."""

import re
import subprocess
import threading
from collections.abc import Iterator
from pathlib import Path
from queue import Queue

import pytest

from rig.commands.laboratory.laboratory_process import run_simulated_laboratory, send_request
from rig.commands.laboratory.practice import INCIDENTS, find_incident, opening_text, practise
from rig.config.load import load
from rig.errors import Fault
from support.laboratories.worlds import fresh_host
from support.paths import CONFIGS, ROOT
from support.practice_page import LABORATORY, RIG, Step, exercises, mask
from support.processes.waiting import PATIENCE_S, alive, wait_for
from support.processes.warm import start_module

QUICK = (  # sweeps that are over soon, by a laboratory that hurries
    "procedure.speed_deg_s=170", "procedure.acceleration_deg_s2=700", "procedure.rest_s=0.5",
    "arm.transfer_speed_deg_s=170", "sensors.gyro.rate_hz=119", "sensors.gyro.range_deg_s=500",
    "limits.scale_std=0.02", "limits.bias_std_rad_s=0.02", "limits.condition=20",
)  # fmt: skip
PACE = 4  # of a run that a fault is to hit, on a busy computer too
QUICKLY = 30  # where nothing happens until the end
SECTIONS = exercises()
TITLES = [title for title in SECTIONS if title[:1].isdigit()]
BY_HAND = {words for words, incident in INCIDENTS.items() if incident.request["do"] == "instruct"}
AT_AN_ARM = INCIDENTS.keys() - BY_HAND


class Terminals:
    """The two terminals of the page: a laboratory, and the rig's commands one after the other."""

    def __init__(self, folder: Path) -> None:
        host = fresh_host()
        self._control, self._folders_before = f"{host}:7322", set[Path]()
        places = (f"arm.host={host}", f"board.port=socket://{host}:7321", f"output.folder={folder / 'runs'}")
        self._folder = folder / "runs"
        self._settings = [word for value in (*places, *QUICK) for word in ("--set", value)]
        self.run: subprocess.Popen[str] | None = None
        start = SECTIONS[""][0]
        self._laboratory = self._start(start.typed, *self._settings)
        self._shown: Queue[str] = Queue()
        self._reader = threading.Thread(target=self._read)
        self._reader.start()
        self.shown_first = [self._shown.get(timeout=PATIENCE_S) for _ in range(2 + len(AT_AN_ARM))]

    def _start(self, command: str, *more: str) -> "subprocess.Popen[str]":
        name, *words = [str(ROOT / word) if word.startswith("configs/") else word for word in command.split()]
        assert name == "rig"
        pipe = subprocess.PIPE
        return start_module(*words, *more, stdin=pipe, stdout=pipe, stderr=pipe, text=True)

    def _read(self) -> None:
        assert self._laboratory.stdout is not None
        with self._laboratory.stdout as lines:
            for line in lines:
                self._shown.put(line.removeprefix(LABORATORY).rstrip("\n"))

    def type_in_laboratory(self, words: str) -> str:
        """Type a line, and return the line that is shown then."""
        assert self._laboratory.stdin is not None
        self._laboratory.stdin.write(words + "\n")
        self._laboratory.stdin.flush()
        return self._shown.get(timeout=PATIENCE_S)

    def type_command(self, command: str) -> None:
        """Start a command, which agrees to a movement as a person does by `yes`."""
        self._folders_before = set(self._folder.glob("*"))
        agreed = ["--yes"] if command.split()[1] in ("run", "resume") else []
        self.run = self._start(command, *agreed, *([] if "latest" in command else self._settings))

    def pace(self, time_scale: float) -> None:
        """Let the laboratory go so much faster than a real one, at most."""
        assert send_request(self._control, {"do": "pace", "time_scale": time_scale})["ok"]

    def wait_for_sweep(self) -> None:
        """Wait until the run on its way has begun a sweep."""
        assert self.run is not None

        def sweeping() -> bool:
            logs = [folder / "log.txt" for folder in set(self._folder.glob("*")) - self._folders_before]
            return any(log.exists() and "transfer to the start" in log.read_text(encoding="utf-8") for log in logs)

        wait_for(sweeping, "the first sweep", meanwhile=alive(self.run))

    def wait_for_end(self) -> str:
        """Wait for the end of the command, and return what it has shown."""
        assert self.run is not None
        shown, errors = self.run.communicate(timeout=PATIENCE_S)
        self.run = None
        return errors + shown

    def close(self) -> None:
        """End the laboratory as Ctrl-D does."""
        if self.run is not None:
            self.run.kill()
            self.run.communicate()
        assert self._laboratory.stdin is not None
        self._laboratory.stdin.close()
        assert self._laboratory.wait(PATIENCE_S) == 0
        self._reader.join()
        assert self._laboratory.stderr is not None
        self._laboratory.stderr.close()


@pytest.fixture(scope="module")
def terminals(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Terminals]:
    both = Terminals(tmp_path_factory.mktemp("practice"))
    yield both
    both.close()


def check_shown(step: Step, actual: str) -> None:
    """Assert that all that the page shows was shown, in that order."""
    rest = mask(actual)
    for text in step.shown:
        if text != "Type go to start, or no:":  # a question for a terminal
            assert text in rest, f"{step.typed}: {text!r} is not in {rest!r}"
            rest = rest.partition(text)[2]


@pytest.mark.slow
@pytest.mark.one_in(6)  # each of these faults ends a run in tests/runner/faults and tests/turners too
@pytest.mark.parametrize("title", TITLES)
def test_each_exercise_runs_as_the_page_states(terminals: Terminals, title: str) -> None:
    steps = SECTIONS[title]
    if not steps[1].prompt:  # the fault ends a run that is on its way
        terminals.pace(PACE)
        terminals.type_command(SECTIONS[""][1].typed)
        terminals.wait_for_sweep()
    for step in steps:
        if step.prompt == LABORATORY:
            answer = terminals.type_in_laboratory(step.typed)
            if step.typed == "unlock" and answer.startswith("not now"):
                assert "Cannot unlock protective stop until 5s after occurrence" in answer
                answer = wait_for(lambda: _unlocked(terminals), "five seconds of the pendant's")
            check_shown(step, answer)
            continue
        if step.prompt == RIG:
            terminals.pace(QUICKLY if "PASS" in step.shown else PACE)
            terminals.type_command(step.typed)
        check_shown(step, terminals.wait_for_end())


def _unlocked(terminals: Terminals) -> str:
    answer = terminals.type_in_laboratory("unlock")
    return "" if answer.startswith("not now") else answer


@pytest.mark.slow
def test_the_laboratory_shows_first_what_can_happen_in_it(terminals: Terminals) -> None:
    check_shown(SECTIONS[""][0], "\n".join([*terminals.shown_first, LABORATORY]))
    assert "unknown" in terminals.type_in_laboratory("unplugg")


@pytest.mark.slow
def test_what_a_laboratory_does_not_have_cannot_happen_in_it() -> None:
    host = fresh_host()
    by_hand = load(CONFIGS / "by_hand.yaml", [f"board.port=socket://{host}:7321"], sections=None)
    with run_simulated_laboratory(by_hand.text) as control:
        assert practise(control, "slider 50") == "this cannot happen in this laboratory"
        assert practise(control, "Unplug") == INCIDENTS["unplug"].text
        assert {*re.findall(r"^  (\S.*?)  ", opening_text(control), re.MULTILINE)} == BY_HAND | {
            "unplug",
            "plug in",
            "power dip",
        }
    with pytest.raises(Fault, match="world_ended"):
        practise(control, "unplug")


def test_the_page_has_six_exercises_with_every_word_that_can_be_typed() -> None:
    assert len(TITLES) == 6
    typed = {step.typed for steps in SECTIONS.values() for step in steps if step.prompt == LABORATORY}
    assert typed >= AT_AN_ARM


@pytest.mark.parametrize(
    ("words", "fraction"), [("slider 7", 0.07), ("Slider  100 %", 1.0), ("slider 101", None), ("slider", None)]
)
def test_the_slider_goes_to_any_percentage(words: str, fraction: float | None) -> None:
    incident = find_incident(words)
    assert (None if incident is None else incident.request["fraction"]) == fraction


@pytest.mark.slow
def test_a_hand_moves_a_device_that_prints_lines_as_is_typed() -> None:
    at = f"sensors.imu.serial.port=socket://{fresh_host()}:7341"
    lines = load(CONFIGS / "by_hand_lines.yaml", [at, "world.hand.mistakes={}"], sections=None)
    with run_simulated_laboratory(lines.text) as control:
        assert practise(control, "unplug") == "this cannot happen in this laboratory"
        for acts, words in enumerate(("lay +x", "turn", "Lay  -y"), 1):
            assert practise(control, words) == INCIDENTS[" ".join(words.lower().split())].text
            wait_for(lambda: send_request(control, {"do": "state"})["acts"] == acts, words)  # noqa: B023
        assert send_request(control, {"do": "state"})["face"] == "-y"
