"""Recomputation: the present result of a recording, compared with the stated one. Pure."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from rig.history.entered.finished_run import EnteredRecording
from rig.history.entered.issued_certificate import IssuedCertificate
from rig.history.store import Past
from rig.report.findings.history_records import HistoryRecord, Parameter

U_FRACTION = 0.1  # a smaller shift changes at most the second digit of a stated uncertainty

# Reasons for a missing present result: the method refuses the recording; the requested setting or estimator does not
# suit it; the recording is missing; it has changed since it was entered; its worker died; the program failed.
State = Literal["refused", "unjudged", "missing", "damaged", "lost", "failed"]


@dataclass(frozen=True, slots=True)
class StatedResult:
    """A result of the history, with its recordings and the certificates that rely on it.

    - `run_id`, `content_sha256`, `started_utc`, `rig`, `verdict`: the run's row in the history.
    - `calibrations`: the run's calibrations that are valid and selected for recomputation.
    - `recordings`: the run's recordings. `places`: computer and folder of each location, the newest first.
    - `certificates`: the certificates in force, that is valid and not replaced by another.
    """

    run_id: int
    content_sha256: str
    started_utc: str
    rig: str
    verdict: str
    calibrations: tuple[Past, ...]
    recordings: tuple[EnteredRecording, ...]
    places: tuple[tuple[str, str], ...]
    certificates: tuple[IssuedCertificate, ...] = ()


@dataclass(frozen=True, slots=True)
class RecomputedResult:
    """The present result of recordings: the verdict, the names of failed checks, and all calibrations.

    `left_out` names omitted quantities in a sentence.
    """

    verdict: str
    failed: tuple[str, ...]
    calibrations: tuple[HistoryRecord, ...]
    left_out: str | None = None


@dataclass(frozen=True, slots=True)
class Unsolved:
    """The reason why recordings have no present result: the kind of reason (`state`), and `why` in words."""

    state: State
    why: str


Answer = RecomputedResult | Unsolved


@dataclass(frozen=True, slots=True)
class ParameterMove:
    """One parameter as stated (`before`) and as recomputed (`now`); `now` is None if the result lacks it."""

    before: Parameter
    now: Parameter | None

    @property
    def shift(self) -> float:
        """The shift of the value in multiples of the stated U; infinite if there is no new value."""
        return math.inf if self.now is None else _u_ratio(abs(self.now.value - self.before.value), self.before.expanded)

    @property
    def growth(self) -> float:
        """The growth of U in multiples of the stated U; positive if the stated U was too small."""
        return (
            math.inf if self.now is None else _u_ratio(self.now.expanded - self.before.expanded, self.before.expanded)
        )

    @property
    def size(self) -> float:
        """The larger of shift and growth."""
        return max(self.shift, self.growth)


@dataclass(frozen=True)
class ComparedResult:
    """A stated result, and the `answer` recomputed from its recordings, if any.

    A value counts as changed if it moved by more than `of_u` × stated U.
    """

    stated: StatedResult
    answer: Answer | None
    of_u: float = U_FRACTION

    @cached_property
    def moves(self) -> Mapping[int, tuple[ParameterMove, ...]]:
        """The changes of every parameter, largest first, by the calibration's number; empty if unsolved."""
        if not isinstance(self.answer, RecomputedResult):
            return {}
        now = {(record.sensor, record.quantity): record.parameters for record in self.answer.calibrations}
        by_number = {}
        for past in self.stated.calibrations:
            present = {parameter.name: parameter for parameter in now.get((past.sensor, past.quantity), ())}
            moves = (ParameterMove(stated, present.get(name)) for name, stated in past.parameters.items())
            by_number[past.id] = tuple(sorted(moves, key=lambda move: -move.size))
        return by_number

    @property
    def moved(self) -> tuple[int, ...]:
        """The numbers of the calibrations of which a value has shifted, or U has grown, by more than `of_u` × U."""
        return tuple(number for number, moves in self.moves.items() if moves and moves[0].size > self.of_u)

    @property
    def verdict_changed(self) -> bool:
        """Whether the present verdict differs from the stated one."""
        return isinstance(self.answer, RecomputedResult) and self.answer.verdict != self.stated.verdict

    @property
    def withdrawn(self) -> tuple[IssuedCertificate, ...]:
        """The certificates that the recomputed results contradict (ISO/IEC 17025, 7.10.1, 7.8.8 and 8.7)."""
        refused = isinstance(self.answer, Unsolved) and self.answer.state == "refused"
        return self.stated.certificates if refused or self.verdict_changed or self.moved else ()

    @property
    def unconfirmed(self) -> tuple[IssuedCertificate, ...]:
        """The certificates that could not be checked, because their recordings were not solved."""
        unsolved = not isinstance(self.answer, RecomputedResult) and not self.withdrawn
        return self.stated.certificates if unsolved else ()

    @property
    def same(self) -> bool:
        """Whether the recomputed values and verdict agree with the stated ones."""
        return isinstance(self.answer, RecomputedResult) and not (self.moved or self.verdict_changed)


@dataclass(frozen=True, slots=True)
class RecomputeOutcome:
    """All comparisons in the order of time. A value counts as changed if it moved by more than `of_u` × stated U."""

    of_u: float
    compared: tuple[ComparedResult, ...]

    @property
    def solved(self) -> int:
        """The number of solved recordings."""
        return sum(isinstance(comparison.answer, RecomputedResult) for comparison in self.compared)

    @property
    def unsolved(self) -> Mapping[State, int]:
        """The numbers of unsolved recordings, by the kind of reason."""
        return Counter(
            comparison.answer.state for comparison in self.compared if isinstance(comparison.answer, Unsolved)
        )

    @property
    def unreached(self) -> int:
        """The number of recordings that were not solved again, because the recomputation ended before."""
        return sum(comparison.answer is None for comparison in self.compared)

    @property
    def moved(self) -> int:
        """The number of calibrations whose result has changed."""
        return sum(len(comparison.moved) for comparison in self.compared)

    @property
    def verdicts_changed(self) -> int:
        """The number of results whose verdict has changed."""
        return sum(comparison.verdict_changed for comparison in self.compared)

    @property
    def withdrawn(self) -> tuple[IssuedCertificate, ...]:
        """The certificates to withdraw, of all results."""
        return tuple(issued for comparison in self.compared for issued in comparison.withdrawn)

    @property
    def unconfirmed(self) -> tuple[IssuedCertificate, ...]:
        """The certificates, of any result, that could not be checked."""
        return tuple(issued for comparison in self.compared for issued in comparison.unconfirmed)

    @property
    def same(self) -> bool:
        """Whether solving all recordings again gave the results in their result files."""
        return all(comparison.same for comparison in self.compared)

    @property
    def notable(self) -> tuple[ComparedResult, ...]:
        """The results that were not confirmed by recomputation."""
        return tuple(comparison for comparison in self.compared if not comparison.same)


def match_answers(
    stated: Iterable[StatedResult], answers: Mapping[str, Answer], of_u: float = U_FRACTION
) -> RecomputeOutcome:
    """Return each stated result with its answer, if any; `answers` are keyed by the checksum of the stated result.

    A value counts as changed if it moved by more than `of_u` × stated U.
    """
    return RecomputeOutcome(
        of_u, tuple(ComparedResult(result, answers.get(result.content_sha256), of_u) for result in stated)
    )


def pending_recordings(stated: Sequence[StatedResult], solved: Mapping[str, Answer]) -> tuple[StatedResult, ...]:
    """Return the recordings still to be solved: those without an answer, and those that failed."""
    return tuple(result for result in stated if not isinstance(solved.get(result.content_sha256), RecomputedResult))


def _u_ratio(difference: float, expanded: float) -> float:
    """Return a difference in multiples of U; infinite if U is 0."""
    if expanded > 0:
        return difference / expanded
    return math.inf if difference > 0 else 0.0
