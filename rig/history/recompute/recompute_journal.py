"""The journal of a recomputation: a line for each solved recording, so that no recording is solved twice.

The first line states program, settings and estimator. A journal whose first line states others is not continued, so
that all answers in a journal are comparable.
"""

import json
import os
from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Final

from rig.config.files.regular_file import UnfitFile, open_regular_file
from rig.config.files.safe_writing import open_to_append
from rig.data.validation import validate
from rig.errors import Refused
from rig.history.recompute.result_comparison import Answer, RecomputedResult

JOURNAL = "recomputed.jsonl"
SCHEMA: Final = "rig.recomputation/1"
SIZE_MAX_BYTES = 1 << 32  # a recording has some thousand bytes


@dataclass(frozen=True, slots=True)
class RecomputeQuestion:
    """The program, settings and estimator (None: each procedure's own) of a recomputation."""

    rig_version: str
    overrides: tuple[str, ...]
    estimator: str | None

    def line(self) -> str:
        """Return the question as the journal's first line."""
        return json.dumps({"schema": SCHEMA, **asdict(self)})


class RecomputeJournal(AbstractContextManager["RecomputeJournal"]):
    """The journal of a recomputation in an existing folder, new or continued; `solved` has the answers so far, by key.

    Raise Refused `another_question`, and `report_folder` if the journal cannot be read or, at any time, written.
    """

    def __init__(self, folder: Path, question: RecomputeQuestion) -> None:
        self._path = folder / JOURNAL
        try:
            self.solved, whole_bytes = _read(self._path, question)
            self._descriptor = open_to_append(self._path)
            os.ftruncate(self._descriptor, whole_bytes)  # removes a line that was interrupted
        except (UnfitFile, OSError) as error:
            raise self._unusable(error) from error
        if whole_bytes == 0:
            self._write(question.line())

    def __exit__(self, *_: object) -> None:
        os.close(self._descriptor)

    def note(self, key: str, answer: Answer) -> None:
        """Store an answer if it is a solution, so that a continued recomputation retries all others."""
        if isinstance(answer, RecomputedResult):
            self._write(json.dumps({"key": key, "given": asdict(answer)}, allow_nan=False))

    def _write(self, line: str) -> None:
        rest = f"{line}\n".encode()
        try:
            while rest:  # a nearly full disk accepts only a part
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError as error:
            raise self._unusable(error) from error

    def _unusable(self, error: Exception) -> Refused:
        return Refused(
            "report_folder",
            f"{self._path} cannot be used: {error}",
            "Free space on the disk, or give another folder by --out",
        )


def _read(path: Path, question: RecomputeQuestion) -> tuple[Mapping[str, Answer], int]:
    """Return the answers of a journal, and the number of bytes in its complete lines; no answers without a journal."""
    solved, complete_bytes = dict[str, Answer](), 0
    if not path.exists():
        return solved, complete_bytes
    with open_regular_file(path, SIZE_MAX_BYTES, follow_links=False) as file:
        for number, line in enumerate(file):
            if not line.endswith(b"\n"):
                break
            complete_bytes += len(line)
            if number == 0:
                _same_question(path, line, question)
                continue
            try:
                document = json.loads(line)
                solved[str(document["key"])] = validate(RecomputedResult, document["given"], "given")
            except (ValueError, KeyError, TypeError, RecursionError):
                continue  # the recording of an invalid line is solved again
    return solved, complete_bytes


def _same_question(path: Path, line: bytes, question: RecomputeQuestion) -> None:
    if line.decode(errors="replace").strip() != question.line():
        raise Refused(
            "another_question",
            f"{path} holds the answers of another version of the rig, or to other settings or another estimator",
            "Give the same ones again to continue it, or choose another folder with --out",
        )
