"""Rounds on one history: a station with its heartbeat, and other users that start and end at random moments."""

import json
import os
import random
import re
import shutil
import signal
import sqlite3
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py

from rig.history.store import open_history
from support.laboratories.commands import configuration, rig_here
from support.paths import RECORDINGS, ROOT
from support.processes.waiting import wait_for
from support.processes.warm import start_module

OTHERS = ("list", "verify", "import", "floor", "notebook", "station")
KILLED = 0.3  # of those who come, and of the stations they come to
WHOLE_EVERY, FIRST_WHOLE = 40, 7  # one station of these is a whole `rig station`, with a laboratory
WHOLE_PARTS = 2
PAUSE_S = 0.2
BUSY_S = 400.0  # a busy machine's patience


@dataclass(frozen=True, slots=True)
class Guest:
    """A user that starts `after_s` after the previous one and is ended after `lasts_s`: `killed`, or by a signal.

    Users that end by themselves and are not killed get no signal.
    """

    who: str
    after_s: float
    lasts_s: float
    killed: bool


@dataclass(frozen=True, slots=True)
class Round:
    """The round drawn from a seed. `killed_after_s`: of the station; None if it ends after its guests."""

    seed: int
    whole: bool
    guests: tuple[Guest, ...]
    killed_after_s: float | None


def drawn(seed: int) -> Round:
    """Draw one to three guests, the first of each kind in turn."""
    of_seed, whole = random.Random(seed), seed % WHOLE_EVERY == FIRST_WHOLE
    kinds = [OTHERS[seed % len(OTHERS)], *of_seed.choices(OTHERS, k=of_seed.randint(0, 2))]
    guests = [
        Guest(who, of_seed.uniform(0, 0.4), of_seed.uniform(0, 1.5), of_seed.random() < KILLED)
        for who in (*kinds, *(of_seed.choices(OTHERS, k=4) if whole else ()))
    ]
    killed_after_s = of_seed.uniform(0, 1.5) if of_seed.random() < KILLED and not whole else None
    return Round(seed, whole, tuple(guests), killed_after_s)


class Rounds:
    """Rounds on the history at `address`, with all entries reported so far, by calibration number.

    `refused`: the output of whole stations that did not measure all their parts, which is no fault of the history.
    """

    def __init__(self, address: str, folder: Path) -> None:
        self.place, self.folder = address, folder
        self.entered: dict[int, str] = {}
        self.not_remembered: list[str] = []
        self.refused: list[str] = []
        self._environment = {**os.environ, "RIG_HISTORY": address, "RIG_PAGE_TOKEN": "a-token-of-this-test"}

    def carry_out(self, this: Round) -> None:
        """Run a round to its end; then assert that every reported entry exists once, and that the history is valid."""
        with ExitStack() as stack:
            station = stack.enter_context(
                self._whole(this) if this.whole else self._station(f"A{this.seed}", this.seed)
            )
            began_s, guests = time.monotonic(), list[tuple[float, Guest, _User]]()
            for number, guest in enumerate(this.guests):
                time.sleep(guest.after_s)
                user = stack.enter_context(self._guest(guest, f"{this.seed}-{number}"))
                guests.append((time.monotonic(), guest, user))
            if this.killed_after_s is not None:
                _sleep_until(began_s + this.killed_after_s)
                station.process.kill()
            for start_s, guest, user in guests:
                if guest.killed or guest.who == "floor":
                    _sleep_until(start_s + guest.lasts_s)
                    how = signal.SIGKILL if guest.killed else (signal.SIGINT, signal.SIGTERM)[this.seed % 2]
                    user.process.send_signal(how)
                user.ends()
            station.ends()
            for user in (station, *(other for _, _, other in guests)):
                self._take(user, this)
        self.check(this)

    def check(self, this: Round) -> None:
        """Assert that every reported entry is there, and that the history is valid."""
        if not self.place.startswith("postgresql"):
            with closing(sqlite3.connect(self.place)) as connection:
                whole = connection.execute("PRAGMA integrity_check").fetchall()
            assert whole == [("ok",)], f"{this}: {whole}"
        with open_history(self.place) as history:
            serial_numbers = {past.id: past.serial_number for past in history.calibrations(replaced_too=True)}
        lost = {number: serial for number, serial in self.entered.items() if serial_numbers.get(number) != serial}
        assert not lost, f"{this}: entered, and not there: {lost}"
        verified = rig_here("history", "verify", "--history", self.place)
        assert verified.returncode == 0, f"{this}: {verified.stdout}"

    def _take(self, user: "_User", this: Round) -> None:
        """Note the entries that a user reported: a station's, a run's, an import's."""
        lines = user.output_path.read_text(encoding="utf-8").splitlines(keepends=True)
        whole_lines = [line for line in lines if line.endswith("\n")]
        assert user.process.returncode < 0 or "Traceback" not in "".join(lines), f"{this}: {''.join(lines)}"
        for line in whole_lines:
            if line.startswith("{"):
                message = json.loads(line)
                self._entered(message.get("numbers", ()), message.get("serial_number"), this)
                self.not_remembered += [message["not_remembered"]] if "not_remembered" in message else []
            elif entry_match := re.search(r"/([^/]+): entered as calibration (\d+)", line):
                self._entered([int(entry_match[2])], entry_match[1], this)
            elif "not entered in the history" in line:
                self.not_remembered.append(line)
        if this.whole and user.output_path.name == f"whole{this.seed}.txt":
            entries = re.findall(r"entered in .* as calibration (\d+).*\nwritten: .*/\d+-(\S+)\n", "".join(whole_lines))
            for number, serial_number in entries:
                self._entered([int(number)], serial_number, this)
            if len(entries) < WHOLE_PARTS:
                self.refused.append("".join(lines))

    def _entered(self, numbers: list[int], serial_number: str, this: Round) -> None:
        for number in numbers:
            assert self.entered.setdefault(number, serial_number) == serial_number, f"{this}: {number} twice"

    def _serial_numbers(self, this: Round) -> list[str]:
        return [f"W{this.seed}-{number}" for number in range(WHOLE_PARTS)]

    def _whole(self, this: Round) -> "_User":
        folder = self.folder / f"W{this.seed}"
        folder.mkdir()
        parts = folder / "parts.csv"
        parts.write_text("\n".join(("serial_number", *self._serial_numbers(this))), encoding="utf-8")
        words = ("station", configuration(folder), "--series", parts, "--out", folder / "batch")
        return self._user(f"whole{this.seed}", *words).begun("batch folder: ")

    def _station(self, rig: str, seed: int) -> "_User":
        words = ("station", self.folder / rig, rig, str(PAUSE_S), str(seed))
        return self._user(rig, *words, module="support.history.history_users").begun('"begun"')

    def _guest(self, guest: Guest, name: str) -> "_User":
        match guest.who:
            case "list":
                return self._user(f"list{name}", "history")
            case "verify":
                return self._user(f"verify{name}", "history", "verify")
            case "import":
                recording = record(self.folder / f"I{name}")
                return self._user(f"import{name}", "history", "import", "--solve", recording)
            case "floor":
                words = ("floor", "--history", self.place, "--page-address", "127.0.0.1:0")
                return self._user(f"floor{name}", *words)
            case "notebook":
                return self._user(
                    f"notebook{name}", "notebook", str(guest.lasts_s), module="support.history.history_users"
                )
        return self._station(f"B{name}", 1000 + int(name.replace("-", "")))

    def _user(self, name: str, *words: str | Path, module: str = "rig") -> "_User":
        return _User(self.folder / name, module, words, self._environment)


class _User:
    """A process that works on the history; its output goes to a file."""

    def __init__(
        self, output_path: Path, module: str, words: tuple[str | Path, ...], environment: dict[str, str]
    ) -> None:
        self.output_path = output_path.with_name(f"{output_path.name}.txt")
        with self.output_path.open("wb") as file:
            self.process: subprocess.Popen[Any] = start_module(
                *words, module=module, cwd=ROOT / "tests", env=environment,
                stdin=subprocess.PIPE, stdout=file, stderr=file,
            )  # fmt: skip

    def begun(self, words: str) -> "_User":
        """Wait until the user has reported these words, and return it."""
        wait_for(
            lambda: words in self.output_path.read_text(encoding="utf-8") or self.process.poll() is not None,
            words,
            BUSY_S,
        )
        return self

    def ends(self) -> None:
        """Wait for the user's end; a station ends when its standard input does."""
        assert self.process.stdin is not None
        self.process.stdin.close()
        self.process.wait(BUSY_S)

    def __enter__(self) -> "_User":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.ends()


def _sleep_until(moment_s: float) -> None:
    time.sleep(max(0.0, moment_s - time.monotonic()))


def record(folder: Path) -> Path:
    """Return a recording of a sensor named as the folder, solved when it is imported."""
    folder.mkdir()
    shutil.copy(RECORDINGS / "six_observation" / "run.h5", folder)
    with h5py.File(folder / "run.h5", "r+") as file:
        file["samples"]["gyro"].attrs["serial_number"] = folder.name
    return folder


def rounds(first: int, count: int) -> Iterator[Round]:
    """Yield `count` rounds, from the seed `first` on."""
    yield from map(drawn, range(first, first + count))
