"""Everything again: what a recording gives today, beside the result that was stated of it. Pure."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from rig.history.entered.finished import Recording
from rig.history.entered.issued import Issued
from rig.history.store import Past
from rig.report.findings.followed import Followed, Parameter

OF_U = 0.1  # of U: what moves by less changes at most the second digit of a stated uncertainty

# Why there is no result of today: the method refuses what lies there as it was recorded; the setting or estimator that
# was asked for is none of this recording; it is not there; it is not what was entered; the worker that had it in hand
# died; the program failed.
State = Literal["refused", "unjudged", "missing", "damaged", "lost", "failed"]


@dataclass(frozen=True, slots=True)
class Stated:
    """A result of the history: what it said, where its recordings lie, and which certificates rely on it.

    `calibrations` are those that were asked for and count; `certificates` those in force, without a mark and replaced
    by none; `places` computer and folder, the newest first.
    """

    run_id: int
    content_sha256: str
    started_utc: str
    rig: str
    verdict: str
    calibrations: tuple[Past, ...]
    recordings: tuple[Recording, ...]
    places: tuple[tuple[str, str], ...]
    certificates: tuple[Issued, ...] = ()


@dataclass(frozen=True, slots=True)
class Given:
    """What recordings give today: the verdict, the names of failed checks, and all calibrations.

    `left_out` is what the solution does without, as a sentence.
    """

    verdict: str
    failed: tuple[str, ...]
    calibrations: tuple[Followed, ...]
    left_out: str | None = None


@dataclass(frozen=True, slots=True)
class Unsolved:
    """Why recordings give nothing, by the kind of reason and in words."""

    state: State
    why: str


Answer = Given | Unsolved


@dataclass(frozen=True, slots=True)
class Move:
    """One parameter as it was stated and as it is `now`, None where today's result does not have it."""

    before: Parameter
    now: Parameter | None

    @property
    def shift(self) -> float:
        """The step of the value in multiples of the U that was stated; without end where it is gone."""
        return math.inf if self.now is None else _of(abs(self.now.value - self.before.value), self.before.expanded)

    @property
    def growth(self) -> float:
        """The growth of U in multiples of what was stated, which then was too small; below 0 it became smaller."""
        return math.inf if self.now is None else _of(self.now.expanded - self.before.expanded, self.before.expanded)

    @property
    def size(self) -> float:
        """The larger of both."""
        return max(self.shift, self.growth)


@dataclass(frozen=True)
class Compared:
    """A stated result beside the answer of its recordings; None where nobody came to solve them."""

    stated: Stated
    answer: Answer | None
    of_u: float = OF_U

    @cached_property
    def moves(self) -> Mapping[int, tuple[Move, ...]]:
        """Every parameter of each calibration, by its number, the one that moved most first; empty if unsolved."""
        if not isinstance(self.answer, Given):
            return {}
        now = {(each.sensor, each.quantity): each.parameters for each in self.answer.calibrations}
        found = {}
        for past in self.stated.calibrations:
            beside = {each.name: each for each in now.get((past.sensor, past.quantity), ())}
            moves = (Move(each, beside.get(name)) for name, each in past.parameters.items())
            found[past.id] = tuple(sorted(moves, key=lambda move: -move.size))
        return found

    @property
    def moved(self) -> tuple[int, ...]:
        """The numbers of the calibrations of which a value moved, or U grew, by more than `of_u` of the stated U."""
        return tuple(number for number, moves in self.moves.items() if moves and moves[0].size > self.of_u)

    @property
    def verdict_changed(self) -> bool:
        """Whether today's verdict is another than the stated one."""
        return isinstance(self.answer, Given) and self.answer.verdict != self.stated.verdict

    @property
    def withdrawn(self) -> tuple[Issued, ...]:
        """The certificates that state what the recordings do not give (ISO/IEC 17025, 7.10.1, 7.8.8 and 8.7)."""
        refused = isinstance(self.answer, Unsolved) and self.answer.state == "refused"
        return self.stated.certificates if refused or self.verdict_changed or self.moved else ()

    @property
    def unconfirmed(self) -> tuple[Issued, ...]:
        """The certificates of which nothing can be said, because their recordings were not solved."""
        unsolved = not isinstance(self.answer, Given) and not self.withdrawn
        return self.stated.certificates if unsolved else ()

    @property
    def same(self) -> bool:
        """Whether it was solved, and today's result is the one that was stated."""
        return isinstance(self.answer, Given) and not (self.moved or self.verdict_changed)


@dataclass(frozen=True, slots=True)
class Outcome:
    """Everything that was compared, in the order of time, in numbers."""

    of_u: float
    compared: tuple[Compared, ...]

    @property
    def solved(self) -> int:
        """How many were solved."""
        return sum(isinstance(each.answer, Given) for each in self.compared)

    @property
    def unsolved(self) -> Mapping[State, int]:
        """How many were not, by the kind of reason."""
        return Counter(each.answer.state for each in self.compared if isinstance(each.answer, Unsolved))

    @property
    def unreached(self) -> int:
        """How many nobody came to solve."""
        return sum(each.answer is None for each in self.compared)

    @property
    def moved(self) -> int:
        """How many calibrations moved."""
        return sum(len(each.moved) for each in self.compared)

    @property
    def verdicts_changed(self) -> int:
        """How many results have another verdict today."""
        return sum(each.verdict_changed for each in self.compared)

    @property
    def withdrawn(self) -> tuple[Issued, ...]:
        """Every certificate that would have to be withdrawn."""
        return tuple(issued for each in self.compared for issued in each.withdrawn)

    @property
    def unconfirmed(self) -> tuple[Issued, ...]:
        """Every certificate of which nothing can be said."""
        return tuple(issued for each in self.compared for issued in each.unconfirmed)

    @property
    def same(self) -> bool:
        """Whether everything was solved, and nothing is to be looked at."""
        return all(each.same for each in self.compared)

    @property
    def notable(self) -> tuple[Compared, ...]:
        """What is to be looked at."""
        return tuple(each for each in self.compared if not each.same)


def compared(stated: Iterable[Stated], answers: Mapping[str, Answer], of_u: float = OF_U) -> Outcome:
    """Results beside the answers to them, which are found by the checksum of the result."""
    return Outcome(of_u, tuple(Compared(each, answers.get(each.content_sha256), of_u) for each in stated))


def to_solve(stated: Sequence[Stated], solved: Mapping[str, Answer]) -> tuple[Stated, ...]:
    """What is left to do: a recording that is solved is not solved again, whatever else failed is tried again."""
    return tuple(each for each in stated if not isinstance(solved.get(each.content_sha256), Given))


def _of(difference: float, expanded: float) -> float:
    """A difference in multiples of U; where there is no U, any difference is without end."""
    if expanded > 0:
        return difference / expanded
    return math.inf if difference > 0 else 0.0
