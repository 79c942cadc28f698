"""A gyroscope's calibration by hand, made by the board: the host instructs, follows, and checks the result.

The board detects rests and moves and solves without the host, which instructs the operator by the board's reports.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from firmware_host.client import Board
from firmware_host.hand_answers import BoardHandSolution, HandReport
from rig.analysis.by_hand.on_board import BoardReadings, HandAgreement, compare_with_board
from rig.board.crystal import follows_crystal
from rig.board.identify import changing, refusing
from rig.config.models import RigConfig
from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.hand_events import HandAsked, HandEvent, HandMoveAccepted, HandMoveRefused, HandRested
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.errors import Fault, Refused
from rig.motion.by_hand import Face, HandMove
from rig.observation.by_hand.rests_and_moves import MICROSECOND_S, clock_unknown, rotate_face
from rig.plans.by_hand import FACE_ORDER, WantedMoves, next_instruction, still_open
from rig.runner.board.sensors import BoardSource, open_board_source
from rig.runner.by_hand.hand_session import drain

POLL_S = 0.05
FAULTS = {  # the board's term: the error's name, what, what to do
    "clipped": ("clipping", "it was turned faster than the sensor's range", "Turn more slowly"),
    "lost": ("lost_in_move", "readings are missing", "Make the move again"),
    "no_face": ("not_flat", "it does not lie on any of its six sides", "Lay it down on a side, and let go"),
    "contradicts": (
        "lost_in_move",
        "the move contradicts all the others",
        "Lay it down flat on a side; a turn must end where it began",
    ),
}


@dataclass(frozen=True, slots=True)
class CalibratedByBoard:
    """The board's solution for the sensor `index`, and its agreement with the solution by this computer.

    `agreement` is None if this computer has no readings of the session.
    """

    index: int
    solved: BoardHandSolution
    agreement: HandAgreement | None


@dataclass(slots=True)
class FollowedSession:
    """A session according to the board's reports: the accepted moves, and the faces on which the item lay."""

    sensor: RecordedSensor
    moves: int
    tell: Callable[[HandEvent], None]
    reports: list[HandReport] = field(default_factory=list)
    _accepted: list[HandMove] = field(default_factory=list)
    _lay: list[Face] = field(default_factory=list)
    _has_asked: bool = False

    def take(self, report: HandReport) -> None:
        """Process the board's report, and announce what it changes.

        If the board's button began a new session, discard what was accepted in the session before.
        """
        wrong = None
        if self.reports and report.judged < self.reports[-1].judged:
            self._has_asked = False
            self.reports = []
            self._accepted = []
            self._lay = []
        if new := report.judged > (self.reports[-1].judged if self.reports else 0):
            self.reports.append(report)
            wrong = self._judge(report)
        first = not self._lay and report.after is not None
        if first and report.after is not None:
            self._note_rest(report, report.after)
        if report.state not in ("done", "failed") and (new or first or not self._has_asked):
            self._ask(wrong)

    def _judge(self, report: HandReport) -> Fault | None:
        """Note the rest and the move that the board judged; return the Fault of a refused move."""
        if report.after is not None:
            self._note_rest(report, report.after)
        if report.outcome == "nothing":
            return None
        if report.outcome != "accepted" or report.before is None or report.after is None:
            wrong = Fault(*FAULTS[report.outcome])
            self.tell(HandMoveRefused(report.move_us, report.after_us, wrong.name))
            return wrong
        before, after = self._face(report.before), self._face(report.after)
        kind: Literal["flip", "turn"] = "flip" if before != after else "turn"
        turns = int(report.whole)
        self._accepted.append(HandMove(kind, before, after, turns))
        self.tell(HandMoveAccepted(report.move_us, report.after_us, kind, before, after, turns))
        return None

    def _note_rest(self, report: HandReport, face: str) -> None:
        self._lay.append(self._face(face))
        self.tell(HandRested(report.after_us, report.end_us, self._lay[-1]))

    def _ask(self, wrong: Fault | None) -> None:
        """Request the next flip. The faces follow `FACE_ORDER`, again and again, until the board has enough moves.

        `wrong`: the error for which the last move was refused, else None.
        """
        flips = self.moves
        while (remaining := still_open(WantedMoves(flips, 0), self._accepted, self._lay)).done:
            flips += len(FACE_ORDER)
        instruction = next_instruction(remaining, self._lay[-1] if self._lay else None)
        again, why = (None, "") if wrong is None else (wrong.name, f"{wrong.what}. {wrong.remedy}.")
        if instruction is not None:
            self.tell(HandAsked(instruction, again, why))
        self._has_asked = True

    def _face(self, of_sensor: str) -> Face:
        return rotate_face(of_sensor, np.array(self.sensor.mounting).T)


@contextmanager
def calibrate_by_board(
    config: RigConfig, name: str, moves: int, scale_std: float, tell: Callable[[HandEvent], None]
) -> Iterator[tuple[Board, CalibratedByBoard]]:
    """Let the board calibrate one of its sensors; yield the board, still connected, and the calibration.

    The session ends after at least `moves` moves, once the standard uncertainty of the scale is at most `scale_std`.
    Raise Refused `clock_unknown`, `first_face_unknown`, and what `open_board_source` raises; Fault `board_unverified`,
    `board_disagrees`, the error of the last of ten refused moves in a row, and the board's own errors.
    """
    arrived: SimpleQueue[tuple[str, NDArray[Any]]] = SimpleQueue()
    with ExitStack() as stack:
        with refusing():
            source = stack.enter_context(
                open_board_source(config, lambda sensor, samples: arrived.put((sensor, samples)), calibrated=False)
            )
            index, described = source.set_up[name].index, source.set_up[name].described
            _check(name, described, source.board)
            source.start()
            source.board.begin_by_hand(index, moves, scale_std)
        with changing():
            session = FollowedSession(described, moves, tell)
            _follow(source, session)
            source.board.stop()
            solved = source.board.hand_solution()
        samples = np.concatenate([samples for sensor, samples in drain(arrived) if sensor == name])
        agreement = compare_with_board(_readings(described, samples), session.reports, solved)
        yield source.board, CalibratedByBoard(index, solved, agreement)


def read_kept_solution(board: Board) -> CalibratedByBoard:
    """Return the board's solution of its last session by hand, begun by button or host, with `agreement` None.

    Raise Refused `no_answer_by_hand`, BoardError as `Board.hand_report` does.
    """
    report = board.hand_report()
    if report.state == "done":
        return CalibratedByBoard(report.sensor, board.hand_solution(), None)
    why = "none has been made since it was switched on or reset"
    if report.state == "failed":
        why = f"it was given up because ten moves in a row were refused; the last because {FAULTS[report.outcome][1]}"
    elif report.state != "idle":
        why = f"it was not done after {report.accepted} moves, and has ended now"
    raise Refused(
        "no_answer_by_hand",
        f"the board holds no result of a session by hand: {why}",
        "Press its button, make the moves until the LED flashes once a second, and leave the power on until then",
    )


def _check(name: str, sensor: RecordedSensor, board: Board) -> None:
    """Raise Refused unless the sensor measures acceleration and the board's clock follows its crystal."""
    if not sensor.measures(ACCELERATION):
        raise Refused(
            "first_face_unknown",
            f"the board determines from accelerations which side is up, but sensors.{name} asks for none",
            f"Add acceleration: {{}} to sensors.{name}",
        )
    if not follows_crystal(board):
        raise clock_unknown()


def _follow(source: BoardSource, session: FollowedSession) -> None:
    """Follow the session to its end. After ten refused moves in a row, raise the Fault of the last refused move."""
    while True:
        report = source.board.hand_report()
        session.take(report)
        if report.state == "failed":
            raise Fault(*FAULTS[report.outcome])
        if report.state == "done":
            return
        time.sleep(POLL_S)
        source.check()


def _readings(sensor: RecordedSensor, samples: NDArray[Any]) -> BoardReadings:
    times_us, sequence = samples["board_time_us"].astype(np.int64), samples["sequence"].astype(np.int64)
    return BoardReadings(times_us, sequence, sensor.channel(RATE).values(samples), MICROSECOND_S)
