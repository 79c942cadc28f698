"""The journal of what was solved again: a line for each recording that is done, so that none is done twice.

Its first line is the question. Answers to another one are not mixed with it.
"""

import json
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from rig.config.files.regular_file import UnfitFile, open_regular_file
from rig.config.files.written_file import open_to_append
from rig.data.checked import validate
from rig.errors import Refused
from rig.history.again.answer import Answer, Given

JOURNAL = "recomputed.jsonl"
SCHEMA: Final = "rig.recomputation/1"
SIZE_MAX_BYTES = 1 << 32  # a recording has some thousand


@dataclass(frozen=True, slots=True)
class Question:
    """The program, settings and estimator (None: each procedure's own) by which everything is solved."""

    rig_version: str
    overrides: tuple[str, ...]
    estimator: str | None

    def line(self) -> str:
        """The first line of its journal."""
        return json.dumps({"schema": SCHEMA, **asdict(self)})


class Journal(AbstractContextManager["Journal"]):
    """The journal in a folder that is there, begun or gone on with; `solved` are the answers it had, by their keys.

    Raises Refused `another_question`, and `report_folder` where it cannot be read, or at any time written.
    """

    def __init__(self, folder: Path, question: Question) -> None:
        self._path = folder / JOURNAL
        try:
            self.solved, whole_bytes = _read(self._path, question)
            self._descriptor = open_to_append(self._path)
            os.ftruncate(self._descriptor, whole_bytes)  # what a kill left half written
        except (UnfitFile, OSError) as error:
            raise self._unusable(error) from error
        if whole_bytes == 0:
            self._write(question.line())

    def __exit__(self, *_: object) -> None:
        os.close(self._descriptor)

    def note(self, key: str, answer: Answer) -> None:
        """One more answer. Only a solved one is kept: whatever else became of a recording is tried again."""
        if isinstance(answer, Given):
            self._write(json.dumps({"key": key, "given": asdict(answer)}, allow_nan=False))

    def _write(self, line: str) -> None:
        rest = f"{line}\n".encode()
        try:
            while rest:  # a disk that is nearly full takes a part of it
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError as error:
            raise self._unusable(error) from error

    def _unusable(self, error: Exception) -> Refused:
        return Refused("report_folder", f"{self._path} cannot be used: {error}", "Make room, or give another by --out")


def _read(path: Path, question: Question) -> tuple[Mapping[str, Answer], int]:
    """The answers of a journal, and how many of its bytes are whole lines; none where there is no journal."""
    solved, whole_bytes = dict[str, Answer](), 0
    if not path.exists():
        return solved, whole_bytes
    with open_regular_file(path, SIZE_MAX_BYTES, follow_links=False) as file:
        for number, line in enumerate(file):
            if not line.endswith(b"\n"):
                break
            whole_bytes += len(line)
            if number == 0:
                _same_question(path, line, question)
                continue
            try:
                document = json.loads(line)
                solved[str(document["key"])] = validate(Given, document["given"], "given")
            except (ValueError, KeyError, TypeError, RecursionError):
                continue  # a line that is none is a recording that is solved once more
    return solved, whole_bytes


def _same_question(path: Path, line: bytes, question: Question) -> None:
    if line.decode(errors="replace").strip() != question.line():
        raise Refused(
            "another_question",
            f"{path} holds the answers of another version of the rig, or to other settings or another estimator",
            "Give the same ones again to go on with it, or choose another folder with --out",
        )
