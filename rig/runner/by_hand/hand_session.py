"""A session by hand in progress: requests a move, waits for the rest after it, and accepts or refuses the move.

The readings of the first sensor to calibrate decide about each move; other sensors are only recorded. All sensors are
solved afterwards, without the refused moves.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.hand_events import (
    HandAsked,
    HandBegunAnew,
    HandEvent,
    HandMoveAccepted,
    HandMoveRefused,
    HandRested,
    HandRestRefused,
)
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import HandSettings
from rig.errors import Fault
from rig.errors.remedies_by_method import remedies_by_method
from rig.estimation.by_hand.progress import SessionProgress, assess_progress
from rig.estimation.by_hand.session_parts import HandRest, Move, SessionConditions
from rig.motion.by_hand import FACES, Face, HandMove, Instruction
from rig.observation.by_hand.hand_segmentation import Segmenter
from rig.observation.by_hand.rests_and_moves import (
    RECORDING_PAUSE_S,
    NotCounted,
    microsecond_of,
    range_of,
    readings_of,
    replay_runs,
    rotate_face,
)
from rig.plans.by_hand import RemainingMoves, WantedMoves, next_instruction, still_open
from rig.runner.acquisition import Acquisition
from rig.station.events import HandSeen, RunEvent

POLL_S = 0.05
MAX_HELD_S = 3.0  # time in the hand, after which the operator is reminded to lay it down
MAX_CLOSURE_STDS = 3.0  # error of a whole turn's end
MAX_REFUSALS = 10  # in a row; then the session ends, because another error is likely
# Moves in a row that contradict those before them; then one of those is likely to be wrong. Sessions begun again so.
MAX_CONTRADICTIONS, MAX_DOUBTED_SESSIONS = 3, 2
MAX_OPPOSITE = 4  # rests in a row with the side up that is opposite to the requested one
UNFIT_RESTS = frozenset({"held_not_laid_down", "not_flat"})  # the item lies still, but not on a side
LAID_AGAIN = UNFIT_RESTS | {"bias_jumped"}  # a rest is refused, and the item is to be laid down once more
RESTARTS = frozenset(
    {"bias_jumped", "table_moved", "accelerometer_jumped", "earlier_move_wrong"}
)  # the readings before and after it contradict each other
REPEATABLE = frozenset({"clipping", "lost_in_move", "no_fit", "turn_not_closed"}) | UNFIT_RESTS | RESTARTS


@dataclass(slots=True)
class HandSession:
    """A session of `settings`, judged by the sensor `name`.

    - `conditions`: the other inputs of the solution.
    - `earlier`: the recordings before an interruption; their rests and moves are included.
    - `wait`: waits a number of seconds between two checks of the samples.
    """

    acquisition: Acquisition
    note: Callable[[HandEvent], None]
    tell: Callable[[RunEvent], None]
    settings: HandSettings
    name: str
    sensor: RecordedSensor
    conditions: SessionConditions
    earlier: Sequence[RunData] = ()
    wait: Callable[[float], None] = time.sleep
    _segmenter: Segmenter = field(init=False)
    _not_counted: NotCounted = field(init=False)
    _begins_s: float | None = None  # start of this recording by the session's clock; None: by the board's
    _shift_s: float | None = None  # offset of the session's clock from the board's, once samples have come
    _move: Move | None = None  # the finished move, until the rest after it is judged
    _rest: HandRest | None = None  # the present rest, while it is shorter than required
    _judged_s: float = -np.inf  # end of the rest that was judged last
    _accepted: list[HandMove] = field(default_factory=list)
    _lay: list[Face] = field(default_factory=list)  # the faces that have been up
    _refused: int = 0  # number of refused moves in a row
    _contradicting: int = 0  # number of moves in a row that contradict those before them
    _doubted_sessions: int = 0  # number of times that the accepted moves were given up for that
    _opposite: int = 0  # number of rests in a row on the side opposite to the requested one
    _bias_doubted: bool = False  # whether the item may have crept at the previous rest
    _reminded: bool = False
    _request: HandAsked | None = None
    _progress: SessionProgress | None = None

    def __post_init__(self) -> None:
        if not self.earlier:
            self._segmenter = Segmenter(range_of(self.sensor))
            self._not_counted = NotCounted(microsecond_s=microsecond_of(self.sensor))
            return
        self._segmenter, self._not_counted, ends_s = replay_runs(self.earlier, self.name)
        self._not_counted.seams.append(ends_s + RECORDING_PAUSE_S / 2)
        self._begins_s = self._judged_s = ends_s + RECORDING_PAUSE_S
        for event in (recorded.event for run in self.earlier for recorded in run.events):
            if isinstance(event, HandMoveAccepted):
                self._accepted.append(HandMove(event.kind, event.from_face, event.to_face, event.turns))
            elif isinstance(event, HandRested):
                self._lay.append(event.face)
            elif isinstance(event, HandBegunAnew):
                self._accepted = []
                self._lay = []

    def carry_out(self, check: Callable[[], None]) -> None:
        """Request the wanted moves until all are made or U reaches the target.

        `check` is called many times a second. Raise Fault for an error that no move corrects, or after ten refused
        moves in a row.
        """
        heard = self.acquisition.hear()
        self._ask(next_instruction(self._open, None))
        while self._request is not None:
            self.wait(POLL_S)
            check()
            self._feed([samples for name, samples in drain(heard) if name == self.name])
            self._remind()
            self.tell(self._describe())

    @property
    def _open(self) -> RemainingMoves:
        return still_open(WantedMoves(self.settings.flips, self.settings.turns), self._accepted, self._lay)

    def _feed(self, batches: Sequence[NDArray[Any]]) -> None:
        """Process the readings that have arrived."""
        if not batches:
            return
        samples = np.concatenate(batches)
        if self._shift_s is None:
            first_s = microsecond_of(self.sensor) * float(samples["board_time_us"][0])
            self._shift_s = 0.0 if self._begins_s is None else self._begins_s - first_s
        for segment in self._segmenter.feed(*readings_of(self.sensor, samples, self._shift_s)):
            if self._rest is not None:
                self._judge_rest(self._rest)
            self._move, self._rest = (segment, None) if isinstance(segment, Move) else (self._move, segment)
        live = self._segmenter.live
        lasts = self._rest is not None and live.time_s - self._rest.start_s >= self.settings.rest_s
        if self._rest is not None and (lasts or live.state != "resting"):
            self._judge_rest(self._rest)

    def _judge_rest(self, rest: HandRest) -> None:
        """Judge the move before a rest, and ask for the next."""
        move, self._move, self._rest = self._move, None, None
        if move is not None and self._begins_s is not None and move.start_s < self._begins_s:
            move = None  # it began during the interruption
        self._pauses_before(rest)
        session = self._not_counted.filter_session(self._segmenter.handled)
        now = self._progress = assess_progress(session, self.conditions)
        wrong = (
            self._doubt_earlier_moves(now) or now.fault_of_last or self._not_closed(now) or self._laid_after_turn(now)
        )
        read = now.faces[-1] if now.faces else None
        if read is None:
            wrong = wrong or Fault(
                "not_flat", "it does not lie on any of its six sides", "Lay it down on a side, and let go"
            )
        counts = wrong is None or self._refuse_move(wrong, move, rest)
        face = None if read is None else self._face(read)
        if face is None or not counts:
            last = Instruction("lay", FACES[0]) if self._request is None else self._request.instruction
            self._ask(last if face is None else Instruction("lay", face), wrong)
            return
        self._refuse_opposite(face)
        self._bias_doubted = False
        self.note(HandRested(*self._board_us(rest), face))
        if move is not None and now.moves and wrong is None:  # a move after a mere pause begins at no rest
            self._take(move, now, face)
        self._lay.append(face)
        self._ask(self._next(now, face), wrong)

    def _doubt_earlier_moves(self, now: SessionProgress) -> Fault | None:
        """Return a Fault if all of the last moves contradict the accepted ones, which may then be wrong; else None.

        A wrong move among the first ones is not detected, because nothing contradicts it yet.
        """
        self._contradicting = self._contradicting + 1 if now.is_contradiction else 0
        if self._contradicting < MAX_CONTRADICTIONS or self._doubted_sessions >= MAX_DOUBTED_SESSIONS:
            return None
        self._contradicting, self._doubted_sessions = 0, self._doubted_sessions + 1
        return Fault(
            "earlier_move_wrong",
            f"the last {MAX_CONTRADICTIONS} moves contradict those before them, so one of those was wrong",
            "Go on as the rig asks: the moves are counted from here",
        )

    def _refuse_opposite(self, face: Face) -> None:
        """Raise Fault `accelerometer_inverted` if again and again the side opposite to the requested one is up."""
        if self._request is None or self._request.instruction.say != "lay":
            return
        wanted = self._request.instruction.face
        self._opposite = self._opposite + 1 if face != wanted and face[1] == wanted[1] else 0
        if self._opposite >= MAX_OPPOSITE:
            raise Fault(
                "accelerometer_inverted",
                f"{MAX_OPPOSITE} times in a row the side opposite to the requested one was up, now {face}",
                "See that the axes on the item are marked rightly. If they are, the accelerometer has the wrong sign: "
                "at rest an axis that points upwards reads +1 g. Correct the program of the device",
            )

    def _pauses_before(self, rest: HandRest) -> None:
        """Discard the unjudged rests before `rest`, which are too short and so are pauses within a move."""
        for pause in self._segmenter.handled.rests:
            if self._judged_s < pause.start_s and pause.end_s < rest.start_s:
                event = HandRestRefused(*self._board_us(pause), "held_not_laid_down")
                self._not_counted.take(event, self._shift_s or 0.0)
                self.note(event)
        self._judged_s = rest.end_s

    def _not_closed(self, now: SessionProgress) -> Fault | None:
        """Return a fault if a whole turn ends too far from its start, else None."""
        if not now.moves or self._request is None:
            return None
        last, whole_rad = now.moves[-1], 2 * np.pi
        missed_rad = last.closure_rad
        if missed_rad is None and self._request.instruction.say == "turn" and last.angle_rad > np.pi:
            missed_rad = last.angle_rad - whole_rad * max(1, round(last.angle_rad / whole_rad))
        if missed_rad is None or abs(missed_rad) <= MAX_CLOSURE_STDS * self.settings.closure_rad:
            return None
        return _turn_not_closed(f"that turn ended {abs(np.degrees(missed_rad)):.1f}° from where it began")

    def _laid_after_turn(self, now: SessionProgress) -> Fault | None:
        """Return a fault if the item was laid down again after a whole turn, so that its heading changed, else None."""
        request = self._request
        if request is None or request.instruction.say != "lay" or request.again not in LAID_AGAIN:
            return None
        if not now.moves or not now.moves[-1].turns:
            return None
        return _turn_not_closed("after that turn it was laid down again, and need not touch the rule as before")

    def _next(self, now: SessionProgress, face: Face | None) -> Instruction | None:
        """Return the next instruction, or None if the session has enough moves."""
        wanted = self.settings.wanted_scale_u
        enough = wanted is not None and now.solution is not None and float(max(now.expanded_scale)) <= wanted
        return None if enough else next_instruction(self._open, face)

    def _take(self, move: Move, now: SessionProgress, face: Face) -> None:
        """Accept a move, unless it took too long."""
        self._refused = 0
        if now.moves[-1].kind == "omitted":
            return
        before, turns = self._lay[-1] if self._lay else face, now.moves[-1].turns
        kind: Literal["flip", "turn"] = "flip" if before != face else "turn"
        self._accepted.append(HandMove(kind, before, face, turns if kind == "turn" else 0))
        self.note(HandMoveAccepted(*self._board_us(move), kind, before, face, self._accepted[-1].turns))

    def _refuse_move(self, wrong: Fault, move: Move | None, rest: HandRest) -> bool:
        """Omit the move, the rest, or everything before, depending on the fault `wrong`; return whether the rest stays.

        If the bias has changed at a single rest, the item may have crept, and the rest is omitted. If it has changed at
        the next rest too, the bias itself jumped. Raise a fault that no move can correct.
        """
        self._refused += 1
        if wrong.name not in REPEATABLE:
            raise wrong
        if self._refused >= MAX_REFUSALS:
            what = f"{MAX_REFUSALS} moves in a row were refused; the last: {wrong.what}"
            raise Fault(wrong.name, what, wrong.remedy)
        events: list[HandEvent] = []
        crept = wrong.name == "bias_jumped" and not self._bias_doubted
        no_rest = crept or wrong.name in UNFIT_RESTS
        if no_rest:
            self._bias_doubted |= crept
            events.append(HandRestRefused(*self._board_us(rest), wrong.name))
        elif wrong.name in RESTARTS:
            events.append(HandBegunAnew(self._board_us(rest)[0], wrong.name))
            self._accepted = []
            self._lay = []
        elif move is not None:
            events.append(HandMoveRefused(*self._board_us(move), wrong.name))
        for event in events:
            self._not_counted.take(event, self._shift_s or 0.0)
            self.note(event)
        return not no_rest

    def _remind(self) -> None:
        """Remind the operator to lay the item down if it is held in a hand."""
        live = self._segmenter.live
        in_hand = live.state == "held" and live.time_s - live.since_s >= MAX_HELD_S
        if in_hand and not self._reminded and self._request is not None:
            what = f"it has been held in the hand for {live.time_s - live.since_s:.0f} s"
            wrong = Fault("held_not_laid_down", what, "Lay it down and let go")
            self._ask(self._request.instruction, wrong)
        self._reminded = in_hand

    def _ask(self, instruction: Instruction | None, wrong: Fault | None = None) -> None:
        """Ask the operator for a move; None announces the end of the session."""
        self._request = None
        if instruction is not None:
            again, why = (None, "") if wrong is None else (wrong.name, _explain(wrong)[:500])
            self._request = HandAsked(instruction, again, why)
            self.note(self._request)

    def _face(self, of_sensor: str) -> Face:
        """Return the face of the item that is up when the sensor's axis `of_sensor` points up."""
        return rotate_face(of_sensor, np.array(self.sensor.mounting).T)

    def _board_us(self, part: HandRest | Move) -> tuple[int, int]:
        """Return the start and end of a rest or a move on the board's clock, µs."""
        shift_s, microsecond_s = self._shift_s or 0.0, microsecond_of(self.sensor)
        return round((part.start_s - shift_s) / microsecond_s), round((part.end_s - shift_s) / microsecond_s)

    def _describe(self) -> HandSeen:
        live, remaining, progress = self._segmenter.live, self._open, self._progress
        return HandSeen(
            time_s=live.time_s,
            doing=live.state,
            since_s=max(live.time_s - live.since_s, 0.0),
            turned_rad=float(np.linalg.norm(live.turned_rad)),
            peak_rad_s=live.peak_rad_s,
            range_rad_s=range_of(self.sensor) or 0.0,
            expanded_scale=None if progress is None else float(max(progress.expanded_scale)),
            faces=tuple(dict.fromkeys(self._lay)),
            pairs=remaining.pairs,
            turns=remaining.turns,
            accepted=len(self._accepted),
        )


def drain(heard: "SimpleQueue[tuple[str, NDArray[Any]]]") -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield the samples that have arrived, with their sensor's name, without waiting for more."""
    while not heard.empty():
        yield heard.get()


def _turn_not_closed(what: str) -> Fault:
    return Fault("turn_not_closed", what, "Lay it against the rule, and turn again")


def _explain(wrong: Fault) -> str:
    """Return what was wrong, and the remedy in a session by hand."""
    return f"{wrong.what}. {remedies_by_method(wrong.name).get('hand', wrong.remedy).rstrip('.')}."
